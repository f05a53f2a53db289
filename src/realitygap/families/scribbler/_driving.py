"""Functions that turn the wheels; of an S2 or S3 also motions to a position, and wheel encoders."""

from __future__ import annotations

import struct
from typing import Literal

from realitygap.errors import whole_number

from . import _codec as codec
from ._codec import MotorStats, Request, SensorBlock, robot_request
from ._device import Device, limited
from .opcodes import Op

Length = Literal["mm", "half-mm"]
Angle = Literal["deg", "units"]

TO, BY, IN_UNITS = 2, 4, 1
"""Bits of a motion's type: absolute, relative, and in millimeters or degrees."""
MOTION_WAIT_S = 30.0
"""Maximum time that a motion waits for the motion before it [s]."""


def _motion(name: str, op: Op, arguments: bytes) -> Request:
    return robot_request(name, op, arguments, repeatable=False, wait_s=MOTION_WAIT_S, may_stay_out=True)


def _shorts(**values: float) -> bytes:
    """Return signed words, high byte first."""
    numbers = [whole_number(name, value, -32768, 32767) for name, value in values.items()]
    return struct.pack(f">{len(numbers)}h", *numbers)


def _longs(**values: float) -> bytes:
    numbers = [whole_number(name, value, -(1 << 31), (1 << 31) - 1) for name, value in values.items()]
    return struct.pack(f">{len(numbers)}i", *numbers)


def _type(how: int, unit: str, in_units: str, other: str) -> bytes:
    if unit not in (in_units, other):
        raise ValueError(f"unit is {unit!r}, expected {in_units!r} or {other!r}.")
    return bytes((how + (IN_UNITS if unit == in_units else 0),))


class Driving(Device):
    """Wheel commands, which the robot keeps until the next one, and motions of an S2.

    Position and heading are 0 when the robot is switched on: x ahead, heading counter-clockwise. `motors` does not
    change them. A motion returns when the robot has accepted it, not when it has arrived; `motor_stats` reports whether
    it moves. If the answer to a motion is lost, that is an error, and the motion is not repeated. A repeated motion to
    a position would have no effect, because an S2 sets its reckoned position as soon as it gets the command. A fault of
    the link before `motor_stats` has reported the end of a motion is also an error, because resynchronization stops the
    motion.
    """

    def motors(self, left: float, right: float) -> SensorBlock:
        """Turn the wheels, each -1 (full back) to 1 (full ahead), until the next command.

        Returns:
            The sensors from the answer to the command.

        Raises:
            ValueError: A wheel is out of range. Nothing was sent.
        """
        limited("left", left, -1.0, 1.0)
        limited("right", right, -1.0, 1.0)
        self.need_robot("motors")
        return self._set(codec.motors(left, right))

    def _stop_motors(self) -> None:
        if self.info.model is not None and self.link.is_open:
            self._set(codec.STOP)

    @property
    def position(self) -> tuple[int, int]:
        """Return the reckoned position of the robot: x and y [mm]."""
        self.need_s2("position")
        return self._get(robot_request("position", Op.GET_POSITION), codec.signed_longs)

    def set_position(self, x: int, y: int) -> None:
        """Set the reckoned position [mm]."""
        self.need_s2("set_position")
        self._set(robot_request("set_position", Op.SET_POSITION, _longs(x=x, y=y)))

    @property
    def angle(self) -> int:
        """Return the reckoned heading [degrees, counter-clockwise]."""
        self.need_s2("angle")
        return self._get(robot_request("angle", Op.GET_ANGLE), codec.signed_long)

    def set_angle(self, degrees: int) -> None:
        """Set the reckoned heading [degrees]."""
        self.need_s2("set_angle")
        self._set(robot_request("set_angle", Op.SET_ANGLE, _longs(degrees=degrees)))

    def begin_path(self, speed: int = 7) -> None:
        """Begin a path: its motions follow each other without a stop. Speed is 1 to 15, each 12.5 mm/s."""
        self._path("begin_path", 1, speed)

    def end_path(self) -> None:
        """End a path. Only now its last motion begins."""
        self._path("end_path", 0, 0)

    def _path(self, name: str, which: int, speed: int) -> None:
        self.need_s2(name)
        arguments = bytes((which,)) + struct.pack(">H", whole_number("speed", speed, 0, 15))
        self._set_late(_motion(name, Op.PATH, arguments))

    def move_to(self, x: int, y: int, unit: Length = "mm") -> None:
        """Turn to a position and drive there; x and y in mm or half millimeters."""
        self._move("move_to", TO, x, y, unit)

    def move_by(self, x: int, y: int, unit: Length = "mm") -> None:
        """Turn and drive by a distance relative to the robot's present position and heading."""
        self._move("move_by", BY, x, y, unit)

    def _move(self, name: str, how: int, x: int, y: int, unit: Length) -> None:
        self.need_s2(name)
        arguments = _type(how, unit, "mm", "half-mm") + _shorts(x=x, y=y)
        self._set_late(_motion(name, Op.MOVE, arguments))

    def turn_to(self, angle: int, unit: Angle = "deg") -> None:
        """Turn on the spot to a heading, in the shorter direction; in degrees or units of 1/955 turn."""
        self._turn("turn_to", TO, angle, unit)

    def turn_by(self, angle: int, unit: Angle = "deg") -> None:
        """Turn on the spot by an angle, counter-clockwise positive, in the shorter direction."""
        self._turn("turn_by", BY, angle, unit)

    def _turn(self, name: str, how: int, angle: int, unit: Angle) -> None:
        self.need_s2(name)
        arguments = _type(how, unit, "deg", "units") + _shorts(angle=angle)
        self._set_late(_motion(name, Op.TURN, arguments))

    def arc_to(self, x: int, y: int, radius: int, unit: Length = "mm") -> None:
        """Drive to a position on an arc. A positive radius is counter-clockwise."""
        self._arc("arc_to", TO, x, y, radius, unit)

    def arc_by(self, x: int, y: int, radius: int, unit: Length = "mm") -> None:
        """Drive on an arc to a position relative to the robot's present position and heading."""
        self._arc("arc_by", BY, x, y, radius, unit)

    def _arc(self, name: str, how: int, x: int, y: int, radius: int, unit: Length) -> None:
        self.need_s2(name)
        arguments = _type(how, unit, "mm", "half-mm") + _shorts(x=x, y=y, radius=radius)
        self._set_late(_motion(name, Op.ARC, arguments))

    def encoders(self, *, zero: bool = False) -> tuple[int, int]:
        """Return the counts of the left and right wheel, each about 0.25 mm.

        Args:
            zero: Whether to reset the counts after reading. A lost answer is then an error, and the command is not
                repeated.
        """
        self.need_s2("encoders")
        arguments = bytes((0 if zero else 1,))
        request = robot_request("encoders", Op.GET_ENCODERS, arguments, repeatable=not zero)
        return self._get(request, codec.signed_longs)

    def motor_stats(self) -> MotorStats:
        """Return the present state of the motors."""
        self.need_s2("motor_stats")
        stats = self._get(robot_request("motor_stats", Op.GET_MOTOR_STATS), codec.motor_stats)
        if stats.ready:
            self.link.is_in_motion = False
        return stats
