"""An emulated robot in the lab's process, which a student drives by hand."""

from __future__ import annotations

from typing import Protocol

from realitygap.emulator import Witness
from realitygap.robot_families import default_family
from realitygap.robots import open_on
from realitygap.world import Pose

from ._hand import DEAD_MAN_S, wheels_of


class StudentRobot(Protocol):
    """A robot that a student drives; `ClassRobot` explains its parts."""

    path: list[Pose]
    n_starts: int

    @property
    def cells(self) -> tuple[int, ...]: ...
    @property
    def is_blocked(self) -> bool: ...
    def put_at_start(self) -> None: ...
    def forget_path(self) -> None: ...
    def pull(self, move: float, turn: float) -> None: ...
    def release(self) -> None: ...
    def advance(self, now: float) -> None: ...
    def close(self) -> None: ...


class ClassRobot:
    """An emulated robot whose time a caller moves. It takes no process and no thread.

    Args:
        seed: Seed of the noise of its sensors.
        now: Time of the class [s].

    Attributes:
        arena: Its arena.
        path: Its pose after each `advance` since it was put at the start.
        n_starts: Number of times that its path began.
    """

    def __init__(self, seed: int, now: float) -> None:
        self._robot = open_on(f"{default_family().emulated}&speed=off&seed={seed}")[1]
        self._witness: Witness = self._robot.port.witness
        self._seed = seed
        self.arena = self._witness.arena()
        self._offset = now - self._robot.clock.now()
        self._now = self._pulled = now
        self._pulled -= DEAD_MAN_S
        self._wheels = (0.0, 0.0)
        self._moves = False
        self.n_starts = 0
        self.put_at_start()

    @property
    def pose(self) -> Pose:
        """Pose of the robot."""
        return self._witness.pose()

    @property
    def cells(self) -> tuple[int, ...]:
        """Cells that its line has crossed, in the order of first visits."""
        return self._witness.cells()

    @property
    def is_blocked(self) -> bool:
        """True if its motors run, and it does not move."""
        return self._moves and self.path[-2:-1] == self.path[-1:]

    def put_at_start(self) -> None:
        """Put it at the start with its motors off."""
        self.release()
        self._seed += 1
        self._witness.place(Pose(*self.arena.start), self._seed)
        self.forget_path()

    def forget_path(self) -> None:
        """Begin its path at its present pose."""
        self.path = [self.pose]
        self.n_starts += 1

    def pull(self, move: float, turn: float) -> None:
        """Drive like this for `DEAD_MAN_S`, if no other command arrives."""
        self._wheels, self._pulled = wheels_of(move, turn), self._now

    def release(self) -> None:
        """Stop the motors."""
        self._pulled = self._now - DEAD_MAN_S
        if self._moves:
            self._robot.stop()
            self._moves = False

    def advance(self, now: float) -> None:
        """Let time pass until a time of the class [s]."""
        until = min(now, self._pulled + DEAD_MAN_S)
        if until > self._now:
            self._robot.motors(*self._wheels)
            self._moves = self._wheels != (0.0, 0.0)
            self._sleep(until)
        if now > until and self._moves:
            self.release()
        self._sleep(now)
        self._now = now
        self.path.append(self.pose)

    def _sleep(self, until: float) -> None:
        self._robot.clock.sleep(max(0.0, until - self._offset - self._robot.clock.now()))

    def close(self) -> None:
        """Switch it off."""
        self._robot.close()
