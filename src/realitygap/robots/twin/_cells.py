"""The cells of a grid that a line crosses."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from realitygap.world import Grid


def cells_along(path: NDArray[np.float64], grid: Grid) -> tuple[int, ...]:
    """Cells along a line, in order of first visit, columns * row + column.

    Args:
        path: (n, >= 2) x and y of its points [m].
        grid: Of cells.
    """
    from realitygap.kernels.tasks.coverage import (  # compiled code takes a while to import
        to_grid,
        visit,
        visit_line,
    )

    found = np.zeros(grid.n_cells, np.bool_)
    order = np.zeros(grid.n_cells, np.int64)
    size = (grid.columns, grid.rows)
    n, before, was = 0, (math.inf, math.inf), None
    for x, y in path[:, :2].tolist():
        at = to_grid(x, grid.x, grid.cell), to_grid(y, grid.y, grid.cell)
        cell = math.floor(at[0]), math.floor(at[1])
        if was is None:
            n = int(visit(*cell, *size, found, order, n))
        elif cell != was:
            n = int(visit_line(*before, *at, *size, found, order, n))
        before, was = at, cell
    return tuple(order[:n].tolist())
