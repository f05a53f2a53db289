"""The cells that a trace crosses, and their confidence."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from realitygap.world import Grid

from ._links import STEP
from ._trace import Trace

Floats = NDArray[np.float64]

DEEP = 0.008  # a line that comes so far into a cell crosses it for certain [m]
HALF_LINE = 0.001  # color no deeper in a cell than this may belong to a line in the next cell [m]
FAR = 0.006  # a line that keeps so far away from a cell does not [m]
FEATURES = (
    "one", "own", "own_shallow", "own_depth", "own_length", "link", "link_depth", "link_length", "link_doubt",
    "near", "left_out", "faint", "hidden",
)  # fmt: skip
"""Features of a cell that show whether a trace crosses it; each about 0 to 3."""

COEFFICIENTS = np.array(
    [-6.53, 7.109, -2.747, 2.196, 1.138, 3.034, 0.749, 0.085, 1.587, 1.875, 1.449, 1.816, -0.209]
)
"""Weights of the features, as `benchmarks/vision.py fit --sheets 48` finds them; it judges by other sheets."""


def visited_cells(trace: Trace, grid: Grid) -> Floats:
    """Return the probability that the trace crosses each cell, (c,).

    Args:
        trace: Trace of `follow_trace`.
        grid: Cells are numbered columns * row + column.

    Source: a logistic function of the features; `benchmarks/vision.py fit` finds coefficients on synthetic sheets.
    """
    return probabilities(cell_features(trace, grid))


def probabilities(features: Floats) -> Floats:
    """Return the probability that cells with these features (c, f) are crossed, (c,)."""
    score = features @ COEFFICIENTS
    return np.asarray(1 / (1 + np.exp(-np.clip(score, -30, 30))))


def cell_features(trace: Trace, grid: Grid) -> Floats:
    """Return the features of each cell, in the order of `FEATURES`, (c, f)."""
    from scipy import ndimage

    cells, depth = _places(trace, grid)
    trodden = trace.own | trace.links
    away = ndimage.distance_transform_edt(~trodden) * STEP if trodden.any() else np.full(trodden.shape, 1.0)
    n = grid.n_cells

    def count(mask: NDArray[np.generic]) -> Floats:
        weights = np.asarray(mask, np.float64)[cells >= 0]
        return np.asarray(np.bincount(cells[cells >= 0], weights, n), np.float64)

    def most(values: NDArray[np.generic], floor: float = 0.0) -> Floats:
        largest = np.full(n, floor)
        np.maximum.at(largest, cells[cells >= 0], np.asarray(values, np.float64)[cells >= 0])
        return largest

    own, links = count(trace.own), count(trace.links)
    has_own = own > 0
    own_depth = most(np.where(trace.own, depth, 0))
    has_link = (links > 0) & ~has_own
    is_bare = ~has_own & ~has_link
    nearest = -most(-np.minimum(away, FAR), -FAR)
    faint = count(np.where(trodden, 0, trace.presence))
    hidden = count(~trodden & (trace.hidden > 0.3))
    return np.column_stack(
        [
            np.ones(n),
            has_own,
            has_own * np.maximum(1 - own_depth / HALF_LINE, 0),
            own_depth / DEEP,
            np.log1p(own / 10),
            has_link,
            has_link * most(np.where(trace.links, depth, 0)) / DEEP,
            has_link * np.log1p(links / 10),
            has_link * count(trace.doubt) / np.maximum(links, 1),
            is_bare * (1 - nearest / FAR) ** 2,
            ~has_own * np.log1p(count(trace.left_out) / 5),
            ~has_own * np.log1p(faint / 5),
            ~has_own * np.log1p(hidden / 20),
        ]
    )


def _places(trace: Trace, grid: Grid) -> tuple[NDArray[np.int64], Floats]:
    """Return the cell of each point, -1 outside, and its distance from the border, at most `DEEP` [m], (h, w)."""
    rows, columns = trace.own.shape
    u = (trace.box[0] + (np.arange(columns) + 0.5) * STEP - grid.x) / grid.cell
    v = (trace.box[3] - (np.arange(rows) + 0.5) * STEP - grid.y) / grid.cell
    column, row = np.floor(u).astype(int), np.floor(v).astype(int)
    is_inside = ((row >= 0) & (row < grid.rows))[:, None] & ((column >= 0) & (column < grid.columns))
    cells = np.where(is_inside, grid.columns * row[:, None] + column, -1)
    from_side = np.minimum(u - column, column + 1 - u) * grid.cell
    from_end = np.minimum(v - row, row + 1 - v) * grid.cell
    return cells, np.minimum(np.minimum(from_end[:, None], from_side), DEEP)
