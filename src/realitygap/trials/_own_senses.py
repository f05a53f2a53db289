"""A robot's own report of its time, its battery, and its encoders, if it has any."""

from __future__ import annotations

import math
from typing import Any

from realitygap.robots import Clock, Robot


class OwnSenses:
    """Clock, battery, and encoders of the robot that was met.

    A robot with encoders has `has_encoders` and `wheels`, the distance of both wheels [m]; with `is_turned`, as seen by
    the end that is behind. One that measures the voltage of its battery has `volts`.
    """

    identity = ""

    def __init__(self) -> None:
        self._robot: Any = None
        self._zero: tuple[float, float] | None = None

    @property
    def has_encoders(self) -> bool:
        """True if the connected robot has encoders."""
        return bool(getattr(self._robot, "has_encoders", False))

    def _met(self, robot: Any) -> None:
        self._robot = robot
        self._is_turned = self.has_encoders and bool(getattr(robot, "is_turned", False))

    def clock(self, robot: Robot) -> Clock:
        """Return the clock of the robot that was met."""
        clock: Clock = self._robot.clock
        return clock

    def begin(self) -> None:
        """A trial begins: wheels count from here on."""
        self._zero = None

    def battery_v(self) -> float:
        """Return the voltage of its battery [V]; nan if it does not measure it."""
        return float(self._robot.volts()) if hasattr(self._robot, "volts") else math.nan

    def wheels(self) -> tuple[float, float] | None:
        """Return the distance of both wheels since the start of the trial, for the end that is ahead [m]."""
        if not self.has_encoders:
            return None
        left, right = self._robot.wheels()
        self._zero = self._zero or (left, right)
        left, right = left - self._zero[0], right - self._zero[1]
        return (-right, -left) if self._is_turned else (left, right)
