"""A gap that is measured or planned, as the pages see it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from realitygap.platforms import names_a_port

from ._job import Job
from ._pace import Pace


class GapJob(Job):
    """A gap at work.

    Attributes:
        name: Of its files.
        platform: The target; empty for a plan.
        n_trials: Number of trials on each platform.
        trials: Number of trials that are done, by platform.
        verdict: Verdict of the last report; empty before the first one.
        measures: Name and value of each measure of the last report.
        n_reports: Number of reports so far.
        plan: Result of a plan; None before, or if none was asked for.
    """

    STOPPED = "Stopped. The trials of the target are saved. Measure again under the same name to continue."

    def __init__(self, name: str, order: dict[str, Any], root: Path, changed: Callable[[], None]) -> None:
        self.name = name
        self.platform = str(order.get("measure", {}).get("target", ""))
        measure = order.get("measure", {})
        self.n_trials = int(measure.get("n_controllers") or 0) * int(measure.get("trials") or 0)
        self.trials: dict[str, int] = {}
        self._pace = Pace()
        self.verdict = ""
        self.measures: list[tuple[str, str]] = []
        self.n_reports = 0
        self.plan: dict[str, Any] | None = None
        super().__init__({"work": "gap", **order}, root, changed)

    @property
    def has_robot(self) -> bool:
        """Whether a robot is in use."""
        return names_a_port(self.platform) and not self.is_over

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
        self.n_reports += 1

    def _on_plan(self, message: dict[str, Any]) -> None:
        self.plan = message

    def _on_done(self, message: dict[str, Any]) -> None:
        self.outcome = "Complete."
