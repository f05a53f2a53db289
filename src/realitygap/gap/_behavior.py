"""Measures of behavior: energy distances with a test within controllers, and maps of visited cells."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from ._side import GapSide, Values

PERMUTATIONS = 999


def energy_distances(source: Values, target: Values) -> Values:
    """Return the energy distance between both sides for each controller, (c,): `2 E|X - Y| - E|X - X'| - E|Y - Y'|`.

    Args:
        source: (c, r, d) behaviors, such as visited cells as 0 and 1: then distances are roots of the number of
            cells that differ.
        target: (c, q, d).

    Returns:
        The unbiased estimate. It is 0 on average if both sides have the same distribution, and then often negative.

    Raises:
        ValueError: One trial on a side: there are no distances within it.

    Source: Székely & Rizzo (2013), Journal of Statistical Planning and Inference 143(8), 1249-1272.
    """
    r = source.shape[1]
    in_source = (np.arange(r + target.shape[1]) < r)[None]
    return np.array([_shared_out(matrix, in_source)[0] for matrix in _matrices(source, target)])


def energy_test(
    source: Values, target: Values, rng: np.random.Generator, permutations: int = PERMUTATIONS
) -> float:
    """Return p: the frequency of an equal or larger mean distance if trials of each controller change sides at random.

    Args:
        source: (c, r, d) and
        target: (c, q, d).
        rng: Draws the permutations.
        permutations: Number of permutations, in addition to the observed order.

    Source: permutation within strata; the observed one counts (Phipson & Smyth 2010).
    """
    n, r = source.shape[:2]
    in_source = np.tile(np.arange(r + target.shape[1]) < r, (n, permutations + 1, 1))
    in_source[:, 1:] = rng.permuted(in_source[:, 1:], axis=2)
    matrices = _matrices(source, target)
    means = np.mean([_shared_out(*pair) for pair in zip(matrices, in_source, strict=True)], axis=0)
    return float((means >= means[0] - 1e-9).mean())


def smallest_energy_p(n: int, r: int, q: int) -> float:
    """Return the smallest p that n controllers with r and q trials can give: one of all ways to share out trials.

    With as many trials on both sides, two ways that are each other's mirror image give the same distance.
    """
    ways = math.comb(r + q, r) // (2 if r == q else 1)
    return float(math.exp(-n * math.log(ways)))


def _matrices(source: Values, target: Values) -> Iterator[Values]:
    """Yield the distances between the trials of each controller, (r + q, r + q)."""
    if min(source.shape[1], target.shape[1]) < 2:
        raise ValueError("An energy distance needs at least 2 trials of each controller on both sides.")
    both = np.concatenate([source, target], axis=1).astype(float)
    return (scipy.spatial.distance.cdist(trials, trials) for trials in both)


def _shared_out(matrix: Values, is_in_source: NDArray[np.bool_]) -> Values:
    """Return energy distances of a controller for p splits of its trials (p, r + q), (p,)."""
    in_source = is_in_source.astype(float)
    r = float(in_source[0].sum())
    q = in_source.shape[1] - r
    to_all = in_source @ matrix.sum(axis=0)
    within = np.einsum("pt,pt->p", in_source @ matrix, in_source)
    within_source = within / (r * (r - 1))
    across = (to_all - within) / (r * q)
    within_target = (matrix.sum() - 2 * to_all + within) / (q * (q - 1))
    return np.asarray(2 * across - within_source - within_target)


@dataclass(frozen=True)
class CoverageMaps:
    """Shares of trials that cross each cell.

    Attributes:
        source: (n_cells,) share of trials in simulation that visit a cell [0..1].
        target: (n_cells,) on the target.
    """

    source: Values
    target: Values

    @property
    def difference(self) -> Values:
        """Difference of the maps, target minus simulator, (n_cells,) [-1..1]."""
        return self.target - self.source


def coverage_maps(source: GapSide, target: GapSide) -> CoverageMaps | None:
    """Return the maps of both sides with equal weights of controllers; None if the cells of a side are unknown."""
    if not (len(source.cells) and len(target.cells)):
        return None
    one, other = (side.cells.mean(axis=(0, 1)) for side in (source, target))
    return CoverageMaps(one, other)
