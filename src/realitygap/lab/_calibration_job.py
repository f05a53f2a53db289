"""A calibration at work, as the pages see it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from realitygap.platforms import names_a_port

from ._job import Job


class CalibrationJob(Job):
    """A calibration.

    Attributes:
        name: Of its files.
        kind: What is calibrated.
        n_done, n_trials: Trials that are there, and wanted.
        readings: Of each trial there is, what to plot.
        made: What was fitted; None before.
    """

    STOPPED = "Stopped. What was recorded is kept; the same name goes on with it."

    def __init__(self, order: dict[str, Any], root: Path, changed: Callable[[], None]) -> None:
        self.name = Path(order["out"]).stem
        self.kind = str(order["kind"])
        self._uses_robot = names_a_port(str(order["platform"]))
        self.n_done = self.n_trials = 0
        self.readings: list[dict[str, Any]] = []
        self.made: dict[str, Any] | None = None
        super().__init__({"work": "calibrate", **order}, root, changed)

    @property
    def has_robot(self) -> bool:
        """Whether a robot is in use."""
        return self._uses_robot and not self.is_over

    def _on_trials(self, message: dict[str, Any]) -> None:
        self.n_done, self.n_trials = message["done"], message["n"]
        self.readings = message["readings"]

    def _on_made(self, message: dict[str, Any]) -> None:
        self.made = message
        self.outcome = f"Written: {self.name}.toml. Simulate it with sim:{self.name}.toml"

    def _on_paused(self, message: dict[str, Any]) -> None:
        self.outcome = self.STOPPED
