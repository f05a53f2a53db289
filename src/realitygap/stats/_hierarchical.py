"""Values that scatter about a mean, each with its noise: a hierarchical model with two levels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import ArrayLike

from ._estimate import CONFIDENCE, Estimate, Values
from ._means import UNBOUNDED, Range

SMALLEST_GROUPS = 5
"""Fewer values have no model: the scatter of so few is known too badly."""

_CLOSE = 1e-12


@dataclass(frozen=True)
class RandomEffects:
    """The fitted model: value k is normal about a true value with its own variance, and true values about the mean.

    Attributes:
        mean: Mean of the true values.
        spread: Standard deviation of the true values.
        each: Each true value, drawn toward the mean by as much as its noise is larger than the spread.
    """

    mean: Estimate
    spread: Estimate
    each: tuple[Estimate, ...]


def random_effects(
    values: ArrayLike, variances: ArrayLike, within: Range = UNBOUNDED, *, noun: str = "values"
) -> RandomEffects | Estimate:
    """Fit a hierarchical model to values whose noise is known.

    Args:
        values: (n,) observed values, such as the gap of each controller.
        variances: (n,) variance of the noise of each, above 0.
        within: Range of the values. Intervals end within it.
        noun: Plural name of the values, for the reason why there is no model.

    Returns:
        The model, with intervals of 95 %; a refusal if there are fewer than `SMALLEST_GROUPS` values, or one without
        noise.

    Source: the spread by restricted maximum likelihood, and its interval by the profile of the generalized Q
    (Viechtbauer 2005, Journal of Educational and Behavioral Statistics 30; 2007, Statistics in Medicine 26); the mean
    by Hartung & Knapp (2001), Statistics in Medicine 20, whose standard error here is at least that of the model
    (Röver, Knapp & Friede 2015); each value and its interval by Morris (1983), Journal of the American Statistical
    Association 78(381), section 1. Differs: variances of true values are weighed as the mean is.
    """
    seen, noise = np.asarray(values, float), np.asarray(variances, float)
    n = len(seen)
    if n < SMALLEST_GROUPS:
        return Estimate.refusal(
            n, f"{n} {noun} are too few for a model; at least {SMALLEST_GROUPS} are needed."
        )
    if not (noise > 0).all():
        return Estimate.refusal(n, "A value has no noise, so noise and spread cannot be separated.")
    square = _restricted_maximum(seen, noise)
    mean, error = _mean(seen, noise, square)
    reach = float(scipy.special.stdtrit(n - 1, (1 + CONFIDENCE) / 2)) * error
    low, high = np.clip([mean - reach, mean + reach], *within)
    least, most = (np.sqrt(_profile(seen, noise, (1 + side * CONFIDENCE) / 2)) for side in (1, -1))
    spread = Estimate(float(np.sqrt(square)), float(least), float(most), n, method="profile")
    return RandomEffects(
        Estimate(mean, float(low), float(high), n, method="t"),
        spread,
        _drawn_in(seen, noise, square, mean, within),
    )


def _weighted_mean(seen: Values, noise: Values, square: float) -> tuple[float, Values]:
    weights = 1 / (noise + square)
    return float(weights @ seen / weights.sum()), weights


def _mean(seen: Values, noise: Values, square: float) -> tuple[float, float]:
    """Return the mean of the true values, and its standard error."""
    mean, weights = _weighted_mean(seen, noise, square)
    misfit = float(weights @ (seen - mean) ** 2) / (len(seen) - 1)
    return mean, float(np.sqrt(max(misfit, 1.0) / weights.sum()))


def _restricted_maximum(seen: Values, noise: Values) -> float:
    """Return the variance of the true values of greatest restricted likelihood."""

    def slope(square: float) -> float:
        mean, weights = _weighted_mean(seen, noise, square)
        trace = weights.sum() - (weights**2).sum() / weights.sum()
        return float((weights**2) @ (seen - mean) ** 2 - trace)

    return _root(slope, float(seen.var(ddof=1) + noise.max()))


def _profile(seen: Values, noise: Values, quantile: float) -> float:
    """Return the variance at which the generalized Q is a quantile of its chi-squared distribution; at least 0."""
    wanted = float(scipy.special.chdtri(len(seen) - 1, 1 - quantile))

    def above(square: float) -> float:
        mean, weights = _weighted_mean(seen, noise, square)
        return float(weights @ (seen - mean) ** 2) - wanted

    return _root(above, float(seen.var(ddof=1) + noise.max()))


def _root(of: Callable[[float], float], most: float) -> float:
    """Return where a function falls below 0; 0 if it begins there. The search doubles `most` as often as needed."""
    if of(0.0) <= 0:
        return 0.0
    while of(most) > 0:
        most *= 2
    return float(scipy.optimize.brentq(of, 0.0, most, xtol=most * _CLOSE))


def _drawn_in(seen: Values, noise: Values, square: float, mean: float, within: Range) -> tuple[Estimate, ...]:
    """Return each true value with an interval that contains the uncertainty of mean and spread."""
    n = len(seen)
    shares = (n - 3) / (n - 1) * noise / (noise + square)
    _, weights = _weighted_mean(seen, noise, square)
    total = weights.sum()
    typical = float(weights @ (noise + square) / total)
    of_share = 2 / (n - 3) * shares**2 * typical / (noise + square) * (seen - mean) ** 2
    errors = np.sqrt(noise * (1 - (1 - weights / total) * shares) + of_share)
    centers = (1 - shares) * seen + shares * mean
    reach = float(scipy.special.ndtri((1 + CONFIDENCE) / 2)) * errors
    ends = np.clip([centers - reach, centers + reach], *within)
    found = Estimate(None, None, None, n, method="empirical Bayes")
    return tuple(
        replace(found, value=float(np.clip(center, *within)), low=float(low), high=float(high))
        for center, low, high in zip(centers, *ends, strict=True)
    )
