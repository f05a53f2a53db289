"""The order of controllers: reliability of means, and what wrong order in simulation costs on the target."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Literal, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from realitygap.stats import CONFIDENCE, SMALLEST_N, Ends, spearman

from ._side import Values

SPLITS = 100
"""Random halves behind a split-half number."""

_BLOCK = 4_000_000
"""Pairs of controllers that are held at a time."""

_MOST_Z = 6.0
"""Fisher's z of a correlation that cannot be told from 1."""

Rng = np.random.Generator

Ties = Literal["both", "simpler"]
"""Counting of pairs that tie on one platform only: `both`, as violated for both controllers; `simpler`, as the code of
SIMPLER does, for the one that is better on the other platform."""

_DECIMALS = 12
"""Means that differ only beyond this are equal, because sums of the same numbers in another order differ there."""


def halves(values: Values, rng: Rng) -> tuple[Values, Values]:
    """Return the means of two random halves of the trials, floor(r / 2) each, (b, c).

    Args:
        values: (b, c, r), r at least 2.
        rng: Draws the halves, the same ones for all samples.
    """
    order = rng.permutation(values.shape[2])
    if np.isnan(values[:, :, -1]).any():
        return _ragged_halves(values[:, :, order])
    size = values.shape[2] // 2
    one, other = order[:size], order[size : 2 * size]
    return np.asarray(values[:, :, one].mean(axis=2)), np.asarray(values[:, :, other].mean(axis=2))


def _ragged_halves(shuffled: Values) -> tuple[Values, Values]:
    """Return the means of two halves of each controller's own trials, whose nan are anywhere, (b, c)."""
    given = ~np.isnan(shuffled)
    place, size = np.cumsum(given, axis=2), given.sum(axis=2) // 2
    numbers = np.where(given, shuffled, 0.0)
    ends = [
        np.where(given & (place <= most[:, :, None]), numbers, 0.0).sum(axis=2) for most in (size, 2 * size)
    ]
    return ends[0] / size, (ends[1] - ends[0]) / size


def lengthened(correlation: Values, times: float | Values) -> Values:
    """Return the reliability of a test that is longer by a factor.

    Source: Spearman (1910) and Brown (1910), British Journal of Psychology 3. Differs: 0 for a correlation below 0,
    for which the formula means nothing.
    """
    positive = np.maximum(correlation, 0.0)
    return np.asarray(times * positive / (1 + (times - 1) * positive))


