"""The observer of an emulated robot: a witness, which places the robot and sees its path."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import RobotError
from realitygap.records import PATH_PARTS, Observe, Score, TrialRecord
from realitygap.robots import Clock, Robot
from realitygap.world import Arena, Pose, paper_arena

from ._own_senses import OwnSenses
from ._target import TrialPlan

if TYPE_CHECKING:
    from realitygap.emulator import Witness

PREFLIGHT_POSE = Pose(0.5334, 0.3048, 0.0)
"""Middle of the paper's arena, where the robot can turn on the spot [m, rad]."""
SHOWN_S = 0.05
"""Real time that may pass in one piece [s]: who watches an emulator sees it move, and not jump."""


class WitnessObserver(OwnSenses):
    """Sees all of an emulated robot, and puts it at the start of each trial.

    Trial `number` has the sensor noise of that number, so that a trial comes out the same whenever it is driven.

    Args:
        witness: Witness of the emulator. Default: that of the robot's port.
    """

    who = "witness"
    asks = False
    observes: Observe = "track"

    def __init__(self, witness: Witness | None = None) -> None:
        super().__init__()
        self._witness = witness
        self._is_own = False
        self._times: list[float] = []

    @property
    def witness(self) -> Witness:
        """Witness of the robot that was met; a `RobotError` if it has none."""
        if self._witness is None:
            raise RobotError(
                "This robot has no witness: it is not an emulator in this program. Name the address of an "
                "emulator's witness, HOST:PORT (realitygap emulate ROBOT --witness PORT), or count its cells by "
                "hand."
            )
        return self._witness

    def meet(self, robot: Robot, arena: Arena | None = None) -> None:
        """Use the witness of the robot's port, unless there is another one.

        Raises:
            RobotError: The robot would count as REAL, there is no witness, or it drives in another arena.
        """
        if robot.label != "EMULATED":
            raise RobotError(
                f"A robot on this port counts as {robot.label}, but a witness reports an emulated one. Its "
                "cells would be recorded as a robot's. Use a pseudo-terminal or a port of this machine, or "
                "leave the witness out."
            )
        self._met(robot)
        own = own_witness(robot)
        self._is_own = own is not None
        self._witness = own or self._witness
        self.identity = self.witness.identity()
        if arena is not None:
            _refuse_other_arena(self.witness.arena(), arena)

    def ready(self) -> None:
        """Put it in the middle of the paper's arena, or at the start of another one."""
        arena = self.witness.arena()
        self.witness.place(PREFLIGHT_POSE if arena.grid == paper_arena().grid else arena.start, 0)

    def clock(self, robot: Robot) -> Clock:
        """Return the robot's own clock. That of an emulator in another program is held from now on, if possible."""
        clock = super().clock(robot)
        speed = None if self._is_own else self.witness.hold()  # type: ignore[attr-defined]  # those that are served can
        return clock if speed is None else WitnessClock(self.witness, clock, speed)

    def place(self, plan: TrialPlan, arena: Arena, observe: Observe) -> None:
        """Put it there.

        Raises:
            RobotError: It drives in another arena.
        """
        _refuse_other_arena(self.witness.arena(), arena)
        self.begin()
        self._times = []
        self.witness.place(plan.start or arena.start, plan.number)

    def look(self) -> None:
        """Note the time: the witness's path has the place of the robot at that time."""
        self._times.append(self.witness.now())

    def poses(self) -> NDArray[np.float64]:
        """Return the pose at each look, (n, 3)."""
        poses = self._poses_at(self._times)
        poses[:, 2] %= math.tau
        return poses

    def cells(self) -> tuple[int, ...]:
        """Return cells along the driven line."""
        return self.witness.cells()

    def settle(self, plan: TrialPlan, arena: Arena, trial: TrialRecord) -> TrialRecord | None:
        """Return None, because an emulated trial can be repeated exactly."""
        return None

    def score(self, arena: Arena) -> Score:
        """Return the cells along the driven line, and the path."""
        rows = np.arange(len(self._times), dtype=np.float64)
        within = np.interp(np.arange((len(rows) - 1) * PATH_PARTS + 1) / PATH_PARTS, rows, self._times)
        cells = self.witness.cells()
        n_ends = len(self.witness.cells_at(self._times))
        return Score(cells, self.who, n_ends=n_ends, path=self._poses_at(within).tolist())

    def _poses_at(self, times: NDArray[np.float64] | list[float]) -> NDArray[np.float64]:
        path = self.witness.path()  # a point for each short step in which it moved
        rows = np.searchsorted(path[:, 0], np.asarray(times) + 1e-9, side="right") - 1
        poses: NDArray[np.float64] = path[np.maximum(rows, 0), 1:4]
        return poses


class WitnessClock:
    """The time of an emulator in another program, which is held: it passes as we let it, however busy the machine is.

    Args:
        witness: Witness that reports and advances the time.
        real: Clock of real time, which limits the speed.
        speed: Seconds of the robot per second of real time; 0: as fast as possible.
    """

    def __init__(self, witness: Witness, real: Clock, speed: float) -> None:
        self._witness, self._real, self._speed = witness, real, speed

    def now(self) -> float:
        """Return the emulator's time [s]."""
        return self._witness.now()

    def sleep(self, seconds: float) -> None:
        """Let so much of its time pass."""
        while seconds > 0:
            piece = min(seconds, self._speed * SHOWN_S) if self._speed else seconds
            if self._speed:
                self._real.sleep(piece / self._speed)
            self._witness.advance(piece)  # type: ignore[attr-defined]
            seconds -= piece


def own_witness(robot: Robot) -> Witness | None:
    """Return the witness of an emulated robot in this program; None if it has none."""
    port: Witness | None = getattr(getattr(robot, "port", None), "witness", None)
    return port or getattr(robot, "witness", None)


def _refuse_other_arena(there: Arena, wanted: Arena) -> None:
    """Refuse an emulated robot that drives elsewhere than it should.

    Raises:
        RobotError: Walls or cells differ.
    """
    if there.grid != wanted.grid or set(there.walls) != set(wanted.walls):
        raise RobotError(
            f"The emulated robot drives in the arena {there.name!r}, and the study is about {wanted.name!r}: other "
            "walls or cells. Start it with the study's arena (`realitygap emulate ROBOT --arena`, or arena= in its "
            "port)."
        )
