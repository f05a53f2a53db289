"""The Fluke: its camera, infrared messages, servos, error log, and the reset of the robot."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

from realitygap.errors import ProtocolError, RobotError, did_you_mean, whole_number

from . import _codec as codec
from . import _images as images
from ._codec import Blob, Request, fluke_request
from ._device import Device
from .opcodes import COUNTED, Op

Kind = Literal["jpeg", "jpeg-fast", "gray", "grayjpeg", "grayjpeg-fast", "grayraw", "color", "blob"]
KINDS = ("jpeg", "jpeg-fast", "gray", "grayjpeg", "grayjpeg-fast", "grayraw", "color", "blob")

PICTURE_WAIT_S = 6.0
"""Maximum time until the first byte of a picture [s]."""
SETTLE_S = 0.15
"""Time that a register of the camera needs to settle [s]. Source: Myro's scribbler.py."""
FIRST_JPEG = (2, 7, 8)
"""First firmware of a Fluke that compresses pictures."""
RAW_WINDOW = 3
"""Window for raw gray pictures. The other three windows are those of `bright`."""
DEFAULT_BLOB = (90, 4, 0, 255, 51, 136, 190, 255)
"""Delay, smoothing, and limits of Y, U, V. Source: the values that Myro sets when it connects."""


class Camera(Device):
    """Pictures, brightness, and blobs. The camera is set up at its first use, as Myro does when it connects."""

    _is_prepared = False
    _is_small = False
    # of JPEG files, gray or not, which a Fluke gives once for all pictures of a size
    _headers: Mapping[bool, bytes] = MappingProxyType({})

    # setting up

    def _prepare(self, what: str) -> None:
        """Set up automatic colors and exposure, the windows of `bright`, and the color of blobs at the first use."""
        self.need_fluke(what)
        if self._is_prepared:
            return
        if self.info.fluke == "2":
            self.set_picture_size("small" if self._is_small else "large")
        self._set_register(0x12, 0x14)
        self._set_register(0x13, 0xA3)
        self._is_prepared = True
        self._set_bright_windows()
        self.configure_blob(*DEFAULT_BLOB)

    def _set_register(self, register: int, value: int) -> None:
        arguments = bytes((register, value))
        self._tell_fluke("camera register", Op.SET_CAMERA_PARAMETER, arguments, pause_s=SETTLE_S)

    def _set_bright_windows(self) -> None:
        if self.info.fluke == "2":
            lefts, width, bottom = (3, 321, 641), 637, 799
        else:
            lefts, width, bottom = (3, 65, 129), 125, 191
        for number, left in enumerate(lefts):
            self.set_window(number, left, 0, left + width, bottom, 2, 1)

    @property
    def picture_size(self) -> images.Size:
        """Return width and height of a picture with the present setting."""
        if self.info.fluke != "2":
            return images.FLUKE_1
        return images.FLUKE_2_SMALL if self._is_small else images.FLUKE_2_LARGE

    def set_picture_size(self, size: Literal["small", "large"]) -> None:
        """Choose 427 x 266 or 1280 x 800 pixels; a Fluke 2 only."""
        self.need_fluke_2("set_picture_size")
        if size not in ("small", "large"):
            raise ValueError(f"size is {size!r}, expected 'small' or 'large'.")
        self._tell_fluke("set_picture_size", Op.SET_PICTURE_SIZE, bytes((71 if size == "small" else 213,)))
        self._is_small = size == "small"
        self._headers = {}

    def set_window(
        self, number: int, x_low: int, y_low: int, x_high: int, y_high: int, x_step: int, y_step: int
    ) -> None:
        """Define window 0 to 3: columns and rows from low to high, both included, in steps of `x_step` and `y_step`.

        Odd columns are brightness, so an odd `x_low` with an even `x_step` selects brightness only.
        """
        window = whole_number("number", number, 0, 3)
        is_2 = self.info.fluke == "2"
        most = 65535 if is_2 else 255
        corners = [
            whole_number(name, value, 0, most)
            for name, value in (("x_low", x_low), ("y_low", y_low), ("x_high", x_high), ("y_high", y_high))
        ]
        steps = [
            whole_number(name, value, 1, 255) for name, value in (("x_step", x_step), ("y_step", y_step))
        ]
        arguments = struct.pack(">B4H2B" if is_2 else ">B4B2B", window, *corners, *steps)
        self._tell_fluke("set_window", Op.SET_WINDOW, arguments)

    def set_white_balance(self, on: bool) -> None:
        """Switch automatic white balance on or off."""
        self._tell_fluke("set_white_balance", Op.WHITE_BALANCE_ON if on else Op.WHITE_BALANCE_OFF)

    def darken_camera(self, level: int = 0) -> None:
        """Switch automatic exposure off and make pictures darker, 0 (darkest) to 255."""
        self._prepare("darken_camera")
        level = whole_number("level", level, 0, 255)
        if self.info.fluke == "2":
            self._set_register(0, min(level + 128, 255))
            return
        for register, value in ((0x12, 0x10), (0x13, 0xA0), (0x06, level), (0x01, 0x80), (0x02, 0x80)):
            self._set_register(register, value)
        for register in (0x00, 0x10):
            self._set_register(register, level)

    def auto_camera(self) -> None:
        """Switch automatic exposure, gain, and colors on, as after a restart."""
        self._prepare("auto_camera")
        if self.info.fluke == "2":
            self._set_register(0x0D, 0x01)
            self._set_register(0, 128)
            return
        for register, value in ((0x12, 0x14), (0x13, 0xA3), (0x06, 0x80)):
            self._set_register(register, value)

    def manual_camera(self, gain: int = 0x00, brightness: int = 0x80, exposure: int = 0x41) -> None:
        """Set gain, brightness, and exposure, each 0 to 255. A Fluke 2 has the exposure only."""
        self._prepare("manual_camera")
        chosen = (("gain", gain), ("brightness", brightness), ("exposure", exposure))
        values = [whole_number(name, value, 0, 255) for name, value in chosen]
        if self.info.fluke == "2":
            self._set_register(0x0D, values[2])
            return
        for register, value in ((0x12, 0x10), (0x13, 0xA0)):
            self._set_register(register, value)
        for register, value in zip((0x00, 0x06, 0x10), values, strict=True):
            self._set_register(register, value)

    # seeing

    def picture(self, kind: Kind = "jpeg") -> images.Pixels:
        """Return a picture, (h, w, 3) uint8 red, green, blue, or (h, w) uint8 in gray; rows from the top.

        Args:
            kind: "jpeg" or "jpeg-fast" in color, "grayjpeg" (also "gray") or "grayjpeg-fast" in gray; "color" and
                "grayraw" without compression, which takes many seconds; "blob": 255 for pixels with the color of
                `configure_blob`. A Fluke older than 2.7.8 has no compression.
        """
        if kind not in KINDS:
            raise ValueError(f"Unknown kind of picture {kind!r}. {did_you_mean(str(kind), KINDS)}")
        self._prepare("picture")
        if "jpeg" in kind or kind == "gray":
            if self.info.has_fluke(*FIRST_JPEG):
                return self._jpeg_picture(gray=kind.startswith("gray"), fast=kind.endswith("-fast"))
            kind = "grayraw" if kind.startswith("gray") else "color"
        if kind == "color":
            return self._raw_picture()
        if kind == "grayraw":
            return self._raw_gray_picture()
        return self._blob_picture()

    def _jpeg_picture(self, *, gray: bool, fast: bool) -> images.Pixels:
        header_op = Op.GET_JPEG_GRAY_HEADER if gray else Op.GET_JPEG_COLOR_HEADER
        scan_op = Op.GET_JPEG_GRAY_SCAN if gray else Op.GET_JPEG_COLOR_SCAN
        if gray not in self._headers:
            header = self._get(_camera_request("picture header", header_op), bytes)
            self._headers = {**self._headers, gray: header}
        header, size = self._headers[gray], self.picture_size
        request = _camera_request("picture", scan_op, bytes((0 if fast else 1,)))
        try:
            return self._get(request, lambda scan: images.jpeg_pixels(header, scan, size, gray=gray))
        except ProtocolError:
            self._headers = {}  # it may be the header that was damaged
            raise

    def _raw_picture(self) -> images.Pixels:
        size = self.picture_size
        request = _camera_request("picture", Op.GET_IMAGE, answer=size.width * size.height)
        return self._get(request, lambda data: images.raw_pixels(data, size))

    def _raw_gray_picture(self) -> images.Pixels:
        whole = self.picture_size
        size = images.Size(whole.width // 2 * 2, whole.height // 2 * 2)
        self.set_window(RAW_WINDOW, 1, 0, size.width - 1, size.height - 1, 2, 2)
        n_bytes = size.width * size.height // 4
        request = _camera_request("picture", Op.GET_WINDOW, bytes((RAW_WINDOW,)), answer=n_bytes)
        return self._get(request, lambda data: images.gray_window_pixels(data, size))

    def _blob_picture(self) -> images.Pixels:
        size, word = self.picture_size, 3 if self.info.fluke == "2" else 2
        request = _camera_request("picture", Op.GET_RLE, answer=COUNTED)
        return self._get(request, lambda data: images.run_pixels(data, size, word))

    def bright(self) -> tuple[int, int, int]:
        """Return the brightness to the left, center, and right: sums of the pixels in the camera's three windows."""
        self._prepare("bright")
        left, center, right = (
            self._get(
                fluke_request("bright", Op.GET_WINDOW_LIGHT, bytes((number,)), wait_s=PICTURE_WAIT_S),
                codec.word,
            )
            for number in range(3)
        )
        return left, center, right

    def blob(self) -> Blob:
        """Return the number of pixels that have the color of `configure_blob`, and their center."""
        self._prepare("blob")
        return self._get(_camera_request("blob", Op.GET_BLOB), codec.blob)

    def configure_blob(
        self,
        delay: int = 90,
        smooth: int = 4,
        y_low: int = 0,
        y_high: int = 255,
        u_low: int = 51,
        u_high: int = 136,
        v_low: int = 190,
        v_high: int = 255,
    ) -> None:
        """Set the color range of a blob: limits of brightness Y and colors U and V, each 0 to 255."""
        self._prepare("configure_blob")
        values = (delay, smooth, y_low, y_high, u_low, u_high, v_low, v_high)
        arguments = bytes(whole_number("A value", value, 0, 255) for value in values)
        self._tell_fluke("configure_blob", Op.SET_RLE, arguments)


def _camera_request(name: str, op: Op, arguments: bytes = b"", *, answer: int | None = None) -> Request:
    return fluke_request(name, op, arguments, answer=answer, wait_s=PICTURE_WAIT_S)


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
