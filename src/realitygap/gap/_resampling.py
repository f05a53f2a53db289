"""Controllers and trials resampled hierarchically, with as much noise as the trials have and no more."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from realitygap.stats import SMALLEST_N, Ends, Estimate, Method

from ._side import GapSide, Values, trial_noise

Statistic = Callable[[Values, Values], Values]
"""A function of trials in simulation (b, c, r) and on the target (b, c, q) that returns a number for each sample,
(b,)."""

_BLOCK = 4_000_000
"""Values of trials that are held at a time."""


def resampled(
    source: GapSide,
    target: GapSide,
    n_resamples: int,
    rng: np.random.Generator,
    *,
    smooth: bool = False,
    paired: bool = False,
) -> Iterator[tuple[Values, Values]]:
    """Yield resamples in blocks: (b, c, r) of the source and (b, c, q) of the target.

    Controllers are resampled with both their means together, and then the trials of each, by residuals. Means of few
    trials spread more than the true means, and resampled trials would add that noise a second time. So means are first
    shrunk towards the common mean until they have the covariance of controllers without noise. Residuals are lengthened
    by sqrt(r / (r - 1)).

    Args:
        source: The simulator's trials.
        target: The target's.
        n_resamples: Number of resamples.
        rng: Draws them.
        smooth: True to move means that were drawn twice slightly apart, with their covariance. Statistics of ranks
            need this, because a controller drawn twice makes ties that no new sample has.
        paired: True if trial k of a controller had the same conditions on both sides. Pairs are then resampled
            together, and means are shrunk by the covariance of their noise.

    Source: Davison & Hinkley (1997), Bootstrap Methods and their Application, section 3.8, for two levels and the
    need to shrink. Differs: the two sides are shrunk together, by the linear map that gives their covariance the
    noise's diagonal less. Smoothing: Silverman & Young (1987), Biometrika 74(3), 469-479.
    """
    latent = shrunk_means(source, target, paired=paired)
    residuals = [(_residuals(side), side.n_trials) for side in (source, target)]
    n, size = source.n, source.values.size + target.values.size
    block = max(1, _BLOCK // size)
    for first in range(0, n_resamples, block):
        b = min(block, n_resamples - first)
        who = rng.integers(0, n, (b, n))
        means = _smoothed(latent[who], latent, rng) if smooth else latent[who]
        which = [_which(side, who, rng) for side in ((source,) if paired else (source, target))]
        drawn = [
            _drawn(residual, counts, who, which[min(k, len(which) - 1)])
            for k, (residual, counts) in enumerate(residuals)
        ]
        yield means[:, :, :1] + drawn[0], means[:, :, 1:] + drawn[1]


def _smoothed(means: Values, latent: Values, rng: np.random.Generator) -> Values:
    """Return means moved by normal numbers, and drawn towards the center so that their covariance stays, (b, c, 2)."""
    width = len(latent) ** (-1 / 6)  # of the normal reference for two dimensions
    root = _power(np.cov(latent.T), 0.5)
    center = latent.mean(axis=0)
    moved = means - center + width * rng.normal(size=means.shape) @ root
    return np.asarray(center + moved / math.sqrt(1 + width**2))


def shrunk_means(source: GapSide, target: GapSide, *, paired: bool = False) -> Values:
    """Return means of controllers on both sides with the covariance that they would have without noise, (c, 2)."""
    means = np.stack([source.means, target.means], axis=1)
    if source.n < 2:
        return means
    center = means.mean(axis=0)
    seen = np.cov(means.T)
    noise = np.diag([source.noise.mean(), target.noise.mean()])
    if paired and source.values.shape[1] > 1:
        shared = (source.noise + target.noise - trial_noise(target.values - source.values)) / 2
        noise += shared.mean() * (1 - np.eye(2))
    wanted = seen - noise
    return np.asarray(center + (means - center) @ _map_between(seen, wanted))


def _map_between(seen: Values, wanted: Values) -> Values:
    """Return the symmetric map that turns one covariance into the other, without its negative part, (2, 2)."""
    root = _power(seen, 0.5)
    inverse = _power(seen, -0.5)
    return inverse @ _power(root @ _power(wanted, 1.0) @ root, 0.5) @ inverse


def _power(matrix: Values, exponent: float) -> Values:
    """Return a power of the part of a symmetric matrix above 0."""
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    is_positive = values > 1e-12 * max(float(values.max()), 1e-300)
    powers = np.where(is_positive, np.where(is_positive, values, 1.0) ** exponent, 0.0)
    return np.asarray((vectors * powers) @ vectors.T)


def _residuals(side: GapSide) -> Values:
    """Return the deviations of trials from their controller's mean, with the trials' variance, (c, r); 0 for one."""
    if side.values.shape[1] < 2:
        return np.zeros_like(side.values)
    deviations = side.values - side.means[:, None]
    if side.n_trials:
        return deviations * np.sqrt(side.counts / np.maximum(side.counts - 1, 1))[:, None]
    return deviations * math.sqrt(side.trials / (side.trials - 1))


def _which(side: GapSide, who: NDArray[np.int64], rng: np.random.Generator) -> NDArray[np.int64]:
    """Return the trials drawn for each controller, (b, c, r)."""
    r = side.values.shape[1]
    most = side.counts[who][:, :, None] if side.n_trials else r
    return rng.integers(0, most, (*who.shape, r))


def _drawn(
    residuals: Values, counts: tuple[int, ...], who: NDArray[np.int64], which: NDArray[np.int64]
) -> Values:
    """Return residuals drawn for each controller, (b, c, r); as many as it has trials, and nan after them."""
    drawn = residuals[who[:, :, None], which]
    if not counts:
        return drawn
    return np.where(np.arange(residuals.shape[1]) < np.array(counts)[who][:, :, None], drawn, np.nan)


_NO_ORDER_LEFT = (
    "Noise leaves no order in most resamples, so there is no interval. Drive more trials of each controller."
)


def over_controllers(value: float, ends: Ends | None, n: int, method: Method = "percentiles") -> Estimate:
    """Return a number over n controllers with the ends of its interval, or why it has none."""
    if ends is None and n < SMALLEST_N:
        return Estimate.of_few(value, n, SMALLEST_N, "controllers")
    if ends is None:
        return Estimate(value, None, None, n, _NO_ORDER_LEFT)
    # a statistic of ranks lies lower in resamples than in the sample; no interval leaves its estimate out
    return Estimate(value, min(ends[0], value), max(ends[1], value), n, method=method)


def bootstrap(
    statistics: Mapping[str, Statistic],
    source: GapSide,
    target: GapSide,
    n_resamples: int,
    rng: np.random.Generator,
    *,
    smooth: bool = False,
    paired: bool = False,
) -> dict[str, Values]:
    """Return each statistic of the same resamples, (b,); arguments as in `resampled`."""
    found: dict[str, list[Values]] = {name: [] for name in statistics}
    for one, other in resampled(source, target, n_resamples, rng, smooth=smooth, paired=paired):
        for name, statistic in statistics.items():
            found[name].append(statistic(one, other))
    return {name: np.concatenate(parts) for name, parts in found.items()}
