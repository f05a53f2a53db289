"""Successes on two sides: the difference of both shares with its interval, and exact tests, paired or not."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import scipy

from ._estimate import CONFIDENCE, Estimate, Values
from ._shares import root, share_interval

MOST_CELLS = 1_000_000
"""Tables of the exact test, (n + 1)(m + 1); more would take seconds."""

_NUISANCE = np.linspace(0, 1, 513)
"""Common shares that the exact test tries first."""

_REFINEMENTS = 3
"""Times that the best of these shares is refined, each to 1/32 of the step."""

_EQUAL = 1e-12
"""Relative distance below which two tables are equally extreme, because their p are sums in another order."""


def success_difference(count: int, n: int, other: int, m: int) -> Estimate:
    """Return the share of the second group minus that of the first, with Newcombe's interval.

    Args:
        count, n: Successes and trials of the first group.
        other, m: Successes and trials of the second group.

    Source: Newcombe (1998), Statistics in Medicine 17(8), 873-890, method 10: square-and-add of Wilson's intervals.
    """
    first, second = share_interval(count, n), share_interval(other, m)
    (low, high), (low_2, high_2) = first.ends or (0.0, 1.0), second.ends or (0.0, 1.0)
    share, share_2 = count / n, other / m
    difference = share_2 - share
    return Estimate(
        difference,
        max(-1.0, difference - math.hypot(share_2 - low_2, high - share)),
        min(1.0, difference + math.hypot(high_2 - share_2, share - low)),
        min(n, m),
        method="Newcombe",
    )


def paired_success_difference(gained: int, lost: int, n: int) -> Estimate:
    """Return the share of the second group minus that of the first over pairs, with Tango's score interval.

    Args:
        gained: Pairs in which only the second group succeeds.
        lost: Pairs in which only the first group succeeds.
        n: All pairs.

    Source: Tango (1998), Statistics in Medicine 17(8), 891-908.
    """
    z = float(scipy.special.ndtri((1 + CONFIDENCE) / 2))
    difference = (gained - lost) / n

    def excess(at: float) -> float:
        return _tango_score(at, gained, lost, n) ** 2 - z * z

    low = -1.0 if difference <= -1 else root(excess, -1.0 + 1e-12, difference)
    high = 1.0 if difference >= 1 else root(excess, difference, 1.0 - 1e-12)
    return Estimate(difference, low, high, n, method="Tango")


def _tango_score(at: float, gained: int, lost: int, n: int) -> float:
    """Return the score statistic of a true difference, infinite for one that cannot be."""
    linear = (2 * n - gained + lost) * at - gained - lost
    product = -lost * at * (1 - at)
    most_likely = (math.sqrt(max(linear * linear - 8 * n * product, 0.0)) - linear) / (
        4 * n
    )  # share of losses
    variance = n * (2 * max(most_likely, 0.0) + at * (1 - at))
    distance = gained - lost - n * at
    if variance <= 0:
        return 0.0 if distance == 0 else math.copysign(math.inf, distance)
    return distance / math.sqrt(variance)


def mcnemar_p(gained: int, lost: int) -> float:
    """Return the two-sided p of the exact test of pairs in which only one group succeeds; 1 without such pairs.

    Source: McNemar (1947), Psychometrika 12(2), 153-157, with the binomial distribution.
    """
    n = gained + lost
    return min(1.0, 2 * float(scipy.special.bdtr(min(gained, lost), n, 0.5))) if n else 1.0


def boschloo_p(count: int, n: int, other: int, m: int) -> float:
    """Return the two-sided p of the exact unconditional test that two groups have the same share of successes.

    It is twice the smaller one-sided p, at most 1. A table is as extreme as its one-sided p of Fisher's test. The p is
    the largest probability of a table at least as extreme as the observed one, over all common shares.

    Args:
        count, n: Successes and trials of the first group.
        other, m: Successes and trials of the second group.

    Raises:
        ValueError: The tables are more than `MOST_CELLS`.

    Source: Boschloo (1970), Statistica Neerlandica 24(1), 1-9.
    """
    if (n + 1) * (m + 1) > MOST_CELLS:
        raise ValueError(f"{n} and {m} trials are too many for the exact test.")
    below = _one_sided(count, n, other, m)
    return min(1.0, 2 * min(below, _one_sided(other, m, count, n)))


def _one_sided(count: int, n: int, other: int, m: int) -> float:
    """Return the p of the alternative that the first group has the smaller share."""
    extremes = _fisher_below(n, m)
    is_extreme = (extremes <= extremes[count, other] * (1 + _EQUAL)).astype(float)

    def probability(shares: Values) -> Values:
        return np.asarray(((_binomial(n, shares) @ is_extreme) * _binomial(m, shares)).sum(axis=1))

    shares, found, step = _NUISANCE, probability(_NUISANCE), _NUISANCE[1]
    for _ in range(_REFINEMENTS):
        best = shares[int(found.argmax())]
        shares = np.clip(np.linspace(best - step, best + step, 65), 0, 1)
        found, step = probability(shares), step / 32
    return float(min(found.max(), 1.0))


def _fisher_below(n: int, m: int) -> Values:
    """Return the one-sided p of Fisher's test for each table, (n + 1, m + 1)."""
    p = np.empty((n + 1, m + 1))
    logs = _log_choose(n)[:, None] + _log_choose(m)[None, :]
    for total in range(n + m + 1):
        first = np.arange(max(0, total - m), min(total, n) + 1)
        weights = np.exp(logs[first, total - first] - logs[first, total - first].max())
        p[first, total - first] = np.cumsum(weights) / weights.sum()
    return p


def _log_choose(n: int) -> Values:
    k: npt.NDArray[np.int64] = np.arange(n + 1)
    gamma = scipy.special.gammaln
    return np.asarray(gamma(n + 1) - gamma(k + 1) - gamma(n - k + 1))


def _binomial(n: int, shares: Values) -> Values:
    """Return the probability of each count for each share, (len(shares), n + 1)."""
    k = np.arange(n + 1)
    xlogy, xlog1py = scipy.special.xlogy, scipy.special.xlog1py
    return np.asarray(np.exp(_log_choose(n) + xlogy(k, shares[:, None]) + xlog1py(n - k, -shares[:, None])))
