"""The cells of a grid that a line visits."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ._arena import Grid


class VisitedCells:
    """Cells along a line that grows, columns * row + column, in the order of first visits.

    Args:
        grid: Grid of cells.
    """

    def __init__(self, grid: Grid) -> None:
        self._grid = grid
        self._visited = np.zeros(grid.n_cells, np.bool_)
        self._order = np.zeros(grid.n_cells, np.int64)
        self._n = 0
        self._at: tuple[float, float] | None = None

    def follow(self, points: Iterable[tuple[float, float]]) -> None:
        """Extend the line to each point [m], straight between them."""
        from realitygap.kernels.tasks.coverage import (  # compiled code takes a while to import
            to_grid,
            visit,
            visit_line,
        )

        grid = self._grid
        size = (grid.columns, grid.rows)
        for x, y in points:
            at = to_grid(x, grid.x, grid.cell), to_grid(y, grid.y, grid.cell)
            cell = math.floor(at[0]), math.floor(at[1])
            if self._at is None:
                self._n = int(visit(*cell, *size, self._visited, self._order, self._n))
            elif cell != (math.floor(self._at[0]), math.floor(self._at[1])):
                self._n = int(visit_line(*self._at, *at, *size, self._visited, self._order, self._n))
            self._at = at

    @property
    def cells(self) -> tuple[int, ...]:
        """All cells up to now."""
        return tuple(self._order[: self._n].tolist())


def cells_along(path: NDArray[np.float64], grid: Grid) -> tuple[int, ...]:
    """Return cells along a line, columns * row + column, in the order of first visits.

    Args:
        path: (n, >= 2) x and y of its points [m].
        grid: Grid of cells.
    """
    visited = VisitedCells(grid)
    visited.follow(path[:, :2].tolist())
    return visited.cells
