"""Means with intervals by t, for a handful of values."""

from __future__ import annotations

import math

from realitygap import _special as special

from ._bootstrap import SMALLEST_N
from ._estimate import CONFIDENCE, Estimate
from ._side import Values


def mean_of(values: Values) -> Estimate:
    """Return the mean of (n,) values and its interval by t; no interval below 5."""
    n = len(values)
    mean = float(values.mean())
    if n < SMALLEST_N:
        return Estimate(
            mean, None, None, n, f"{n} values are too few for an interval; at least {SMALLEST_N} are needed."
        )
    reach = _t(n - 1) * float(values.std(ddof=1)) / math.sqrt(n)
    return Estimate(mean, mean - reach, mean + reach, n)


def difference_of_groups(one: Values, other: Values) -> Estimate:
    """Return the mean of the other group less that of the one, with its interval; n is the smaller group's.

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
    reach = _t(freedom) * math.sqrt(total)
    return Estimate(difference, difference - reach, difference + reach, n)


def _t(freedom: float) -> float:
    return float(special.stdtrit(freedom, (1 + CONFIDENCE) / 2))
