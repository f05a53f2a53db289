"""What all parts of Myro's robot stand on: the driver, its clock, and time that passes."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from realitygap.robots import Clock
    from realitygap.robots.scribbler import Scribbler as Driver

SIDES = {"left": "left", 0: "left", "right": "right", 1: "right"}
"""Positions of sensors that come in pairs."""

PLACES = {
    "left": 0, 0: 0,
    "center": 1, "middle": 1, 1: 1,
    "right": 2, 2: 2,
}  # fmt: skip
"""Positions of sensors that come in threes."""


class Base:
    """A robot and its clock."""

    driver: Driver
    clock: Clock

    def __init__(self) -> None:
        self.lock = threading.RLock()
        self.deadline: float | None = None
        self.watchers: list[Callable[[], None]] = []

    def pause(self, seconds: float) -> None:
        """Let time pass on the robot's clock [s]; a robot that moves goes on moving.

        Left before its end (Ctrl-C, a stop button), it stops the robot.
        """
        try:
            self._pause(seconds)
        except BaseException:
            self.driver.stop()
            raise

    def _pause(self, seconds: float) -> None:
        end = self.clock.now() + seconds
        if self.deadline is not None and end > self.deadline:
            self.clock.sleep(max(0.0, self.deadline - self.clock.now()))
            raise TimeUp(self.deadline)
        self.clock.sleep(seconds)


class TimeUp(BaseException):
    """The time that a program was given is over; no program catches it by mistake."""
