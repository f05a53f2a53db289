"""Mean maximum rank violation: what wrong order in simulation costs on the target."""

from __future__ import annotations

import numpy as np

from ._correlation import SPLITS, Rng, halves
from ._side import Values

_BLOCK = 4_000_000
"""Pairs of controllers that are held at a time."""


def mean_maximum_rank_violation(source: Values, target: Values) -> Values:
    """(b,) mean over controllers of the largest difference on the target to one that the simulator orders otherwise.

    For each controller i the largest `|target_i - target_j|` over all j with (source_i < source_j) differing from
    (target_i < target_j); 0 where the simulator orders all as the target does. It is in the unit of the *target's*
    quality, so the order of arguments matters.

    Args:
        source: (b, c) means in simulation.
        target: (b, c) means on the target.

    Source: Li et al. (2024), Evaluating Real-World Robot Manipulation Policies in Simulation (SIMPLER), section III.
    """
    b, c = target.shape
    size = max(1, _BLOCK // (c * c))
    return np.concatenate(
        [_of_block(source[first : first + size], target[first : first + size]) for first in range(0, b, size)]
    )


def _of_block(source: Values, target: Values) -> Values:
    violated = (source[:, :, None] < source[:, None, :]) != (target[:, :, None] < target[:, None, :])
    apart = np.abs(target[:, :, None] - target[:, None, :])
    return np.asarray(np.where(violated, apart, 0.0).max(axis=2).mean(axis=1))


def rank_violation_floor(target: Values, rng: Rng, splits: int = SPLITS) -> Values:
    """(b,) the violation of one random half of the target's trials by the other: what noise alone makes of it.

    Args:
        target: (b, c, q), q at least 2.
        rng: Draws the halves.
        splits: How many, of which the mean is taken.
    """
    found = [mean_maximum_rank_violation(*halves(target, rng)) for _ in range(splits)]
    return np.asarray(np.mean(found, axis=0))
