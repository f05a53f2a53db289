"""Functions of a Fluke other than sensors and camera: infrared messages, servos, error log, reset of the robot."""

from __future__ import annotations

from realitygap.errors import RobotError, whole_number

from . import _codec as codec
from ._codec import fluke_request
from ._device import Device
from .opcodes import COUNTED, Op

RESET_S = 3.0
"""Time that a robot needs to restart [s]. Source: the wait in Scribbler2-Python."""
FIRST_MESSAGES = (2, 8, 1)
"""First firmware of a Fluke that sends messages. Source: the check in Myro."""
_EMITTERS = {"right": 1, "center": 2, "left": 4}


class Board(Device):
    """The functions of a Fluke that no trial needs."""

    def _need_messages(self, what: str) -> None:
        self._need(what, self.info.has_fluke(*FIRST_MESSAGES), "a Fluke with firmware 2.8.1 or newer")

    def send_ir_message(self, message: bytes) -> None:
        """Send up to 255 bytes by infrared."""
        self._need_messages("send_ir_message")
        if len(message) > 255:
            raise ValueError(f"message has {len(message)} bytes, expected at most 255.")
        arguments = bytes((len(message),)) + message
        self._tell_fluke("send_ir_message", Op.SEND_IR_MESSAGE, arguments, repeatable=False)

    def get_ir_message(self) -> bytes:
        """Return the bytes that arrived by infrared since the last call. A lost answer is not requested again."""
        self._need_messages("get_ir_message")
        request = fluke_request("get_ir_message", Op.GET_IR_MESSAGE, answer=COUNTED, repeatable=False)
        return self._get(request, bytes)

    def set_ir_emitters(self, *, left: bool = True, center: bool = True, right: bool = True) -> None:
        """Choose which emitters send messages."""
        chosen = {"left": left, "center": center, "right": right}
        mask = sum(_EMITTERS[side] for side, wanted in chosen.items() if wanted)
        self._tell_fluke("set_ir_emitters", Op.SET_IR_EMITTERS, bytes((mask,)))

    def servo(self, number: int, position: int) -> None:
        """Turn servo 0 to 3 of a Fluke 2 to a position, 0 to 255."""
        self.need_fluke_2("servo")
        arguments = bytes((whole_number("number", number, 0, 3), whole_number("position", position, 0, 255)))
        self._tell_fluke("servo", Op.SET_SERVO, arguments)

    def error_log(self) -> str:
        """Return the error log of a Fluke 2."""
        self.need_fluke_2("error_log")
        request = fluke_request("error_log", Op.GET_ERRORS, answer=COUNTED, repeatable=False)
        return self._get(request, bytes).decode("utf-8", "replace")

    def enable_pan(self) -> None:
        """Have a Fluke 2 offer a network over Bluetooth."""
        self.need_fluke_2("enable_pan")
        self._tell_fluke("enable_pan", Op.ENABLE_PAN, b"\x01\x23")

    def reset_robot(self) -> None:
        """Restart the firmware of the robot and wait until it answers again; the motors are off then.

        A Fluke pulls the robot's reset line; without one the robot is asked to.

        Raises:
            RobotError: The robot does not answer again.
        """
        self.need_robot("reset_robot")
        if self.info.fluke == "none":
            self.link.forget(codec.Request("reset_robot", codec.packet(Op.SOFT_RESET), 0, False), RESET_S)
        else:
            request = fluke_request("reset_robot", Op.RESET_SCRIBBLER, answer=0)
            self.link.forget(request, RESET_S)
        found = self.link.greet()
        if found.model != self.info.model:
            raise RobotError(f"After the reset {found.model} answers on {self.info.port}, not {self.info}.")
