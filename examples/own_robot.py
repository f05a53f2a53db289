"""A platform in one file: a disc with three rays, which stops before a wall.

    uv run python examples/own_robot.py

checks it. Its name on the command line is python:examples/own_robot.py:ToyPlatform.
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from pydantic import Field

from realitygap.platforms import Platform
from realitygap.robots import Command, Label, Observation, ProgramRobot, check_command
from realitygap.world import Arena, Pose

REACH = 0.2  # of the rays [m]
RAYS = (0.5, 0.0, -0.5)  # directions, from left to right [rad]


class ToyPlatform(Platform):
    """The settings of the toy, `[platform.toy]` of a study file."""

    name: ClassVar[str] = "toy"
    summary: ClassVar[str] = "a toy: a disc with three rays"
    takes_noise: ClassVar[bool] = True

    speed: float = Field(0.1, gt=0, le=1, description="Speed at full output [m/s].")
    seed: int = Field(1, ge=0, description="Of the noise of its sensors.")

    def open_robot(self, arena: Arena, *, noise: float = 0.0) -> ToyRobot:
        """Open one robot."""
        return ToyRobot(self, arena, noise)


class ToyRobot(ProgramRobot):
    """The toy, one command at a time."""

    label: Label = "SIM"
    step_s, n_sensors = 0.5, len(RAYS)

    def __init__(self, platform: ToyPlatform, arena: Arena, noise: float) -> None:
        self._platform, self.arena, self._noise = platform, arena, noise
        self._walls = np.array(arena.straight_walls(), np.float64).reshape(-1, 4)
        self.number = 0  # of the trial that the next `reset` begins
        self.reset()

    def reset(self, pose: Pose | None = None) -> None:
        """Begin a trial at a pose, or at the arena's start."""
        self._check_open()
        self.pose = pose or self.arena.start
        self._stalled = False
        self._rng = np.random.default_rng([self._platform.seed, self.number])

    def observe(self) -> Observation:
        """Read the three rays: 0 is nothing within reach, 1 a wall at the center."""
        self._check_open()
        x, y, heading = self.pose
        distances = [self._distance(x, y, heading + ray) for ray in RAYS]
        near = 1 - np.minimum(distances, REACH) / REACH
        noisy = near + self._noise * self._rng.uniform(-1, 1, len(RAYS))
        readings = tuple(np.clip(noisy, 0.0, 1.0).tolist())
        return Observation(readings, self._stalled, readings)

    def drive(self, command: Command) -> None:
        """Turn, then move ahead or back for `step_s`."""
        self._check_open()
        move, turn = check_command(command)
        x, y, heading = self.pose
        heading += turn * self.step_s
        distance = move * self._platform.speed * self.step_s
        free = self._distance(x, y, heading if distance > 0 else heading + math.pi)
        self._stalled = abs(distance) > free - 0.01
        distance = 0.0 if self._stalled else distance
        self.pose = Pose(
            x + distance * math.cos(heading), y + distance * math.sin(heading), heading % math.tau
        )

    def _distance(self, x: float, y: float, direction: float) -> float:
        """Return the distance to the nearest wall in a direction [m]."""
        u, v = math.cos(direction), math.sin(direction)
        near = math.inf
        for x0, y0, x1, y1 in self._walls.tolist():
            across = u * (y1 - y0) - v * (x1 - x0)
            if across:
                ahead = ((x0 - x) * (y1 - y0) - (y0 - y) * (x1 - x0)) / across
                along = ((x0 - x) * v - (y0 - y) * u) / across
                if ahead >= 0 and 0 <= along <= 1:
                    near = min(near, ahead)
        return near


if __name__ == "__main__":
    from realitygap.testing import check_platform

    check_platform(ToyPlatform())
    print("ToyPlatform keeps the contract of a platform.")
