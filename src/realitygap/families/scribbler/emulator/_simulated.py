"""The simulated robots behind the emulator: the interface of a robot on two wheels, and the built-in box on wheels."""

from __future__ import annotations

import math
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from realitygap.emulator import Walls
from realitygap.errors import check_finite
from realitygap.world import Arena, Body, Pose

Floats = NDArray[np.float64]

SCRIBBLER_BODY = Body(((0.089, 0.0795), (0.089, -0.0795), (-0.089, -0.0795), (-0.089, 0.0795)))
"""The outline of the Scribbler, 178 x 159 mm; its origin is the pen, midway between the wheels."""


class SimulatedRobot(Protocol):
    """A robot on two wheels in its own world.

    If it has an `identity`, a unique text, that identifies it; otherwise its class does.

    Attributes:
        pose: Pose of the point midway between its wheels; the heading is that of the Scribbler's end without the
            caster.
        stalled: True if it was blocked at its last attempt to move.
    """

    pose: Pose
    stalled: bool

    def place(self, pose: Pose) -> None:
        """Put it at another place."""
        ...

    def advance(self, left: float, right: float, seconds: float) -> tuple[float, float]:
        """Move on for a short time with the wheels at `left` and `right` [m/s].

        Returns:
            The distance of each wheel [m]; the wheels of a blocked robot slip.
        """
        ...

    def ranges(self, mounts: Floats, reach: float) -> Floats:
        """Return distances to the nearest obstacle [m], at most `reach`.

        Args:
            mounts: (r, 3) forward [m], left [m] of the origin and direction [rad, positive to the left].
            reach: The largest distance that counts [m].
        """
        ...


@runtime_checkable
class RobotOfItsOwn(SimulatedRobot, Protocol):
    """A simulated robot that also models noise, a Fluke's infrared, and a battery.

    Attributes:
        rolls: True if it still moves, or will, although its motors are off.
    """

    rolls: bool

    def restart(self, seed: int) -> None:
        """Take other random numbers from the next `place` on."""
        ...

    def obstacle(self, emitter: str, stronger: float) -> int:
        """Return the reading of a Fluke's infrared sensor, 0 (free) to 6400 (near).

        Args:
            emitter: "left", "center" or "right".
            stronger: Ratio of the light's reach to its reach at the usual power; 0 for no light.
        """
        ...

    def volts(self, load: float) -> float:
        """Return the battery's voltage [V] with the motors at a load of 0 to 1."""
        ...


class BoxOnWheels:
    """A box with two wheels between walls and obstacles. If blocked, it does not move, as in Jyro, and its wheels slip.

    Args:
        arena: The walls, the obstacles, and the start.
        spacing: Distance between its wheels [m].
        body: Outline of the body.
    """

    def __init__(self, arena: Arena, spacing: float, body: Body = SCRIBBLER_BODY) -> None:
        self.arena = arena
        self.spacing = spacing
        self.walls = Walls.of(arena)
        self._corners = np.array(body.corners)
        self._radius = float(np.hypot(*self._corners.T).max())
        self.place(arena.start)

    def place(self, pose: Pose) -> None:
        """Put it at another place."""
        check_finite({"pose": tuple(pose), "spacing": self.spacing})
        self.pose = Pose(*map(float, pose))
        self.stalled = False
        self._free = 0.0  # how far the origin can go before the outline may touch something [m]
        self._refused: tuple[float, float] | None = None  # how the wheels turned when it was blocked here

    def advance(self, left: float, right: float, seconds: float) -> tuple[float, float]:
        """Move on along the circle that the wheels' speeds make."""
        rolled_left, rolled_right = left * seconds, right * seconds
        if self._refused == (rolled_left, rolled_right):
            return self._refused
        far = (rolled_left + rolled_right) / 2
        turn = (rolled_right - rolled_left) / self.spacing
        x, y, heading = self.pose
        middle = heading + turn / 2
        chord = far * (math.sin(turn / 2) / (turn / 2)) if abs(turn) > 1e-9 else far
        pose = Pose(x + chord * math.cos(middle), y + chord * math.sin(middle), heading + turn)
        if self._is_blocked(pose, abs(chord)):
            self.stalled, self._refused = True, (rolled_left, rolled_right)
        else:
            self.pose, self.stalled, self._refused = pose, False, None
        return rolled_left, rolled_right

    def _is_blocked(self, pose: Pose, moved: float) -> bool:
        """Return whether the outline touches a wall or an obstacle at a pose displaced by this."""
        self._free -= moved
        if self._free > 0:
            return False
        self._free = self.walls.nearest(pose.x, pose.y) - self._radius
        if self._free > 0:
            return False
        xs, ys = self._corners.T
        cos, sin = math.cos(pose.heading), math.sin(pose.heading)
        return self.walls.touch(pose.x + cos * xs - sin * ys, pose.y + sin * xs + cos * ys)

    def ranges(self, mounts: Floats, reach: float) -> Floats:
        """Return distances to walls and obstacles [m]."""
        x, y, heading = self.pose
        cos, sin = math.cos(heading), math.sin(heading)
        forward, left = mounts[:, 0], mounts[:, 1]
        return self.walls.ranges(
            x + cos * forward - sin * left, y + sin * forward + cos * left, heading + mounts[:, 2], reach
        )
