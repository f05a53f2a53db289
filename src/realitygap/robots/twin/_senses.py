"""Sensors of a twin other than its range sensors: light, floor, encoders, and stall."""

from __future__ import annotations

import math

from realitygap.world import Arena, Pose

from ._model import AMBIENT, ENCODERS, TwinLight, TwinModel, TwinMount, numbers_for

NEAREST = 0.05
"""Distance below which a lamp gets no brighter [m]."""
COUNT = 2.5e-4
"""Of an S2's encoders [m]; less than that is no difference."""


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
        readings: dict[str, float] = {}
        if self._light is not None:
            sensors = self._light
            noise = numbers_for(self._seed, self._number, AMBIENT, step).standard_normal(len(sensors.mount))
            for k, (mount, drawn) in enumerate(zip(sensors.mount, noise.tolist(), strict=True)):
                light = self._arriving(sensors, mount, pose) * mount.gain * math.exp(sensors.noise * drawn)
                readings[f"light.{k}"] = max(1.0 - sensors.half / (2.0 * light), 0.0) if light else 0.0
        if self._line is not None:
            for k, (ahead, left) in enumerate(self._line.mount):
                brightness = self._arena.floor.brightness(*pose.point(ahead, left))
                readings[f"line.{k}"] = float(brightness < self._line.threshold)
        return readings

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


class Encoders:
    """The encoders of one twin in one trial.

    Args:
        model: The twin.
        number: Number of the trial.
    """

    def __init__(self, model: TwinModel, number: int) -> None:
        self._encoders = model.encoders
        self._random = numbers_for(model.seed, number, ENCODERS)
        self._drawn: list[float] = []
        self._ways = [0.0, 0.0]

    def turn(self, left: float, right: float) -> tuple[float, float]:
        """Turn the wheels by these distances and return the distances that are counted [m]."""
        encoders = self._encoders
        counted = []
        for wheel, (way, gain) in enumerate(((left, encoders.gain_left), (right, encoders.gain_right))):
            more = gain * way
            if encoders.noise_per_m:
                if not self._drawn:
                    self._drawn = self._random.standard_normal(512).tolist()
                more += encoders.noise_per_m * math.sqrt(abs(way)) * self._drawn.pop()
            self._ways[wheel] += more
            counted.append(more)
        return counted[0], counted[1]

    @property
    def distances(self) -> tuple[float, float]:
        """Distances of the left and the right wheel since the start [m], in whole counts."""
        left, right = self._ways
        count = self._encoders.count
        return (round(left / count) * count, round(right / count) * count) if count else (left, right)


class Idler:
    """Stall as an S2 computes it: its caster rolls too little for what the drive wheels turn.

    Args:
        model: The twin.
        pose: Start of the robot.
    """

    def __init__(self, model: TwinModel, pose: Pose) -> None:
        self._stall, self._ahead = model.stall, model.wheels.caster
        self._was = self._point(pose)
        self._driven = self._rolled = 0.0
        self.stalled = False

    def _point(self, pose: Pose) -> tuple[float, float]:
        return (
            pose.x + self._ahead * math.cos(pose.heading),
            pose.y + self._ahead * math.sin(pose.heading),
        )

    def watch(self, pose: Pose, left: float, right: float, seconds: float) -> None:
        """Take note of a short time.

        Args:
            pose: Pose of the robot after it.
            left, right: Distances of the wheels in it [m].
            seconds: Duration [s].
        """
        point = self._point(pose)
        way = math.dist(point, self._was)
        self._was = point
        keep = math.exp(-seconds / self._stall.window)
        self._driven = keep * self._driven + abs(left + right) / 2
        self._rolled = keep * self._rolled + way
        is_driven = abs(left) + abs(right) > 1e-9
        self.stalled = is_driven and self._rolled + COUNT < self._stall.share * self._driven
