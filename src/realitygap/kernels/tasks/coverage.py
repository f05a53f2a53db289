"""Which cells of a grid a path visits, along its line and at the ends of its steps.

Positions are in grid units: one cell is 1 wide, (0, 0) is the grid's lower left corner. A cell holds its left
and lower border, not its right and upper one. A line through a corner goes on to the cell diagonally
opposite and visits neither of the other two.
"""

from __future__ import annotations

import math

from realitygap.kernels.compile.decorators import kernel

# A coordinate this near a border lies on it: a start on a cell junction must not fall to one side or the other
# by the last bit of a division. In the paper's arena 1e-9 cells are 8e-11 m.
BORDER_SNAP = 1e-9


@kernel
def to_grid(position, origin, cell):
    """A coordinate [m] in grid units, put on a cell border where it is within `BORDER_SNAP` of one."""
    value = (position - origin) / cell
    border = math.floor(value + 0.5)
    return border if abs(value - border) < BORDER_SNAP else value


@kernel
def visit(column, row, columns, rows, visited, order, n):
    """Note one cell; returns how many cells have been visited.

    Args:
        column, row: The cell; one outside the grid counts for nothing.
        columns, rows: Size of the grid.
        visited: (columns * rows,) bool, changed.
        order: (columns * rows,) cells in order of first visit, changed; cell = columns * row + column.
        n: How many there were.
    """
    if column < 0 or column >= columns or row < 0 or row >= rows:
        return n
    cell = columns * row + column
    if visited[cell]:
        return n
    visited[cell] = True
    order[n] = cell
    return n + 1


@kernel
def visit_line(u0, v0, u1, v1, columns, rows, visited, order, n):
    """Note the cells on the line from (u0, v0), whose own cell is noted already, to (u1, v1) [grid units].

    The line crosses as many borders as the cells of its ends are apart; they are taken in the order in which
    it meets them, two at once at a corner (Amanatides & Woo, 1987, with the number of steps fixed at the
    start, so that the last cell is always that of the end).
    """
    column = int(math.floor(u0))
    row = int(math.floor(v0))
    to_column = int(math.floor(u1)) - column
    to_row = int(math.floor(v1)) - row
    right = 1 if to_column > 0 else -1
    up = 1 if to_row > 0 else -1
    columns_over = abs(to_column)
    rows_over = abs(to_row)
    while columns_over > 0 or rows_over > 0:
        along_u = math.inf
        along_v = math.inf
        if columns_over > 0:
            along_u = ((column + 1 if right > 0 else column) - u0) / (u1 - u0)
        if rows_over > 0:
            along_v = ((row + 1 if up > 0 else row) - v0) / (v1 - v0)
        if along_u <= along_v:
            column += right
            columns_over -= 1
        if along_v <= along_u:
            row += up
            rows_over -= 1
        n = visit(column, row, columns, rows, visited, order, n)
    return n
