"""A calibration at work, as the pages see it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from realitygap.orders import CalibrateOrder
from realitygap.platforms import names_a_port

from ._measuring_job import MeasuringJob
from ._pace import Pace


class CalibrationJob(MeasuringJob):
    """A calibration.

    Attributes:
        name: Of its files.
        order: The order.
        kind: What is calibrated.
        platform: The platform that is measured.
        n_done, n_trials: Number of trials: recorded, and total.
        readings: Point of the plot for each recorded trial.
        made: Result of the fit; None before.
    """

    STOPPED = "Stopped. Recorded trials are saved. Resume to continue."

    def __init__(self, order: CalibrateOrder, root: Path, changed: Callable[[], None]) -> None:
        self.name = "" if order.out is None else order.out.stem
        self.order = order
        self.kind = order.what
        self.platform = order.robot or ""
        self.n_done = self.n_trials = 0
        self._pace = Pace()
        self.readings: list[dict[str, Any]] = []
        self.made: dict[str, Any] | None = None
        super().__init__({"work": "calibrate", "order": order.message()}, root, changed)

    @property
    def has_met(self) -> bool:
        """True if a robot has been measured."""
        return bool(self.n_trials) and names_a_port(self.platform)

    @property
    def can_resume(self) -> bool:
        """True if it has ended without a result, and not by an error before its first trial that no robot caused."""
        has_begun = self.n_done > 0 or self.is_link_lost
        return self.is_over and self.made is None and (has_begun or not self.is_failed)

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

    def _on_error(self, message: dict[str, Any]) -> None:
        super()._on_error(message)
        if self.is_lost:
            self.outcome = (
                f"Link lost after {self.n_done} of {self.n_trials} trials. They are saved. Resume once the robot is "
                f"back.\n{message['text']}"
            )

    def _on_paused(self, message: dict[str, Any]) -> None:
        self.outcome = self.STOPPED
