"""The contract of an emulated robot: bytes in, bytes out, and the view of an observer."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from realitygap.world import Arena, Pose, cells_along

# Times are whole nanoseconds, so that what happens does not depend on when the robot was switched on.
SECOND = 1_000_000_000  # [ns]
MILLISECOND = 1_000_000  # [ns]


def nanoseconds(seconds: float) -> int:
    """Return a duration as whole nanoseconds."""
    return round(seconds * SECOND)


class EmulatedRobot(ABC):
    """A robot as a client sees it through its port, as a function of bytes and time.

    Attributes:
        arena: Arena in which it drives.
        identity: Identity of the emulated robot, which does not depend on its port and seed.
        may_hang_up: True if its link can be interrupted.
    """

    arena: Arena
    identity: str
    may_hang_up = False

    @property
    @abstractmethod
    def now_ns(self) -> int:
        """The time since it was switched on [ns]."""

    @property
    def now(self) -> float:
        """The time since it was switched on [s]."""
        return self.now_ns / 1e9

    @abstractmethod
    def advance_to(self, when: int) -> None:
        """Let time pass until a time [ns]."""

    def advance(self, seconds: float) -> None:
        """Let time pass [s]."""
        self.advance_to(self.now_ns + round(seconds * 1e9))

    def compute_motion(self) -> None:  # noqa: B027  # most emulators compute it as time passes
        """Compute the physics up to the present, if `advance_to` puts them off."""

    @abstractmethod
    def next_event(self, wanted: int = 1) -> int | None:
        """Return the time of the next event that may bring output, or at which `wanted` bytes are out [ns], or None."""

    @abstractmethod
    def receive(self, data: bytes) -> None:
        """Take bytes that a client sends from now on."""

    @abstractmethod
    def transmit(self) -> bytes:
        """Return the bytes that have been sent since the last call."""

    @property
    def is_talking(self) -> bool:
        """True while bytes are transmitted to it or from it."""
        return False

    @property
    def is_connected(self) -> bool:
        """True if the link works."""
        return True

    def reset_line(self) -> None:  # noqa: B027  # most robots have no such line
        """Apply DTR going low on a cable."""

    @property
    def is_turning(self) -> bool:
        """True if its motors run."""
        return any(self.wheel_speeds())

    @property
    def pose(self) -> Pose:
        """Pose of its pen."""
        return Pose(*self._points[-1][1:])

    def place(self, pose: Pose, seed: int) -> None:
        """Place the robot at a pose; the pen's path restarts.

        Override it to turn the motors off, and to restart the sensors' noise with the seed.
        """
        self._points = [(self.now, *map(float, pose))]

    def move_to(self, pose: Pose) -> None:
        """Add the present pose to the pen's path."""
        self._points.append((self.now, *pose))

    @abstractmethod
    def wheel_speeds(self) -> tuple[float, float]:
        """Return the speeds of the left and the right wheel [m/s]."""

    def path(self) -> NDArray[np.float64]:
        """Return time [s], x [m], y [m] and heading [rad] of the pen since it was placed, (t, 4)."""
        return np.array(self._points, dtype=float)

    def cells(self) -> tuple[int, ...]:
        """Return cells of the arena's grid along the driven line, in order of first visits."""
        return cells_along(self.path()[:, 1:3], self.arena.grid)
