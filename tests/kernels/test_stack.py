"""Stacks of named tuples, and their members in kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import kernel
from realitygap.kernels.math.stack import member_of, stack


class Inner(NamedTuple):
    row: NDArray[np.float64]


class Outer(NamedTuple):
    size: int
    rows: NDArray[np.float64]
    inner: Inner


_outer_of = member_of(Outer)


@kernel
def _add(outer, value):  # type: ignore[no-untyped-def]
    outer.inner.row[0] += value * outer.size
    outer.rows[1, 0] = outer.inner.row[0]


@kernel
def _add_to_each(outers, values):  # type: ignore[no-untyped-def]
    for k in range(values.size):
        _add(_outer_of(outers, k), values[k])


def test_kernels_change_the_members_of_a_stack_one_by_one() -> None:
    members = [Outer(3, np.full((2, 4), k + 0.5), Inner(np.full(2, k + 0.25))) for k in range(5)]
    together, values = stack(members), np.array([1.0, -2.0, 0.5, 4.0, 8.0])
    _add_to_each(together, values)
    for k, member in enumerate(members):
        _add(member, values[k])
        assert np.array_equal(together.rows[k], member.rows)
        assert np.array_equal(together.inner.row[k], member.inner.row)
    assert together.size == 3


def test_members_with_different_numbers_are_refused() -> None:
    members = [Outer(size, np.zeros((1, 1)), Inner(np.zeros(1))) for size in (1, 2)]
    with pytest.raises(ValueError, match="Expected the same number in each"):
        stack(members)
