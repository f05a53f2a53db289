"""Light sensors: how much light arrives from all lamps, half of it in a shadow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, get_args

from realitygap.drawing import Disc, Shape
from realitygap.kernels.jyro import scene as kernel

from ._mounted import MountedSensors

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
