"""Bootstraps: intervals from resampled values."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import scipy

from ._estimate import CONFIDENCE, Ends, Estimate, Values
from ._means import SMALLEST_N
from ._permutation import SEED

Statistic = Callable[[Values, Values, Values], Values]
"""A function of values (u,) and of their counts in b samples of each side, (b, u), that returns (b,)."""

BCA_SMALLEST_N = 10
"""Fewer runs give no bootstrap interval: resamples of so few values vary too little, and it would be too short."""

RESAMPLES = 1_999
"""Number of resamples behind a BCa interval."""

NORMAL_MEAN_DISTANCE = math.sqrt(2 / math.pi)
"""Mean distance from the median of a normal distribution [standard deviations]."""

_BLOCK = 4_000_000


def resampled_means(values: Values, n_resamples: int, rng: np.random.Generator) -> Values:
    """Return the means of resamples, (b,), for independent values (n,)."""
    return np.asarray(values[rng.integers(0, len(values), (n_resamples, len(values)))].mean(axis=1))


def percentile_interval(resamples: Values, n: int, level: float = CONFIDENCE) -> Ends | None:
    """Return the percentiles of resamples, expanded for few values; None below 5.

    Args:
        resamples: (b,) a statistic of resamples; nan is left out.
        n: Independent values behind the statistic.
        level: Probability, between 0 and 1.

    Source: Hesterberg (2015), The American Statistician 69(4), 371-386: percentiles are too narrow as if t were
    normal and n were n - 1, and are taken farther out by as much.
    """
    finite = resamples[np.isfinite(resamples)]
    if n < SMALLEST_N or len(finite) < len(resamples) / 2:
        return None
    reach = math.sqrt(n / (n - 1)) * float(scipy.special.stdtrit(n - 1, (1 + level) / 2))
    tail = float(scipy.special.ndtr(-reach))
    low, high = np.quantile(finite, [tail, 1 - tail])
    return float(low), float(high)


# with bias and acceleration corrected


def difference_of_means(values: Values, one: Values, other: Values) -> Values:
    """Return the mean of one minus the mean of the other, (b,)."""
    return np.asarray(one @ values / one.sum(axis=1) - other @ values / other.sum(axis=1))


def share_above(values: Values, one: Values, other: Values) -> Values:
    """Return A12 of samples given as counts over values in ascending order, (b,)."""
    up_to = np.cumsum(other, axis=1) - other / 2
    return np.asarray((one * up_to).sum(axis=1) / (one.sum(axis=1) * other.sum(axis=1)))


def ratio_of_spreads(values: Values, one: Values, other: Values) -> Values:
    """Return the standard deviation of one divided by that of the other, (b,); NaN if the other's is 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = _deviations(values, one) / _deviations(values, other)
    return np.where(np.isfinite(ratio), ratio, np.nan)


def robust_spread(values: Values) -> float:
    """Mean distance from the median, in standard deviations of a normal distribution with as much.

    Source: the scale of Brown & Forsythe (1974), Journal of the American Statistical Association 69(346).
    """
    return float(np.abs(values - np.median(values)).mean()) / NORMAL_MEAN_DISTANCE


