"""Moving: by speeds, for a time or until the next command; a Scribbler 2 also to places, by its own counting."""

from __future__ import annotations

import math
import numbers

from ._base import Base
from ._mistakes import choice, is_on, number, whole

_TURNS = {"left": 1, "right": -1, "straight": 0, "center": 0}


class Driving(Base):
    """Speeds from -1 to 1; what is beyond is limited. Turning to the left is positive."""

    _translate = 0.0
    _rotate = 0.0

    def forward(self, speed: float = 1, seconds: float | None = None) -> None:
        """Drive straight ahead.

        Args:
            speed: Speed from 0 to 1, full speed; negative drives backward.
            seconds: Duration [s]. The call then returns when the robot has stopped again. Without a duration, it
                returns immediately, and the robot keeps driving until the next command.
        """
        self._go("forward", number("forward: the speed", speed), 0.0, seconds)

    def backward(self, speed: float = 1, seconds: float | None = None) -> None:
        """Drive straight back; arguments as for `forward`."""
        self._go("backward", -number("backward: the speed", speed), 0.0, seconds)

    def turnLeft(self, speed: float = 1, seconds: float | None = None) -> None:
        """Turn to the left on the spot; arguments as for `forward`."""
        self._go("turnLeft", 0.0, number("turnLeft: the speed", speed), seconds)

    def turnRight(self, speed: float = 1, seconds: float | None = None) -> None:
        """Turn to the right on the spot; arguments as for `forward`."""
        self._go("turnRight", 0.0, -number("turnRight: the speed", speed), seconds)

    def turn(self, direction: str | float, amount: float = 0.8, seconds: float | None = None) -> None:
        """Turn on the spot.

        Args:
            direction: "left", "right" or "straight" (which stops); or a speed from -1 (right) to 1 (left).
            amount: The speed for a direction in words.
            seconds: Duration, as for `forward`.
        """
        if isinstance(direction, numbers.Real):
            speed = number("turn: the direction", direction)
        else:
            speed = choice("turn: the direction", direction, _TURNS) * number("turn: the amount", amount)
        self._go("turn", 0.0, speed, seconds)

    def move(self, translate: float, rotate: float, seconds: float | None = None) -> None:
        """Drive and turn at the same time.

        Args:
            translate: Speed ahead, from -1 (back) to 1.
            rotate: Speed of the turn, from -1 (right) to 1 (left).
            seconds: Duration, as for `forward`.
        """
        self._go("move", number("move: translate", translate), number("move: rotate", rotate), seconds)

    def translate(self, amount: float, seconds: float | None = None) -> None:
        """Drive ahead or back, from 1 to -1, and keep turning as before."""
        self._go("translate", number("translate: the amount", amount), self._rotate, seconds)

    def rotate(self, amount: float, seconds: float | None = None) -> None:
        """Turn left or right, from 1 to -1, and keep driving as before."""
        self._go("rotate", self._translate, number("rotate: the amount", amount), seconds)

    def motors(self, left: float, right: float, seconds: float | None = None) -> None:
        """Set the speed of each wheel, from -1 (back) to 1; `seconds` as for `forward`."""
        left, right = number("motors: left", left), number("motors: right", right)
        self._go("motors", (left + right) / 2, (right - left) / 2, seconds)

    def stop(self) -> None:
        """Stop both wheels."""
        self._translate = self._rotate = 0.0
        self.driver.stop()

    hardStop = stop

    def _go(self, name: str, translate: float, rotate: float, seconds: float | None) -> None:
        """Set both speeds; the wheels get their difference and their sum, each limited to -1..1."""
        duration = None if seconds is None else number(f"{name}: the seconds", seconds, 0)
        self._translate, self._rotate = translate, rotate
        self.driver.motors(_limited(translate - rotate), _limited(translate + rotate))
        if duration is not None:
            self.pause(duration)
            self.stop()


def _limited(speed: float) -> float:
    return min(max(speed, -1.0), 1.0)


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

    def getMotorStats(self) -> dict[str, list[int] | list[bool]]:
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
