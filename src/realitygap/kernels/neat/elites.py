"""Elites, the best genome of each cell of a space of descriptors, and children of them (MAP-Elites).

Source: Mouret & Clune, "Illuminating search spaces by mapping elites" (2015), with the variation of NEAT. Cells of a
CVT are those of Vassiliades, Chatzilygeroudis & Mouret (2018).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import inlined, shared
from realitygap.kernels.math.philox import FIRST, PURPOSE_CHILD, make_stream

from .crossover import crossover
from .genome import Genomes, copy_genome, make_genomes, next_below, next_uniform
from .mutation import mutate, start_generation


class Cells(NamedTuple):
    """The cells of a space of d descriptors: a grid, or the nearest of c centroids."""

    low: NDArray[np.float64]  # (d,)
    high: NDArray[np.float64]  # (d,)
    size: NDArray[np.int64]  # (d,) cells along each descriptor; of a grid
    centroids: NDArray[np.float64]  # (c, d) as parts of the range; (0, d) of a grid


class Elites(NamedTuple):
    """The elites of c cells, and the order in which cells were filled."""

    genomes: Genomes  # c rows
    fitness: NDArray[np.float64]  # (c,)
    descriptors: NDArray[np.float64]  # (c, d)
    batch: NDArray[np.int32]  # (c,) in which the elite was told; -1: empty
    individual: NDArray[np.int32]  # (c,) its place in that batch
    filled: NDArray[np.int32]  # (c,) cells, the first filled one first
    n_filled: NDArray[np.int64]  # (1,)


def make_elites(n_cells, n_descriptors, n_outputs, room, hidden_room):
    """Return an empty archive."""
    return Elites(
        make_genomes(n_cells, n_outputs, room, hidden_room),
        np.full(n_cells, -math.inf),
        np.zeros((n_cells, n_descriptors)),
        np.full(n_cells, -1, np.int32),
        np.zeros(n_cells, np.int32),
        np.zeros(n_cells, np.int32),
        np.zeros(1, np.int64),
    )


@inlined
def cell_of(descriptors, row, cells):
    """The cell of a descriptor; one out of range counts as at the end of the range."""
    d = cells.low.size
    if cells.centroids.shape[0] == 0:
        index = 0
        for k in range(d):
            part = (descriptors[row, k] - cells.low[k]) / (cells.high[k] - cells.low[k])
            place = int(math.floor(min(max(part, 0.0), 1.0) * cells.size[k]))
            index = index * cells.size[k] + min(place, cells.size[k] - 1)
        return index
    nearest = 0
    least = math.inf
    for centroid in range(cells.centroids.shape[0]):
        distance = 0.0
        for k in range(d):
            part = (descriptors[row, k] - cells.low[k]) / (cells.high[k] - cells.low[k])
            off = min(max(part, 0.0), 1.0) - cells.centroids[centroid, k]
            distance += off * off
        if distance < least:
            least = distance
            nearest = centroid
    return nearest


@shared
def cells_of(descriptors, cells, found):
    """Write the cell of each descriptor, (n, d), into `found`, (n,)."""
    for row in range(found.size):
        found[row] = cell_of(descriptors, row, cells)


@shared
def place_elites(genomes, fitness, descriptors, cells, elites, batch):
    """Keep those individuals, in their order, that are fitter than the elite of their cell.

    Args:
        genomes: n individuals; their room is that of the elites.
        fitness: (n,) finite.
        descriptors: (n, d) finite.
        cells: The cells.
        elites: Written. Of equally fit ones the earlier one stays.
        batch: Number of this batch.
    """
    for row in range(fitness.size):
        cell = cell_of(descriptors, row, cells)
        if not fitness[row] > elites.fitness[cell]:
            continue
        if elites.batch[cell] < 0:
            elites.filled[elites.n_filled[0]] = cell
            elites.n_filled[0] += 1
        copy_genome(genomes, row, elites.genomes, cell)
        elites.fitness[cell] = fitness[row]
        elites.batch[cell] = batch
        elites.individual[cell] = row
        for k in range(cells.low.size):
            elites.descriptors[cell, k] = descriptors[row, k]


@shared
def vary_elites(elites, share, rules, innovations, key, replicate, batch, children, parents):
    """Fill `children` with children of elites, which are drawn with equal chances.

    Where `children.full` is set afterwards, a gene found no room and everything written is worth nothing.

    Args:
        elites: At least one.
        share: Share of children with two parents. All are mutated, but those that `rules.crossover_only` excepts.
        rules: NEAT's rates and choices; those of species have no effect.
        innovations: The numbers of the run; what arose in the batch before is forgotten first.
        key, replicate, batch: Which random numbers; `batch` is that of the children.
        children: Room for n genomes.
        parents: (n, 2) int32, written: cells; -1 where there is no second parent.
    """
    start_generation(innovations)
    n_filled = elites.n_filled[0]
    cursor = children.cursor
    for child in range(children.n_connections.size):
        stream = make_stream(key, replicate, batch, child, FIRST, PURPOSE_CHILD)
        cursor[0] = 0
        first = elites.filled[next_below(stream, cursor, n_filled)]
        second = np.int32(-1)
        if next_uniform(stream, cursor) < share:
            second = elites.filled[next_below(stream, cursor, n_filled)]
            if second == first:
                second = np.int32(-1)
        is_mutated = True
        if second < 0:
            copy_genome(elites.genomes, first, children, child)
        else:
            crossover(
                elites.genomes,
                first,
                second,
                elites.fitness,
                rules,
                children,
                child,
                stream,
                cursor,
                children.reached,
            )
            is_mutated = next_uniform(stream, cursor) >= rules.crossover_only
        if is_mutated:
            mutate(children, child, rules, innovations, stream, cursor, children.reached)
        parents[child, 0] = first
        parents[child, 1] = second
