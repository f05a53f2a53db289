"""Which half-open cells a straight line visits, in exact fractions."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction

Cell = tuple[int, int]


def cell_of(u: Fraction, v: Fraction) -> Cell:
    """A cell holds its left and lower border."""
    return math.floor(u), math.floor(v)


def cells_on_line(u0: float, v0: float, u1: float, v1: float) -> list[Cell]:
    """The start's cell, every cell that the line shares more than a point with, and the end's cell.

    Between two neighboring crossings of grid lines the line lies in one cell, that of the middle. So at a
    corner the two cells beside it, which share a point with the line at most, are not visited.
    """
    a, b, c, d = (Fraction(value) for value in (u0, v0, u1, v1))
    crossings = {Fraction(0), Fraction(1)}
    for start, end in [(a, c), (b, d)]:
        for border in range(math.floor(min(start, end)), math.ceil(max(start, end)) + 1):
            if min(start, end) < border < max(start, end):
                crossings.add((border - start) / (end - start))
    ordered = sorted(crossings)
    cells = [cell_of(a, b)]
    for before, after in itertools.pairwise(ordered):
        middle = (before + after) / 2
        cells.append(cell_of(a + middle * (c - a), b + middle * (d - b)))
    cells.append(cell_of(c, d))
    return cells


def first_visits(cells: list[Cell], columns: int, rows: int) -> list[int]:
    """Numbers, columns * row + column, of the cells inside the grid, each once, in order."""
    inside = [columns * row + column for column, row in cells if 0 <= column < columns and 0 <= row < rows]
    return list(dict.fromkeys(inside))
