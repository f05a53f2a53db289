"""Tests that count what relabeling alone would do, the smallest p that n can give, and Holm's correction."""

from __future__ import annotations

import itertools
import math

import numpy as np
import numpy.typing as npt

from ._estimate import Values

ALPHA = 0.05
"""Level: a difference is claimed if its p, corrected by Holm, is below it."""

MOST_ENUMERATED = 200_000
"""Relabelings that are counted one by one: two conditions of ten runs have 184,756."""

MONTE_CARLO = 9_999
"""Number of relabelings that are drawn if there are more; p is then never below 2 / 10,000."""

SEED = 2_000
"""Seed of every random draw in a report, so that the same results give the same page."""

_FINEST_UNIT = 256
"""Maximum number of cells of an arena, so that each coverage is a multiple of 1/N for an N up to this."""

_ROUNDING = 1e-9
"""Sums that differ by less are equal: coverages are fractions of up to 256, held in double precision."""


def lattice(values: Values) -> npt.NDArray[np.int64] | None:
    """The values as whole multiples of 1/N for the smallest N up to 256 that fits all; None if none does."""
    for cells in range(1, _FINEST_UNIT + 1):
        scaled = values * cells
        whole = np.round(scaled)
        if np.abs(scaled - whole).max(initial=0.0) <= _ROUNDING * cells:
            return whole.astype(np.int64)
    return None


def sign_flip_p(differences: Values) -> float:
    """Return the two-sided p of the mean of paired differences, if each pair could have the opposite sign.

    Args:
        differences: (n,) one per pair; zeros change nothing.

    Returns:
        Twice the share of all 2^n sign patterns with a sum as large as the observed one, at most 1. Exact if the
        differences are multiples of one unit, like coverages, or if n is at most 17; otherwise from 9,999 patterns
        drawn with a fixed seed.

    Raises:
        ValueError: `differences` is empty or not finite.

    Source: Fisher (1935), The Design of Experiments, section 21; counting instead of listing the patterns:
    Pagano & Tritchler (1983), Journal of the American Statistical Association 78(382).
    """
    if len(differences) == 0 or not np.isfinite(differences).all():
        raise ValueError("differences must be finite numbers, at least one.")
    whole = lattice(differences)
    if whole is not None:
        return _sign_flip_counted(whole)
    sizes = np.abs(differences[differences != 0])
    observed = abs(differences.sum()) - _ROUNDING
    if 2 ** len(sizes) <= MOST_ENUMERATED:
        signs = np.array(list(itertools.product((-1.0, 1.0), repeat=len(sizes))))
        return _two_sided(float(((signs @ sizes) >= observed).mean()))
    rng = np.random.default_rng(SEED)
    reached = sum(
        int(((rng.integers(0, 2, (333, len(sizes))) * 2.0 - 1.0) @ sizes >= observed).sum())
        for _ in range(MONTE_CARLO // 333)
    )
    drawn = MONTE_CARLO // 333 * 333
    return _two_sided((reached + 1) / (drawn + 1))


def _sign_flip_counted(differences: npt.NDArray[np.int64]) -> float:
    """Return p from all 2^n patterns together: the distribution of the sum of those differences that turn negative."""
    sizes = np.abs(differences[differences != 0])
    # with total T, a sum is T - 2 m where m is what turned negative, so a sum >= s means m <= (T - s) / 2
    most = int(sizes.sum() - abs(differences.sum())) // 2
    share = np.zeros(most + 1)
    share[0] = 1.0
    for size in sizes:
        share *= 0.5
        if size <= most:
            # the old share is twice the new one; the right side is read before the left is written
            share[size:] = share[size:] + share[: most + 1 - size]
    return _two_sided(float(share.sum()))


def permutation_p(one: Values, other: Values) -> float:
    """Two-sided p of the difference of two means, when runs could as well belong to the other condition.

    Args:
        one: (n,) and
        other: (m,) independent values.

    Returns:
        Twice the share of relabelings with a difference as large, or as small, whichever are fewer; at most 1. Exact up
        to 200,000 relabelings (ten runs against ten); otherwise from 9,999 drawn with a fixed seed.

    Raises:
        ValueError: one of them is empty or not finite.

    Source: Fisher's randomization test as in Edgington & Onghena (2007), Randomization Tests, 4th edition,
    chapter 4; the p of drawn relabelings counts the observed one, as Phipson & Smyth (2010) show it must.
    """
    both = np.concatenate([one, other])
    if len(one) == 0 or len(other) == 0 or not np.isfinite(both).all():
        raise ValueError("one and other must be finite numbers, at least one each.")
    n = len(one)
    rounding = _ROUNDING * max(1.0, float(np.abs(both).sum()))
    observed = float(one.sum())
    if math.comb(len(both), n) <= MOST_ENUMERATED:
        which = np.fromiter(
            itertools.chain.from_iterable(itertools.combinations(range(len(both)), n)), np.int64
        ).reshape(-1, n)
        sums = both[which].sum(axis=1)
        return _two_sided(_smaller_tail(sums, observed, rounding) / len(sums))
    values, counts = np.unique(both, return_counts=True)
    drawn = np.random.default_rng(SEED).multivariate_hypergeometric(
        counts, n, size=MONTE_CARLO, method="marginals"
    )
    return _two_sided((_smaller_tail(drawn @ values, observed, rounding) + 1) / (MONTE_CARLO + 1))


def _smaller_tail(sums: Values, observed: float, rounding: float) -> int:
    """Return the number of sums as large as the observed one, or as small, whichever number is smaller."""
    return int(min((sums >= observed - rounding).sum(), (sums <= observed + rounding).sum()))


def _two_sided(share: float) -> float:
    return min(1.0, 2.0 * share)


def smallest_p(n: int, m: int | None = None, *, as_drawn: bool = False) -> float:
    """The smallest two-sided p that n pairs can give, or with `m` n runs against m.

    It is 2 / 2^n, or 2 / (n + m choose n): that of the two most extreme relabelings, without ties.

    Args:
        n: Number of pairs, or of runs.
        m: Number of runs of the other condition.
        as_drawn: True for the p of `permutation_p`, which draws relabelings if there are too many to count.
    """
    if m is None:
        return min(1.0, math.ldexp(1.0, 1 - n))
    exact = min(1.0, 2 / math.comb(n + m, n))
    return max(exact, 2 / (MONTE_CARLO + 1)) if as_drawn and exact < 2 / MOST_ENUMERATED else exact


def runs_for_a_claim(n_comparisons: int = 1, *, paired: bool, alpha: float = ALPHA) -> int:
    """The fewest runs a condition whose smallest p, times the comparisons made, is below `alpha`."""
    n = 1
    while smallest_p(n, None if paired else n) * n_comparisons >= alpha:
        n += 1
    return n


def holm(p: Values) -> Values:
    """The p values of a family, corrected so that one false claim in the whole family has its level.

    Args:
        p: (m,) p values in any order.

    Returns:
        (m,) p values in the same order, at most 1: the smallest times m, the next times m - 1 and so on, none below the
        one before it.

    Source: Holm (1979), Scandinavian Journal of Statistics 6(2).
    """
    order = np.argsort(p, kind="stable")
    corrected = np.empty(len(p))
    corrected[order] = np.minimum(1.0, np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1)))
    return corrected
