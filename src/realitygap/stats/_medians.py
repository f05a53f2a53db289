"""Quartiles, and the median with an interval that holds for any distribution."""

from __future__ import annotations

import bisect
import functools
import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy

from realitygap.errors import finite_numbers

from ._estimate import CONFIDENCE, Estimate

MEDIAN_SMALLEST_N = 6
"""Fewer values give no interval of 95 %: the range of five covers the median with 1 - 2 / 2^5 = 93.75 %."""

_LARGEST_COUNTED_N = 300
"""Largest n for which whole numbers are added up, within 2 ms. Loading SciPy's function takes 0.1 s."""


@dataclass(frozen=True)
class IntervalRanks:
    """Ranks of the ordered values that bound the interval of the median.

    Attributes:
        lower: Rank of the lower bound, counted from 1.
        upper: Rank of the upper bound, n + 1 - lower.
        coverage: Probability that such an interval contains the median of a continuous distribution [0..1]; a lower
            bound for a discrete one.
    """

    lower: int
    upper: int
    coverage: float


@dataclass(frozen=True)
class Quartiles:
    """Three values that split ordered values into four equal parts, in their unit."""

    q25: float
    median: float
    q75: float


@functools.lru_cache
def interval_ranks(n: int, confidence: float = CONFIDENCE) -> IntervalRanks | None:
    """Return the innermost pair of symmetric ranks whose interval covers the median with at least `confidence`.

    The number of n independent values below the median is Binomial(n, 1/2), so the interval between the
    values of rank r and n + 1 - r misses it with probability 2 P(X <= r - 1), exactly.

    Args:
        n: Number of values, at least 0.
        confidence: Probability, between 0 and 1.

    Returns:
        The ranks, or None if n is too small: then not even the range contains the median with this probability.

    Raises:
        ValueError: n is negative, or `confidence` not between 0 and 1.

    Source: David & Nagaraja (2003), Order Statistics, 3rd edition, section 7.1; for discrete distributions
    Scheffé & Tukey (1945), Annals of Mathematical Statistics 16(2).
    """
    if n < 0:
        raise ValueError(f"n is {n}, expected 0 or more.")
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence is {confidence}, expected a number between 0 and 1.")
    if n == 0:
        return None
    may_miss = (1.0 - confidence) / 2.0
    misses = _cumulative(n)
    lower = bisect.bisect_right(range((n + 1) // 2), may_miss, key=misses)
    if lower < 1:
        return None
    return IntervalRanks(lower, n + 1 - lower, 1.0 - 2.0 * misses(lower - 1))


def _cumulative(n: int) -> Callable[[int], float]:
    """Return the function P(X <= k) of k, from 0 to (n - 1) // 2, where X is Binomial(n, 1/2)."""
    if n > _LARGEST_COUNTED_N:
        return lambda k: float(scipy.special.betainc(n - k, k + 1, 0.5))
    counts = list(itertools.accumulate(math.comb(n, k) for k in range((n + 1) // 2)))
    return lambda k: counts[k] / 2**n


def median_interval(values: npt.ArrayLike, level: float = CONFIDENCE) -> Estimate:
    """Return the median with its order-statistic interval: no distribution is assumed and nothing is resampled.

    Args:
        values: (n,) independent observations in any order and unit, all finite.
        level: Minimum probability that the interval contains the median, between 0 and 1.

    Returns:
        The median, None of no values; without an interval if n is too small (below 6 for 95 %).

    Raises:
        ValueError: `values` is not one row of finite numbers, or `level` is not between 0 and 1.

    Source: as `interval_ranks`.
    """
    ordered = np.sort(_checked(np.asarray(values, float)))
    n, ranks = len(ordered), interval_ranks(len(ordered), level)
    if n == 0:
        return Estimate.refusal(0, "There are no values.")
    median = float(np.median(ordered))
    if ranks is None:
        needed = next(size for size in itertools.count(n + 1) if interval_ranks(size, level) is not None)
        return Estimate.of_few(median, n, needed)
    ends = float(ordered[ranks.lower - 1]), float(ordered[ranks.upper - 1])
    return Estimate(median, *ends, n, level=level, method="ranks")


def quartiles(values: npt.NDArray[np.float64]) -> Quartiles:
    """Return the lower quartile, median and upper quartile, with straight lines between ordered values.

    Args:
        values: (n,) values in any order and unit, n >= 1, all finite.

    Raises:
        ValueError: `values` is empty, not one row, or not finite.

    Source: Hyndman & Fan (1996), The American Statistician 50(4), definition 7.
    """
    if len(_checked(values)) == 0:
        raise ValueError("values is empty, expected at least one.")
    q25, median, q75 = np.quantile(values, [0.25, 0.5, 0.75])
    return Quartiles(float(q25), float(median), float(q75))


def _checked(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    if values.ndim != 1:
        raise ValueError(f"values has shape {values.shape}, expected (n,).")
    return finite_numbers("values", values)
