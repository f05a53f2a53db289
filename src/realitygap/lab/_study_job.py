"""A study that runs in its own process, as the pages see it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ._job import MOST_POINTS, Job

SILENT_S = 2.0
"""Time without a step of a trial from which the robot counts as silent [s]. A step lasts half a second."""
OPTIONS = ("port", "witness", "camera", "counts", "when")
"""Keys of an order that state how a robot is connected."""


class StudyJob(Job):
    """A study at work.

    Attributes:
        name: Of the study.
        port: Of the robot that drives it; empty where none does.
        options: How the robot is connected, by `OPTIONS`.
        progress: How far its simulated runs are; None before the first word.
        card: Of the trial that is being driven; None while none is.
        step: Its last step.
        line: (x, y) [m] where an emulated robot has been in it; `pose` is where it is.
        label: Of the robot: REAL or EMULATED; empty before one was met.
        preflight: What its pre-flight found.
        said: What the camera above the robot said last; empty where it said nothing.

    Args:
        name: Of the study.
        order: What the process is told first.
        root: Where it works.
        changed: Called after each change, from another thread.
    """

    QUIET = frozenset({"pose", "step"})
    STOPPED = "Paused. Published runs and scores are saved. You can resume."
    LOST = "The process of the study ended (status {status}). Published runs and scores are saved. You can resume."

    def __init__(self, name: str, order: Mapping[str, Any], root: Path, changed: Callable[[], None]) -> None:
        self.name = name
        self.port = str(order.get("port") or "")
        self.options = {key: str(order.get(key) or "") for key in OPTIONS}
        self.progress: dict[str, Any] | None = None
        self.card: dict[str, Any] | None = None
        self.step: dict[str, Any] | None = None
        self.pose: list[float] | None = None
        self.line: list[list[float]] = []
        self.label = ""
        self.preflight: dict[str, Any] | None = None
        self.said = ""
        self.n_live = 0
        self._stepped_s = 0.0
        self._ending: tuple[str, bool] | None = None
        super().__init__(order, root, changed)

    @property
    def has_met(self) -> bool:
        """True if a robot has answered."""
        return bool(self.label)

    @property
    def silent_s(self) -> float:
        """Time since the last step of the trial that is being driven [s]; 0 while its steps come."""
        age = 0.0 if self.card is None or self.is_over else time.monotonic() - self._stepped_s
        return age if age > SILENT_S else 0.0

    def stop_robot(self) -> None:
        """Stop the motors, and with them the trial."""
        self._child.tell({"do": "stop"})

    def _on_progress(self, message: dict[str, Any]) -> None:
        self.progress = message

    def _on_ask(self, message: dict[str, Any]) -> None:
        super()._on_ask(message)
        self.card = None

    def _on_met(self, message: dict[str, Any]) -> None:
        self.label = message["label"]

    def _on_preflight(self, message: dict[str, Any]) -> None:
        self.preflight = message

    def _on_driving(self, message: dict[str, Any]) -> None:
        self._stepped_s = time.monotonic()
        self.card, self.step, self.line = message["card"], None, []

    def _on_step(self, message: dict[str, Any]) -> None:
        self.step, self._stepped_s = message, time.monotonic()
        self.n_live += 1

    def _on_pose(self, message: dict[str, Any]) -> None:
        self.pose = message["pose"]
        self.n_live += 1
        if not self.line or self.line[-1] != message["pose"][:2]:
            self.line = [*self.line[-MOST_POINTS:], message["pose"][:2]]

    def _on_said(self, message: dict[str, Any]) -> None:
        self.said = message["text"]

    def _on_driven(self, message: dict[str, Any]) -> None:
        self.card = None

    # It is over only when its process has ended: until then its folder is in use.

    def _on_done(self, message: dict[str, Any]) -> None:
        self._ending = (message["waiting"] or "Complete.", False)

    def _on_error(self, message: dict[str, Any]) -> None:
        self.is_link_lost = bool(message.get("is_of_robot"))
        self._ending = (message["text"], True)

    def _on_interrupted(self, message: dict[str, Any]) -> None:
        self._ending = (self.STOPPED, False)

    def _on_ended(self, message: dict[str, Any]) -> None:
        self.card = None
        if self._ending is not None:
            self.outcome, self.is_failed = self._ending
        super()._on_ended(message)
