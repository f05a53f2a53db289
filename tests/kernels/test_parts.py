"""Kernels take tuples and arrays apart as Python does."""

import itertools
from typing import Any, NamedTuple

import numpy as np
import pytest

from realitygap.kernels.compile.decorators import kernel, maker, shared


class Inner(NamedTuple):
    row: np.ndarray
    number: float


class Outer(NamedTuple):
    rows: np.ndarray
    inner: Inner
    flags: np.ndarray


def _change(outer, index, value):
    row = outer.rows[index]
    row[-1] = value + outer.inner.number
    outer.flags[index] = row[-1] > 2.0
    outer.inner.row[index] = outer.rows.shape[1] + outer.rows.size
    return outer.flags[index]


def _count(outer):
    total = 0
    for i in range(outer.rows.shape[0]):
        for j in range(outer.rows.shape[1] - 1, -1, -2):
            if outer.rows[i, j] > 0:
                total += 1
    return total


def _swap(first, second, times):
    for _ in range(times):
        first, second = second, first
    first[0] = 7.0
    return first.size, second


def _maybe(value):
    return value if value > 0.0 else None


change, count, swap, maybe = (kernel(function) for function in (_change, _count, _swap, _maybe))
change_shared = shared(_change)


def make_outer() -> Outer:
    return Outer(np.zeros((3, 4)), Inner(np.zeros(3), 1.5), np.zeros(3, np.bool_))


def _run(outer, changed, counted, swapped, maybe):
    hits = 0
    for i in range(0, 3, 1):
        if changed(outer, i, i - 0.25):
            hits += 1
    for _ in range(5, 2):
        hits += 100
    size, other = swapped(outer.rows[0], outer.inner.row, hits)
    other[1] += 0.5
    found = maybe(outer.rows[0, 0] - 5.0)
    if found is not None:
        hits += 10
    return hits, counted(outer), size


@kernel
def run(outer):
    """Call by inlining."""
    hits = 0
    for i in range(0, 3, 1):
        if change(outer, i, i - 0.25):
            hits += 1
    for _ in range(5, 2):
        hits += 100
    size, other = swap(outer.rows[0], outer.inner.row, hits)
    other[1] += 0.5
    found = maybe(outer.rows[0, 0] - 5.0)
    if found is not None:
        hits += 10
    return hits, count(outer), size


@kernel
def run_shared(outer):
    """Call by symbol."""
    hits = 0
    for i in range(3):
        if change_shared(outer, i, i - 0.25):
            hits += 1
    return hits


@kernel
def item(array, i, j):
    """Return an item of a matrix whose rows may be apart."""
    return array[i][j] + array[i, j] + array[-1, -1]


@pytest.mark.slow
def test_kernels_give_what_python_gives() -> None:
    compiled, plain = make_outer(), make_outer()
    assert run(compiled) == _run(plain, _change, _count, _swap, _maybe)
    for got, expected in ((compiled.rows, plain.rows), (compiled.inner.row, plain.inner.row)):
        np.testing.assert_array_equal(got, expected)
    np.testing.assert_array_equal(compiled.flags, plain.flags)


@pytest.mark.slow
def test_shared_kernels_give_what_python_gives() -> None:
    compiled, plain = make_outer(), make_outer()
    assert run_shared(compiled) == sum(bool(_change(plain, i, i - 0.25)) for i in range(3))
    np.testing.assert_array_equal(compiled.rows, plain.rows)
    assert change_shared(compiled, 1, 9.0) == _change(plain, 1, 9.0)
    np.testing.assert_array_equal(compiled.rows, plain.rows)


@pytest.mark.slow
def test_items_of_arrays_with_gaps_are_found() -> None:
    whole = np.arange(60.0).reshape(5, 12)
    for array in (whole, whole[::2, ::3], whole[::-1, 1:], np.asfortranarray(whole)):
        assert item(array, 1, -2) == 2 * array[1, -2] + array[-1, -1]
    assert item(whole, np.int32(-1), np.uint8(3)) == 2 * whole[-1, 3] + whole[-1, -1]


def _extremes(a, b, i, j, out):
    out[0] = min(a, b)
    out[1] = max(a, b)
    out[2] = min(i, a)
    out[3] = max(min(a, 1.0), -1.0)
    for _ in range(min(i, out.size)):
        out[4] += 1
    return max(i, j)


@pytest.mark.parametrize("decorator", [kernel, maker])
def test_min_and_max_of_two_numbers_are_those_of_python(decorator: Any) -> None:
    compiled = decorator(_extremes)
    numbers = [0.0, -0.0, 1.5, -3.0, np.inf, np.nan]
    for a, b in itertools.product(numbers, numbers):
        for real, i, j in ((float, 3, 5), (np.float32, 5, 3), (float, np.int32(2), -7)):
            mine, plain = np.zeros(5), np.zeros(5)
            largest = compiled(real(a), real(b), i, j, mine)
            expected = _extremes(real(a), real(b), i, j, plain)
            assert largest == expected
            assert mine.tobytes() == plain.tobytes(), (a, b, i, j)
