"""Means with intervals by t within the range of the values, for a handful of values."""

from __future__ import annotations

import math

from realitygap import _special as special

from ._bootstrap import SMALLEST_N
from ._bounded import UNBOUNDED, Range, bounded_interval, range_of_differences
from ._estimate import CONFIDENCE, Estimate
from ._side import Values


def mean_of(values: Values, within: Range = UNBOUNDED) -> Estimate:
    """Return the mean of (n,) values and its interval by t, within the range of the values; no interval below 5."""
    n = len(values)
    mean = float(values.mean())
    if n < SMALLEST_N:
        return Estimate(
            mean, None, None, n, f"{n} values are too few for an interval; at least {SMALLEST_N} are needed."
        )
    error = float(values.std(ddof=1)) / math.sqrt(n)
    low, high = bounded_interval(mean, error, _t(n - 1), within)
    return Estimate(mean, float(low), float(high), n)


def difference_of_groups(one: Values, other: Values, within: Range = UNBOUNDED) -> Estimate:
    """Return the mean of the other group less that of the one, with its interval; n is the smaller group's.

    Args:
        one: (n,) values.
        other: (m,) values.
        within: Range of the values, in whose differences the interval ends.

    Source: Welch (1947), Biometrika 34(1-2), 28-35.
    """
    n = min(len(one), len(other))
    difference = float(other.mean() - one.mean())
    if n < SMALLEST_N:
        return Estimate(
            difference,
            None,
            None,
            n,
            f"{n} champions are too few for an interval; at least {SMALLEST_N} are needed.",
        )
    parts = [float(each.var(ddof=1)) / len(each) for each in (one, other)]
    total = sum(parts)
    if total == 0:
        return Estimate(difference, difference, difference, n)
    freedom = total**2 / sum(
        part**2 / (len(each) - 1) for part, each in zip(parts, (one, other), strict=True)
    )
    ends = bounded_interval(difference, math.sqrt(total), _t(freedom), range_of_differences(within))
    return Estimate(difference, float(ends[0]), float(ends[1]), n)


def _t(freedom: float) -> float:
    return float(special.stdtrit(freedom, (1 + CONFIDENCE) / 2))
