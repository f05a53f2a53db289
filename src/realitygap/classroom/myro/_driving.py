"""Moving: straight ahead, turning, both together, for a time or until the next command."""

from __future__ import annotations

import numbers

from ._base import Base
from ._mistakes import choice, number

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
