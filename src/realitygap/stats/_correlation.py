"""Correlations, the interval of rank correlations, and the effect of noise on them."""

from __future__ import annotations

import math

import numpy as np
import scipy

from ._estimate import CONFIDENCE, Estimate, Values

FISHER_SMALLEST_N = 10
"""Fewer pairs give no correlation with an interval by Fisher's z."""


def spearman(one: Values, other: Values) -> Values:
    """Return Spearman's rank correlation of b pairs of samples, (b,); nan if all values of one sample are equal.

    Args:
        one: (b, c) and
        other: (b, c); ties get their mean rank.
    """
    ranks = [scipy.stats.rankdata(values, axis=1) for values in (one, other)]
    return pearson(*ranks)


def pearson(one: Values, other: Values) -> Values:
    """Return Pearson's correlation of b pairs of samples, (b,); nan if all values of one sample are equal.

    Args:
        one: (b, c) and
        other: (b, c) values.
    """
    a, b = (values - values.mean(axis=1, keepdims=True) for values in (one, other))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray((a * b).sum(axis=1) / np.sqrt((a * a).sum(axis=1) * (b * b).sum(axis=1)))


def rank_correlation(one: Values, other: Values) -> Estimate:
    """Return Spearman's rank correlation of n pairs with its interval; values that differ by rounding alone are ties.

    Args:
        one: (n,) and
        other: (n,) values.

    Source: Bonett & Wright (2000), Psychometrika 65(1), 23-28: Fisher's z with variance (1 + r^2 / 2) / (n - 3).
    """
    n = len(one)
    if n < FISHER_SMALLEST_N or np.ptp(one) == 0 or np.ptp(other) == 0:
        return Estimate.refusal(n, "all pairs are alike in one of the two, or there are fewer than ten")
    # two sums of one distance in another order are one distance
    ranks = [scipy.stats.rankdata(values.round(9)) for values in (one, other)]
    value = float(np.corrcoef(*ranks)[0, 1])
    if abs(value) >= 1:
        return Estimate(value, value, value, n, method="Fisher z")
    reach = scipy.special.ndtri((1 + CONFIDENCE) / 2) * correlation_error(value, n)
    low, high = (math.tanh(math.atanh(value) + side * reach) for side in (-1, 1))
    return Estimate(value, low, high, n, method="Fisher z")


def correlation_error(correlation: float, n: int) -> float:
    """Return the standard error of the Fisher transform of Spearman's correlation of n pairs, 4 or more."""
    return math.sqrt((1 + correlation**2 / 2) / (n - 3))


def attenuated(correlation: float, source: float, target: float) -> float:
    """Return the rank correlation of means of trials, given the one of controllers without noise.

    Noise lowers Pearson's correlation by the factor √(source · target). Spearman's is converted to Pearson's and back,
    for normal values.

    Args:
        correlation: Spearman's, without noise [-1..1].
        source: Reliability of the simulator's means [0..1]: the share of their variance that is not noise.
        target: Reliability of the target's means.

    Source: Spearman (1904), American Journal of Psychology 15(1), 72-101; Pearson (1907) for the conversion.
    """
    pearson = 2 * math.sin(math.pi * correlation / 6) * math.sqrt(source * target)
    return 6 / math.pi * math.asin(pearson / 2)
