"""Identity of the robot, and the values that it stores while it is switched off."""

from __future__ import annotations

import struct
from typing import Literal

from realitygap.errors import RobotError, whole_number

from . import _codec as codec
from ._codec import fluke_request, robot_request
from ._device import Device
from .opcodes import Op

Ahead = Literal["fluke", "scribbler"]

_SCRIBBLER_AHEAD = 0xDF
"""First byte in the Fluke's memory if the end with the light sensors is ahead."""
_GET_FORWARDNESS = fluke_request("forwardness", Op.GET_SERIAL_MEMORY, bytes(4))


class Identity(Device):
    """Names, passwords, stored bytes, and the end that is ahead."""

    def _get_halves(self, name: str, first: Op, second: Op) -> str:
        self.need_robot(name)
        halves = [self._get(robot_request(name, op), bytes) for op in (first, second)]
        return codec.text(b"".join(halves))

    def _set_halves(self, name: str, value: str, first: Op, second: Op) -> None:
        self.need_robot(name)
        letters = codec.name_bytes(name.removeprefix("set_"), value)
        self._set(robot_request(name, first, letters[:8]))
        self._set(robot_request(name, second, letters[8:]))

    @property
    def name(self) -> str:
        """The robot's name, at most 16 letters."""
        return self._get_halves("name", Op.GET_NAME1, Op.GET_NAME2)

    def set_name(self, name: str) -> None:
        """Give the robot a name of at most 16 ASCII letters."""
        self._set_halves("set_name", name, Op.SET_NAME1, Op.SET_NAME2)

    @property
    def password(self) -> str:
        """The robot's password, at most 16 letters."""
        return self._get_halves("password", Op.GET_PASS1, Op.GET_PASS2)

    def set_password(self, password: str) -> None:
        """Give the robot a password of at most 16 ASCII letters."""
        self._set_halves("set_password", password, Op.SET_PASS1, Op.SET_PASS2)

    @property
    def data(self) -> tuple[int, ...]:
        """Return (8,) bytes that the robot stores. The first four correct its motors; 127 is no correction."""
        self.need_robot("data")
        return tuple(self._get(robot_request("data", Op.GET_DATA), bytes))

    def set_data(self, values: tuple[int, ...] | list[int]) -> None:
        """Store 8 bytes in the robot, each 0 to 255."""
        self.need_robot("set_data")
        if len(values) != 8:
            raise ValueError(f"values has {len(values)} numbers, expected 8.")
        checked = bytes(whole_number("A value", value, 0, 255) for value in values)
        self._set(robot_request("set_data", Op.SET_DATA, checked))

    def set_single_data(self, position: int, value: int) -> None:
        """Store one byte at position 0 to 7. Beyond, it would overwrite other values of the robot."""
        self.need_robot("set_single_data")
        arguments = bytes((whole_number("position", position, 0, 7), whole_number("value", value, 0, 255)))
        self._set(robot_request("set_single_data", Op.SET_SINGLE_DATA, arguments))

    @property
    def forwardness(self) -> Ahead:
        """Return the end that is ahead for `motors`: the one with the Fluke, or the one with the light sensors."""
        if self.info.fluke == "none":
            return "scribbler"
        kept = self._get(_GET_FORWARDNESS, codec.word)
        return "scribbler" if kept == _SCRIBBLER_AHEAD else "fluke"

    def set_forwardness(self, ahead: Ahead) -> None:
        """Choose the end that is ahead for `motors`. The Fluke stores it, and it is read back.

        Raises:
            RobotError: The Fluke did not store it.
        """
        if ahead not in ("fluke", "scribbler"):
            raise ValueError(f"ahead is {ahead!r}, expected 'fluke' or 'scribbler'.")
        for _ in range(3):
            self._tell_fluke("set_forwardness", Op.SET_FORWARDNESS, bytes((ahead == "fluke",)))
            if self.forwardness == ahead:
                return
        raise RobotError(
            f"The Fluke on {self.info.port} does not keep '{ahead}' ahead: after three requests, it reports "
            f"'{self.forwardness}'. Switch it off and on, then try again."
        )

    def set_ir_power(self, power: int) -> None:
        """Set the power of the Fluke's infrared, 0 to 255 (135 as delivered). Lower values have a shorter range."""
        arguments = struct.pack("B", whole_number("power", power, 0, 255))
        self._tell_fluke("set_ir_power", Op.SET_DONGLE_IR, arguments)
