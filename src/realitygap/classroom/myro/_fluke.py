"""The Fluke's infrared, messages between robots, and what only a Fluke 2 has."""

from __future__ import annotations

from realitygap._foreign_text import printable

from ._base import Base
from ._mistakes import MyroError, is_on, whole

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