def reliability(values: Values, rng: Rng, splits: int = SPLITS) -> Values:
    """Return the reliability of the means of r trials: their rank correlation with those of new trials, 0 to 1, (b,).

    The rank correlation between halves, mean of `splits` random ones, lengthened to r trials. If numbers of trials
    differ, it is lengthened by the mean factor of the controllers.

    Args:
        values: (b, c, r), r at least 2.
        rng: Draws the halves.
        splits: Number of random splits.
    """
    between = _over_splits(spearman, values, rng, splits)
    times: float | Values = values.shape[2] / (values.shape[2] // 2)
    if np.isnan(values[:, :, -1]).any():
        counts = (~np.isnan(values)).sum(axis=2)
        times = np.asarray((counts / (counts // 2)).mean(axis=1))
    return lengthened(np.nan_to_num(between), times)


def _over_splits(
    measure: Callable[[Values, Values], Values], values: Values, rng: Rng, splits: int
) -> Values:
    """Return the mean of a measure of two halves over random splits of the trials (b, c, r), (b,)."""
    pairs = [halves(values, rng) for _ in range(splits)]
    one, other = (np.concatenate(side) for side in zip(*pairs, strict=True))  # one call is faster than many
    return np.asarray(measure(one, other).reshape(splits, -1).mean(axis=0))


def fisher_interval(ceiling: float, resampled: Values, n: int, confidence: float = CONFIDENCE) -> Ends | None:
    """Return the interval of a noise ceiling, by t on the scale of Fisher's z; none below 5 controllers.

    Resamples have fewer distinct controllers than the sample, so their ceilings are lower, and so are their
    percentiles. Their spread on this scale is right.

    Args:
        ceiling: The noise ceiling, 0 to 1.
        resampled: (b,) ceilings of resamples.
        n: Number of controllers.
        confidence: Probability, between 0 and 1.
    """
    if n < SMALLEST_N:
        return None
    most = math.tanh(_MOST_Z)
    error = float(np.arctanh(np.clip(resampled, 0.0, most)).std())
    reach = float(scipy.special.stdtrit(n - 1, (1 + confidence) / 2)) * error
    z = math.atanh(min(ceiling, most))
    return math.tanh(max(z - reach, 0.0)), math.tanh(z + reach)


def trials_for_reliability(observed: float, trials: int, wanted: float) -> int | None:
    """Return the number of trials of each controller for a reliability, by Spearman & Brown; None if none does."""
    if observed <= 0:
        return None
    return int(np.ceil(trials * wanted * (1 - observed) / (observed * (1 - wanted)) - 1e-9))


def mean_maximum_rank_violation(source: Values, target: Values, ties: Ties = "both") -> Values:
    """Return the mean over controllers of the largest violation of the target's order, (b,).

    For each controller i the largest `|target_i - target_j|` over all j that the two platforms order differently; 0 if
    the simulator orders all as the target does. It is in the unit of the *target's* quality, so the order of arguments
    matters.

    Args:
        source: (b, c) means in simulation.
        target: (b, c) means on the target.
        ties: Counting of pairs that tie on one platform only.

    Source: Li et al. (2024), Evaluating Real-World Robot Manipulation Policies in Simulation (SIMPLER), section III.
    Differs: a pair that ties on one platform only is violated for both controllers, so the sign of the score does not
    matter. The paper writes <, its code >, which count such a pair for one controller only, and for different ones.
    """
    b, c = target.shape
    size = max(1, _BLOCK // (c * c))
    return np.concatenate(
        [
            _of_block(source[first : first + size], target[first : first + size], ties)
            for first in range(0, b, size)
        ]
    )


def _of_block(source: Values, target: Values, ties: Ties) -> Values:
    return np.asarray(_violations(source, target, ties).max(axis=2).mean(axis=1))


def _violations(source: Values, target: Values, ties: Ties = "both") -> Values:
    """Return the difference on the target of two controllers that the simulator orders otherwise, or 0, (b, c, c)."""
    violated = _is_above(source) != _is_above(target)
    if ties == "both":
        violated |= violated.swapaxes(1, 2)
    apart = np.abs(target[:, :, None] - target[:, None, :])
    return np.where(violated, apart, 0.0)


def _is_above(values: Values) -> NDArray[np.bool_]:
    """Return whether controller i is above controller j, (b, c, c)."""
    rounded = values.round(_DECIMALS)
    return np.asarray(rounded[:, :, None] > rounded[:, None, :])


def ties_on_one_side(source: Values, target: Values) -> int:
    """Return the number of pairs of controllers that tie on exactly one platform.

    Args:
        source: (c,) means in simulation.
        target: (c,) means on the target.
    """
    tied = []
    for values in (source, target):
        above = _is_above(values[None])[0]
        tied.append(~(above | above.T))
    return int((tied[0] != tied[1]).sum()) // 2


class WorstPair(NamedTuple):
    """The two controllers that the platforms order differently and that are farthest apart on the target.

    Attributes:
        better: Index of the one that is better on the target.
        worse: Index of the other one.
        violation: Difference of their means on the target.
    """

    better: int
    worse: int
    violation: float


def worst_pair(source: Values, target: Values, ties: Ties = "both") -> WorstPair | None:
    """Return the pair of controllers with the largest violation; None if none is violated.

    Args:
        source: (c,) means in simulation.
        target: (c,) means on the target.
        ties: Counting of pairs that tie on one platform only.
    """
    violations = _violations(source[None], target[None], ties)[0]
    pair = np.unravel_index(int(violations.argmax()), violations.shape)
    worse, better = sorted(map(int, pair), key=lambda k: float(target[k]))
    violation = float(violations.max())
    return WorstPair(better, worse, violation) if violation > 0 else None


def mean_violation(source: Values, target: Values, ties: Ties = "both") -> float:
    """Return the mean over all pairs of controllers of the violation, which is 0 for pairs in the same order.

    Unlike the mean of maxima, it does not grow with the number of controllers.

    Args:
        source: (c,) means in simulation.
        target: (c,) means on the target.
        ties: Counting of pairs that tie on one platform only.
    """
    c = len(target)
    return float(_violations(source[None], target[None], ties).sum() / (c * (c - 1)))


def mean_violation_interval(
    source: Values, target: Values, confidence: float = CONFIDENCE, ties: Ties = "both"
) -> tuple[float, float]:
    """Return the t interval of a mean violation with the jackknife's standard error, from 0 to the range of means.

    Source: Arvesen (1969), Annals of Mathematical Statistics 40(6), 2076-2100, for means over pairs.
    """
    c = len(target)
    violations = _violations(source[None], target[None], ties)[0]
    total = float(violations.sum())
    left = (total - violations.sum(axis=0) - violations.sum(axis=1)) / ((c - 1) * (c - 2))
    reach = float(scipy.special.stdtrit(c - 1, (1 + confidence) / 2)) * _jackknife_error(left)
    value = total / (c * (c - 1))
    return max(value - reach, 0.0), min(value + reach, float(np.ptp(target)))


def rank_violation_interval(
    source: Values, target: Values, confidence: float = CONFIDENCE, ties: Ties = "both"
) -> tuple[float, float]:
    """Return the interval of a mean maximum rank violation above 0.

    It is a t interval on the logarithmic scale with the jackknife's standard error. The upper end is at most the range
    of the target's means, which no rank violation exceeds. It is of the violation expected of as many controllers with
    as many trials: the violation grows with the number of controllers and with the noise of trials.

    Args:
        source: (c,) means in simulation.
        target: (c,) means on the target.
        confidence: Probability, between 0 and 1.
        ties: Counting of pairs that tie on one platform only.

    Raises:
        ValueError: The violation is 0, which has no logarithm.
    """
    return _jackknifed(source[None], target[None], ties, confidence)


def _jackknifed(source: Values, target: Values, ties: Ties, confidence: float) -> tuple[float, float]:
    """Return the interval of the mean violation of s pairs of orders of the same controllers, each (s, c)."""
    size = max(1, _BLOCK // target.shape[1] ** 2)
    parts = []
    for first in range(0, len(target), size):
        violations = _violations(source[first : first + size], target[first : first + size], ties)
        parts.append((violations.max(axis=2).mean(axis=1), _left_out(violations)))
    means, left = (np.concatenate(part) for part in zip(*parts, strict=True))
    value = float(means.mean())
    if value == 0:
        raise ValueError("The rank violation is 0, expected one above 0.")
    error = _jackknife_error(left.mean(axis=0))
    factor = math.exp(float(scipy.special.stdtrit(target.shape[1] - 1, (1 + confidence) / 2)) * error / value)
    return value / factor, min(value * factor, float(np.ptp(target, axis=1).max()))


def _jackknife_error(left: Values) -> float:
    """Return the standard error of a number from its values with each controller left out, (c,)."""
    c = len(left)
    return math.sqrt((c - 1) / c * float(((left - left.mean()) ** 2).sum()))


def _left_out(violations: Values) -> Values:
    """Return the mean maximum rank violation (s, c, c) without each controller, (s, c)."""
    s, c, _ = violations.shape
    worst = violations.argmax(axis=2) + c * np.arange(s)[:, None]
    second, first = np.moveaxis(np.partition(violations, c - 2, axis=2)[:, :, c - 2 :], 2, 0)
    # where the worst partner is left out
    less = np.bincount(worst.ravel(), weights=(first - second).ravel(), minlength=s * c)
    return np.asarray((first.sum(axis=1, keepdims=True) - first - less.reshape(s, c)) / (c - 1))


def rank_violation_floor(target: Values, rng: Rng, splits: int = SPLITS, ties: Ties = "both") -> Values:
    """Return the violation of one random half of the target's trials by the other, (b,), which noise alone causes.

    Args:
        target: (b, c, q), q at least 2.
        rng: Draws the halves.
        splits: Number of random splits, of which the mean is taken.
        ties: Counting of pairs that tie in one half only.
    """
    return _over_splits(partial(mean_maximum_rank_violation, ties=ties), target, rng, splits)


def floor_interval(
    target: Values, rng: Rng, splits: int = SPLITS, ties: Ties = "both"
) -> tuple[float, float]:
    """Return the interval of a floor above 0, as `rank_violation_interval` does, over the same halves.

    Args:
        target: (c, q), q at least 2.
        rng: Draws the halves.
        splits: Number of random splits, of which the mean is taken.
        ties: Counting of pairs that tie in one half only.

    Raises:
        ValueError: The floor is 0, which has no logarithm.
    """
    pairs = [halves(target[None], rng) for _ in range(splits)]
    one, other = (np.concatenate(side) for side in zip(*pairs, strict=True))
    return _jackknifed(one, other, ties, CONFIDENCE)
