"""Sensors of the robot and its Fluke, without the camera."""

from __future__ import annotations

import math
import struct

from . import _codec as codec
from ._codec import SensorBlock, fluke_request, robot_request
from ._device import Device, limited
from .opcodes import Op

_ALL = robot_request("sensors", Op.GET_ALL)
_IR = robot_request("ir", Op.GET_IR_ALL)
_LIGHT = robot_request("light", Op.GET_LIGHT_ALL)
_LINE = robot_request("line", Op.GET_LINE_ALL)
_STALL = robot_request("stall", Op.GET_STALL)
_OBSTACLES = tuple(
    fluke_request(f"obstacle {side}", op)
    for side, op in (
        ("left", Op.GET_DONGLE_IR_LEFT),
        ("center", Op.GET_DONGLE_IR_CENTER),
        ("right", Op.GET_DONGLE_IR_RIGHT),
    )
)
_DISTANCES = tuple(
    robot_request(f"distance {side}", Op.GET_DISTANCE, bytes((number,)))
    for number, side in enumerate(("left", "right"))
)


class Senses(Device):
    """Functions that read sensors. They neither move nor change the robot."""

    def sensors(self) -> SensorBlock:
        """Return all sensors of the robot without its Fluke, from one command."""
        self.need_robot("sensors")
        self.last_sensors = self._get(_ALL, codec.sensor_block)
        return self.last_sensors

    def ir(self) -> tuple[int, int]:
        """Return infrared left, right (1: free, 0: an obstacle within some 15 to 25 cm)."""
        self.need_robot("ir")
        return self._get(_IR, codec.two_flags)

    def light(self) -> tuple[int, int, int]:
        """Return light left, center, right (0: bright, to 65535: dark; an S1 from about 5000 on)."""
        self.need_robot("light")
        return self._get(_LIGHT, codec.light_words)

    def line(self) -> tuple[int, int]:
        """Return line left, right (1: dark floor, 0: light)."""
        self.need_robot("line")
        return self._get(_LINE, codec.two_flags)

    def stall(self) -> bool:
        """Return whether the robot reports a stall."""
        self.need_robot("stall")
        return self._get(_STALL, codec.flag) == 1

    def obstacle(self) -> tuple[int, int, int]:
        """Return obstacle left, center, right by the Fluke (0: free, 6400: near; a Fluke 2 has one sensor for all)."""
        self.need_fluke("obstacle")
        left, center, right = (self._get(request, codec.obstacle) for request in _OBSTACLES)
        return left, center, right

    def battery(self) -> float:
        """Return the battery voltage [V]: about 9 when full, low below 6.15."""
        self.need_fluke("battery")
        return self._get(codec.BATTERY, codec.volts)

    def volts(self) -> float:
        """Return the battery voltage by its Fluke [V], nan without a Fluke."""
        return math.nan if self.info.fluke == "none" else self.battery()

    def distance(self) -> tuple[int, int]:
        """Return distance left, right by an S2 (0: touching, to 99: nothing in range)."""
        self.need_s2("distance")
        left, right = (self._get(request, codec.distance) for request in _DISTANCES)
        return left, right

    def mic_envelope(self) -> int:
        """Return the loudness by an S2's microphone (0 upwards, no unit)."""
        self.need_s2("mic_envelope")
        return self._get(robot_request("mic_envelope", Op.GET_MIC_ENVELOPE), codec.signed_long)

    def ir_ex(self, side: str, threshold: int = 0) -> int:
        """Return the infrared of one side of an S2 (1: free) with a custom threshold.

        Args:
            side: "left" or "right".
            threshold: 1 to 100; a higher one has a shorter range. 0: the default of the robot.
        """
        return self._get_ex("ir_ex", Op.GET_IR_EX, side, threshold, 100)

    def line_ex(self, side: str, threshold: int = 0) -> int:
        """Return the line of one side of an S2 (1: dark) with a custom threshold.

        Args:
            side: "left" or "right".
            threshold: 1 to 255. 0: the default of the robot.
        """
        return self._get_ex("line_ex", Op.GET_LINE_EX, side, threshold, 255)

    def _get_ex(self, name: str, op: Op, side: str, threshold: int, most: int) -> int:
        self.need_s2(name)
        if side not in ("left", "right"):
            raise ValueError(f"side is {side!r}, expected 'left' or 'right'.")
        limited("threshold", threshold, 0, most)
        arguments = struct.pack("BBB", side == "right", 0, int(threshold))
        return self._get(robot_request(name, op, arguments), codec.flag)

    def _flags(self) -> tuple[tuple[int, int], tuple[int, int], bool]:
        """Return IR, line, and stall of the robot from one byte, which is the fastest reading."""
        return self._get(robot_request("flags", Op.GET_ALL_BINARY), codec.binary_block)
