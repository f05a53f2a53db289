"""Distances of behaviors: how different two trials were, by the cells that they visited or by where they ended.

All of them are compiled here, over behaviors in a form that suits each: marks of 32 bits and a point. A measure says
which distance is meant, and holds what it looks up.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import inlined, kernel
from realitygap.kernels.math.bits import count_bits

PAPER = 0
ORDERED = 1
JACCARD = 2
HAMMING = 3
FINAL = 4
EDIT = 5
ALIGNMENT = 6

GAP = 1.0  # what a cell costs that only one of two aligned behaviors has [cells]
_BITS = 31  # cells in a mark, which stays above zero


class CellTable(NamedTuple):
    """The c cells of a grid as places: numbers in whose order behaviors are sorted.

    Two places differ by a number that says how many columns and rows apart their cells are.
    """

    rank: NDArray[np.int32]  # (c,) how many cells have a lower place, by the number of the cell
    place: NDArray[np.int32]  # (c,) by rank
    span: NDArray[np.float64]  # (2 p + 1,) their distance [cells] by p + the difference of two places


class Measure(NamedTuple):
    """A distance of behaviors in a grid of c cells."""

    kind: int
    table: CellTable
    cost: NDArray[np.float64]  # as the table's span: what it costs to put one cell for another [cells]
    room: NDArray[np.float64]  # (c + 1,)


class Behaviors(NamedTuple):
    """n behaviors, as a measure reads them: of its cells, c at most, only as many marks count as it needs."""

    marks: NDArray[
        np.int32
    ]  # (n, c) places of cells, sorted or in order of first visit; or a bit for each cell
    n_cells: NDArray[np.int32]  # (n,)
    points: NDArray[np.float64]  # (n, 2) where each trial ended [m]


def make_cell_table(columns, rows, by_column):
    """The cells of a grid, sorted by x, then y, as Python sorts pairs (`by_column`), or by y, then x."""
    number = np.arange(columns * rows, dtype=np.int32)
    x, y = number % columns, number // columns
    place = (2 * rows - 1) * x + y if by_column else (2 * columns - 1) * y + x
    order = np.argsort(place)
    across = np.arange(1 - columns, columns)[:, None]
    up = np.arange(1 - rows, rows)
    span = np.sqrt(across * across + up * up)
    span = span if by_column else span.T
    return CellTable(np.argsort(order).astype(np.int32), place[order], np.ascontiguousarray(span).reshape(-1))


def make_measure(kind, columns, rows, by_column):
    """A distance in a grid; `by_column` says how the paper sorts cells."""
    table = make_cell_table(columns, rows, by_column)
    cost = (table.span > 0).astype(np.float64) if kind == EDIT else table.span
    return Measure(kind, table, cost, np.zeros(columns * rows + 1))


def make_behaviors(n, cells):
    """Return room for n behaviors in a grid of `cells` cells."""
    return Behaviors(np.zeros((n, cells), np.int32), np.zeros(n, np.int32), np.zeros((n, 2)))


@kernel
def sort_cells(cells, n, table, places):
    """Write the places of n cells in ascending order.

    Args:
        cells: (>= n,) cell numbers, columns * row + column, each at most once.
        n: How many.
        table: Of the grid.
        places: (c,) int32, written: the first n are the cells'.
    """
    for rank in range(table.place.size):
        places[rank] = 0
    for k in range(n):
        places[table.rank[cells[k]]] = 1
    found = 0
    for rank in range(table.place.size):
        here = places[rank]
        places[found] = table.place[rank]
        found += here


@kernel
def pointwise_distance(one, n_one, other, n_other, span):
    """The distances of the cells at equal places of two lists, added up [cells].

    Of sorted cells it is the paper's distance (its section 2.4). Each cell without a counterpart counts with the
    largest distance in the grid. Four sums, so that one addition need not wait for the other.

    Args:
        one, other: (>= n,) places of the cells.
        n_one, n_other: How many each has.
        span: Of the grid's table.
    """
    shorter = min(n_one, n_other)
    first = 0.0
    second = 0.0
    third = 0.0
    fourth = 0.0
    k = 0
    while k + 4 <= shorter:
        first += _apart(one[k], other[k], span)
        second += _apart(one[k + 1], other[k + 1], span)
        third += _apart(one[k + 2], other[k + 2], span)
        fourth += _apart(one[k + 3], other[k + 3], span)
        k += 4
    while k < shorter:
        first += _apart(one[k], other[k], span)
        k += 1
    return ((first + second) + (third + fourth)) + span[0] * (max(n_one, n_other) - shorter)


@inlined
def _apart(one, other, span):
    # An unsigned index: one that may be below zero is looked at first.
    return span[np.uint64((span.size >> 1) + one - other)]


@kernel
def _set_bits(cells, n, marks):
    """Write n cells as bits."""
    for k in range(_words_of(marks.size)):
        marks[k] = 0
    for k in range(n):
        cell = np.int64(cells[k])
        marks[cell // _BITS] |= np.int32(1) << np.int32(cell % _BITS)


@inlined
def _words_of(cells):
    return (cells + _BITS - 1) // _BITS


@kernel
def describe(measure, cells, n, x, y, behaviors, row):
    """Write one behavior in the form that a measure reads.

    Args:
        measure: Which distance.
        cells: (>= n,) cell numbers, columns * row + column, each at most once, in order of first visit.
        n: How many.
        x, y: Where the trial ended [m].
        behaviors: Written at `row`.
    """
    marks = behaviors.marks[row]
    table = measure.table
    behaviors.n_cells[row] = n
    behaviors.points[row, 0] = x
    behaviors.points[row, 1] = y
    if measure.kind == PAPER:
        sort_cells(cells, n, table, marks)
    elif measure.kind == JACCARD or measure.kind == HAMMING:
        _set_bits(cells, n, marks)
    else:
        for k in range(n):
            marks[k] = table.place[table.rank[cells[k]]]


@kernel
def copy_behavior(behaviors, row, to, place):
    """Copy one behavior to a place among others."""
    for k in range(min(behaviors.marks.shape[1], to.marks.shape[1])):
        to.marks[place, k] = behaviors.marks[row, k]
    to.n_cells[place] = behaviors.n_cells[row]
    to.points[place, 0] = behaviors.points[row, 0]
    to.points[place, 1] = behaviors.points[row, 1]


@kernel
def alignment_cost(one, n_one, other, n_other, cost, row):
    """The least cost that makes one list of cells the other: put a cell for another, or leave one out of either.

    Args:
        one, other: (>= n,) places of the cells, in order of first visit.
        n_one, n_other: How many each has.
        cost: Of putting one cell for another, by the difference of their places; leaving one out costs `GAP`.
        row: (>= n_other + 1,) room.

    Source: Needleman & Wunsch (1970), with costs in place of scores; Wagner & Fischer (1974).
    """
    for k in range(n_other + 1):
        row[k] = k * GAP
    for i in range(n_one):
        diagonal = row[0]
        row[0] = (i + 1) * GAP
        left = row[0]
        for k in range(n_other):
            above = row[k + 1]
            put = diagonal + _apart(one[i], other[k], cost)
            left = min(min(put, above + GAP), left + GAP)
            row[k + 1] = left
            diagonal = above
    return row[n_other]


@kernel
def _set_distance(one, other, as_share):
    """Cells that one of two behaviors has alone; as a share of those that either has."""
    alone = 0
    either = 0
    for k in range(_words_of(one.size)):
        alone += count_bits(np.int32(one[k] ^ other[k]))
        either += count_bits(np.int32(one[k] | other[k]))
    if as_share:
        return alone / either if either > 0 else 0.0
    return np.float64(alone)


@inlined
def distance_of(measure, one, row, other, place):
    """The distance of one behavior and another.

    Args:
        measure: Which distance; its room is changed.
        one, row: Behaviors, and which of them.
        other, place: Others, and which of them.

    Returns:
        In cells (paper, ordered, hamming, edit), as a share (jaccard, alignment) or in meters (final).
    """
    kind = measure.kind
    if kind == FINAL:
        across = one.points[row, 0] - other.points[place, 0]
        up = one.points[row, 1] - other.points[place, 1]
        return np.sqrt(across * across + up * up)
    a, n_a = one.marks[row], np.int64(one.n_cells[row])
    b, n_b = other.marks[place], np.int64(other.n_cells[place])
    if kind == PAPER or kind == ORDERED:
        return pointwise_distance(a, n_a, b, n_b, measure.table.span)
    if kind == JACCARD or kind == HAMMING:
        return _set_distance(a, b, kind == JACCARD)
    cost = alignment_cost(a, n_a, b, n_b, measure.cost, measure.room)
    if kind == EDIT:
        return cost
    total = GAP * (n_a + n_b) + cost
    return 2.0 * cost / total if total > 0.0 else 0.0


@kernel
def distances_to(measure, one, row, others, n_others, distance):
    """One behavior against many.

    Args:
        measure, one, row: As in `distance_of`.
        others: Behaviors, of which the first `n_others` count.
        distance: (>= n_others,) float64, written.
    """
    for place in range(n_others):
        distance[place] = distance_of(measure, one, row, others, place)


@kernel
def distances_between(measure, behaviors, others, distance):
    """Many behaviors against many.

    Args:
        measure: As in `distance_of`.
        behaviors, others: n and m of them.
        distance: (n, m) float64, written.
    """
    for row in range(distance.shape[0]):
        distances_to(measure, behaviors, row, others, distance.shape[1], distance[row])


@kernel
def distances_in_pairs(measure, behaviors, distance):
    """The first behavior against the second, the third against the fourth, and so on.

    Args:
        measure: As in `distance_of`.
        behaviors: 2 n of them.
        distance: (n,) float64, written.
    """
    for k in range(distance.size):
        distance[k] = distance_of(measure, behaviors, 2 * k, behaviors, 2 * k + 1)
