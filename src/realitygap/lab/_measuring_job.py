"""Trials on a target, such as those of a gap or of a calibration, as the pages see them."""

from __future__ import annotations

import time
from typing import Any, ClassVar

from realitygap.platforms import names_a_port

from ._job import Job

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

    def _on_pulse(self, message: dict[str, Any]) -> None:
        self._answered_s = time.monotonic() if message["is_driving"] else None
