"""A twin's light and line sensors, which see the arena's lamps and floor."""

from __future__ import annotations

import math

from realitygap.world import Arena, Pose

from ._model import TwinLight, TwinModel, TwinMount
from ._random import AMBIENT, numbers_for

NEAREST = 0.05
"""Distance below which a lamp gets no brighter [m]."""


class Ambient:
    """The light and line sensors of one twin in one trial.

    Args:
        model: The twin.
        arena: Arena of the robot.
        number: Number of the trial.
    """

    def __init__(self, model: TwinModel, arena: Arena, number: int) -> None:
        self._light, self._line, self._arena = model.light, model.line, arena
        self._seed, self._number = model.seed, number

    def values(self, pose: Pose, step: int) -> dict[str, float]:
        """Return what the sensors answer before a step, 0..1, by name."""
        found: dict[str, float] = {}
        if self._light is not None:
            sensors = self._light
            noise = numbers_for(self._seed, self._number, AMBIENT, step).standard_normal(len(sensors.mount))
            for k, (mount, drawn) in enumerate(zip(sensors.mount, noise.tolist(), strict=True)):
                light = self._arriving(sensors, mount, pose) * mount.gain * math.exp(sensors.noise * drawn)
                found[f"light.{k}"] = max(1.0 - sensors.half / (2.0 * light), 0.0) if light else 0.0
        if self._line is not None:
            for k, (ahead, left) in enumerate(self._line.mount):
                brightness = self._arena.floor.brightness(*pose.point(ahead, left))
                found[f"line.{k}"] = float(brightness < self._line.threshold)
        return found

    def _arriving(self, sensors: TwinLight, mount: TwinMount, pose: Pose) -> float:
        """Return the light that arrives at a sensor; a lamp of strength 1 straight ahead at 1 m gives 1."""
        x, y = pose.point(mount.x, mount.y)
        direction, total = pose.heading + mount.direction, sensors.room
        for lamp in self._arena.lights:
            to_x, to_y = lamp.x - x, lamp.y - y
            distance = max(NEAREST, math.hypot(to_x, to_y))
            facing = (to_x * math.cos(direction) + to_y * math.sin(direction)) / distance
            total += lamp.strength * max(0.0, facing) ** sensors.lobe / distance**2
        return total


def names_of(model: TwinModel) -> tuple[str, ...]:
    """Return the names of a twin's light and line sensors."""
    light = 0 if model.light is None else len(model.light.mount)
    line = 0 if model.line is None else len(model.line.mount)
    return (*(f"light.{k}" for k in range(light)), *(f"line.{k}" for k in range(line)))
