"""The robot's sensors."""

from __future__ import annotations

from typing import Any

from realitygap._version import __version__

from ._base import PLACES, Base
from ._mistakes import MyroError, choice

_PAIR = {"left": 0, 0: 0, "right": 1, 1: 1}


class Senses(Base):
    """Readings of the robot. They are a list from left to right, or one value if a position is given."""

    def getLight(self, *position: str | int) -> Any:
        """Return the darkness at the light sensors: 0 in bright light; the darker, the larger.

        Args:
            position: "left", "center", "right", or 0, 1, 2; several give a list; none gives all three.
        """
        return self._picked("getLight", list(self._driven("light")), PLACES, position)

    def getIR(self, *position: str | int) -> Any:
        """Return the readings of the robot's own infrared sensors: 1 nothing, 0 an obstacle.

        Args:
            position: "left", "right", or 0, 1; none gives both.
        """
        return self._picked("getIR", list(self._driven("ir")), _PAIR, position)

    def getLine(self, *position: str | int) -> Any:
        """Return the readings of the line sensors below the robot: 1 dark, 0 light.

        Args:
            position: "left", "right", or 0, 1; none gives both.
        """
        return self._picked("getLine", list(self._driven("line")), _PAIR, position)

    def getStall(self) -> int:
        """Return 1 if the wheels are blocked, otherwise 0."""
        return int(self._driven("stall"))

    def getObstacle(self, position: str | int | None = None) -> Any:
        """Return the strength of the Fluke's reflected infrared: 0 nothing, up to about 6400 very near.

        Args:
            position: "left", "center", "right", or 0, 1, 2; none gives all three. A Fluke 2 has one emitter and tells
                the same for all.
        """
        return self._one_or_all("getObstacle", "obstacle", position)

    def getBright(self, position: str | int | None = None) -> Any:
        """Return the brightness of the left, middle and right of the camera's picture: the sum of their pixels.

        Args:
            position: "left", "center", "right", or 0, 1, 2; none or "all" gives all three.
        """
        return self._one_or_all("getBright", "bright", None if position == "all" else position)

    def getBlob(self) -> tuple[int, int, int]:
        """Return the pixels of the color that `configureBlob` set: how many, and their mean column and row."""
        count, x, y = self._driven("blob")
        return (int(count), int(x), int(y))

    def getBattery(self) -> float:
        """Return the voltage of the cells [V]; six fresh ones have about 9."""
        return float(self._driven("battery"))

    def getDistance(self, *position: str | int) -> Any:
        """Return the distance of an obstacle from the infrared sensors of a Scribbler 2: 0 touching, 99 nothing.

        Args:
            position: "left", "right", or 0, 1; none gives both.
        """
        return self._picked("getDistance", list(self._driven("distance")), _PAIR, position)

    def getMicEnvelope(self) -> int:
        """Return the loudness at the microphone of a Scribbler 2."""
        return int(self._driven("mic_envelope"))

    def getAll(self) -> dict[str, Any]:
        """Return all readings by name: light, ir, line, stall; with a Fluke also obstacle, bright, blob and battery."""
        block = self._driven("sensors")
        readings = {
            "light": list(block.light),
            "ir": list(block.ir),
            "line": list(block.line),
            "stall": int(block.stall),
        }
        if self.driver.info.fluke == "none":
            return readings
        return readings | {
            "obstacle": self.getObstacle(),
            "bright": self.getBright(),
            "blob": self.getBlob(),
            "battery": self.getBattery(),
        }

    def getLastSensors(self) -> dict[str, Any]:
        """Return light, ir, line and stall as the robot sent them with the last command, without asking again."""
        block = self.driver.last_sensors
        if block is None:
            block = self._driven("sensors")
        return {
            "light": list(block.light),
            "ir": list(block.ir),
            "line": list(block.line),
            "stall": int(block.stall),
        }

    def senses(self) -> None:
        """Print all readings by name. Differs: Myro shows them in a window that stays open."""
        for name, value in self.getAll().items():
            print(f"{name:>9}: {', '.join(map(str, value)) if isinstance(value, (list, tuple)) else value}")

    def wall(self, threshold: float = 4500) -> bool:
        """Return whether the echo of the Fluke's infrared ahead is stronger than a threshold."""
        return bool(self.getObstacle("center") > threshold)

    def get(self, sensor: str = "all", *position: Any) -> Any:
        """Return a reading by its name: `get("light", "left")` is `getLight("left")`.

        Args:
            sensor: "light", "ir", "line", "stall", "obstacle", "bright", "blob", "battery", "distance", "all", "name",
                "password", "data", "info", "forwardness", "volume", "startsong", "version", "config" or "picture".
            position: Position, as for the function that reads this sensor.
        """
        return choice("get: the sensor", sensor, self._getters())(*position)

    def _getters(self) -> dict[str | int, Any]:
        raise NotImplementedError

    def _config(self) -> dict[str, int]:
        own = {"ir": 2, "line": 2, "stall": 1, "light": 3}
        fluke = {"battery": 1, "obstacle": 3, "bright": 3}
        return own if self.driver.info.fluke == "none" else own | fluke

    def _driven(self, name: str) -> Any:
        return getattr(self.driver, name)()

    def _picked(
        self, name: str, values: list[int], places: dict[Any, int], position: tuple[str | int, ...]
    ) -> Any:
        """Return all values, the one at a position, or those at several."""
        if not position or position in ((None,), ("all",)):
            return values
        picked = [values[choice(f"{name}: the position", where, places)] for where in position]
        return picked[0] if len(picked) == 1 else picked

    def _one_or_all(self, name: str, what: str, position: str | int | None) -> Any:
        place = None if position is None else choice(f"{name}: the position", position, PLACES)
        values = [int(value) for value in self._driven(what)]
        return values if place is None else values[place]

    def _said(self) -> dict[str, str]:
        """Return the info line by its keys, and our version."""
        info = self.driver.info
        said = {"fluke": info.fluke_version} if info.fluke != "none" else {}
        if info.model is not None:
            said |= {
                "robot-version": info.robot_version,
                "robot": "Scribbler2" if info.model == "s2" else "Scribbler",
                "mode": "Serial",
            }
        return said | {"myro": __version__}

    def getVersion(self) -> str:
        """Return the version of the robot's firmware."""
        return str(self.driver.info.robot_version)

    def getInfo(self, *item: str) -> Any:
        """Return the robot's identity by name: "robot", "robot-version", "fluke", "mode"; and "myro", ours.

        Args:
            item: Names of what is wanted; one gives its value, several a list, none all in a dictionary.

        Raises:
            MyroError: The robot says nothing of that.
        """
        info = self._said()
        for name in item:
            if name.lower() not in info:
                raise MyroError(f"getInfo: this robot says nothing of {name!r}, only of {', '.join(info)}.")
        values = [info[name.lower()] for name in item]
        return info if not item else values[0] if len(values) == 1 else values
