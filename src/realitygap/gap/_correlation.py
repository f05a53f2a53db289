"""The rank correlation of simulator and target over controllers, and the effect of noise on it."""

from __future__ import annotations

import math

import numpy as np

from ._side import Values

SPLITS = 100
"""Random halves behind a split-half number."""

Rng = np.random.Generator


def spearman(one: Values, other: Values) -> Values:
    """Return Spearman's rank correlation of b pairs of samples, (b,); nan if all values of one sample are equal.

    Args:
        one: (b, c) and
        other: (b, c); ties get their mean rank.
    """
    from scipy import stats  # takes a third of a second, which most commands can do without

    ranks = [stats.rankdata(each, axis=1) for each in (one, other)]
    a, b = (each - each.mean(axis=1, keepdims=True) for each in ranks)
    with np.errstate(invalid="ignore", divide="ignore"):
        found = (a * b).sum(axis=1) / np.sqrt((a * a).sum(axis=1) * (b * b).sum(axis=1))
    return np.asarray(found)


def halves(values: Values, rng: Rng) -> tuple[Values, Values]:
    """Return the means of two random halves of the trials, floor(r / 2) each, (b, c).

    Args:
        values: (b, c, r), r at least 2.
        rng: Draws the halves, the same ones for all samples.
    """
    order = rng.permutation(values.shape[2])
    size = values.shape[2] // 2
    one, other = order[:size], order[size : 2 * size]
    return np.asarray(values[:, :, one].mean(axis=2)), np.asarray(values[:, :, other].mean(axis=2))


def lengthened(correlation: Values, times: float) -> Values:
    """Return the reliability of a test that is longer by a factor.

    Source: Spearman (1910) and Brown (1910), British Journal of Psychology 3. Differs: 0 for a correlation below 0,
    for which the formula means nothing.
    """
    positive = np.maximum(correlation, 0.0)
    return np.asarray(times * positive / (1 + (times - 1) * positive))


def reliability(values: Values, rng: Rng, splits: int = SPLITS) -> Values:
    """Return the reliability of the means of r trials: their rank correlation with those of new trials, 0 to 1, (b,).

    The rank correlation between halves, mean of `splits` random ones, lengthened to r trials.

    Args:
        values: (b, c, r), r at least 2.
        rng: Draws the halves.
        splits: Number of random splits.
    """
    between = [spearman(*halves(values, rng)) for _ in range(splits)]
    size = values.shape[2] // 2
    return lengthened(np.nan_to_num(np.mean(between, axis=0)), values.shape[2] / size)


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


def trials_for_reliability(found: float, trials: int, wanted: float) -> int | None:
    """Return the number of trials of each controller for a reliability, by Spearman & Brown; None if none does."""
    if found <= 0:
        return None
    return int(np.ceil(trials * wanted * (1 - found) / (found * (1 - wanted)) - 1e-9))
