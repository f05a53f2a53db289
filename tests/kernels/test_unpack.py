"""Calls of kernels from Python: each kind of argument arrives, and what does not fit is an error."""

from typing import NamedTuple

import numpy as np
import pytest

from realitygap.kernels.compile.decorators import kernel

numba = pytest.importorskip("numba")


class Inner(NamedTuple):
    cube: np.ndarray
    is_on: bool


class Outer(NamedTuple):
    row: np.ndarray
    inner: Inner
    pair: tuple
    rate: float


@kernel
def describe(outer, key, small, single, point, out):
    """Write a number that depends on each argument."""
    out[0] = outer.row[1] + 10 * outer.row.shape[0]
    out[1] = outer.inner.cube[1, 2, 3]
    out[2] = outer.inner.cube.shape[0] + 10 * outer.inner.cube.shape[1] + 100 * outer.inner.cube.shape[2]
    out[3] = 1 if outer.inner.is_on else 0
    out[4] = outer.pair[0][0] + outer.pair[1][0, 1]
    out[5] = outer.rate
    out[6] = key >> np.uint64(60)
    out[7] = small
    out[8] = single
    out[9] = point[0] if point.size > 0 else -1
    return out[0] > 0


def arguments(**changed):
    cube = np.arange(120.0).reshape(4, 5, 6)
    values = {
        "outer": Outer(
            np.arange(9.0)[::3],
            Inner(cube, True),
            (np.array([7], np.int32), np.array([[1, 2]], np.uint8)),
            0.25,
        ),
        "key": np.uint64(15 << 60),
        "small": np.int32(-3),
        "single": np.float32(0.1),
        "point": np.zeros(0, np.bool_),
        "out": np.zeros(10),
    }
    return values | changed


def test_each_kind_of_argument_arrives():
    values = arguments()
    assert describe(*values.values()) is True
    expected = [3 + 30, 1 * 30 + 2 * 6 + 3, 4 + 50 + 600, 1, 7 + 2, 0.25, 15, -3, float(np.float32(0.1)), -1]
    np.testing.assert_array_equal(values["out"], expected)


def test_views_arrive_with_their_strides():
    values = arguments()
    outer = values["outer"]
    cube = np.asfortranarray(outer.inner.cube)[::1, ::-1, :]
    values["outer"] = outer._replace(inner=Inner(cube, False), row=outer.row[::-1])
    describe(*values.values())
    np.testing.assert_array_equal(values["out"][:4], [3 + 30, cube[1, 2, 3], 654, 0])


def test_arguments_of_other_types_are_compiled_again():
    values = arguments(small=-4.5, single=2, point=np.array([True]))
    describe(*values.values())
    np.testing.assert_array_equal(values["out"][7:], [-4.5, 2, 1])


def test_unknown_arguments_are_an_error():
    if numba.config.DISABLE_JIT:
        pytest.skip("Numba is switched off")
    with pytest.raises(numba.errors.NumbaError):
        describe(*arguments(small="3").values())
