"""Time in the emulator: whole nanoseconds, so that what happens does not depend on when it was switched on."""

from __future__ import annotations

SECOND = 1_000_000_000  # [ns]
MILLISECOND = 1_000_000  # [ns]


def nanoseconds(seconds: float) -> int:
    """Return a duration as whole nanoseconds."""
    return round(seconds * SECOND)
