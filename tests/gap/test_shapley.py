"""Exact Shapley values."""

import itertools

import numpy as np
import pytest

from realitygap.gap import coalitions
from realitygap.gap._why import shapley_values


def by_orders(worth, n):
    total = np.zeros(n)
    orders = list(itertools.permutations(range(n)))
    for order in orders:
        k = 0
        for group in order:
            total[group] += worth[k | 1 << group] - worth[k]
            k |= 1 << group
    return total / len(orders)


def test_values_are_means_over_all_orders_and_add_up():
    worth = np.random.default_rng(1).random((2, 16))
    found = shapley_values(worth)
    for row, values in zip(worth, found, strict=True):
        assert values == pytest.approx(by_orders(row, 4))
    assert found.sum(axis=1) == pytest.approx(worth[:, -1] - worth[:, 0])


def test_a_group_that_does_nothing_has_0():
    worth = np.array([[float(k & 1) for k in range(8)]])
    assert shapley_values(worth) == pytest.approx(np.array([[1.0, 0.0, 0.0]]))


def test_coalitions_are_numbered_as_bits():
    assert coalitions(2) == [(False, False), (True, False), (False, True), (True, True)]


def test_a_number_of_columns_that_is_no_power_of_2_is_refused():
    with pytest.raises(ValueError, match="power of 2"):
        shapley_values(np.zeros((1, 6)))
