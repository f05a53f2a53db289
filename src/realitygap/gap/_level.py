"""The size of the difference in quality: mean, root mean square without noise with its interval, and A12."""

from __future__ import annotations

import math

import numpy as np
import scipy

from realitygap.stats import CONFIDENCE, Ends, percentile_interval, range_of_differences, t_interval

from ._side import GapSide, Values, trial_means, trial_noise

LEAST_RATIO = 1.5
"""Minimum of the mean square in standard errors for the upper end, because a logarithm has no scale near 0."""


def mean_difference(source: Values, target: Values) -> Values:
    """Return the mean over controllers of the difference of means, target minus source, (b,).

    Args:
        source: (b, c, r) and
        target: (b, c, q) quality of each trial of b samples.
    """
    return np.asarray((trial_means(target) - trial_means(source)).mean(axis=1))


def square_differences(source: Values, target: Values, *, paired: bool = False) -> Values:
    """Return unbiased estimates of the square of each controller's true difference, (b, c), which may be negative.

    The square of a difference of means is too large by the variance of both means, which is taken out:
    d² - s²/r - t²/q. A controller without a gap gives 0 on average.

    Args:
        source: (b, c, r) and
        target: (b, c, q), r and q at least 2.
        paired: True if trial k of both sides had the same conditions, r = q. The noise is then that of the differences
            of pairs, which shared conditions do not add to.

    Raises:
        ValueError: Some side has one trial a controller, which says nothing of noise.
    """
    if min(source.shape[2], target.shape[2]) < 2:
        raise ValueError("The noise of trials needs at least 2 of each controller on both sides.")
    difference = trial_means(target) - trial_means(source)
    noise = trial_noise(target - source) if paired else trial_noise(source) + trial_noise(target)
    return np.asarray(difference**2 - noise)


def difference_ends(source: GapSide, target: GapSide, *, paired: bool = False) -> tuple[Values, Values]:
    """Return both ends of the interval of each controller's difference, (c,); the difference itself for single trials.

    No end leaves the range of differences. For pairs, it is the interval by t of their differences.

    Args:
        source, target: Trials of the same controllers.
        paired: True if trial k of a controller had the same conditions on both sides.

    Source: Zou & Donner (2008), Statistics in Medicine 27(10), 1693-1702, for independent trials.
    """
    differences = target.means - source.means
    if paired and source.values.shape[1] > 1:
        errors = np.sqrt(trial_noise(target.values - source.values))
        within = range_of_differences(source.score_range)
        return t_interval(differences, errors, np.maximum(source.counts - 1, 1), within)
    (low, high), (low_there, high_there) = source.intervals(), target.intervals()
    lower = differences - np.hypot(target.means - low_there, high - source.means)
    return lower, differences + np.hypot(high_there - target.means, source.means - low)


def rms_of(squares: Values) -> Values:
    """Return the root of a mean square; 0 for a negative one, which an unbiased estimate may be."""
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))


def shares_above(source: Values, target: Values) -> Values:
    """Return the probability that a trial on the target is above one in simulation, (c,); ties count half.

    Args:
        source: (c, r) and
        target: (c, q).

    Source: A12 of Vargha & Delaney (2000), Journal of Educational and Behavioral Statistics 25(2), 101-132, within
    each controller.
    """
    if np.isnan(source[:, -1]).any() or np.isnan(target[:, -1]).any():
        pairs = zip(source, target, strict=True)
        return np.array([float(shares_above(_given(s), _given(t))[0]) for s, t in pairs])
    one, other = target[:, :, None], source[:, None, :]
    return np.asarray(((one > other).mean(axis=(1, 2)) + (one >= other).mean(axis=(1, 2))) / 2)


def _given(row: Values) -> Values:
    """Return the trials of one controller without nan, (1, r)."""
    return row[~np.isnan(row)][None]


def rms_interval(
    differences: Values,
    squares: Values,
    resampled: Values,
    *,
    more_variance: float = 0.0,
    most: float = math.inf,
    confidence: float = CONFIDENCE,
) -> Ends | None:
    """Return the interval of the RMS gap; none below 5 controllers.

    It has the roots of the ends of `skewed_interval` for the mean square, with the standard error of the squares or, if
    that is larger, the one that normal differences would have: a sample without large squares shows too small a
    standard error. `benchmarks/gap_intervals.py` measures how often the ends miss.

    Args:
        differences: (c,) difference of the two means of each controller.
        squares: (c,) unbiased squares of the true differences (`square_differences`).
        resampled: (b,) mean of the squares of resampled controllers.
        more_variance: Variance of the mean square that controllers do not show, such as that of a fit's draws.
        most: Largest difference that there can be. The upper end is at most this, because the RMS gap is.
        confidence: Probability, between 0 and 1.

    Returns:
        Both ends, from 0 to `most`.
    """
    variance = max(float(squares.var(ddof=1)), _variance_if_normal(differences)) if len(squares) > 1 else 0.0
    error = math.sqrt(variance / len(squares) + more_variance)
    ends = skewed_interval(float(squares.mean()), error, resampled, len(squares), confidence)
    if ends is None:
        return None
    return math.sqrt(max(ends[0], 0.0)), min(math.sqrt(ends[1]), most)


def skewed_interval(
    mean: float, error: float, resampled: Values, n: int, confidence: float = CONFIDENCE
) -> Ends | None:
    """Return the interval of the mean of n independent values with a long tail to the right; none below 5.

    The lower end is the percentile of resamples (`percentile_interval`). Their upper percentile is too low, so the
    upper end is a t interval on the logarithmic scale.

    Args:
        mean: The mean, 0 or more in truth; an unbiased estimate may be below.
        error: Its standard error.
        resampled: (b,) means of resampled values.
        n: Number of values.
        confidence: Probability, between 0 and 1.
    """
    percentiles = percentile_interval(resampled, n, confidence)
    if percentiles is None:
        return None
    reach = float(scipy.special.stdtrit(n - 1, (1 + confidence) / 2))
    scale = max(mean, LEAST_RATIO * error)
    above = 0.0 if scale == 0 else scale * math.expm1(reach * error / scale)
    return percentiles[0], max(mean, 0.0) + above


def _variance_if_normal(differences: Values) -> float:
    """Return the variance of the square of a normal number with the mean and the variance of these."""
    variance = float(differences.var(ddof=1))
    return 4 * float(differences.mean()) ** 2 * variance + 2 * variance**2
