"""Energy distance of behaviors, with a permutation test that never compares different controllers."""

from __future__ import annotations

import math

import numpy as np

from ._side import Values

PERMUTATIONS = 999
ALPHA = 0.05


def energy_distances(source: Values, target: Values) -> Values:
    """(c,) energy distance between both sides of each controller: `2 E|X - Y| - E|X - X'| - E|Y - Y'|`.

    Args:
        source: (c, r, d) behaviors, such as visited cells as 0 and 1: then distances are roots of the number of
            cells that differ.
        target: (c, q, d).

    Returns:
        Without bias: 0 on average where both sides have the same distribution, and then often below 0.

    Raises:
        ValueError: One trial on a side: there are no distances within it.

    Source: Székely & Rizzo (2013), Journal of Statistical Planning and Inference 143(8), 1249-1272.
    """
    return _distances(_matrices(source, target), source.shape[1])


def energy_test(
    source: Values, target: Values, rng: np.random.Generator, permutations: int = PERMUTATIONS
) -> float:
    """How often the mean energy distance is as large when trials of each controller change sides at random: p.

    Args:
        source: (c, r, d) and
        target: (c, q, d).
        rng: Draws the permutations.
        permutations: How many, beside the observed one.

    Source: permutation within strata; the observed one counts (Phipson & Smyth 2010).
    """
    matrices, r = _matrices(source, target), source.shape[1]
    n, both = matrices.shape[:2]
    in_source = np.tile(np.arange(both) < r, (n, permutations + 1, 1))
    in_source[:, 1:] = rng.permuted(in_source[:, 1:], axis=2)
    means = _shared_out(matrices, in_source.astype(float)).mean(axis=0)
    return float((means >= means[0] - 1e-9).mean())


def smallest_energy_p(n: int, r: int, q: int) -> float:
    """The smallest p that n controllers with r and q trials can give: one of all ways to share out trials."""
    return float(math.exp(-n * math.log(math.comb(r + q, r))))


def _matrices(source: Values, target: Values) -> Values:
    from scipy.spatial.distance import cdist  # which takes a while to import, and nothing else needs

    if min(source.shape[1], target.shape[1]) < 2:
        raise ValueError("An energy distance needs at least 2 trials of each controller on both sides.")
    both = np.concatenate([source, target], axis=1).astype(float)
    return np.stack([cdist(each, each) for each in both])


def _distances(matrices: Values, r: int) -> Values:
    in_source = np.broadcast_to(np.arange(matrices.shape[1]) < r, (len(matrices), 1, matrices.shape[1]))
    return _shared_out(matrices, in_source.astype(float))[:, 0]


def _shared_out(matrices: Values, in_source: Values) -> Values:
    """(c, p) energy distance of each controller for p ways to share out its trials, (c, p, r + q) 1 in the source."""
    r = float(in_source[0, 0].sum())
    q = in_source.shape[2] - r
    in_target = 1 - in_source
    to_source = in_source @ matrices
    within_source = (to_source * in_source).sum(axis=2) / (r * (r - 1))
    across = (to_source * in_target).sum(axis=2) / (r * q)
    within_target = (in_target @ matrices * in_target).sum(axis=2) / (q * (q - 1))
    return np.asarray(2 * across - within_source - within_target)
