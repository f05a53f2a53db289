"""The base of all parts of Myro's robot: the driver, its clock, and pauses."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from realitygap.families.scribbler import Scribbler as Driver
    from realitygap.robots import Clock

    from ._simulation import Simulation

PLACES = {
    "left": 0, 0: 0,
    "center": 1, "middle": 1, 1: 1,
    "right": 2, 2: 2,
}  # fmt: skip
"""Names of the positions of sensors in groups of three."""

_GLANCE_S = 1e-3
"""Time that a look at the clock takes if time passes in no other way [s], so that loops that only wait for it end."""


class TimeUp(BaseException):
    """The time that a program was given is over; no program catches it by mistake."""


class Part(threading.Thread):
    """A function of a program that runs in parallel with others.

    Attributes:
        result: Returned value.
        error: Raised error.
        is_over: True if it may no longer use a robot.
    """

    def __init__(self, function: Callable[[], object]) -> None:
        super().__init__(daemon=True)
        self._function = function
        self.result: object = None
        self.error: BaseException | None = None
        self.is_over = False

    def run(self) -> None:
        """Run the function."""
        try:
            self.result = self._function()
        except BaseException as error:
            self.error = error


class Base:
    """A robot and its clock.

    Attributes:
        simulation: View of a simulated robot from outside; None for others.
        clock: The time that the robot lives in.
        deadline: Time at which a program has to end, by that clock [s]; None for never.
    """

    _driver: Driver
    simulation: Simulation | None
    clock: Clock
    deadline: float | None = None

    @property
    def driver(self) -> Driver:
        """The robot's driver, to say something to the robot.

        Raises:
            TimeUp: The time of the program, or of this part of it, is over.
        """
        is_late = self.deadline is not None and self.clock.now() >= self.deadline
        if is_late or getattr(threading.current_thread(), "is_over", False):
            raise TimeUp
        if self.simulation is not None:
            self.simulation.look()
        return self._driver

    def now(self) -> float:
        """Return the time on the robot's clock [s]."""
        if self.simulation is not None and not self.simulation.is_timed:
            self.pause(_GLANCE_S)
        return self.clock.now()

    def pause(self, seconds: float) -> None:
        """Let time pass on the robot's clock [s]; a moving robot keeps moving.

        Left before its end (Ctrl-C, a stop button, the program's time is over), it stops the robot.
        """
        try:
            self._pause(seconds)
        except BaseException:
            self._driver.stop()
            raise

    def _pause(self, seconds: float) -> None:
        rest = seconds if self.deadline is None else min(seconds, self.deadline - self.clock.now())
        self.clock.sleep(max(0.0, rest))
        if rest < seconds:
            raise TimeUp
        if self.simulation is not None:
            self.simulation.look()
