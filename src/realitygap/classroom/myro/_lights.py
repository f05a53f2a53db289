"""The robot's lights."""

from __future__ import annotations

from ._base import Base
from ._mistakes import choice, is_on, number

_LEDS = {
    "left": "left", 0: "left",
    "center": "center", "middle": "center", 1: "center",
    "right": "right", 2: "right",
    "front": "front", "back": "back", "all": "all",
}  # fmt: skip


class Lights(Base):
    """Three on the robot, one ahead and one behind on the Fluke."""

    def setLED(self, position: str | int, value: str | float) -> None:
        """Switch a light.

        Args:
            position: "left", "center", "right" (or 0, 1, 2), "all" of these; with a Fluke "front" and "back".
            value: "on" or 1, "off" or 0; for "back" also how bright, 0 to 1.
        """
        led = choice("setLED: the position", position, _LEDS)
        if led == "back" and not isinstance(value, str):
            self.setLEDBack(value)
        else:
            self.driver.set_led(led, is_on("setLED: the value", value))

    def setLEDFront(self, value: str | float) -> None:
        """Switch the light on the Fluke's front on ("on", 1) or off ("off", 0)."""
        self.driver.set_led("front", is_on("setLEDFront: the value", value))

    def setLEDBack(self, value: str | float) -> None:
        """Set how bright the light on the Fluke's back is: 0 (off) to 1; what is beyond is limited."""
        if isinstance(value, str):
            value = int(is_on("setLEDBack: the value", value))
        self.driver.set_led("back", min(max(number("setLEDBack: the value", value), 0.0), 1.0))
