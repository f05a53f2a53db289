"""The computer as a player of tones."""

from __future__ import annotations

import sys

from . import _robot
from ._mistakes import MyroError, number
from ._sound import Plays


class Computer(Plays):
    """The computer as a player of tones: it rings the terminal's bell and waits as long as the tone lasts."""

    def _tone(self, duration: float, hz: float, hz2: float | None) -> None:
        if hz:
            sys.stdout.write("\a")
            sys.stdout.flush()
        _robot.sleep(duration)

    def speak(self, message: object, async_: bool = False) -> None:
        """Print what the computer would say."""
        print(message)


computer = Computer()


def beepScale(duration: float, start: float, stop: float, factor: float = 2) -> None:
    """Let the computer play tones from one frequency to another; `factor` is the ratio of neighboring tones."""
    if number("beepScale: the factor", factor) <= 1 or number("beepScale: the start", start) <= 0:
        raise MyroError(
            f"beepScale: starts at {start!r} and grows by {factor!r}, expected a start above 0 and a factor above 1."
        )
    hz = start
    while hz <= stop:
        computer.beep(duration, hz)
        hz *= factor
