"""The grid of reachable cells, and those that a line visits."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import check_finite


@dataclass(frozen=True)
class Grid:
    """The reachable cells, whose visited share is coverage.

    Cell (column, row) is numbered `columns * row + column`, (0, 0) at the lower left. A cell holds its left
    and lower border, not its right and upper one.

    Attributes:
        x, y: Lower left corner [m].
        cell: Size of a cell [m].
        columns, rows: Number of columns and rows; at most 256 cells.
    """

    x: float
    y: float
    cell: float
    columns: int
    rows: int

    def __post_init__(self) -> None:
        """Raise a ValueError if a number is infinite or NaN."""
        check_finite(vars(self))

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return self.columns * self.rows

    @property
    def right_end(self) -> float:
        """Right end [m]."""
        return self.x + self.columns * self.cell

    @property
    def upper_end(self) -> float:
        """Upper end [m]."""
        return self.y + self.rows * self.cell

    def corners(self, cell: int) -> tuple[tuple[float, float], ...]:
        """Return the four corners of a cell [m], from the lower left one, counter-clockwise."""
        row, column = divmod(cell, self.columns)
        x, y = self.x + column * self.cell, self.y + row * self.cell
        return (x, y), (x + self.cell, y), (x + self.cell, y + self.cell), (x, y + self.cell)

    def cell_at(self, x: float, y: float) -> int | None:
        """Return the number of the cell that a point [m] lies in, columns * row + column; None outside of the grid."""
        column, row = int((x - self.x) // self.cell), int((y - self.y) // self.cell)
        if 0 <= column < self.columns and 0 <= row < self.rows:
            return self.columns * row + column
        return None


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
