"""Novelty of behaviors: the paper's archive, and the nearest neighbors of Lehman & Stanley (2011).

A behavior is a list of cells, sorted; the distance of two is the paper's: the sum over their common length
of the distances of the cells at equal places, and the largest distance there is for each cell that only the
longer one has.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._compile import inlined, kernel


class Archive(NamedTuple):
    """The paper's archive of at most m behaviors, and room for n individuals; cells as in `sort_cells`."""

    points: NDArray[np.uint8]  # (m, c, 2)
    n_points: NDArray[np.int32]  # (m,)
    among: NDArray[np.float64]  # (m, m) distances of the archived behaviors; negative from each to itself
    state: NDArray[np.int64]  # (2,) behaviors in the archive; place of the oldest
    place_of: NDArray[np.int64]  # (n,) room
    distance: NDArray[np.float64]  # (n, m) room
    archived: NDArray[np.float64]  # (m,) room


def make_archive(n, size, cells):
    """An empty archive."""
    return Archive(
        np.zeros((size, cells, 2), np.uint8),
        np.zeros(size, np.int32),
        np.zeros((size, size)),
        np.zeros(2, np.int64),
        np.zeros(n, np.int64),
        np.zeros((n, size)),
        np.zeros(size),
    )


def make_spans(columns, rows):
    """(columns, rows) distance of two cells so many columns and rows apart [cells]; the last is the largest."""
    spans = np.zeros((columns, rows))
    for column in range(columns):
        for row in range(rows):
            spans[column, row] = math.sqrt(column * column + row * row)
    return spans


@kernel
def sort_cells(cells, n, columns, rows, by_column, points):
    """Write the n cells as sorted (x, y) points.

    Args:
        cells: (>= n,) cell numbers, columns * row + column, each at most once.
        n: How many.
        columns, rows: Size of the grid.
        by_column: Sort by x, then y, as Python sorts pairs; else by y, then x.
        points: (>= n, 2) uint8, written [cells].
    """
    for k in range(n):
        row = cells[k] // columns
        column = cells[k] - columns * row
        rank = column * rows + row if by_column else row * columns + column
        place = k
        while place > 0:
            x = points[place - 1, 0]
            y = points[place - 1, 1]
            if (x * rows + y if by_column else y * columns + x) < rank:
                break
            points[place, 0] = x
            points[place, 1] = y
            place -= 1
        points[place, 0] = column
        points[place, 1] = row


@kernel
def sorted_cells_distance(one, n_one, other, n_other, spans):
    """The paper's distance of two behaviors [cells] (its section 2.4).

    Each cell without a counterpart counts with the largest distance in the grid. Four sums, so that one
    addition need not wait for the other.

    Args:
        one, other: (>= n, 2) sorted points.
        n_one, n_other: How many each has.
        spans: Of the grid.
    """
    shorter = min(n_one, n_other)
    first = 0.0
    second = 0.0
    third = 0.0
    fourth = 0.0
    k = 0
    while k + 4 <= shorter:
        first += _span(one, other, k, spans)
        second += _span(one, other, k + 1, spans)
        third += _span(one, other, k + 2, spans)
        fourth += _span(one, other, k + 3, spans)
        k += 4
    while k < shorter:
        first += _span(one, other, k, spans)
        k += 1
    padding = spans[spans.shape[0] - 1, spans.shape[1] - 1]
    return ((first + second) + (third + fourth)) + padding * (max(n_one, n_other) - shorter)


@inlined
def _span(one, other, k, spans):
    dx = np.int64(one[k, 0]) - np.int64(other[k, 0])
    dy = np.int64(one[k, 1]) - np.int64(other[k, 1])
    return spans[abs(dx), abs(dy)]


@kernel
def archive_novelty(distance, n_archive, novelty):
    """Mean distance of each individual to the archive, itself left out where it is in it.

    Args:
        distance: (n, >= n_archive) to each archived behavior; negative where that is the individual itself.
        n_archive: Behaviors in the archive.
        novelty: (n,) written; 0 where there is nothing to compare with.
    """
    for row in range(novelty.size):
        total = 0.0
        others = 0
        for k in range(n_archive):
            if distance[row, k] >= 0.0:
                total += distance[row, k]
                others += 1
        novelty[row] = total / others if others > 0 else 0.0


@kernel
def _cells_to_archive(points, n_points, row, archive, n_archive, k):
    """Put one behavior at place k of the archive."""
    n_archive[k] = n_points[row]
    for cell in range(n_points[row]):
        archive[k, cell, 0] = points[row, cell, 0]
        archive[k, cell, 1] = points[row, cell, 1]


@kernel
def _to_archive(archive, points, n_points, row, k, spans):
    """Put one behavior at place k of the paper's archive."""
    _cells_to_archive(points, n_points, row, archive.points, archive.n_points, k)
    archive.among[k, k] = -1.0
    for other in range(archive.state[0]):
        if other != k:
            apart = sorted_cells_distance(
                archive.points[k], archive.n_points[k], archive.points[other], archive.n_points[other], spans
            )
            archive.among[k, other] = apart
            archive.among[other, k] = apart


