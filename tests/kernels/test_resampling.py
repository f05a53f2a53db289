"""Counts of resamples, against counting one by one."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from realitygap.kernels.math.resampling import count_drawn


@pytest.mark.parametrize(("b", "n", "m", "u"), [(1, 1, 1, 1), (7, 20, 20, 6), (3, 50, 4, 9), (5, 0, 3, 2)])
def test_counts_are_those_of_the_values_drawn(b, n, m, u):
    rng = np.random.default_rng(5)
    draws, places = rng.integers(0, m, (b, n)), rng.integers(0, u, m)
    counts = np.zeros((b, u))
    count_drawn(draws, places, counts)
    for row, drawn in zip(counts, draws, strict=True):
        expected = Counter(int(places[member]) for member in drawn)
        assert row.tolist() == [expected[value] for value in range(u)]


def test_counts_are_added():
    counts = np.array([[1.0, 2.0]])
    count_drawn(np.array([[0, 1, 1]]), np.array([1, 0]), counts)
    assert counts.tolist() == [[3.0, 3.0]]
