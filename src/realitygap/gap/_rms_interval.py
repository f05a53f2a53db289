"""The interval of the RMS gap, from one unbiased square a controller."""

from __future__ import annotations

import math

from realitygap import _special as special

from ._bootstrap import interval
from ._estimate import CONFIDENCE
from ._side import Values

LEAST_RATIO = 1.5
"""Minimum of the mean square in standard errors for the upper end, because a logarithm has no scale near 0."""


def rms_interval(
    differences: Values,
    squares: Values,
    resampled: Values,
    *,
    more_variance: float = 0.0,
    most: float = math.inf,
    confidence: float = CONFIDENCE,
) -> tuple[float, float] | tuple[None, None]:
    """Return the interval of the RMS gap; none below 5 controllers.

    The mean square is a mean of c independent values with a long tail to the right. Its lower end is the percentile of
    resamples (`interval`). Their upper percentile is too low. So the upper end is a t interval on the logarithmic
    scale, with the standard error of the squares or, if that is larger, the one that normal differences would have: a
    sample without large squares shows too small a standard error. `benchmarks/gap_intervals.py` measures how often the
    ends miss.

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
    c = len(squares)
    low, _ = interval(resampled, c, confidence)
    if low is None:
        return None, None
    errors = [
        math.sqrt(variance / c + more_variance)
        for variance in (float(squares.var(ddof=1)), _variance_if_normal(differences))
    ]
    reach = float(special.stdtrit(c - 1, (1 + confidence) / 2))
    high = math.sqrt(_upper_end(float(squares.mean()), max(errors), reach))
    return math.sqrt(max(low, 0.0)), min(high, most)


def _variance_if_normal(differences: Values) -> float:
    """Return the variance of the square of a normal number with the mean and the variance of these."""
    variance = float(differences.var(ddof=1))
    return 4 * float(differences.mean()) ** 2 * variance + 2 * variance**2


def _upper_end(mean: float, error: float, reach: float) -> float:
    scale = max(mean, LEAST_RATIO * error)
    if scale == 0:
        return 0.0
    return max(mean, 0.0) + scale * math.expm1(reach * error / scale)
