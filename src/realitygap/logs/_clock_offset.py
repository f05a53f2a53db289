"""Correlations of signals, and the time by which the poses of a robot follow its commands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from realitygap._wording import fixed

from ._source import Floats

LONGEST_S = 3.0
"""Longest offset to detect."""
N_BLOCKS = 16
N_DRAWS = 400
INTERVAL = (0.05, 0.95)
FEWEST_STEPS = 40
LEAST_SCORE = 0.15
"""Squared correlation below which no offset is reported."""


@dataclass(frozen=True)
class ClockOffset:
    """The time by which one signal follows another.

    Attributes:
        seconds: Positive if the second signal is later [s].
        low: Lower end of its 90 % interval [s].
        high: Upper end [s].
        correlation: Correlation at this offset: the root of the mean squared correlation of the signals.
    """

    seconds: float
    low: float
    high: float
    correlation: float

    def __str__(self) -> str:
        """Return the offset with its interval."""
        at, low, high = (round(value, 2) + 0.0 for value in (self.seconds, self.low, self.high))
        return f"{fixed(at, 2)} s ({fixed(low, 2)} to {fixed(high, 2)})"


def clock_offset(leading: Floats, following: Floats, step_s: float, *, seed: int = 0) -> ClockOffset | None:
    """Return the time by which one set of signals follows another; None if they do not show it.

    The sign of a correlation does not count: wheels may be swapped.

    Args:
        leading: (n, k) signals, such as speed and turn rate by the wheels.
        following: (n, k) the same signals, from the poses; nan if unknown.
        step_s: Time between two rows [s].
        seed: Seed of the draws.

    Source: peak of the cross-correlation, with a parabola through its neighbors; interval by a bootstrap of blocks
        of time (Künsch 1989).
    """
    n = len(leading)
    most = min(round(LONGEST_S / step_s), n // 4)
    if n < FEWEST_STEPS or most < 2:
        return None
    lags = np.arange(-most, most + 1)
    sums = np.stack([_block_sums(leading, following, int(lag)) for lag in lags])  # lag, block, signal, moment
    score = _score(sums.sum(1))
    if not np.isfinite(score).any() or np.nanmax(score) < LEAST_SCORE:
        return None
    best = _peak(lags, score)
    rng = np.random.default_rng(seed)
    weights = rng.multinomial(N_BLOCKS, np.full(N_BLOCKS, 1 / N_BLOCKS), N_DRAWS)
    drawn = [_peak(lags, _score(np.einsum("lbsm,b->lsm", sums, weight))) for weight in weights]
    low, high = np.nanquantile(drawn, INTERVAL)
    return ClockOffset(
        best * step_s, float(low) * step_s, float(high) * step_s, float(np.sqrt(np.nanmax(score)))
    )


def _block_sums(leading: Floats, following: Floats, lag: int) -> Floats:
    """Return moments of the pairs of a lag: n, x, y, xx, yy, xy, (blocks, k, 6)."""
    n = len(leading)
    x = leading[max(0, -lag) : n - max(0, lag)]
    y = following[max(0, lag) : n - max(0, -lag)]
    known = np.isfinite(y) & np.isfinite(x)
    x, y = np.where(known, x, 0.0), np.where(known, y, 0.0)
    moments = np.stack([known.astype(float), x, y, x * x, y * y, x * y], -1)
    # blocks lie at the same times of `leading` for all lags
    edges = np.clip(np.linspace(0, n, N_BLOCKS + 1).astype(int) - max(0, -lag), 0, len(x))
    total = np.concatenate([np.zeros((1, *moments.shape[1:])), np.cumsum(moments, 0)])
    return np.asarray(np.diff(total[edges], axis=0))


def _score(sums: Floats) -> Floats:
    """Return the mean squared correlation over the signals that vary, (lags,)."""
    n, x, y, xx, yy, xy = np.moveaxis(sums, -1, 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        vx, vy, cov = xx - x * x / n, yy - y * y / n, xy - x * y / n
        squared = cov * cov / (vx * vy)
    varies = (vx > 1e-9 * np.maximum(xx, 1e-30)) & (vy > 1e-9 * np.maximum(yy, 1e-30)) & (n > 8)
    weights = varies.astype(float)
    total = weights.sum(-1)
    return np.where(total > 0, np.nansum(np.where(varies, squared, 0.0), -1) / np.maximum(total, 1), np.nan)


def _peak(lags: np.ndarray, score: Floats) -> float:
    """Return the lag of the peak, between the lags by a parabola."""
    if not np.isfinite(score).any():
        return float("nan")
    k = int(np.nanargmax(score))
    if not 0 < k < len(lags) - 1 or not np.isfinite(score[k - 1 : k + 2]).all():
        return float(lags[k])
    before, at, after = score[k - 1 : k + 2]
    bend = before - 2 * at + after
    return float(lags[k] + (0.5 * (before - after) / bend if bend < 0 else 0.0))


def correlation(first: Floats, second: Floats) -> float:
    """Return the correlation of two signals, 0 if one of them is constant."""
    if not (np.ptp(first) and np.ptp(second)):
        return 0.0
    return float(np.corrcoef(first, second)[0, 1])
