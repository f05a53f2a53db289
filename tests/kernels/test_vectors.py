"""Vectors of lanes: each operation against the same one on arrays, to the last bit."""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import kernel
from realitygap.kernels.math.lanes import ALIGNED, LANES, zeros
from realitygap.kernels.math.vectors import (
    WIDTH,
    any_of,
    load,
    load_row,
    pick,
    root,
    spread,
    store,
    store_row,
)


@kernel
def _combine(rows, row, results, touched):
    for lane in range(0, LANES, WIDTH):
        a, b = load(rows, 0, lane), load_row(row, lane)
        half = spread(rows.dtype.type(0.5))
        store(a * b + half - (-a), results, 0, lane)
        store(root(pick(a > b, a, b) / half), results, 1, lane)
        store(pick((a < b) & (b <= half), a, pick((a == b) | (a < half), b, half)), results, 2, lane)
        if any_of(a > half + half):
            store_row(half, touched, lane)


def test_vectors_compute_what_arrays_do():
    rng = np.random.default_rng(1)
    for dtype in (np.float32, np.float64):
        rows, row = rng.uniform(0, 1, (2, LANES)).astype(dtype), rng.uniform(0, 1, LANES).astype(dtype)
        rows[0, 3] = row[3]
        rows[0, WIDTH + 1] = 2.0
        results, touched = np.zeros((3, LANES), dtype), np.zeros(LANES, dtype)
        _combine(rows, row, results, touched)
        a, half = rows[0], dtype(0.5)
        np.testing.assert_array_equal(results[0], a * row + half + a)
        np.testing.assert_array_equal(results[1], np.sqrt(np.maximum(a, row) / half))
        both = np.where((a == row) | (a < half), row, half)
        np.testing.assert_array_equal(results[2], np.where((a < row) & (row <= half), a, both))
        assert touched.nonzero()[0].tolist() == list(range(WIDTH, 2 * WIDTH))


def test_rows_begin_at_a_cache_line():
    for shape in (LANES, (3, LANES)):
        room = zeros(shape, np.float32)
        assert room.ctypes.data % ALIGNED == 0
        assert room.flags.c_contiguous
        assert not room.any()
