"""The position of a Scribbler 2 by its own counting, and driving to places."""

from __future__ import annotations

import math
from typing import Any

from ._base import Base
from ._mistakes import choice, is_on, number, whole

_FURTHEST = 32767  # a signed word on the wire
_POLL_S = 0.1  # between two questions whether the robot has arrived [s]
_ANGLES = {"deg": 1.0, "rad": 180 / math.pi}
_HOW = {"to": "to", "by": "by"}


class Paths(Base):
    """Positions in half millimeters, as Myro has them; angles counter-clockwise, 0 along x."""

    def getPosition(self) -> list[int]:
        """Return [x, y], the position by the robot's own count [mm]."""
        return [int(value) for value in self.driver.position]

    def hereIs(self, x: int = 0, y: int = 0) -> None:
        """Set the position in the robot's own count [mm]."""
        self.driver.set_position(_far("hereIs: x", x), _far("hereIs: y", y))

    setHereIs = hereIs

    def getAngle(self) -> int:
        """Return the robot's heading by its own counting [degrees]."""
        return int(self.driver.angle)

    def setAngle(self, angle: int) -> None:
        """Set the heading in the robot's own count [degrees]."""
        self.driver.set_angle(_far("setAngle: the angle", angle))

    def beginPath(self, speed: int = 7) -> None:
        """Begin a path: the motions that follow run into one another until `endPath`; speed 1 to 15."""
        self.driver.begin_path(whole("beginPath: the speed", speed, 1, 15))

    setBeginPath = beginPath

    def endPath(self) -> None:
        """End a path: the robot drives what is left of it."""
        self.driver.end_path()

    setEndPath = endPath

    def moveTo(self, x: int, y: int) -> None:
        """Face a place, drive there and return on arrival [half mm]."""
        self._motion("move_to", _far("moveTo: x", x), _far("moveTo: y", y), "half-mm")

    def moveBy(self, x: int, y: int) -> None:
        """Move like `moveTo`, relative to the robot's position [half mm]."""
        self._motion("move_by", _far("moveBy: x", x), _far("moveBy: y", y), "half-mm")

    def turnTo(self, angle: float, radsOrDegrees: str = "deg") -> None:
        """Turn to a heading in the shorter direction.

        Args:
            angle: Counter-clockwise from x.
            radsOrDegrees: "deg", or "rad".

        Differs: "rad" means radians; Myro sends the number as units of 1/955 of a turn.
        """
        self._motion("turn_to", _degrees("turnTo", angle, radsOrDegrees), "deg")

    def turnBy(self, angle: float, radsOrDegrees: str = "deg") -> None:
        """Turn by an angle, to the left if positive; arguments as for `turnTo`."""
        self._motion("turn_by", _degrees("turnBy", angle, radsOrDegrees), "deg")

    def arcTo(self, x: int, y: int, radius: int) -> None:
        """Drive to a place along an arc and return on arrival [half mm]; a positive radius turns to the left."""
        self._motion(
            "arc_to", _far("arcTo: x", x), _far("arcTo: y", y), _far("arcTo: the radius", radius), "half-mm"
        )

    def arcBy(self, x: int, y: int, radius: int) -> None:
        """Drive like `arcTo`, relative to the robot's position [half mm]."""
        self._motion(
            "arc_by", _far("arcBy: x", x), _far("arcBy: y", y), _far("arcBy: the radius", radius), "half-mm"
        )

    def setMove(self, x: int, y: int, moveType: str = "to") -> None:
        """Move as `moveTo` or `moveBy`, as the type says: "to" or "by"."""
        (self.moveTo if choice("setMove: the type", moveType, _HOW) == "to" else self.moveBy)(x, y)

    def setTurn(self, angle: float, turnType: str = "to", radOrDeg: str = "rad") -> None:
        """Turn as `turnTo` or `turnBy`, as the type says: "to" or "by"."""
        (self.turnTo if choice("setTurn: the type", turnType, _HOW) == "to" else self.turnBy)(angle, radOrDeg)

    def setArc(self, x: int, y: int, radius: int, arcType: str = "to") -> None:
        """Drive an arc as `arcTo` or `arcBy`, as the type says: "to" or "by"."""
        (self.arcTo if choice("setArc: the type", arcType, _HOW) == "to" else self.arcBy)(x, y, radius)

    def getEncoders(self, zeroEncoders: bool = False) -> list[int]:
        """Return the wheels' counts [left, right], about 0.25 mm each, backwards negative; perhaps restart at 0."""
        return [int(value) for value in self.driver.encoders(zero=is_on("getEncoders", zeroEncoders))]

    def getMotorStats(self) -> dict[str, list[Any]]:
        """Return the state of the wheels and motors.

        Returns:
            "wheel": [left, right] counts in 1/10 s; "IdlerTimer": [1/10 s since the caster moved];
            "IdlerSpeed": [of the caster]; "Mov": [whether a motor turns];
            "Ready": [whether the robot is ready for a new motion].
        """
        stats = self.driver.motor_stats()
        return {
            "wheel": [stats.left, stats.right],
            "IdlerTimer": [round(stats.idler_age_s * 10)],
            "IdlerSpeed": [stats.idler_speed],
            "Mov": [bool(stats.moving)],
            "Ready": [bool(stats.ready)],
        }

    def _motion(self, name: str, *where: int | str) -> None:
        getattr(self.driver, name)(*where)
        while not self.getMotorStats()["Ready"][0]:
            self.pause(_POLL_S)


def _far(name: str, value: object) -> int:
    return int(number(name, value, -_FURTHEST, _FURTHEST))


def _degrees(name: str, angle: object, unit: object) -> int:
    per_unit = choice(f"{name}: the unit", unit, _ANGLES)
    most = _FURTHEST / per_unit
    return round(number(f"{name}: the angle", angle, -most, most) * per_unit)