def ratio_of_robust_spreads(values: Values, one: Values, other: Values) -> Values:
    """Return the robust spread of one divided by that of the other, (b,); NaN if the other's is 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = _distances(values, one) / _distances(values, other)
    return np.where(np.isfinite(ratio), ratio, np.nan)


def _distances(values: Values, counts: Values) -> Values:
    """Return the mean distance from the median, (b,); any point between two middle values gives the same."""
    n = counts.sum(axis=1)
    median = values[(np.cumsum(counts, axis=1) >= n[:, None] / 2).argmax(axis=1)]
    return np.asarray((counts * np.abs(values - median[:, None])).sum(axis=1) / n)


def _deviations(values: Values, counts: Values) -> Values:
    n = counts.sum(axis=1)
    mean = counts @ values / n
    squares = counts @ (values * values) - n * mean * mean
    # what rounding leaves of a sample without spread
    squares = np.where(squares > 1e-12 * n, squares, 0.0)
    return np.asarray(np.sqrt(squares / np.maximum(n - 1, 1)))


def bca_interval(statistic: Statistic, one: Values, other: Values, *, paired: bool) -> Estimate:
    """Return an effect with its bootstrap interval, corrected for bias and skewness.

    Args:
        statistic: Statistic of two samples, given as counts over their values.
        one: (n,) and
        other: (m,) values; in pairs if `paired`, which are then resampled together.
        paired: True if value k of one belongs to value k of the other.

    Returns:
        The effect; without an interval below 10 runs, or if all resamples are equal.

    Raises:
        ValueError: `paired` with samples of different size.

    Source: Efron (1987), Journal of the American Statistical Association 82(397); two samples as
    `scipy.stats.bootstrap`, which draws the same resamples. Differs: they are kept as counts, and what
    is equal but for rounding counts as a tie.
    """
    (estimate,) = bca_intervals([statistic], one, other, paired=paired)
    return estimate


def bca_intervals(
    statistics: Sequence[Statistic], one: Values, other: Values, *, paired: bool
) -> list[Estimate]:
    """Return several effects of the same samples, which are resampled once, with their BCa intervals."""
    if paired and len(one) != len(other):
        raise ValueError(f"Pairs need samples of one size, these have {len(one)} and {len(other)} values.")
    n = min(len(one), len(other))
    if n == 0:
        return [Estimate.refusal(0, "There are no runs.") for _ in statistics]
    values, codes = np.unique(np.concatenate([one, other]), return_inverse=True)
    samples = _Samples(values, codes[: len(one)], codes[len(one) :], paired)
    observed = [float(statistic(values, *(c[None] for c in samples.counts))[0]) for statistic in statistics]
    if n < BCA_SMALLEST_N:
        return [_with_value(Estimate.of_few(value, n, BCA_SMALLEST_N, "runs")) for value in observed]
    resampled = samples.resample(statistics, RESAMPLES)
    return [_with_value(_bca(*parts, samples)) for parts in zip(statistics, observed, resampled, strict=True)]


def _with_value(estimate: Estimate) -> Estimate:
    """Return the estimate; without a number if that is not finite, such as a ratio to a spread of 0."""
    is_number = estimate.value is not None and math.isfinite(estimate.value)
    return estimate if is_number else replace(estimate, value=None)


def _bca(statistic: Statistic, observed: float, resampled: Values, samples: _Samples) -> Estimate:
    n = min(len(samples.one), len(samples.other))
    alike = Estimate(observed, None, None, n, "All resamples are alike, so there is no interval.")
    if not np.isfinite(resampled).all() or np.ptp(resampled) == 0:
        return alike
    ties = 1e-12 * max(1.0, abs(observed))
    below = ((resampled < observed - ties).mean() + (resampled <= observed + ties).mean()) / 2
    bias = scipy.special.ndtri(below)
    skewness = samples.acceleration(statistic)
    tails = np.array([(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    shifted = bias + scipy.special.ndtri(tails)
    bounds = np.quantile(resampled, scipy.special.ndtr(bias + shifted / (1 - skewness * shifted)))
    if not np.isfinite(bounds).all():
        return alike
    return Estimate(observed, float(bounds[0]), float(bounds[1]), n, method="BCa")


def bca_mean(values: Values) -> Estimate:
    """Return the mean of (n,) values with its BCa interval; without one below 10 values or if all are equal."""
    estimate = bca_interval(_first_mean, values, values, paired=True)
    return replace(estimate, value=float(values.mean()))


def _first_mean(values: Values, one: Values, _: Values) -> Values:
    return np.asarray(one @ values / one.sum(axis=1))


@dataclass(frozen=True)
class _Samples:
    """Two samples as places in their common values.

    Attributes:
        values: (u,) values in ascending order.
        one: (n,) the place of each of the first sample's values, and
        other: (m,) indices of the second sample's values.
        paired: True if they are drawn together.
    """

    values: Values
    one: npt.NDArray[np.int64]
    other: npt.NDArray[np.int64]
    paired: bool

    @property
    def counts(self) -> tuple[Values, Values]:
        """Return the counts of each value in one sample, and in the other, (u,)."""
        one, other = (np.bincount(part, minlength=len(self.values)) for part in (self.one, self.other))
        return one.astype(float), other.astype(float)

    def resample(self, statistics: Sequence[Statistic], n_resamples: int) -> list[Values]:
        """Return each statistic of the resamples, (b,)."""
        most = max(len(self.one), len(self.other), len(self.values))
        block = max(1, _BLOCK // most)
        draw = _draw_once if n_resamples <= block else _draw
        found: list[list[Values]] = [[] for _ in statistics]
        for rows, others in draw(len(self.one), None if self.paired else len(self.other), n_resamples, block):
            counts = (
                _counts(rows, self.one, len(self.values)),
                _counts(others, self.other, len(self.values)),
            )
            for parts, statistic in zip(found, statistics, strict=True):
                parts.append(statistic(self.values, *counts))
        return [np.concatenate(parts) for parts in found]

    def acceleration(self, statistic: Statistic) -> float:
        """Efron's acceleration, from leaving out one value (or pair) at a time."""
        one, other, counts = self.one, self.other, self.counts
        drops_one, drops_other = (each - np.eye(len(self.values)) for each in counts)
        if self.paired:
            pairs, inverse = np.unique(np.stack([one, other]), axis=1, return_inverse=True)
            left_out = statistic(self.values, drops_one[pairs[0]], drops_other[pairs[1]])[inverse.ravel()]
            influences = [(len(one) - 1) * (left_out.mean() - left_out)]
        else:
            first = statistic(self.values, drops_one[one], np.repeat(counts[1][None], len(one), 0))
            second = statistic(self.values, np.repeat(counts[0][None], len(other), 0), drops_other[other])
            influences = [(len(part) - 1) * (part.mean() - part) for part in (first, second)]
        cubes = sum(float((part**3).sum()) / len(part) ** 3 for part in influences)
        squares = sum(float((part**2).sum()) / len(part) ** 2 for part in influences)
        return cubes / (6 * squares**1.5) if squares > 0 else 0.0


def _counts(draws: npt.NDArray[np.int64], places: npt.NDArray[np.int64], n_values: int) -> Values:
    """Return the counts of each value in each draw (b, n) from a sample of places (m,), (b, u)."""
    from realitygap.kernels.math.resampling import (
        count_drawn,  # Numba loads slowly, and medians need none of it
    )

    counts = np.zeros((len(draws), n_values))
    count_drawn(draws, places, counts)
    return counts


_Draws = tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]


def _draw(n: int, m: int | None, n_resamples: int, block: int) -> Iterator[_Draws]:
    """Yield indices of n values in each resample, (b, n), and of m others, in blocks; m None: the same."""
    rng = np.random.default_rng(SEED)
    for first in range(0, n_resamples, block):
        b = min(block, n_resamples - first)
        rows = rng.integers(0, n, (b, n))
        yield rows, rows if m is None else rng.integers(0, m, (b, m))


@functools.lru_cache(maxsize=2)
def _draw_once(n: int, m: int | None, n_resamples: int, block: int) -> list[_Draws]:
    """Return the indices of `_draw`, cached for the next samples of these sizes."""
    return list(_draw(n, m, n_resamples, block))
