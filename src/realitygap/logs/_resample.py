"""Streams of irregular samples on one regular grid: each takes batches in order, and keeps only what the grid needs.

The grid begins at the first command, and has a point every step.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np

from realitygap.errors import LogError

from ._source import Floats

MOST_STEPS = 2_000_000
"""Maximum number of steps of one trial, so that it fits into memory."""
GAP_INTERVALS = 3.0
"""Usual intervals between samples beyond which nothing is known in between."""


class Grid:
    """Regular times.

    Attributes:
        start_s: The first one [s].
        step_s: Time between two points [s].
    """

    def __init__(self, start_s: float, step_s: float) -> None:
        self.start_s, self.step_s = start_s, step_s

    def until(self, time_s: float) -> int:
        """Return the number of points up to a time, that time included.

        Raises:
            LogError: They are too many for memory.
        """
        # a sample on a point may be off by the rounding of its time
        n = math.floor((time_s - self.start_s) / self.step_s + 1e-6) + 1
        if n > MOST_STEPS:
            raise LogError(
                f"A trial has {n:,} steps of {self.step_s:g} s, expected at most {MOST_STEPS:,}. Choose a longer "
                "step_s, or split the log."
            )
        return max(n, 0)

    def times(self, first: int, last: int) -> Floats:
        """Return the points from one to before another [s]."""
        return np.arange(first, last, dtype=np.float64) * self.step_s + self.start_s


class HeldMean:
    """Means over each step of a signal that holds its value until the next sample, such as commands."""

    def __init__(self, grid: Grid, width: int) -> None:
        self._grid, self._parts, self._n = grid, [np.empty((0, width))], 0
        self._time, self._value = math.nan, np.empty(width)
        self._sum = np.zeros(width)  # over the time since the grid began
        self._at_edge = np.zeros(width)  # the sum at the last edge

    def push(self, times: Floats, values: Floats) -> None:
        """Add times (b,) and values (b, k), which follow all earlier ones."""
        if math.isnan(self._time):
            self._time, self._value = float(times[0]), values[0]
            self._n = 1
        times = np.concatenate([[self._time], times])
        values = np.concatenate([self._value[None], values])
        sums = self._sum + np.concatenate(
            [np.zeros((1, values.shape[1])), np.cumsum(values[:-1] * np.diff(times)[:, None], 0)]
        )
        end = self._grid.until(float(times[-1]))
        if end > self._n:
            edges = self._grid.times(self._n, end)
            at = np.stack([np.interp(edges, times, sums[:, k]) for k in range(values.shape[1])], 1)
            self._parts.append(np.diff(np.concatenate([self._at_edge[None], at]), axis=0) / self._grid.step_s)
            self._at_edge, self._n = at[-1], end
        self._time, self._value, self._sum = float(times[-1]), values[-1], sums[-1]

    def rows(self, n: int) -> Floats:
        """Return the means over the first n steps, (n, k); nan after the last sample."""
        return _padded(np.concatenate(self._parts), n)


class _AtPoints(ABC):
    """Values of a signal at each point; nan if no sample is near."""

    def __init__(self, grid: Grid, width: int) -> None:
        self._grid, self._parts, self._n = grid, [np.empty((0, width))], 0
        self._last: tuple[float, Floats] | None = None
        self._gap = 0.0

    def push(self, times: Floats, values: Floats) -> None:
        """Add times (b,) and values (b, k), which follow all earlier ones."""
        if not len(times):
            return
        self._gap = self._gap or _gap_of(times, self._grid.step_s)
        if self._last is not None:
            times = np.concatenate([[self._last[0]], times])
            values = np.concatenate([self._last[1][None], values])
        end = self._grid.until(float(times[-1]))
        if end > self._n:
            self._parts.append(self._at(self._grid.times(self._n, end), times, values))
            self._n = end
        self._last = float(times[-1]), values[-1]

    @abstractmethod
    def _at(self, points: Floats, times: Floats, values: Floats) -> Floats:
        """Return (p, k) values at (p,) points, from (b,) times and (b, k) values."""

    def rows(self, n: int) -> Floats:
        """Return the values at the first n points, (n, k); nan after the last sample."""
        return _padded(np.concatenate(self._parts), n)


class Interpolated(_AtPoints):
    """Values at each point by linear interpolation between samples; nan if samples are too far apart."""

    def _at(self, points: Floats, times: Floats, values: Floats) -> Floats:
        points[-1] = min(points[-1], times[-1])
        after = np.clip(np.searchsorted(times, points - 1e-6 * self._grid.step_s), 0, len(times) - 1)
        before = np.maximum(after - 1, 0)
        at = np.stack([np.interp(points, times, values[:, k]) for k in range(values.shape[1])], 1)
        is_near = np.abs(times[after] - points) < 1e-6 * self._grid.step_s
        is_known = (points >= times[0] - 1e-6 * self._grid.step_s) & (
            is_near | (times[after] - times[before] <= self._gap)
        )
        at[~is_known] = np.nan
        return at


class Held(_AtPoints):
    """The last sample at each point; nan where it is too old."""

    def _at(self, points: Floats, times: Floats, values: Floats) -> Floats:
        index = np.searchsorted(times, points + 1e-6 * self._grid.step_s, side="right") - 1
        at = values[np.maximum(index, 0)].copy()
        at[(index < 0) | (points - times[np.maximum(index, 0)] > self._gap)] = np.nan
        return at


def _gap_of(times: Floats, step_s: float) -> float:
    """Return the time between two samples beyond which nothing is known in between [s]."""
    usual = float(np.median(np.diff(times))) if len(times) > 1 else step_s
    return max(GAP_INTERVALS * usual, 2 * step_s)


def _padded(rows: Floats, n: int) -> Floats:
    if len(rows) >= n:
        return rows[:n]
    return np.concatenate([rows, np.full((n - len(rows), rows.shape[1]), np.nan)])
