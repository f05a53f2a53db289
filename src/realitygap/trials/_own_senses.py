"""A Scribbler's own report of its battery and, for an S2, of its encoders."""

from __future__ import annotations

import math
from typing import Any

COUNT_M = 0.00025
"""Way of a wheel for one count of an S2's encoders [m]: half of its half millimeter."""


class OwnSenses:
    """Battery and encoders of the robot that was met."""

    identity = ""

    def __init__(self) -> None:
        self._robot: Any = None
        self._zero: tuple[int, int] | None = None

    @property
    def has_encoders(self) -> bool:
        """Whether the robot that was met has any."""
        return getattr(getattr(self._robot, "info", None), "model", "") == "s2"

    def _met(self, robot: Any) -> None:
        self._robot = robot
        has_fluke = self.has_encoders and robot.info.fluke != "none"
        self._is_turned = has_fluke and robot.forwardness == "fluke"

    def begin(self) -> None:
        """A trial begins: wheels count from here on."""
        self._zero = None

    def battery_v(self) -> float:
        """Voltage by its Fluke [V]; nan without one."""
        info = getattr(self._robot, "info", None)
        return math.nan if info is None or info.fluke == "none" else float(self._robot.battery())

    def wheels(self) -> tuple[float, float] | None:
        """Way of the wheels by its encoders, seen by the end that is ahead [m]."""
        if not self.has_encoders:
            return None
        left, right = self._robot.encoders()
        self._zero = self._zero or (left, right)
        left, right = left - self._zero[0], right - self._zero[1]
        if self._is_turned:
            left, right = -right, -left
        return left * COUNT_M, right * COUNT_M
