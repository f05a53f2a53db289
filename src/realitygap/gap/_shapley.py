"""Shapley values: how much each group carries of what all of them do together."""

from __future__ import annotations

import itertools
import math

import numpy as np

from ._side import Values


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
