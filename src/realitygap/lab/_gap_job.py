"""A gap that is measured or planned, as the pages see it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from realitygap.platforms import names_a_port

from ._job import Job


class GapJob(Job):
    """A gap at work.

    Attributes:
        name: Of its files.
        has_robot: Whether the target is a robot.
        trials: Done and wanted, by platform, in the present round.
        verdict: Of the last report; empty before there is one.
        n_reports: How many reports there have been.
        plan: What was planned; None before, or where nothing was to be.
    """

    STOPPED = "Stopped. The trials of the target are kept, and measuring goes on with them."

    def __init__(self, name: str, order: dict[str, Any], root: Path, changed: Callable[[], None]) -> None:
        self.name = name
        self._uses_robot = names_a_port(str(order.get("measure", {}).get("target", "")))
        self.trials: dict[str, tuple[int, int]] = {}
        self.verdict = ""
        self.n_reports = 0
        self.plan: dict[str, Any] | None = None
        super().__init__({"work": "gap", **order}, root, changed)

    @property
    def has_robot(self) -> bool:
        """Whether a robot is in use."""
        return self._uses_robot and not self.is_over

    def _on_trials(self, message: dict[str, Any]) -> None:
        self.trials[message["name"]] = (message["done"], message["total"])

    def _on_measured(self, message: dict[str, Any]) -> None:
        self.verdict = message["verdict"]
        self.n_reports += 1

    def _on_plan(self, message: dict[str, Any]) -> None:
        self.plan = message

    def _on_done(self, message: dict[str, Any]) -> None:
        self.outcome = "Done."
