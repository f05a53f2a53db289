"""Novelty of behaviors: the paper's archive, and the nearest neighbors of Lehman & Stanley (2011).

A behavior is a list of cells, sorted; the distance of two is the paper's: the sum over their common length
of the distances of the cells at equal places, and the largest distance there is for each cell that only the
longer one has.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._compile import inlined, kernel


class CellTable(NamedTuple):
    """The c cells of a grid as places: numbers in whose order behaviors are sorted.

    Two places differ by a number that says how many columns and rows apart their cells are.
    """

    rank: NDArray[np.int32]  # (c,) how many cells have a lower place, by the number of the cell
    place: NDArray[np.int32]  # (c,) by rank
    span: NDArray[np.float64]  # (2 p + 1,) their distance [cells] by p + the difference of two places


class Archive(NamedTuple):
    """The paper's archive of at most m behaviors, and room for n individuals."""

    places: NDArray[np.int32]  # (m, c) as of `sort_cells`
    n_places: NDArray[np.int32]  # (m,)
    among: NDArray[np.float64]  # (m, m) distances of the archived behaviors; negative from each to itself
    state: NDArray[np.int64]  # (2,) behaviors in the archive; place of the oldest
    place_of: NDArray[np.int64]  # (n,) room
    distance: NDArray[np.float64]  # (n, m) room
    archived: NDArray[np.float64]  # (m,) room


def make_archive(n, size, cells):
    """An empty archive."""
    return Archive(
        np.zeros((size, cells), np.int32),
        np.zeros(size, np.int32),
        np.zeros((size, size)),
        np.zeros(2, np.int64),
        np.zeros(n, np.int64),
        np.zeros((n, size)),
        np.zeros(size),
    )


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
def sorted_cells_distance(one, n_one, other, n_other, span):
    """The paper's distance of two behaviors [cells] (its section 2.4).

    Each cell without a counterpart counts with the largest distance in the grid. Four sums, so that one
    addition need not wait for the other.

    Args:
        one, other: (>= n,) places of the cells, sorted.
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
def _copy_places(places, n, to):
    """Copy the n places of one behavior."""
    for k in range(n):
        to[k] = places[k]


@kernel
def _to_archive(archive, places, n_places, row, k, span):
    """Put one behavior at place k of the paper's archive."""
    _copy_places(places[row], n_places[row], archive.places[k])
    archive.n_places[k] = n_places[row]
    archive.among[k, k] = -1.0
    for other in range(archive.state[0]):
        if other != k:
            apart = sorted_cells_distance(
                archive.places[k], archive.n_places[k], archive.places[other], archive.n_places[other], span
            )
            archive.among[k, other] = apart
            archive.among[other, k] = apart


@kernel
def _bar(archive, above_all):
    """The novelty of the most novel behavior in the paper's archive, or of the least novel one."""
    size = archive.archived.size
    archive_novelty(archive.among, size, archive.archived)
    bar = archive.archived[0]
    for k in range(1, size):
        bar = max(bar, archive.archived[k]) if above_all else min(bar, archive.archived[k])
    return bar


@kernel
def paper_archive_step(places, n_places, span, archive, above_all, novelty):
    """Novelty of one generation against the paper's archive, which is then brought up to date.

    While the archive has room, the generation's behaviors are put in first, in the order of individuals, and
    then everyone is compared with the archive, itself left out. Afterwards each individual that was not put
    in, in order, replaces the archive's oldest behavior if its novelty is greater than that of the archived
    ones: of every one, or of the least novel one. Their novelty is their mean distance to one another.

    Args:
        places: (n, c) int32, sorted cells of each individual.
        n_places: (n,) int32.
        span: Of the grid's table.
        archive: Changed.
        above_all: Whether a newcomer must be more novel than all, else than the least novel one.
        novelty: (n,) float64, written [cells].
    """
    size = archive.n_places.size
    state = archive.state
    for row in range(novelty.size):
        archive.place_of[row] = -1
        if state[0] < size:
            _to_archive(archive, places, n_places, row, state[0], span)
            archive.place_of[row] = state[0]
            state[0] += 1
    for row in range(novelty.size):
        at = archive.place_of[row]
        for k in range(state[0]):
            archive.distance[row, k] = (
                archive.among[at, k]
                if at >= 0
                else sorted_cells_distance(
                    places[row], n_places[row], archive.places[k], archive.n_places[k], span
                )
            )
    archive_novelty(archive.distance, state[0], novelty)
    if state[0] < size:
        return
    bar = _bar(archive, above_all)
    for row in range(novelty.size):
        if archive.place_of[row] < 0 and novelty[row] > bar:
            _to_archive(archive, places, n_places, row, state[1], span)
            state[1] = (state[1] + 1) % size
            bar = _bar(archive, above_all)


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
    places, n_places, span, patience, archive, n_archive, state, counters, threshold, room, novelty
):
    """Novelty of one generation by nearest neighbors in population and archive, which then takes entries.

    Args:
        places: (n, c) int32, sorted cells of each individual.
        n_places: (n,) int32.
        span: Of the grid's table.
        patience: Evaluations without an entry after which the threshold falls.
        archive: (size, c) int32, changed; room for everyone who can enter.
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
                places[row], n_places[row], places[other], n_places[other], span
            )
        room.distance[row] = -1.0
        for place in range(state[0]):
            room.distance[n + place] = sorted_cells_distance(
                places[row], n_places[row], archive[place], n_archive[place], span
            )
        novelty[row] = mean_of_nearest(room.distance, n + state[0], room.nearest)
    admit(novelty, counters, threshold, patience, room.entered)
    for row in range(n):
        if room.entered[row]:
            _copy_places(places[row], n_places[row], archive[state[0]])
            n_archive[state[0]] = n_places[row]
            state[0] += 1
