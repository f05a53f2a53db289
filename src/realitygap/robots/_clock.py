"""The time that a robot lives in: ours, or one that an emulator keeps."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Protocol, runtime_checkable

HEAR_S = 0.1
"""The longest wait in one piece [s]: Ctrl-C that comes just before a piece begins is heard only after it."""


@runtime_checkable
class Clock(Protocol):
    """Tells the time and lets it pass; whoever has to do with a robot waits by its clock and by no other."""

    def now(self) -> float:
        """The time [s], from any origin, never going back."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let so much time pass [s]."""
        ...


class SystemClock:
    """Real time."""

    def now(self) -> float:
        """The time since this machine started [s]."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Wait [s]."""
        sleep(seconds)


class VirtualClock:
    """A clock of a robot in this program: time passes while the robot drives, and in `sleep`.

    Args:
        wait: Lets time pass, such as by driving on; the clock alone goes on if not given.
    """

    def __init__(self, wait: Callable[[float], None] | None = None) -> None:
        self._wait = wait
        self.seconds = 0.0

    def now(self) -> float:
        """Return the time since it was made [s]."""
        return self.seconds

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        if self._wait is None:
            self.seconds += seconds
        else:
            self._wait(seconds)


def sleep(seconds: float) -> None:
    """Let real time pass [s], so that whoever ends the program never waits for the end: a robot may be driving."""
    until = time.monotonic() + seconds
    while seconds > HEAR_S:
        time.sleep(HEAR_S)
        seconds = until - time.monotonic()
    time.sleep(max(seconds, 0.0))
