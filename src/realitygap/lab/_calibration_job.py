"""A calibration at work, as the pages see it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from realitygap.platforms import names_a_port

from ._job import Job
from ._pace import Pace


class CalibrationJob(Job):
    """A calibration.

    Attributes:
        name: Of its files.
        kind: What is calibrated.
        platform: The platform that is measured.
        n_done, n_trials: Number of trials: recorded, and total.
        readings: Point of the plot for each recorded trial.
        made: Result of the fit; None before.
    """

    STOPPED = "Stopped. Recorded trials are saved. Calibrate again under the same name to continue."

    def __init__(self, order: dict[str, Any], root: Path, changed: Callable[[], None]) -> None:
        self.name = Path(order["out"]).stem
        self.kind = str(order["kind"])
        self.platform = str(order["platform"])
        self.n_done = self.n_trials = 0
        self._pace = Pace()
        self.readings: list[dict[str, Any]] = []
        self.made: dict[str, Any] | None = None
        super().__init__({"work": "calibrate", **order}, root, changed)

    @property
    def has_robot(self) -> bool:
        """Whether a robot is in use."""
        return names_a_port(self.platform) and not self.is_over

    @property
    def is_lost(self) -> bool:
        """Whether a robot was measured, and the link to it has failed."""
        return self.is_link_lost and bool(self.n_trials) and names_a_port(self.platform)

    @property
    def progress(self) -> str:
        """Progress in words."""
        if self.outcome is not None:
            return self.outcome
        if not self.n_trials:
            return "Starting…"
        number = min(self.n_done + 1, self.n_trials)
        return f"Trial {number} of {self.n_trials}{self._pace.words}"

    def _on_trials(self, message: dict[str, Any]) -> None:
        self._pace.note(message["done"] / max(message["n"], 1))
        self.n_done, self.n_trials = message["done"], message["n"]
        self.readings = message["readings"]

    def _on_made(self, message: dict[str, Any]) -> None:
        self.made = message
        self.outcome = f"Complete. Saved as {self.name}.toml. Use it as sim:{self.name}.toml."

    def _on_paused(self, message: dict[str, Any]) -> None:
        self.outcome = self.STOPPED
