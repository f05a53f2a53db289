"""The share of a gap that each part of the model explains: its Shapley value."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from realitygap.stats import Estimate, percentile_interval

from ._level import rms_interval, rms_of
from ._resampling import over_controllers
from ._side import Values

RESAMPLES = 2_000
MOST = 1_024  # controllers that `realitygap gap` takes


@dataclass(frozen=True)
class Why:
    """The share of each part of the model in the fall of the RMS gap from the defaults to the fit.

    Attributes:
        parts: Names of the parts.
        falls: Amount by which each part lowers the RMS gap: its Shapley value. Negative if it makes the gap larger.
        numbers: Number of numbers of each part that the fit changes. A part without any explains nothing.
        before: RMS gap with the defaults.
        after: RMS gap with the whole fit.
        change: Amount by which the whole fit makes it larger.
    """

    parts: tuple[str, ...]
    falls: tuple[Estimate, ...]
    numbers: tuple[int, ...]
    before: Estimate
    after: Estimate
    change: Estimate

    @property
    def order(self) -> list[int]:
        """Places of the parts, the one that carries most first."""
        return sorted(range(len(self.parts)), key=lambda k: -(self.falls[k].value or 0.0))

    @property
    def advice(self) -> str:
        """Advice on the next change, in a sentence or two."""
        if self.after.low is None:
            return f"No advice on the next change: {self.after.refused}"
        left = (
            f" The rest with the whole fit, {self.after} RMS, is outside these numbers."
            if self.after.low > 0
            else " With the whole fit no gap is shown."
        )
        first = self.order[0]
        fall = self.falls[first]
        if (fall.value or 0.0) <= 0:
            return f"Change this next: none of the fitted parts, because none reduces the gap.{left}"
        if (self.change.low or 0.0) > 0:
            return (
                f"Change this next: the fit. It makes the gap larger, {self.after} RMS instead of "
                f"{self.before}. Check the trials that it was fitted to before any part of it."
            )
        if (self.change.high or 0.0) >= 0:
            left = " The whole fit is not shown to reduce the gap."
        sure = "" if (fall.low or 0.0) > 0 else f"; this may be chance ({_would(fall)})"
        return (
            f"Change this next: {self.parts[first]}, which explains most, {fall} of the RMS gap of "
            f"{self.before.value:.3f}{sure}.{left}"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        falls = zip(self.parts, self.falls, self.numbers, strict=True)
        return {
            "before": self.before.to_dict(),
            "after": self.after.to_dict(),
            "change": self.change.to_dict(),
            "parts": {name: {**fall.to_dict(), "numbers": numbers} for name, fall, numbers in falls},
            "advice": self.advice,
        }


def _would(fall: Estimate) -> str:
    """Return the number of controllers that would show a fall of this size: intervals shrink with its root.

    As far as the fit is sure: what its draws differ by does not shrink with controllers.
    """
    if not fall.value or fall.low is None:
        return "more controllers are needed"
    n = max(int(np.ceil(fall.n * ((fall.value - fall.low) / fall.value) ** 2)), fall.n + 1)
    if n > MOST:
        return f"more than {MOST:,} controllers are needed to show it"
    return f"about {n} controllers would show it, if the fit is precise enough"


def explain_gap(
    differences: Values,
    squares: Values,
    parts: Sequence[str],
    numbers: Sequence[int],
    *,
    seed: int = 7,
) -> Why:
    """Return the share out the fall of the RMS gap among parts of the model.

    Args:
        differences: (1 + d, 2^g, c) difference of each controller's means, with each choice of g parts taken from the
            fit, in the order of `coalitions`: row 0 for the estimate, the others for draws from its posterior.
        squares: (1 + d, 2^g, c) unbiased squares of the true differences (`square_differences`).
        parts: Names of the g parts.
        numbers: Number of numbers that the fit changes in each part.
        seed: Seed of its draws.

    Returns:
        Shapley values. For their intervals, controllers are resampled, each time with a draw from the posterior. The
        intervals of the RMS gap are those of `rms_interval`, with the variance over the posterior.
    """
    rng = np.random.default_rng(seed)
    n_draws, _, c = squares.shape
    worth = rms_of(squares[0].mean(axis=1))[None]
    which = rng.integers(1, n_draws, RESAMPLES) if n_draws > 1 else np.zeros(RESAMPLES, np.int64)
    drawn = np.empty((RESAMPLES, squares.shape[1]))
    for k in range(RESAMPLES):
        drawn[k] = squares[which[k]][:, rng.integers(0, c, c)].mean(axis=1)
    gaps = rms_of(drawn)
    falls, others = _falls(worth)[0], _falls(gaps)
    return Why(
        tuple(parts),
        tuple(_estimate(falls[k], others[:, k], c) for k in range(len(parts))),
        tuple(numbers),
        _rms(worth[0, 0], differences[:, 0], squares[:, 0], drawn[:, 0]),
        _rms(worth[0, -1], differences[:, -1], squares[:, -1], drawn[:, -1]),
        _estimate(worth[0, -1] - worth[0, 0], gaps[:, -1] - gaps[:, 0], c),
    )


def _falls(worth: Values) -> Values:
    """Return the amount by which each part lowers the gap, (b, g); exactly 0 if only rounding is left."""
    return np.asarray(np.round(-shapley_values(worth), 12) + 0.0)


def _rms(value: float, differences: Values, squares: Values, drawn: Values) -> Estimate:
    """Return an RMS gap, of (1 + d, c) as in `explain_gap` and (b,) mean squares of its resamples."""
    draws = squares[1:].mean(axis=1)
    more_variance = float(draws.var(ddof=1)) if len(draws) > 1 else 0.0
    ends = rms_interval(
        differences[0], squares[0], drawn, more_variance=more_variance, most=1.0
    )  # differences in coverage
    return over_controllers(float(value), ends, squares.shape[1])


def _estimate(value: float, drawn: Values, n: int) -> Estimate:
    return over_controllers(float(value), percentile_interval(drawn, n), n)


# Shapley values


def coalitions(n: int) -> list[tuple[bool, ...]]:
    """Return all 2^n choices of n groups. Choice k includes group g if bit g of k is set."""
    return [tuple(bool(k >> g & 1) for g in range(n)) for k in range(2**n)]


def shapley_values(worth: Values) -> Values:
    """Return what each of g groups adds on average over all orders of adding them, (b, g).

    Args:
        worth: (b, 2^g) value of each choice of groups, in the order of `coalitions`.

    Returns:
        The values, whose sum over groups is the worth of all less that of none.

    Raises:
        ValueError: The number of columns is not a power of 2.

    Source: Shapley (1953), A Value for n-Person Games; exact, over all choices.
    """
    n = round(math.log2(worth.shape[1]))
    if 2**n != worth.shape[1]:
        raise ValueError(f"worth has {worth.shape[1]} columns, expected a power of 2.")
    return np.asarray(worth @ _weights(n))


def _weights(n: int) -> Values:
    weights = np.zeros((2**n, n))
    for group, k in itertools.product(range(n), range(2**n)):
        size = k.bit_count() - (k >> group & 1)
        weight = 1 / (n * math.comb(n - 1, size))
        weights[k, group] = weight if k >> group & 1 else -weight
    return weights
