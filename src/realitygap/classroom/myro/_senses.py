"""The robot's sensors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from ._base import PLACES, Base
from ._mistakes import choice

if TYPE_CHECKING:
    from realitygap.families.scribbler import SensorBlock

K = TypeVar("K")
Readings = int | list[int]
"""One reading, or those of several sensors from left to right."""

_PAIR = {"left": 0, 0: 0, "right": 1, 1: 1}


class Senses(Base):
    """Readings of the robot. They are a list from left to right, or one value if a position is given."""

    def getLight(self, *position: str | int) -> Readings:
        """Return the darkness at the light sensors: 0 in bright light; the darker, the larger.

        Args:
            position: "left", "center", "right", or 0, 1, 2; several give a list; none gives all three.
        """
        return _picked("getLight", self.driver.light(), PLACES, position)

    def getIR(self, *position: str | int) -> Readings:
        """Return the readings of the robot's own infrared sensors: 1 nothing, 0 an obstacle.

        Args:
            position: "left", "right", or 0, 1; none gives both.
        """
        return _picked("getIR", self.driver.ir(), _PAIR, position)

    def getLine(self, *position: str | int) -> Readings:
        """Return the readings of the line sensors below the robot: 1 dark, 0 light.

        Args:
            position: "left", "right", or 0, 1; none gives both.
        """
        return _picked("getLine", self.driver.line(), _PAIR, position)

    def getStall(self) -> int:
        """Return 1 if the wheels are blocked, otherwise 0."""
        return int(self.driver.stall())

    def getObstacle(self, position: str | int | None = None) -> Readings:
        """Return the strength of the Fluke's reflected infrared: 0 nothing, up to about 6400 very near.

        Args:
            position: "left", "center", "right", or 0, 1, 2; none gives all three. A Fluke 2 has one emitter and tells
                the same for all.
        """
        return _one_or_all("getObstacle", self.driver.obstacle, position)

    def getBright(self, position: str | int | None = None) -> Readings:
        """Return the brightness of the left, middle and right of the camera's picture: the sum of their pixels.

        Args:
            position: "left", "center", "right", or 0, 1, 2; none or "all" gives all three.
        """
        return _one_or_all("getBright", self.driver.bright, None if position == "all" else position)

    def getBlob(self) -> tuple[int, int, int]:
        """Return the pixels of the color that `configureBlob` set: how many, and their mean column and row."""
        count, x, y = self.driver.blob()
        return (count, x, y)

    def getBattery(self) -> float:
        """Return the voltage of the cells [V]; six fresh ones have about 9."""
        return self.driver.battery()

    def getDistance(self, *position: str | int) -> Readings:
        """Return the distance of an obstacle from the infrared sensors of a Scribbler 2: 0 touching, 99 nothing.

        Args:
            position: "left", "right", or 0, 1; none gives both.
        """
        return _picked("getDistance", self.driver.distance(), _PAIR, position)

    def getMicEnvelope(self) -> int:
        """Return the loudness at the microphone of a Scribbler 2."""
        return self.driver.mic_envelope()

    def getAll(self) -> dict[str, Readings | float | tuple[int, int, int]]:
        """Return all readings by name: light, ir, line, stall; with a Fluke also obstacle, bright, blob and battery."""
        readings = _by_name(self.driver.sensors())
        if self.driver.info.fluke == "none":
            return readings
        return readings | {
            "obstacle": self.getObstacle(),
            "bright": self.getBright(),
            "blob": self.getBlob(),
            "battery": self.getBattery(),
        }

    def getLastSensors(self) -> dict[str, Readings | float | tuple[int, int, int]]:
        """Return light, ir, line and stall as the robot sent them with the last command, without asking again."""
        return _by_name(self.driver.last_sensors or self.driver.sensors())

    def senses(self) -> None:
        """Print all readings by name. Differs: Myro shows them in a window that stays open."""
        for name, value in self.getAll().items():
            print(f"{name:>9}: {', '.join(map(str, value)) if isinstance(value, (list, tuple)) else value}")

    def wall(self, threshold: float = 4500) -> bool:
        """Return whether the echo of the Fluke's infrared ahead is stronger than a threshold."""
        return self.driver.obstacle()[1] > threshold

    def get(self, sensor: str = "all", *position: str | int) -> Any:
        """Return a reading by its name: `get("light", "left")` is `getLight("left")`.

        Args:
            sensor: "light", "ir", "line", "stall", "obstacle", "bright", "blob", "battery", "distance", "all", "name",
                "password", "data", "info", "forwardness", "volume", "startsong", "version", "config" or "picture".
            position: Position, as for the function that reads this sensor.
        """
        return choice("get: the sensor", sensor, self._getters())(*position)

    def _getters(self) -> Mapping[str | int, Callable[..., object]]:
        raise NotImplementedError

    def _config(self) -> dict[str, int]:
        own = {"ir": 2, "line": 2, "stall": 1, "light": 3}
        fluke = {"battery": 1, "obstacle": 3, "bright": 3}
        return own if self.driver.info.fluke == "none" else own | fluke


def _by_name(block: SensorBlock) -> dict[str, Readings | float | tuple[int, int, int]]:
    return {
        "light": list(block.light),
        "ir": list(block.ir),
        "line": list(block.line),
        "stall": int(block.stall),
    }


def _picked(
    name: str, values: Sequence[int], places: Mapping[K, int], position: tuple[str | int | None, ...]
) -> Readings:
    """Return all values, the one at a position, or those at several."""
    if not position or position in ((None,), ("all",)):
        return list(values)
    picked = [values[choice(f"{name}: the position", where, places)] for where in position]
    return picked[0] if len(picked) == 1 else picked


def _one_or_all(name: str, read: Callable[[], Sequence[int]], position: str | int | None) -> Readings:
    """Read the sensors, and return all values or the one at a position; a wrong position reads nothing."""
    place = None if position is None else choice(f"{name}: the position", position, PLACES)
    values = list(read())
    return values if place is None else values[place]
