"""Shares of n with their intervals, and how often one sample is above another."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import scipy

from ._estimate import CONFIDENCE, Estimate, Values

USUAL_EFFECTS = {"small": 0.56, "medium": 0.64, "large": 0.71}
"""A12 of what is called a small, medium and large effect (Vargha & Delaney 2000, Table 1)."""


def share_interval(count: float, n: int) -> Estimate:
    """Return a share of n with Wilson's interval; a draw may count as half.

    Source: Wilson (1927), Journal of the American Statistical Association 22(158), 209-212.
    """
    if n == 0:
        return Estimate.refusal(0, "There is nothing to count.")
    share, z = count / n, float(scipy.special.ndtri((1 + CONFIDENCE) / 2))
    center = (share + z * z / (2 * n)) / (1 + z * z / n)
    reach = z * math.sqrt(share * (1 - share) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    return Estimate(share, max(0.0, center - reach), min(1.0, center + reach), n, method="Wilson")


def exact_share_interval(count: int, n: int, confidence: float = CONFIDENCE) -> Estimate:
    """Return a share of n with the interval that covers the truth at least as often as it claims.

    Source: Clopper & Pearson (1934), Biometrika 26(4), 404-413.
    """
    beyond = (1 - confidence) / 2
    low = float(scipy.special.betaincinv(count, n - count + 1, beyond)) if count > 0 else 0.0
    high = float(scipy.special.betaincinv(count + 1, n - count, 1 - beyond)) if count < n else 1.0
    return Estimate(count / n, low, high, n, level=confidence, method="Clopper-Pearson")


def a12(one: Values, other: Values) -> float:
    """Return the probability that a run of one condition is above a run of the other; ties count half [0..1].

    Args:
        one: (n,) and
        other: (m,) values in any order, n, m >= 1.

    Source: Vargha & Delaney (2000), Journal of Educational and Behavioral Statistics 25(2).
    """
    if len(one) == 0 or len(other) == 0:
        raise ValueError("one and other need at least one value each.")
    ordered = np.sort(other)
    below = np.searchsorted(ordered, one, "left") + np.searchsorted(ordered, one, "right")
    return float(below.sum() / (2 * len(one) * len(other)))


def effect_of_a12(share: float) -> float:
    """The difference of means [standard deviations] of two normal conditions with this A12."""
    return float(math.sqrt(2) * scipy.special.ndtri(share))


def a12_of_effect(effect: float) -> float:
    """Return A12 of two normal conditions whose means differ by `effect` standard deviations."""
    return float(scipy.special.ndtr(effect / math.sqrt(2)))


def newcombe_interval(share: float, n: int, m: int) -> Estimate:
    """Return A12 with an interval for few runs, without resampling. It has a width even if all runs are above.

    Args:
        share: A12 as observed [0..1].
        n: Number of runs of one condition.
        m: Number of runs of the other.

    Source: Newcombe (2006), Statistics in Medicine 25(4), 559-573, method 5.
    """
    z = scipy.special.ndtri((1 + CONFIDENCE) / 2)
    others = (n + m) / 2 - 1

    def excess(at: float) -> float:
        variance = at * (1 - at) * (1 + others * ((1 - at) / (2 - at) + at / (1 + at))) / (n * m)
        return float((at - share) ** 2 - z * z * variance)

    # at 0 and 1 the share itself is a root too, which is not the one that is meant
    low = 0.0 if share <= 0 else root(excess, 0.0, min(share, 1 - 1e-9))
    high = 1.0 if share >= 1 else root(excess, max(share, 1e-9), 1.0)
    return Estimate(share, float(low), float(high), min(n, m), method="Newcombe")


def root(function: Callable[[float], float], low: float, high: float) -> float:
    """Return the point between two bounds at which a function changes its sign, by bisection, to about the last bit."""
    sign = function(low) > 0
    while low < (middle := (low + high) / 2) < high:
        if (function(middle) > 0) == sign:
            low = middle
        else:
            high = middle
    return middle
