"""A gap that is measured, as the pages see it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from realitygap.orders import GapOrder
from realitygap.platforms import names_a_port

from ._measuring_job import MeasuringJob
from ._pace import Pace


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

    def _on_error(self, message: dict[str, Any]) -> None:
        super()._on_error(message)
        if self.is_lost:
            self.outcome = (
                f"Link lost after {self._done_words} Resume once the robot is back.\n{message['text']}"
            )

    def _on_interrupted(self, message: dict[str, Any]) -> None:
        self.outcome = f"Stopped after {self._done_words}"

    def _on_done(self, message: dict[str, Any]) -> None:
        self.outcome, self.is_complete = "Complete.", True