@kernel
def paper_archive_step(points, n_points, spans, archive, above_all, novelty):
    """Novelty of one generation against the paper's archive, which is then brought up to date.

    While the archive has room, the generation's behaviors are put in first, in the order of individuals, and
    then everyone is compared with the archive, itself left out. Afterwards each individual that was not put
    in, in order, replaces the archive's oldest behavior if its novelty is greater than that of the archived
    ones: of every one, or of the least novel one. Their novelty is their mean distance to one another.

    Args:
        points: (n, c, 2) uint8, sorted cells of each individual.
        n_points: (n,) int32.
        spans: Of the grid.
        archive: Changed.
        above_all: Whether a newcomer must be more novel than all, else than the least novel one.
        novelty: (n,) float64, written [cells].
    """
    size = archive.n_points.size
    state = archive.state
    for row in range(novelty.size):
        archive.place_of[row] = -1
        if state[0] < size:
            _to_archive(archive, points, n_points, row, state[0], spans)
            archive.place_of[row] = state[0]
            state[0] += 1
    for row in range(novelty.size):
        for k in range(state[0]):
            if archive.place_of[row] == k:
                archive.distance[row, k] = -1.0
            else:
                archive.distance[row, k] = sorted_cells_distance(
                    points[row], n_points[row], archive.points[k], archive.n_points[k], spans
                )
    archive_novelty(archive.distance, state[0], novelty)
    if state[0] < size:
        return
    for row in range(novelty.size):
        if archive.place_of[row] >= 0:
            continue
        archive_novelty(archive.among, size, archive.archived)
        bar = archive.archived[0]
        for i in range(1, size):
            bar = max(bar, archive.archived[i]) if above_all else min(bar, archive.archived[i])
        if novelty[row] > bar:
            _to_archive(archive, points, n_points, row, state[1], spans)
            state[1] = (state[1] + 1) % size


@kernel
def mean_of_nearest(distance, n, nearest):
    """Mean of the smallest of n distances (Lehman & Stanley 2011, sparseness); 0 where there is none.

    Args:
        distance: (>= n,) to everyone that counts; negative for the individual itself.
        n: How many.
        nearest: (k,) room: as many are averaged over, or all of them while there are fewer.
    """
    held = 0
    for other in range(n):
        value = distance[other]
        if value < 0.0 or (held == nearest.size and value >= nearest[held - 1]):
            continue
        place = held if held < nearest.size else held - 1
        while place > 0 and nearest[place - 1] > value:
            nearest[place] = nearest[place - 1]
            place -= 1
        nearest[place] = value
        held = min(held + 1, nearest.size)
    total = 0.0
    for i in range(held):
        total += nearest[i]
    return total / held if held > 0 else 0.0


@kernel
def admit(novelty, counters, threshold, patience, entered):
    """Who enters the archive of Lehman & Stanley (2011), in the order of individuals; moves the threshold.

    Args:
        novelty: (n,) of the individuals.
        counters: (2,) int64: evaluations since the last entry; entries in a row. Changed.
        threshold: (1,) float64, changed: -5 % after `patience` evaluations without an entry, +20 % when
            more than four enter in a row.
        patience: Evaluations.
        entered: (n,) bool, written.
    """
    for row in range(novelty.size):
        entered[row] = novelty[row] > threshold[0]
        if entered[row]:
            counters[0] = 0
            counters[1] += 1
            if counters[1] > 4:
                threshold[0] *= 1.2
                counters[1] = 0
        else:
            counters[0] += 1
            counters[1] = 0
            if counters[0] >= patience:
                threshold[0] *= 0.95
                counters[0] = 0


class NearestRoom(NamedTuple):
    """Room for one generation of n individuals against an archive of at most m."""

    distance: NDArray[np.float64]  # (n + m,)
    nearest: NDArray[np.float64]  # (k,)
    entered: NDArray[np.bool_]  # (n,)


@kernel
def nearest_archive_step(
    points, n_points, spans, patience, archive, n_archive, state, counters, threshold, room, novelty
):
    """Novelty of one generation by nearest neighbors in population and archive, which then takes entries.

    Args:
        points: (n, c, 2) uint8, sorted cells of each individual.
        n_points: (n,) int32.
        spans: Of the grid.
        patience: Evaluations without an entry after which the threshold falls.
        archive: (size, c, 2) uint8, changed; room for everyone who can enter.
        n_archive: (size,) int32, changed.
        state: (>= 1,) int64: behaviors in the archive. Changed.
        counters, threshold: As in `admit`.
        room: As many neighbors count as it has room for.
        novelty: (n,) float64, written [cells].
    """
    n = novelty.size
    for row in range(n):
        for other in range(n):
            room.distance[other] = sorted_cells_distance(
                points[row], n_points[row], points[other], n_points[other], spans
            )
        room.distance[row] = -1.0
        for place in range(state[0]):
            room.distance[n + place] = sorted_cells_distance(
                points[row], n_points[row], archive[place], n_archive[place], spans
            )
        novelty[row] = mean_of_nearest(room.distance, n + state[0], room.nearest)
    admit(novelty, counters, threshold, patience, room.entered)
    for row in range(n):
        if room.entered[row]:
            _cells_to_archive(points, n_points, row, archive, n_archive, state[0])
            state[0] += 1
