"""Time left, from the pace so far."""

from __future__ import annotations

import time

EARLY_S = 2.0
"""Time after which the pace is steady enough for an estimate [s]."""


class Pace:
    """Estimates how long work will take; what was done before it began does not count."""

    def __init__(self) -> None:
        self._first: tuple[float, float] | None = None
        self._last = (0.0, 0.0)

    def note(self, share: float) -> None:
        """Note which share of the work is done, 0 to 1."""
        self._last = (time.monotonic(), share)
        if self._first is None:
            self._first = self._last

    @property
    def seconds_left(self) -> float | None:
        """Time left [s]; None as long as it cannot be estimated."""
        if self._first is None:
            return None
        seconds, done = (last - first for last, first in zip(self._last, self._first, strict=True))
        if seconds < EARLY_S or done <= 0:
            return None
        return seconds * (1.0 - self._last[1]) / done

    @property
    def words(self) -> str:
        """Time left in words, with a separator before them; empty as long as it cannot be estimated."""
        left = self.seconds_left
        return "" if left is None else f" · {duration(left)} left"


def duration(seconds: float) -> str:
    """Return a time in words: seconds below 90 s, minutes below 90 min, hours above."""
    for limit, unit, name in ((90.0, 1.0, "s"), (5400.0, 60.0, "min")):
        if seconds < limit:
            return f"{seconds / unit:.0f} {name}"
    return f"{seconds / 3600.0:.1f} h"
