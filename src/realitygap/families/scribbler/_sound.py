"""Tones and lights."""

from __future__ import annotations

import struct

from ._codec import robot_request
from ._device import Device, limited
from .opcodes import Op

LONGEST_TONE_S = 8.191
"""Longest tone of an S2 [s]."""
_LEDS = {
    "left": (Op.SET_LED_LEFT_ON, Op.SET_LED_LEFT_OFF),
    "center": (Op.SET_LED_CENTER_ON, Op.SET_LED_CENTER_OFF),
    "right": (Op.SET_LED_RIGHT_ON, Op.SET_LED_RIGHT_OFF),
    "all": (Op.SET_LED_ALL_ON, Op.SET_LED_ALL_OFF),
}


class SoundAndLight(Device):
    """Speaker and lights of the robot."""

    def beep(self, seconds: float, hz: float, hz2: float | None = None) -> None:
        """Play a tone, or two in parallel, and return when it has ended.

        A lost answer is an error, and the tone is not repeated, because it may have been played.

        Args:
            seconds: 0 to 8.191 s.
            hz: 0 to 10000 Hz; 0 is a rest.
            hz2: Frequency of the second tone.
        """
        self.need_robot("beep")
        limited("seconds", seconds, 0.0, LONGEST_TONE_S)
        tones = [round(limited("hz", hz, 0, 10_000))]
        if hz2 is not None:
            tones.append(round(limited("hz2", hz2, 0, 10_000)))
        op = Op.SET_SPEAKER if hz2 is None else Op.SET_SPEAKER_2
        arguments = struct.pack(f">{1 + len(tones)}H", round(seconds * 1000), *tones)
        wait_s = seconds + 2.0
        self._set_late(
            robot_request("beep", op, arguments, repeatable=False, wait_s=wait_s, may_stay_out=True)
        )

    def set_loud(self, loud: bool) -> None:
        """Switch the speaker on or off. The robot stores this while it is switched off."""
        self.need_robot("set_loud")
        self._set(robot_request("set_loud", Op.SET_LOUD if loud else Op.SET_QUIET))

    def set_volume(self, level: int) -> None:
        """Switch the speaker off (0) or on (anything else up to 100)."""
        self.set_loud(limited("level", level, 0, 100) > 0)

    def set_s2_volume(self, level: int) -> None:
        """Set the volume of an S2, 0 to 100."""
        self.need_s2("set_s2_volume")
        level = int(limited("level", level, 0, 100))
        self._set(robot_request("set_s2_volume", Op.SET_VOLUME, bytes((level,))))

    def set_led(self, which: str, value: float) -> None:
        """Switch a light on (1) or off (0).

        Args:
            which: "left", "center", "right" or "all" of the robot; "front" or "back" of the Fluke.
            value: 0 or 1; for "back", its brightness in between, too.
        """
        limited("value", value, 0.0, 1.0)
        if which == "back":
            level = int(170 + 85 * value) if value > 0 else 0
            self._tell_fluke("set_led back", Op.SET_BACK_LED, bytes((level,)))
        elif which == "front":
            self._tell_fluke("set_led front", Op.SET_FRONT_LED_ON if value > 0 else Op.SET_FRONT_LED_OFF)
        elif which in _LEDS:
            self.need_robot("set_led")
            self._set(robot_request(f"set_led {which}", _LEDS[which][0 if value > 0 else 1]))
        else:
            known = ", ".join((*_LEDS, "front", "back"))
            raise ValueError(f"which is {which!r}, expected one of {known}.")
