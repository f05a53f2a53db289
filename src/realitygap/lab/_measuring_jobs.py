"""Trials on a target, which may be a robot, as the pages see them: a gap and a calibration."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

from realitygap.orders import CalibrateOrder, GapOrder
from realitygap.platforms import names_a_port

from ._job import Job
from ._pace import Pace

SILENT_S = 1.5
"""Time without an answer in a trial from which the robot counts as silent [s]. A command lasts half a second."""


class MeasuringJob(Job):
    """Trials on a target, which may be a robot.

    Attributes:
        platform: The target.
    """

    QUIET: ClassVar[frozenset[str]] = frozenset({"pulse"})
    platform: str
    _answered_s: float | None = None

    @property
    def has_robot(self) -> bool:
        """True if a robot is in use."""
        return names_a_port(self.platform) and not self.is_over

    @property
    def silent_s(self) -> float:
        """Time since the robot has answered in the trial that is being driven [s]; 0 while its answers come."""
        answered_s = self._answered_s
        age = 0.0 if answered_s is None or self.is_over else time.monotonic() - answered_s
        return age if age > SILENT_S else 0.0

    @property
    def _done_words(self) -> str:
        """Trials that are saved, in words."""
        raise NotImplementedError

    def _on_error(self, message: dict[str, Any]) -> None:
        super()._on_error(message)
        if self.is_lost:
            self.outcome = (
                f"Link lost after {self._done_words} Resume once the robot is back.\n{message['text']}"
            )

    def _on_pulse(self, message: dict[str, Any]) -> None:
        self._answered_s = time.monotonic() if message["is_driving"] else None


class GapJob(MeasuringJob):
    """A gap at work.

    Attributes:
        name: Name of its files.
        order: The order.
        platform: The target.
        n_trials: Number of trials on each platform.
        trials: Number of trials that are done, by platform.
        is_complete: Whether all trials are done.
        verdict: Verdict of the last report; empty before the first one.
        measures: Name and value of each measure of the last report.
        intervals: Trials of each controller, and the RMS gap with its interval, of each report that has one.
        pairs: Scores of each controller on both sides, as `pairs_of` returns them; empty before the first report.
        n_reports: Number of reports so far.
    """

    def __init__(self, order: GapOrder, page: Path, root: Path, changed: Callable[[], None]) -> None:
        self.name = page.stem
        self.order = order
        self.platform = order.target
        self.n_trials = order.n_trials
        self.trials: dict[str, int] = {}
        self._pace = Pace()
        self.is_complete = False
        self.verdict = ""
        self.measures: list[tuple[str, str]] = []
        self.intervals: list[tuple[int, float, float, float]] = []
        self.pairs: dict[str, Any] = {}
        self.n_reports = 0
        super().__init__({"work": "gap", "order": order.message(), "page": str(page)}, root, changed)

    @property
    def has_met(self) -> bool:
        """True if a robot has driven."""
        return bool(self.trials) and names_a_port(self.platform)

    @property
    def progress(self) -> str:
        """Progress in words."""
        if self.outcome is not None:
            return self.outcome
        if not self.trials:
            return "Starting…"
        done = ", ".join(f"{name} {n:,}" for name, n in self.trials.items())
        return f"{done} of {self.n_trials:,} trials{self._pace.words}"

    def _on_trials(self, message: dict[str, Any]) -> None:
        name = message["name"]
        self.trials[name] = max(
            self.trials.get(name, 0), message["done"]
        )  # each round simulates from the start
        self._pace.note(sum(self.trials.values()) / max(2 * self.n_trials, 1))

    def _on_measured(self, message: dict[str, Any]) -> None:
        self.verdict, self.measures = message["verdict"], message["measures"]
        self.pairs = message["pairs"]
        if message["rms"] is not None:
            estimate, low, high = message["rms"]
            self.intervals = [*self.intervals, (message["trials"], estimate, low, high)]
        self.n_reports += 1

    @property
    def _done_words(self) -> str:
        n_done = next(iter(self.trials.values()), 0)  # the target is the first that is told of
        return f"{n_done:,} of {self.n_trials:,} trials on the target. They are saved."

    def _on_interrupted(self, message: dict[str, Any]) -> None:
        self.outcome = f"Stopped after {self._done_words}"

    def _on_done(self, message: dict[str, Any]) -> None:
        self.outcome, self.is_complete = "Complete.", True


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

    @property
    def _done_words(self) -> str:
        return f"{self.n_done} of {self.n_trials} trials. They are saved."

    def _on_paused(self, message: dict[str, Any]) -> None:
        self.outcome = self.STOPPED
