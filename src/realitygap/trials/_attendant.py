"""Who puts a robot at its start and says what it drew, for trials one by one: an emulator's witness, or a person."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import RobotError
from realitygap.records import Observe
from realitygap.robots import Clock, Robot
from realitygap.world import Arena, Pose

from ._carry_out import Onlooker
from ._operator import refuse_other_arena
from ._target import TrialPlan

if TYPE_CHECKING:
    from realitygap.emulator import Witness

COUNT_M = 0.00025
"""Way of a wheel for one count of an S2's encoders [m]: half of its half millimeter."""
SHOWN_S = 0.05
"""Real time that is let pass at once [s]: who watches an emulator sees it move, and not jump."""


class Attendant(Onlooker, Protocol):
    """Who stands beside a robot.

    Attributes:
        observes: The most that can be seen with it.
        identity: Of the robot that was met, as `Target.identity`.
    """

    observes: Observe
    identity: str

    def meet(self, robot: Robot, arena: Arena) -> Clock:
        """A robot was opened; the clock by which its commands are timed.

        Raises:
            RobotError: It is not one that can be attended to.
        """
        ...

    def place(self, plan: TrialPlan, start: Pose) -> None:
        """Put the robot at a start; returns when it stands there."""
        ...


class RobotsOwnSenses:
    """What a Scribbler says of itself beyond its observations: its battery and, an S2, its encoders."""

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
        """By its Fluke [V]; nan without one."""
        info = getattr(self._robot, "info", None)
        return math.nan if info is None or info.fluke == "none" else float(self._robot.battery())

    def wheels(self) -> tuple[float, float] | None:
        """By its encoders, seen by the end that is ahead [m]."""
        if not self.has_encoders:
            return None
        left, right = self._robot.encoders()
        self._zero = self._zero or (left, right)
        left, right = left - self._zero[0], right - self._zero[1]
        if self._is_turned:
            left, right = -right, -left
        return left * COUNT_M, right * COUNT_M


class WitnessAttendant(RobotsOwnSenses):
    """The attendant of an emulated robot: nobody. Trial `number` has the noise of that number.

    Args:
        witness: Of the emulator; that of the robot's port when not given.
    """

    observes: Observe = "track"

    def __init__(self, witness: Witness | None = None) -> None:
        super().__init__()
        self._given = witness
        self._times: list[float] = []

    def meet(self, robot: Robot, arena: Arena) -> Clock:
        """Take the witness that comes with the robot's port, unless there is one.

        Raises:
            RobotError: The robot would count as REAL, there is no witness, or it drives in another arena.
        """
        if robot.label != "EMULATED":
            raise RobotError(
                f"A robot on this port counts as {robot.label}, and a witness sees an emulated one: its cells would "
                "be taken for a robot's. Use a pseudo-terminal or a port of this machine, or leave the witness out."
            )
        self._met(robot)
        own = getattr(getattr(robot, "port", None), "witness", None)
        found = own or self._given
        if found is None:
            raise RobotError(
                "This robot has no witness that would say what it drew: it is no emulator in this program. Name the "
                "address of one's witness, HOST:PORT (realitygap emulate --witness PORT)."
            )
        self._witness: Witness = found
        self.identity = found.identity()
        refuse_other_arena(found.arena(), arena)
        clock: Clock = robot.clock  # type: ignore[attr-defined]  # of a Scribbler
        return clock if own is not None else WitnessClock(found, clock)

    def place(self, plan: TrialPlan, start: Pose) -> None:
        """Put it there."""
        self.begin()
        self._times = []
        self._witness.place(start, plan.number)

    def look(self) -> None:
        """Note the time: where it was then is in the path that is told afterwards."""
        self._times.append(self._witness.now())

    def poses(self) -> NDArray[np.float64]:
        """(n, 3) at each look."""
        path = self._witness.path()  # a point for each short step in which it moved
        rows = np.searchsorted(path[:, 0], np.array(self._times) + 1e-9, side="right") - 1
        poses: NDArray[np.float64] = path[np.maximum(rows, 0), 1:4]
        poses[:, 2] %= math.tau
        return poses

    def cells(self) -> tuple[int, ...]:
        """Cells along the driven line."""
        return self._witness.cells()


class WitnessClock:
    """The time of an emulator in another program, which is held: it passes as we let it, however busy the machine is.

    Args:
        witness: Who tells it, and holds it.
        real: By which is waited, so that it passes no faster than was asked for.
    """

    def __init__(self, witness: Witness, real: Clock) -> None:
        self._witness, self._real = witness, real
        self._speed: float = witness.hold()  # type: ignore[attr-defined]  # those of emulators that are served can

    def now(self) -> float:
        """The emulator's time [s]."""
        return self._witness.now()

    def sleep(self, seconds: float) -> None:
        """Let so much of its time pass."""
        while seconds > 0:
            piece = min(seconds, self._speed * SHOWN_S) if self._speed else seconds
            if self._speed:
                self._real.sleep(piece / self._speed)
            self._witness.advance(piece)  # type: ignore[attr-defined]
            seconds -= piece
