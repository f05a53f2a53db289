"""An observer knows of a robot what its sensors do not tell; that of a simulated robot is the simulation."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import RobotError
from realitygap.records import Observe, Score, TrialRecord
from realitygap.robots import Clock, Robot
from realitygap.world import Arena

from ._target import TrialPlan


class Observer(Protocol):
    """Sees a trial from outside; asked only for what is to be observed."""

    def battery_v(self) -> float:
        """Return the voltage of the robot at the start of a trial [V]; nan if it is not known."""
        ...

    def wheels(self) -> tuple[float, float] | None:
        """Return the distance of both wheels since the start of the trial, by encoders [m]; None if it has none."""
        ...

    def look(self) -> None:
        """Record the robot's pose: before each command, and after the last."""
        ...

    def poses(self) -> NDArray[np.float64]:
        """Return x [m], y [m], heading [rad] at each look of the trial, (n, 3)."""
        ...

    def cells(self) -> tuple[int, ...]:
        """Return the cells that were crossed, in any order."""
        ...


class PortObserver(Observer, Protocol):
    """Observes a robot on a port, which it has to meet and to put at the start of a trial.

    Attributes:
        observes: Highest observation level of this observer.
        identity: Identity of the connected robot, as in `Target.identity`.
        who: Enters the scores that it reports.
        asks: True if a person reports after a trial what they saw.
    """

    who: str
    asks: bool

    @property
    def observes(self) -> Observe:
        """Highest observation level of this observer."""
        ...

    @property
    def identity(self) -> str:
        """Identity of the connected robot, as in `Target.identity`."""
        ...

    def meet(self, robot: Robot, arena: Arena | None = None) -> None:
        """Take note of a robot that was opened, in an arena if that is known.

        Raises:
            RobotError: It cannot be observed, or it drives in another arena.
        """
        ...

    def ready(self) -> None:
        """Put a connected robot at a place where it can turn on the spot, unless a person does."""
        ...

    def clock(self, robot: Robot) -> Clock:
        """Return the clock by which commands of the robot that was met are timed."""
        ...

    def place(self, plan: TrialPlan, arena: Arena, observe: Observe) -> None:
        """Put the robot at the start of a trial, or have a person do so.

        Raises:
            RobotError: It drives in another arena.
        """
        ...

    def score(self, arena: Arena) -> Score | None:
        """Return the score of the trial that has just ended; None if a person has to count it."""
        ...

    def settle(self, plan: TrialPlan, arena: Arena, trial: TrialRecord) -> TrialRecord | None:
        """Return the trial that was running when the program ended, as far as it counts; None if it is void."""
        ...


class RobotObserver:
    """An observer of a simulated robot that reads `pose`, `visited_cells` and, if it has them, `encoders`.

    Args:
        robot: Whom to look at.
    """

    def __init__(self, robot: Any) -> None:
        self._robot = robot
        self._poses: list[tuple[float, float, float]] = []

    def battery_v(self) -> float:
        """Return the battery voltage [V]; nan if the simulation has none."""
        self._poses = []
        return float(getattr(self._robot, "battery_v", float("nan")))

    def wheels(self) -> tuple[float, float] | None:
        """Return the way of the wheels by its encoders [m]."""
        try:
            left, right = self._robot.encoders
        except (AttributeError, RobotError):
            return None
        return float(left), float(right)

    def look(self) -> None:
        """Remember its pose."""
        self._poses.append(tuple(self._robot.pose))

    def poses(self) -> NDArray[np.float64]:
        """Return the pose at each look, (n, 3)."""
        return np.array(self._poses, np.float64).reshape(-1, 3)

    def cells(self) -> tuple[int, ...]:
        """Return the cells along its line."""
        return tuple(self._robot.visited_cells)
