"""The number of pairs that a sequential test needs: planned before the first pair, and forecast after some."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from realitygap.errors import check_finite

from ._estimate import Values
from ._planning import POWER, fewest_pairs
from ._sequential import SequentialTest

FORECAST_FROM = 5
"""Smallest number of pairs from which more pairs are forecast."""

MOST_PAIRS = 200
"""Pairs up to which a forecast looks ahead, if no maximum is planned."""

_STUDIES = 2_000
_MOST_DRAWN = 4_000_000
"""Differences in all studies that are simulated: above 2,000 pairs there are fewer studies."""

_FORECAST_STUDIES = 400
_SEED = 20
_QUANTILE = 0.8


@dataclass(frozen=True)
class PlannedPairs:
    """The number of pairs of a sequential test, next to that of a fixed design.

    Attributes:
        fixed: Number of pairs of a paired t test with the requested power; None if 100,000 are not enough.
        maximum: Maximum number of pairs: the worst case. None if there is no fixed number.
        median: Number of pairs at which half of all studies have ended.
        mean: Mean number of pairs.
        quantile: Number of pairs at which 80 % of all studies have ended.
        power: Share of studies that claim the difference by the maximum.
    """

    fixed: int | None
    maximum: int | None = None
    median: int | None = None
    mean: float | None = None
    quantile: int | None = None
    power: float | None = None


@dataclass(frozen=True)
class Forecast:
    """A forecast of more pairs: studies that continue with observed differences, which are drawn again.

    It assumes that the observed differences are typical. It has no part in the test.

    Attributes:
        more: Median number of more pairs; None if half of the studies reach the maximum first.
        quantile: 80 of 100 studies end within this number of more pairs; None if they do not.
        ended: Share of studies that end by the maximum.
        maximum: Total number of pairs up to which the forecast looks.
    """

    more: int | None
    quantile: int | None
    ended: float
    maximum: int


def plan_pairs(
    effect: float,
    spread: float,
    *,
    test: SequentialTest | None = None,
    power: float = POWER,
    maximum: int | None = None,
    seed: int = 1,
) -> PlannedPairs:
    """Return how many pairs a sequential test needs to claim a mean difference, by simulating it.

    Differences are normal, and cut off at -1 and 1.

    Args:
        effect: Mean difference, above 0.
        spread: Standard deviation of a difference.
        test: The test, which also gives the level of the fixed design. Default: the sign-symmetric one at 5 %.
        power: Power of the fixed design.
        maximum: Maximum number of pairs. Default: twice the fixed number, and 4 more.
        seed: Seed of the simulated studies.

    Raises:
        ValueError: A number is out of range.
    """
    check_finite({"effect": effect, "spread": spread})
    if effect <= 0 or spread < 0:
        raise ValueError(f"effect is {effect} and spread {spread}, expected above 0, and 0 or more.")
    test = test or SequentialTest()
    fixed = fewest_pairs(effect, spread, power, test.alpha) if spread > 0 else 2
    if fixed is None:
        return PlannedPairs(None)
    most = 2 * fixed + 4 if maximum is None else maximum
    studies = max(100, min(_STUDIES, _MOST_DRAWN // most))
    differences = np.clip(np.random.default_rng(seed).normal(effect, spread, (studies, most)), -1.0, 1.0)
    ends = test.stops(differences)
    pairs = np.where(ends > 0, ends, most)
    return PlannedPairs(
        fixed, most, _rank(pairs, 0.5), float(pairs.mean()), _rank(pairs, _QUANTILE), float((ends > 0).mean())
    )


def forecast_pairs(
    differences: Values, test: SequentialTest, *, maximum: int | None = None, seed: int = _SEED
) -> Forecast | None:
    """Return how many more pairs a test would need if later differences were like those so far.

    Args:
        differences: (k,) differences so far.
        test: The test.
        maximum: Maximum number of pairs. Default: 200, or twice the present number if that is more.
        seed: Seed of the draws.

    Returns:
        The forecast; None below 5 pairs, or if there are no pairs left.
    """
    n = len(differences)
    most = max(MOST_PAIRS, 2 * n) if maximum is None else maximum
    if n < FORECAST_FROM or most <= n:
        return None
    drawn = np.random.default_rng(seed).choice(differences, (_FORECAST_STUDIES, most - n))
    ends = test.stops(np.concatenate([np.broadcast_to(differences, (len(drawn), n)), drawn], axis=1))
    more = np.where(ends > 0, np.maximum(ends - n, 0), most)  # those that do not end come last
    ranks = [_rank(more, share) for share in (0.5, _QUANTILE)]
    median, quantile = (None if rank > most - n else rank for rank in ranks)
    return Forecast(median, quantile, float((ends > 0).mean()), most)


def _rank(values: npt.NDArray[np.int64], share: float) -> int:
    """Return the smallest value that at least this share of all values does not exceed."""
    return int(np.sort(values)[math.ceil(share * len(values)) - 1])
