"""Novelty of behaviors: the paper's archive, and the nearest neighbors of Lehman & Stanley (2011).

A behavior is a list of cells, sorted; the distance of two is the paper's: the sum over their common length
of the distances of the cells at equal places, and the largest distance there is for each cell that only the
longer one has.
"""

from __future__ import annotations

import math

import numpy as np

from ._compile import kernel


@kernel
def sort_cells(cells, n, columns, rows, by_column, points):
    """Write the n cells as sorted (x, y) points.

    Args:
        cells: (>= n,) cell numbers, columns * row + column, each at most once.
        n: How many.
        columns, rows: Size of the grid.
        by_column: Sort by x, then y, as Python sorts pairs; else by y, then x.
        points: (>= n, 2) float64, written [cells].
    """
    here = np.zeros(columns * rows, np.bool_)
    for k in range(n):
        here[cells[k]] = True
    at = 0
    for k in range(columns * rows):
        if by_column:
            column, row = k // rows, k % rows
        else:
            row, column = k // columns, k % columns
        if here[columns * row + column]:
            points[at, 0] = column
            points[at, 1] = row
            at += 1


@kernel
def sorted_cells_distance(one, n_one, other, n_other, padding):
    """The paper's distance of two behaviors [cells] (its section 2.4).

    Args:
        one, other: (>= n, 2) sorted points.
        n_one, n_other: How many each has.
        padding: Distance for each cell without a counterpart.
    """
    shorter = min(n_one, n_other)
    total = 0.0
    for k in range(shorter):
        dx = one[k, 0] - other[k, 0]
        dy = one[k, 1] - other[k, 1]
        total += math.sqrt(dx * dx + dy * dy)
    return total + padding * (max(n_one, n_other) - shorter)


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
def paper_archive_step(points, n_points, padding, archive, n_archive, state, above_all, novelty):
    """Novelty of one generation against the paper's archive, which is then brought up to date.

    While the archive has room, the generation's behaviors are put in first, in the order of individuals, and
    then everyone is compared with the archive, itself left out. Afterwards each individual that was not put
    in, in order, replaces the archive's oldest behavior if its novelty is greater than that of the archived
    ones: of every one, or of the least novel one. Their novelty is their mean distance to one another.

    Args:
        points: (n, c, 2) sorted cells of each individual.
        n_points: (n,) int32.
        padding: Distance for each cell without a counterpart [cells].
        archive: (size, c, 2) float64, changed.
        n_archive: (size,) int32 cells of each archived behavior, changed.
        state: (2,) int64: behaviors in the archive; place of the oldest. Changed.
        above_all: Whether a newcomer must be more novel than all, else than the least novel one.
        novelty: (n,) float64, written [cells].
    """
    size = n_archive.size
    n = novelty.size
    place_of = np.empty(n, np.int64)
    for row in range(n):
        place_of[row] = -1
        if state[0] < size:
            _cells_to_archive(points, n_points, row, archive, n_archive, state[0])
            place_of[row] = state[0]
            state[0] += 1
    distance = np.empty((n, size))
    for row in range(n):
        for k in range(state[0]):
            if place_of[row] == k:
                distance[row, k] = -1.0
            else:
                distance[row, k] = sorted_cells_distance(
                    points[row], n_points[row], archive[k], n_archive[k], padding
                )
    archive_novelty(distance, state[0], novelty)
    if state[0] < size:
        return
    among = np.empty((size, size))
    archived = np.empty(size)
    for row in range(n):
        if place_of[row] >= 0:
            continue
        for i in range(size):
            among[i, i] = -1.0
            for j in range(i):
                among[i, j] = sorted_cells_distance(
                    archive[i], n_archive[i], archive[j], n_archive[j], padding
                )
                among[j, i] = among[i, j]
        archive_novelty(among, size, archived)
        bar = archived[0]
        for i in range(1, size):
            bar = max(bar, archived[i]) if above_all else min(bar, archived[i])
        if novelty[row] > bar:
            _cells_to_archive(points, n_points, row, archive, n_archive, state[1])
            state[1] = (state[1] + 1) % size


@kernel
def nearest_novelty(distance, k, novelty):
    """Mean distance of each individual to its k nearest others (Lehman & Stanley 2011, sparseness).

    Args:
        distance: (n, m) to everyone that counts; negative where it is the individual itself.
        k: Neighbors to average over; all of them while there are fewer.
        novelty: (n,) written; 0 where there is nothing to compare with.
    """
    nearest = np.empty(min(k, distance.shape[1]))
    for row in range(novelty.size):
        n = 0
        for other in range(distance.shape[1]):
            value = distance[row, other]
            if value < 0.0 or (n == nearest.size and value >= nearest[n - 1]):
                continue
            place = n if n < nearest.size else n - 1
            while place > 0 and nearest[place - 1] > value:
                nearest[place] = nearest[place - 1]
                place -= 1
            nearest[place] = value
            n = min(n + 1, nearest.size)
        total = 0.0
        for i in range(n):
            total += nearest[i]
        novelty[row] = total / n if n > 0 else 0.0


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


@kernel
def nearest_archive_step(
    points, n_points, padding, k, patience, archive, n_archive, state, counters, threshold, novelty
):
    """Novelty of one generation by nearest neighbors in population and archive, which then takes entries.

    Args:
        points: (n, c, 2) sorted cells of each individual.
        n_points: (n,) int32.
        padding: Distance for each cell without a counterpart [cells].
        k: Neighbors.
        patience: Evaluations without an entry after which the threshold falls.
        archive: (size, c, 2) float64, changed; room for everyone who can enter.
        n_archive: (size,) int32, changed.
        state: (>= 1,) int64: behaviors in the archive. Changed.
        counters, threshold: As in `admit`.
        novelty: (n,) float64, written [cells].
    """
    n = novelty.size
    held = state[0]
    distance = np.empty((n, n + held))
    for row in range(n):
        distance[row, row] = -1.0
        for other in range(row):
            distance[row, other] = sorted_cells_distance(
                points[row], n_points[row], points[other], n_points[other], padding
            )
            distance[other, row] = distance[row, other]
        for place in range(held):
            distance[row, n + place] = sorted_cells_distance(
                points[row], n_points[row], archive[place], n_archive[place], padding
            )
    nearest_novelty(distance, k, novelty)
    entered = np.empty(n, np.bool_)
    admit(novelty, counters, threshold, patience, entered)
    for row in range(n):
        if entered[row]:
            _cells_to_archive(points, n_points, row, archive, n_archive, state[0])
            state[0] += 1
