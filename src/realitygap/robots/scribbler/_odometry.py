"""What only an S2 (or S3) does: going to places, and counting how far its wheels turned."""

from __future__ import annotations

import struct
from typing import Literal

from realitygap.errors import whole_number

from . import _codec as codec
from ._codec import MotorStats, Request, robot_request
from ._device import Device
from .opcodes import Op

Length = Literal["mm", "half-mm"]
Angle = Literal["deg", "units"]

TO, BY, IN_UNITS = 2, 4, 1
"""Parts of the type of a motion: absolute, relative, and in millimeters or degrees."""
MOTION_WAIT_S = 30.0
"""How long a motion may have to wait for the one before it [s]."""


def _motion(name: str, op: Op, arguments: bytes) -> Request:
    return robot_request(name, op, arguments, repeatable=False, wait_s=MOTION_WAIT_S, may_stay_out=True)


def _shorts(**values: float) -> bytes:
    """Signed words, high byte first."""
    numbers = [whole_number(name, value, -32768, 32767) for name, value in values.items()]
    return struct.pack(f">{len(numbers)}h", *numbers)


def _longs(**values: float) -> bytes:
    numbers = [whole_number(name, value, -(1 << 31), (1 << 31) - 1) for name, value in values.items()]
    return struct.pack(f">{len(numbers)}i", *numbers)


def _type(how: int, unit: str, in_units: str, other: str) -> bytes:
    if unit not in (in_units, other):
        raise ValueError(f"unit is {unit!r}, expected {in_units!r} or {other!r}.")
    return bytes((how + (IN_UNITS if unit == in_units else 0),))


class Odometry(Device):
    """Position and heading as an S2 reckons them from its commands, motions to a place, and its encoders.

    Position and heading are 0 as it is switched on: x ahead, heading counter-clockwise. `motors` does not change them.
    A motion returns when the robot has accepted it, not when it has arrived; `motor_stats` says whether it moves. A
    motion whose answer is lost is an error and not repeated, one to a place neither: an S2 takes itself to be there as
    soon as it has been told, and would not move. So is a fault of the link before `motor_stats` says that a motion has
    ended: finding the same step again stops it.
    """

    @property
    def position(self) -> tuple[int, int]:
        """Where the robot is as reckoned: x and y [mm]."""
        self.need_s2("position")
        return self._get(robot_request("position", Op.GET_POSITION), codec.signed_longs)

    def set_position(self, x: int, y: int) -> None:
        """Say where the robot is [mm]."""
        self.need_s2("set_position")
        self._set(robot_request("set_position", Op.SET_POSITION, _longs(x=x, y=y)))

    @property
    def angle(self) -> int:
        """Heading [degrees, counter-clockwise] as reckoned."""
        self.need_s2("angle")
        return self._get(robot_request("angle", Op.GET_ANGLE), codec.signed_long)

    def set_angle(self, degrees: int) -> None:
        """Say where the robot heads [degrees]."""
        self.need_s2("set_angle")
        self._set(robot_request("set_angle", Op.SET_ANGLE, _longs(degrees=degrees)))

    def begin_path(self, speed: int = 7) -> None:
        """Begin a path, whose motions flow into each other; speed 1 to 15, each 12.5 mm/s."""
        self._path("begin_path", 1, speed)

    def end_path(self) -> None:
        """End a path; its last motion begins only now."""
        self._path("end_path", 0, 0)

    def _path(self, name: str, which: int, speed: int) -> None:
        self.need_s2(name)
        arguments = bytes((which,)) + struct.pack(">H", whole_number("speed", speed, 0, 15))
        self._set_late(_motion(name, Op.PATH, arguments))

    def move_to(self, x: int, y: int, unit: Length = "mm") -> None:
        """Turn to a place and drive there; x and y in mm or half millimeters."""
        self._move("move_to", TO, x, y, unit)

    def move_by(self, x: int, y: int, unit: Length = "mm") -> None:
        """The same relative to where the robot is and heads."""
        self._move("move_by", BY, x, y, unit)

    def _move(self, name: str, how: int, x: int, y: int, unit: Length) -> None:
        self.need_s2(name)
        arguments = _type(how, unit, "mm", "half-mm") + _shorts(x=x, y=y)
        self._set_late(_motion(name, Op.MOVE, arguments))

    def turn_to(self, angle: int, unit: Angle = "deg") -> None:
        """Turn on the spot to a heading, the shorter way round; in degrees or units of 1/955 turn."""
        self._turn("turn_to", TO, angle, unit)

    def turn_by(self, angle: int, unit: Angle = "deg") -> None:
        """Turn on the spot by an angle, counter-clockwise positive, the shorter way round."""
        self._turn("turn_by", BY, angle, unit)

    def _turn(self, name: str, how: int, angle: int, unit: Angle) -> None:
        self.need_s2(name)
        arguments = _type(how, unit, "deg", "units") + _shorts(angle=angle)
        self._set_late(_motion(name, Op.TURN, arguments))

    def arc_to(self, x: int, y: int, radius: int, unit: Length = "mm") -> None:
        """Drive to a place on an arc; a positive radius is counter-clockwise."""
        self._arc("arc_to", TO, x, y, radius, unit)

    def arc_by(self, x: int, y: int, radius: int, unit: Length = "mm") -> None:
        """The same relative to where the robot is and heads."""
        self._arc("arc_by", BY, x, y, radius, unit)

    def _arc(self, name: str, how: int, x: int, y: int, radius: int, unit: Length) -> None:
        self.need_s2(name)
        arguments = _type(how, unit, "mm", "half-mm") + _shorts(x=x, y=y, radius=radius)
        self._set_late(_motion(name, Op.ARC, arguments))

    def encoders(self, *, zero: bool = False) -> tuple[int, int]:
        """Counts of the left and right wheel, each about 0.25 mm.

        Args:
            zero: Begin at 0 after this; where the answer to that is lost, it is an error and not repeated.
        """
        self.need_s2("encoders")
        arguments = bytes((0 if zero else 1,))
        request = robot_request("encoders", Op.GET_ENCODERS, arguments, repeatable=not zero)
        return self._get(request, codec.signed_longs)

    def motor_stats(self) -> MotorStats:
        """How the wheels turn right now."""
        self.need_s2("motor_stats")
        stats = self._get(robot_request("motor_stats", Op.GET_MOTOR_STATS), codec.motor_stats)
        if stats.ready:
            self.link.is_in_motion = False
        return stats
