"""A rule for robots that measure the speeds of their wheels, and have no other sign of a stall."""

from __future__ import annotations

from collections.abc import Sequence

SHARE = 0.3
"""Share of its target below which a wheel counts as held."""
STALL_S = 0.3
"""Time for which a wheel has to be held [s]."""


class StallRule:
    """A robot is stalled if a wheel has turned slower than 0.3 of its target for 0.3 s.

    The numbers are chosen. The rule was not tried on a robot.

    Args:
        least: Targets below it count as standing, because measured speeds are noisy [the unit of the targets].
    """

    def __init__(self, least: float) -> None:
        self._least = least
        self._since: float | None = None

    def is_stalled(self, now: float, targets: Sequence[float], speeds: Sequence[float]) -> bool:
        """Return whether the robot is stalled.

        Args:
            now: The robot's time [s].
            targets: Target speeds of both wheels.
            speeds: Measured, in the same unit.
        """
        is_held = any(
            abs(target) >= self._least and speed * (1 if target > 0 else -1) < SHARE * abs(target)
            for target, speed in zip(targets, speeds, strict=True)
        )
        if not is_held:
            self._since = None
        elif self._since is None:
            self._since = now
        return self._since is not None and now - self._since >= STALL_S
