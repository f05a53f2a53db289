"""The order of controllers: reliability of means, and what wrong order in simulation costs on the target."""

from __future__ import annotations

import math

import numpy as np
import scipy

from realitygap.stats import CONFIDENCE, spearman

from ._side import Values

SPLITS = 100
"""Random halves behind a split-half number."""

_BLOCK = 4_000_000
"""Pairs of controllers that are held at a time."""

Rng = np.random.Generator


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


def trials_for_reliability(observed: float, trials: int, wanted: float) -> int | None:
    """Return the number of trials of each controller for a reliability, by Spearman & Brown; None if none does."""
    if observed <= 0:
        return None
    return int(np.ceil(trials * wanted * (1 - observed) / (observed * (1 - wanted)) - 1e-9))


def mean_maximum_rank_violation(source: Values, target: Values) -> Values:
    """Return the mean over controllers of the largest violation of the target's order, (b,).

    For each controller i the largest `|target_i - target_j|` over all j with (source_i < source_j) differing from
    (target_i < target_j); 0 where the simulator orders all as the target does. It is in the unit of the *target's*
    quality, so the order of arguments matters.

    Args:
        source: (b, c) means in simulation.
        target: (b, c) means on the target.

    Source: Li et al. (2024), Evaluating Real-World Robot Manipulation Policies in Simulation (SIMPLER), section III.
    """
    b, c = target.shape
    size = max(1, _BLOCK // (c * c))
    return np.concatenate(
        [_of_block(source[first : first + size], target[first : first + size]) for first in range(0, b, size)]
    )


def _of_block(source: Values, target: Values) -> Values:
    return np.asarray(_violations(source, target).max(axis=2).mean(axis=1))


def _violations(source: Values, target: Values) -> Values:
    """Return the difference on the target of two controllers that the simulator orders otherwise, or 0, (b, c, c)."""
    violated = (source[:, :, None] < source[:, None, :]) != (target[:, :, None] < target[:, None, :])
    apart = np.abs(target[:, :, None] - target[:, None, :])
    return np.where(violated, apart, 0.0)


def rank_violation_interval(
    source: Values, target: Values, confidence: float = CONFIDENCE
) -> tuple[float, float]:
    """Return the interval of a mean maximum rank violation above 0.

    It is a t interval on the logarithmic scale with the jackknife's standard error. The upper end is at most the range
    of the target's means, which no rank violation exceeds. It is of the violation expected of as many controllers with
    as many trials: the violation grows with the number of controllers and with the noise of trials.

    Args:
        source: (c,) means in simulation.
        target: (c,) means on the target.
        confidence: Probability, between 0 and 1.

    Raises:
        ValueError: The violation is 0, which has no logarithm.
    """
    violations = _violations(source[None], target[None])[0]
    value = float(violations.max(axis=1).mean())
    if value == 0:
        raise ValueError("The rank violation is 0, expected one above 0.")
    c = len(source)
    left = _left_out(violations)
    error = math.sqrt((c - 1) / c * float(((left - left.mean()) ** 2).sum()))
    factor = math.exp(float(scipy.special.stdtrit(c - 1, (1 + confidence) / 2)) * error / value)
    return value / factor, min(value * factor, float(np.ptp(target)))


def _left_out(violations: Values) -> Values:
    """Return the mean maximum rank violation without each controller, (c,)."""
    c = len(violations)
    worst = violations.argmax(axis=1)
    second, first = np.partition(violations, c - 2, axis=1)[:, c - 2 :].T
    less = np.bincount(worst, weights=first - second, minlength=c)  # where the worst partner is left out
    return np.asarray((first.sum() - first - less) / (c - 1))


def rank_violation_floor(target: Values, rng: Rng, splits: int = SPLITS) -> Values:
    """Return the violation of one random half of the target's trials by the other, (b,), which noise alone causes.

    Args:
        target: (b, c, q), q at least 2.
        rng: Draws the halves.
        splits: Number of random splits, of which the mean is taken.
    """
    violations = [mean_maximum_rank_violation(*halves(target, rng)) for _ in range(splits)]
    return np.asarray(np.mean(violations, axis=0))
