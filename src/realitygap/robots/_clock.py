"""The time that a robot lives in: ours, or one that an emulator keeps."""

from __future__ import annotations

import time
from typing import Protocol, runtime_checkable


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
        time.sleep(seconds)
