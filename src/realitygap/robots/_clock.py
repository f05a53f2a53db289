"""The clock of a robot: real time, or the time of an emulator."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol, runtime_checkable

from realitygap.errors import real_number

HEAR_S = 0.1
"""Longest uninterrupted wait [s]. Ctrl-C that comes just before such a wait takes effect after it."""


@runtime_checkable
class Clock(Protocol):
    """A clock that can be read and can wait. All code that times a robot uses the robot's own clock."""

    def now(self) -> float:
        """Return the time [s] since any origin. It never decreases."""
        ...

    def sleep(self, seconds: float) -> None:
        """Wait for a number of seconds by this clock."""
        ...


class SystemClock:
    """Real time."""

    def now(self) -> float:
        """Return the time since this machine started [s]."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Wait [s]."""
        sleep(seconds)


class VirtualClock:
    """The clock of a robot in this program: time passes only while the robot drives, and in `sleep`.

    Args:
        wait: Advances the robot by a number of seconds. If not given, only the clock advances.
    """

    def __init__(self, wait: Callable[[float], None] | None = None) -> None:
        self._wait = wait
        self.seconds = 0.0

    def now(self) -> float:
        """Return the time since it was made [s]."""
        return self.seconds

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        real_number("seconds", seconds)
        if self._wait is None:
            self.seconds += seconds
        else:
            self._wait(seconds)


def sleep(seconds: float) -> None:
    """Wait in real time [s], in pieces so short that Ctrl-C and SIGTERM take effect soon: a robot may be driving."""
    until = time.monotonic() + real_number("seconds", seconds)
    while seconds > HEAR_S:
        time.sleep(HEAR_S)
        seconds = until - time.monotonic()
    time.sleep(max(seconds, 0.0))
