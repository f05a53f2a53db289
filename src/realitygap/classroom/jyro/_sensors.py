"""Sensors with a reading for each of several mounts on the robot: thin rays to what is near, and the light of lamps."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from realitygap.drawing import Disc, Ink, Line, Shape
from realitygap.kernels.jyro import scene as kernel

from ._robot import Device


class MountedSensors(Device):
    """Sensors of one kind that are read together.

    Args:
        mounts: (s, 3) forward [m], left [m] and direction [rad, positive to the left] of each on the robot.
        max_range: Maximum range [m].
        groups: Names of groups of sensors.

    Attributes:
        mounts: (s, 3) mounts of the sensors.
        max_range: Largest range [m].
        groups: Indices of the sensors of each group, by name.
    """

    def __init__(
        self,
        mounts: Sequence[Sequence[float]],
        max_range: float,
        groups: Mapping[str, Sequence[int]] | None,
    ) -> None:
        super().__init__()
        self.mounts = _checked(mounts)
        if not (math.isfinite(max_range) and max_range > 0):
            raise ValueError(f"max_range is {max_range!r}, expected a length above 0 [m].")
        self.max_range = float(max_range)
        self.groups = {name: tuple(which) for name, which in (groups or {}).items()}
        self._readings = np.zeros(len(self.mounts))

    def __len__(self) -> int:
        return len(self.mounts)

    @property
    def readings(self) -> NDArray[np.float64]:
        """Readings in the order of the mounts, (s,); a copy."""
        return self._readings.copy()

    def group(self, name: str) -> NDArray[np.float64]:
        """Return the readings of a group of sensors. They are empty if the group is.

        Raises:
            KeyError: There is no such group.
        """
        if name not in self.groups:
            raise KeyError(f"No group {name!r}; there are: {', '.join(sorted(self.groups)) or 'none'}.")
        return self._readings[list(self.groups[name])]

    def to_dict(self) -> dict[str, Any]:
        """Return mounts, range, groups and readings, as plain values."""
        return super().to_dict() | {
            "mounts": self.mounts.tolist(),
            "max_range": self.max_range,
            "groups": {name: list(which) for name, which in self.groups.items()},
            "readings": self._readings.tolist(),
        }


def _checked(mounts: Sequence[Sequence[float]]) -> NDArray[np.float64]:
    try:
        rows = np.array([tuple(mount) for mount in mounts], np.float64)
    except (TypeError, ValueError):
        rows = np.empty(0)
    if rows.ndim != 2 or rows.shape[1] != 3 or not np.isfinite(rows).all():
        raise ValueError(
            f"The mounts are {mounts!r}, expected for each sensor three numbers: forward [m], left [m], direction "
            "[rad]."
        )
    return rows


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


LightMode = Literal["linear", "ambient", "direct"]
_MODES = {
    "linear": kernel.SENSOR_LIGHT_LINEAR,
    "ambient": kernel.SENSOR_LIGHT_AMBIENT,
    "direct": kernel.SENSOR_LIGHT_DIRECT,
}


class LightSensor(MountedSensors):
    """The light at each of several points on the robot: the sum over lamps of intensity times brightness.

    At a distance d [m] the intensity is 1 - d / max_range (linear, 0 beyond), 0.2 / d (ambient) or its square
    (direct), d limited to 0.2..max_range in the last two. A wall or another robot between lamp and sensor halves it,
    unless `world.light_above_walls` lets light pass over walls. The direction of the lamp has no effect.

    Args:
        mounts: (s, 3) forward, left [m] of each sensor; the direction is unused.
        max_range: Distance at which linear light is 0 [m].
        mode: Decrease of light with distance.
        groups: Names of groups of sensors.
        own_shadow: Whether the robot's own body casts a shadow on its sensors.
        shadows: Whether other robots cast shadows on them.

    Source: Jyro 0.3.2.
    """

    kind = "light"

    def __init__(
        self,
        mounts: Sequence[Sequence[float]],
        max_range: float,
        *,
        mode: LightMode = "linear",
        groups: Mapping[str, Sequence[int]] | None = None,
        own_shadow: bool = False,
        shadows: bool = True,
    ) -> None:
        super().__init__(mounts, max_range, groups)
        self.mode = mode
        self.own_shadow, self.shadows = own_shadow, shadows

    @property
    def mode(self) -> LightMode:
        """The decrease of light with distance. It may be changed at any time."""
        return self._mode

    @mode.setter
    def mode(self, mode: LightMode) -> None:
        if mode not in _MODES:
            raise ValueError(f"Unknown mode {mode!r}, expected one of: {', '.join(get_args(LightMode))}.")
        self._mode: LightMode = mode

    def read(self) -> None:
        """Refresh the readings."""
        world = self.robot.world
        stops = 0 if world.light_above_walls else kernel.WALLS
        stops += kernel.OWN_BODY if self.own_shadow else 0
        stops += kernel.OTHER_BODIES if self.shadows else 0
        self._readings = world.light_at(
            self.robot, self.mounts, _MODES[self.mode], self.max_range, int(stops)
        )

    def shapes(self) -> list[Shape]:
        """Return the positions of the sensors."""
        return [
            Disc(*self.robot.point(forward, left), 2.0, "#ffa500", "#ffff00", 0.6)
            for forward, left, _ in self.mounts.tolist()
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return mounts, range, mode, groups and readings, as plain values."""
        return super().to_dict() | {"mode": self.mode}
