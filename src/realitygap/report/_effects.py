"""Effect sizes with intervals, and the number of runs required to detect an effect."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from realitygap import _special as special
from realitygap._medians import CONFIDENCE, Interval
from realitygap.gap import fewest
from realitygap.kernels.math.resampling import count_drawn
from realitygap.report._permutation import ALPHA, SEED

Values = npt.NDArray[np.float64]
Statistic = Callable[[Values, Values, Values], Values]
"""A function of values (u,) and of their counts in b samples of each side, (b, u), that returns (b,)."""

BCA_SMALLEST_N = 10
"""Fewer runs give no bootstrap interval: resamples of so few values vary too little, and it would be too short."""

RESAMPLES = 1_999
POWER = 0.8
"""Statistical power for which the required number of runs is reported."""

USUAL_EFFECTS = {"small": 0.56, "medium": 0.64, "large": 0.71}
"""A12 of what is called a small, medium and large effect (Vargha & Delaney 2000, Table 1)."""

NORMAL_MEAN_DISTANCE = math.sqrt(2 / math.pi)
"""Mean distance from the median of a normal distribution [standard deviations]."""

MOST_RUNS = 1_000_000
_BLOCK = 4_000_000


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


def bca_interval(
    statistic: Statistic,
    one: Values,
    other: Values,
    *,
    paired: bool,
) -> Interval | None:
    """The bootstrap interval of an effect, corrected for bias and skewness.

    Args:
        statistic: Statistic of two samples, given as counts over their values.
        one: (n,) and
        other: (m,) values; in pairs if `paired`, which are then resampled together.
        paired: True if value k of one belongs to value k of the other.

    Returns:
        The interval; None below 10 runs, or if all resamples are equal.

    Raises:
        ValueError: `paired` with samples of different size.

    Source: Efron (1987), Journal of the American Statistical Association 82(397); two samples as
    `scipy.stats.bootstrap`, which draws the same resamples. Differs: they are kept as counts, and what
    is equal but for rounding counts as a tie.
    """
    (interval,) = bca_intervals([statistic], one, other, paired=paired)
    return interval


def bca_intervals(
    statistics: Sequence[Statistic],
    one: Values,
    other: Values,
    *,
    paired: bool,
) -> list[Interval | None]:
    """Return BCa intervals of several effects of the same samples, which are resampled once."""
    if paired and len(one) != len(other):
        raise ValueError(f"Pairs need samples of one size, these have {len(one)} and {len(other)} values.")
    if min(len(one), len(other)) < BCA_SMALLEST_N:
        return [None] * len(statistics)
    values, codes = np.unique(np.concatenate([one, other]), return_inverse=True)
    samples = _Samples(values, codes[: len(one)], codes[len(one) :], paired)
    resampled = samples.resample(statistics, RESAMPLES)
    return [_bca(*each, samples) for each in zip(statistics, resampled, strict=True)]


def _bca(statistic: Statistic, resampled: Values, samples: _Samples) -> Interval | None:
    if not np.isfinite(resampled).all() or np.ptp(resampled) == 0:
        return None
    observed = float(statistic(samples.values, *(counts[None] for counts in samples.counts))[0])
    ties = 1e-12 * max(1.0, abs(observed))
    below = ((resampled < observed - ties).mean() + (resampled <= observed + ties).mean()) / 2
    bias = special.ndtri(below)
    skewness = samples.acceleration(statistic)
    tails = np.array([(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    shifted = bias + special.ndtri(tails)
    bounds = np.quantile(resampled, special.ndtr(bias + shifted / (1 - skewness * shifted)))
    if not np.isfinite(bounds).all():
        return None
    return Interval(float(bounds[0]), float(bounds[1]), "BCa")


def mean_interval(values: Values) -> Interval | None:
    """Return the BCa interval of a mean; None below 10 values or if all are equal."""
    return bca_interval(_first_mean, values, values, paired=True)


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


def newcombe_interval(share: float, n: int, m: int) -> Interval:
    """Return an interval of A12 for few runs, without resampling. It has a width even if all runs are above.

    Args:
        share: A12 as observed [0..1].
        n: Number of runs of one condition.
        m: Number of runs of the other.

    Source: Newcombe (2006), Statistics in Medicine 25(4), 559-573, method 5.
    """
    z = special.ndtri((1 + CONFIDENCE) / 2)
    others = (n + m) / 2 - 1

    def excess(at: float) -> float:
        variance = at * (1 - at) * (1 + others * ((1 - at) / (2 - at) + at / (1 + at))) / (n * m)
        return float((at - share) ** 2 - z * z * variance)

    # at 0 and 1 the share itself is a root too, which is not the one that is meant
    low = 0.0 if share <= 0 else _root(excess, 0.0, min(share, 1 - 1e-9))
    high = 1.0 if share >= 1 else _root(excess, max(share, 1e-9), 1.0)
    return Interval(float(low), float(high), "Newcombe")


def runs_needed(effect: float, *, paired: bool, alpha: float = ALPHA) -> int | None:
    """Runs a condition with which a t test finds a difference of `effect` standard deviations so often.

    Args:
        effect: Difference of means over the standard deviation of a run (`paired`: of a difference).
        paired: True if runs come in pairs.
        alpha: Two-sided level.

    Returns:
        The number, at least 2; None above a million.

    Source: Cohen (1988), chapter 2, by the noncentral t distribution. It assumes normal values; the
    permutation tests here need about as many.
    """
    return fewest(lambda n: _power(effect, n, paired, alpha), POWER, most=MOST_RUNS)


@functools.lru_cache
def detectable_effect(n: int, *, paired: bool, alpha: float = ALPHA) -> float | None:
    """The smallest difference [standard deviations] that n runs a condition find so often; None below 2.

    Source: as `runs_needed`.
    """
    if n < 2:
        return None
    high = 1.0
    while _power(high, n, paired, alpha) < POWER:
        high *= 2
    return _root(lambda effect: _power(effect, n, paired, alpha) - POWER, 0.0, high)


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    """Return the point between two bounds at which a function changes its sign, by bisection, to about the last bit."""
    sign = function(low) > 0
    while low < (middle := (low + high) / 2) < high:
        if (function(middle) > 0) == sign:
            low = middle
        else:
            high = middle
    return middle


def _power(effect: float, n: int, paired: bool, alpha: float) -> float:
    freedom = n - 1 if paired else 2 * n - 2
    center = abs(effect) * math.sqrt(n if paired else n / 2)
    critical = float(special.stdtrit(freedom, 1 - alpha / 2))
    found = 1.0 - float(special.nctdtr(freedom, center, critical))
    if not math.isfinite(found):
        # so far out the noncentral distribution cannot be computed, and a normal one will do
        found = float(special.ndtr(center - critical))
    # a difference found with the wrong sign; beyond 3 it is less than one in 10 million
    wrong = float(special.nctdtr(freedom, center, -critical)) if center < 3 else 0.0
    return found + (wrong if math.isfinite(wrong) else 0.0)


def effect_of_a12(share: float) -> float:
    """The difference of means [standard deviations] of two normal conditions with this A12."""
    return float(math.sqrt(2) * special.ndtri(share))


def a12_of_effect(effect: float) -> float:
    """Return A12 of two normal conditions whose means differ by `effect` standard deviations."""
    return float(special.ndtr(effect / math.sqrt(2)))
