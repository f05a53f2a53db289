"""Range sensors: thin rays that measure the distance of the nearest wall or robot."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from realitygap.drawing import Ink, Line, Shape

from ._mounted import MountedSensors

RAYS_OF_A_CONE = 5
"""Number of rays in a cone. It is odd, so that one ray is the axis."""


class RangeSensor(MountedSensors):
    """Distances [m] along rays from mounts on the robot, from 0 to `max_range`.

    Args:
        mounts: (s, 3) forward, left [m] and direction [rad] of each ray.
        max_range: The reading if nothing is nearer [m].
        kind: Key of the sensor in `robot[kind]`, such as "ir" or "sonar".
        groups: Names of groups of rays.
        arc: Width of the cone of each sensor [rad]. The reading is the minimum along five rays in it. 0: one ray.
        noise: Level a. a * max_range * U(-1, 1) is added to a reading, which is limited to 0..max_range.

    Source: Jyro 0.3.2. Differs: Jyro stores `arc` and `noise` but never uses them, so here both are 0 by default.
    """

    def __init__(
        self,
        mounts: Sequence[Sequence[float]],
        max_range: float,
        *,
        kind: str = "ir",
        groups: Mapping[str, Sequence[int]] | None = None,
        arc: float = 0.0,
        noise: float = 0.0,
    ) -> None:
        super().__init__(mounts, max_range, groups)
        if not (arc >= 0 and noise >= 0):
            raise ValueError(f"arc is {arc!r} and noise {noise!r}, expected 0 or more.")
        self.kind = kind
        self.arc, self.noise = arc, noise
        self._rays = _rays(self.mounts, arc)
        self._readings[:] = self.max_range

    @property
    def nearness(self) -> NDArray[np.float64]:
        """Nearness from 0, nothing within range, to 1, touching, (s,)."""
        return 1.0 - self._readings / self.max_range

    def read(self) -> None:
        """Refresh the readings."""
        self._readings = self._distances()

    def _distances(self) -> NDArray[np.float64]:
        world = self.robot.world
        distances, _ = world.look(self.robot, self._rays, self.max_range)
        nearest: NDArray[np.float64] = distances.reshape(len(self.mounts), -1).min(axis=1)
        if self.noise:
            nearest += self.noise * self.max_range * world.random.uniform(-1, 1, len(nearest))
            nearest = np.clip(nearest, 0.0, self.max_range)
        return nearest

    def rays(self) -> list[Shape]:
        """Return the rays, up to the measured distance."""
        shapes: list[Shape] = []
        for (forward, left, direction), far in zip(self.mounts.tolist(), self._lengths(), strict=True):
            end = (forward + far * math.cos(direction), left + far * math.sin(direction))
            shapes.append(Line((self.robot.point(forward, left), self.robot.point(*end)), Ink.PUBLISHED, 0.6))
        return shapes

    def _lengths(self) -> list[float]:
        return self._readings.tolist()


class Bumper(RangeSensor):
    """Feelers that read 1 if something is nearer than their length, and 0 otherwise.

    Args:
        mounts: (s, 3) forward, left [m] and direction [rad] of each feeler.
        max_range: Length of the feelers [m].
        groups: Names of groups of feelers.
    """

    def __init__(
        self,
        mounts: Sequence[Sequence[float]],
        max_range: float,
        *,
        groups: Mapping[str, Sequence[int]] | None = None,
    ) -> None:
        super().__init__(mounts, max_range, kind="bumper", groups=groups)
        self._readings[:] = 0.0

    @property
    def nearness(self) -> NDArray[np.float64]:
        """Nearness, 1 if touching, (s,)."""
        return self.readings

    def read(self) -> None:
        """Refresh the readings."""
        self._readings = (self._distances() < self.max_range).astype(np.float64)

    def _lengths(self) -> list[float]:
        return [self.max_range] * len(self.mounts)


def _rays(mounts: NDArray[np.float64], arc: float) -> NDArray[np.float64]:
    """Return the (s * k, 3) mounts of the rays of all sensors: one ray each, or k over the cone."""
    if not arc:
        return mounts
    rays = np.repeat(mounts, RAYS_OF_A_CONE, axis=0)
    rays[:, 2] += np.tile(np.linspace(-arc / 2, arc / 2, RAYS_OF_A_CONE), len(mounts))
    return rays
