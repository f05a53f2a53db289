"""The Fluke: its infrared, messages between robots, its camera, and what only a Fluke 2 has."""

from __future__ import annotations

from typing import Any

import numpy as np

from realitygap._foreign_text import printable

from ._base import Base
from ._colors import rgb2yuv
from ._mistakes import MyroError, choice, is_on, whole
from ._pictures import Picture

_RIGHT, _CENTER, _LEFT = 1, 2, 4  # bits of the emitters
_LONGEST = 255  # bytes of a message


class Fluke(Base):
    """Infrared power, infrared messages, servos."""

    _emitters = _RIGHT | _CENTER | _LEFT

    def setIRPower(self, value: int) -> None:
        """Set how strongly the Fluke's infrared shines, 0 to 255; 135 is usual.

        Obstacles that are always seen want less, those never seen more.
        """
        self.driver.set_ir_power(whole("setIRPower: the value", value, 0, 255))

    def sendIRMessage(self, msg: str) -> None:
        """Send a text of up to 255 characters by infrared to robots nearby."""
        if not isinstance(msg, str) or not msg.isascii() or len(msg) > _LONGEST:
            raise MyroError(
                f"sendIRMessage: the message is {msg!r}, expected text of up to {_LONGEST} characters, no accents."
            )
        self.driver.send_ir_message(msg.encode("ascii"))

    def getIRMessage(self) -> str:
        """Return the text received by infrared since the last call; empty if there was none."""
        return bytes(self.driver.get_ir_message()).decode("latin-1")

    def setCommunicateLeft(self, on: bool = True) -> None:
        """Send messages to the left, or not."""
        self._communicate(_LEFT, on)

    def setCommunicateCenter(self, on: bool = True) -> None:
        """Send messages ahead, or not."""
        self._communicate(_CENTER, on)

    def setCommunicateRight(self, on: bool = True) -> None:
        """Send messages to the right, or not. Differs: Myro's function of this name sets the left one."""
        self._communicate(_RIGHT, on)

    def setCommunicateAll(self, on: bool = True) -> None:
        """Send messages to all sides, or to none."""
        self._communicate(_LEFT | _CENTER | _RIGHT, on)

    def _communicate(self, emitters: int, on: object) -> None:
        lit = is_on("setCommunicate", on)
        self._emitters = self._emitters | emitters if lit else self._emitters & ~emitters
        self.driver.set_ir_emitters(
            left=bool(self._emitters & _LEFT),
            center=bool(self._emitters & _CENTER),
            right=bool(self._emitters & _RIGHT),
        )

    def servo(self, id: int, position: int) -> None:
        """Turn a servo of a Fluke 2: number 0 to 3, position 0 to 255."""
        self.driver.servo(
            whole("servo: the number", id, 0, 3), whole("servo: the position", position, 0, 255)
        )

    def getFlukeLog(self) -> None:
        """Print the error log of a Fluke 2."""
        print(printable(self.driver.error_log()))

    def enablePanNetworking(self) -> None:
        """Let a Fluke 2 offer a network over Bluetooth."""
        self.driver.enable_pan()


_KINDS: dict[str, Any] = {
    "color": "color",
    "jpeg": "jpeg", "jpeg-fast": "jpeg-fast",
    "gray": "gray", "grey": "gray", "grayjpeg": "grayjpeg", "greyjpeg": "grayjpeg",
    "grayjpeg-fast": "grayjpeg-fast", "greyjpeg-fast": "grayjpeg-fast",
    "grayraw": "grayraw", "greyraw": "grayraw",
    "blob": "blob",
}  # fmt: skip
_BYTE = 255


class Camera(Base):
    """256 x 192 pixels on a Fluke 1; 1280 x 800 or 427 x 266 on a Fluke 2."""

    def takePicture(self, mode: str | None = None) -> Picture:
        """Take a picture.

        Args:
            mode: "jpeg" (the default), "jpeg-fast" (coarser), "color" (slow), "gray", "grayjpeg-fast", "grayraw", or
                "blob": white for pixels of the color of `configureBlob`.
        """
        kind = choice("takePicture: the mode", mode or "jpeg", _KINDS)
        picture = Picture.from_array(self.driver.picture(kind))
        if (picture.width, picture.height) != self.driver.picture_size:
            picture.resize(*self.driver.picture_size)  # a raw gray one has half the pixels of an even width
        return picture

    def setPicSize(self, value: str) -> None:
        """Set the size of a Fluke 2's pictures: "small" (427 x 266) or "large" (1280 x 800)."""
        self.driver.set_picture_size(
            choice("setPicSize: the size", value, {"small": "small", "large": "large"})
        )

    def configureBlob(
        self,
        y_low: int = 0,
        y_high: int = 255,
        u_low: int = 0,
        u_high: int = 255,
        v_low: int = 0,
        v_high: int = 255,
        smooth_thresh: int = 4,
    ) -> None:
        """Set the color that `getBlob` and `takePicture("blob")` look for, by limits in Y, U and V of 0 to 255.

        Args:
            y_low, y_high, u_low, u_high, v_low, v_high: Limits; `rgb2yuv` tells a color's values.
            smooth_thresh: Number of pixels of another color that end a run.
        """
        limits = {
            name: whole(f"configureBlob: {name}", value, 0, _BYTE)
            for name, value in (
                ("y_low", y_low), ("y_high", y_high), ("u_low", u_low),
                ("u_high", u_high), ("v_low", v_low), ("v_high", v_high),
            )
        }  # fmt: skip
        self.driver.configure_blob(
            **limits, smooth=whole("configureBlob: smooth_thresh", smooth_thresh, 0, _BYTE)
        )

    def set_blob_yuv(self, picture: Picture, x1: int, y1: int, x2: int, y2: int) -> tuple[int, ...]:
        """Set the color to look for to that of a rectangle of a picture: U and V within three standard deviations.

        Returns:
            Lowest and highest Y, U and V, as for `configureBlob`.
        """
        (left, right), (top, bottom) = sorted((x1, x2)), sorted((y1, y2))
        yuv = np.array(
            [
                rgb2yuv(*picture.getRGB(x, y))
                for x in range(left, max(right, left + 1))
                for y in range(top, max(bottom, top + 1))
            ]
        )
        spread = 3 * yuv.std(axis=0)
        low = np.clip(yuv.mean(axis=0) - spread, 0, _BYTE).astype(int)
        high = np.clip(yuv.mean(axis=0) + spread, 0, _BYTE).astype(int)
        limits = (0, 254, int(low[1]), int(high[1]), int(low[2]), int(high[2]))
        self.configureBlob(*limits)
        return limits

    def darkenCamera(self, value: int = 0) -> None:
        """Make the camera's pictures dark and its settings fixed; 0 darkest, up to 255."""
        self.driver.darken_camera(whole("darkenCamera: the value", value, 0, _BYTE))

    def manualCamera(self, gain: int = 0, brightness: int = 128, exposure: int = 65) -> None:
        """Fix the camera's gain, brightness and exposure, each 0 to 255."""
        values = (("gain", gain), ("brightness", brightness), ("exposure", exposure))
        self.driver.manual_camera(
            **{name: whole(f"manualCamera: the {name}", value, 0, _BYTE) for name, value in values}
        )

    def autoCamera(self, value: int = 0) -> None:
        """Let the camera set gain, exposure and white balance by itself again; the value is ignored, as in Myro."""
        self.driver.auto_camera()

    def setWhiteBalance(self, value: str | int) -> None:
        """Switch the camera's automatic white balance on ("on", 1) or off ("off", 0)."""
        self.driver.set_white_balance(is_on("setWhiteBalance: the value", value))
