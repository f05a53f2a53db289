"""Elites, the best genome of each cell of a space of descriptors, and children of them (MAP-Elites).

Source: Mouret & Clune, "Illuminating search spaces by mapping elites" (2015), with the variation of NEAT. Cells of a
CVT are those of Vassiliades, Chatzilygeroudis & Mouret (2018). Where trials are noisy, a cell may hold several genomes,
as in Flageat & Cully (2020), and elites may be tried again. Without cells, genomes compete by dominated novelty
(Bahlous-Boldi, Faldor and others 2025, arXiv 2502.00593), or by novelty and local competition (Lehman & Stanley 2011).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import inlined, shared
from realitygap.kernels.math.philox import FIRST, PURPOSE_CHILD, make_stream

from .crossover import crossover
from .genome import Genomes, copy_genome, next_below, next_uniform
from .mutation import mutate, start_generation


class Cells(NamedTuple):
    """The cells of a space of d descriptors: a grid, or the nearest of c centroids."""

    low: NDArray[np.float64]  # (d,)
    high: NDArray[np.float64]  # (d,)
    size: NDArray[np.int64]  # (d,) cells along each descriptor; of a grid
    centroids: NDArray[np.float64]  # (c, d) as parts of the range; (0, d) of a grid


class Elites(NamedTuple):
    """The genomes of c cells with room for p of them each, and the order in which cells were filled.

    Genomes of cell k are in the places p * k to p * k + p - 1. An archive without cells has one place for each genome.
    """

    genomes: Genomes  # c * p rows
    fitness: NDArray[np.float64]  # (c * p,) mean over the trials
    descriptors: NDArray[np.float64]  # (c * p, d) means
    batch: NDArray[np.int32]  # (c * p,) in which the genome was told last; -1: empty
    individual: NDArray[np.int32]  # (c * p,) its place in that batch
    tries: NDArray[np.int32]  # (c * p,) how often it was told
    best: NDArray[np.int32]  # (c,) place of the elite of each cell; -1: empty
    filled: NDArray[np.int32]  # (c,) cells, the first filled one first
    rank: NDArray[np.int32]  # (c,) of each cell in `filled`
    n_filled: NDArray[np.int64]  # (1,)
    worth: NDArray[
        np.float64
    ]  # (1, c + n) room for the novelty of a batch of n; (4, c + n) of local competition
    nearest: NDArray[np.float64]  # (2, k) room for distances and fitness of neighbors; (2, 0) of cells


def make_elites(n_cells, n_descriptors, genomes, depth=1, batch=0, neighbors=0, local=False):
    """Return an empty archive.

    Args:
        n_cells: Number of cells, or of genomes without cells.
        n_descriptors: Numbers that describe a genome.
        genomes: A row for each place; none if the archive keeps no genomes.
        depth: Genomes of a cell.
        batch: Individuals of a batch; of an archive without cells.
        neighbors: Neighbors of novelty; 0 for cells.
        local: True for novelty and local competition, False for dominated novelty.
    """
    n = n_cells * depth
    return Elites(
        genomes,
        np.full(n, -math.inf),
        np.zeros((n, n_descriptors)),
        np.full(n, -1, np.int32),
        np.zeros(n, np.int32),
        np.zeros(n, np.int32),
        np.full(n_cells, -1, np.int32),
        np.zeros(n_cells, np.int32),
        np.zeros(n_cells, np.int32),
        np.zeros(1, np.int64),
        np.zeros((4 if local else 1, n_cells + batch if neighbors else 0)),
        np.zeros((2, neighbors)),
    )


@inlined
def cell_of(descriptors, row, cells):
    """The cell of a descriptor; one out of range counts as at the end of the range."""
    d = cells.low.size
    if cells.centroids.shape[0] == 0:
        index = 0
        for k in range(d):
            part = (descriptors[row, k] - cells.low[k]) / (cells.high[k] - cells.low[k])
            part = min(part, 1.0) if part > 0.0 else 0.0  # also of NaN, which rows of others may have
            place = int(math.floor(part * cells.size[k]))
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


@inlined
def _find_best(elites, cell, depth):
    """Make the fittest genome of a cell its elite, the one in the first place of equally fit ones."""
    best = -1
    for place in range(cell * depth, (cell + 1) * depth):
        if elites.batch[place] >= 0 and (best < 0 or elites.fitness[place] > elites.fitness[best]):
            best = place
    elites.best[cell] = best


@inlined
def _remove(elites, place, depth):
    """Empty a place."""
    cell = place // depth
    elites.batch[place] = -1
    elites.fitness[place] = -math.inf
    if elites.best[cell] == place:
        _find_best(elites, cell, depth)
        if elites.best[cell] < 0:
            n = elites.n_filled[0] - 1
            last = elites.filled[n]
            elites.filled[elites.rank[cell]] = last
            elites.rank[last] = elites.rank[cell]
            elites.n_filled[0] = n


@inlined
def _put(elites, place, cell, fitness, descriptors, tries, batch, row):
    """Let an individual have a place."""
    elites.fitness[place] = fitness[row]
    elites.batch[place] = batch
    elites.individual[place] = row
    elites.tries[place] = tries[row]
    for k in range(descriptors.shape[1]):
        elites.descriptors[place, k] = descriptors[row, k]
    if elites.best[cell] < 0:
        elites.filled[elites.n_filled[0]] = cell
        elites.rank[cell] = elites.n_filled[0]
        elites.n_filled[0] += 1
    if elites.best[cell] < 0 or fitness[row] > elites.fitness[elites.best[cell]]:
        elites.best[cell] = place


@inlined
def _nearest_to(elites, fitness, descriptors, cells, one, only_fitter):
    """Return the mean distance of one to its nearest neighbors, and how many of them are less fit.

    Infinite and 0 without neighbors. Numbers below that of places are places of the archive; others are individuals of
    the batch. Of equally near ones the lower numbers count.

    Args:
        elites, fitness, descriptors, cells: As `place_results`.
        one: Number of the one.
        only_fitter: True to count those only that are fitter, or as fit with a lower number.
    """
    c = elites.best.size
    nearest = elites.nearest
    d = descriptors.shape[1]
    own = elites.fitness[one] if one < c else fitness[one - c]
    n = 0
    for other in range(c + fitness.size):
        if other == one or (other < c and elites.batch[other] < 0):
            continue
        value = elites.fitness[other] if other < c else fitness[other - c]
        if only_fitter and (value < own or (value == own and other > one)):
            continue
        distance = 0.0
        for k in range(d):
            here = elites.descriptors[one, k] if one < c else descriptors[one - c, k]
            there = elites.descriptors[other, k] if other < c else descriptors[other - c, k]
            off = (here - there) / (cells.high[k] - cells.low[k])
            distance += off * off
        if n < nearest.shape[1]:
            n += 1
        elif distance >= nearest[0, n - 1]:
            continue
        at = n - 1
        while at > 0 and nearest[0, at - 1] > distance:
            nearest[0, at] = nearest[0, at - 1]
            nearest[1, at] = nearest[1, at - 1]
            at -= 1
        nearest[0, at] = distance
        nearest[1, at] = value
    if n == 0:
        return math.inf, 0
    total = 0.0
    n_less_fit = 0
    for k in range(n):
        total += math.sqrt(nearest[0, k])
        n_less_fit += nearest[1, k] < own
    return total / n, n_less_fit


@inlined
def _crowding(worth, one, objective):
    """Return how far the neighbors of one in its front are apart, by an objective; infinite at the ends.

    Those of the front have -2 in row 2. Equal ones are in the order of their numbers.
    """
    own = worth[objective, one]
    below = -math.inf
    above = math.inf
    least = math.inf
    most = -math.inf
    for other in range(worth.shape[1]):
        if worth[2, other] != -2:
            continue
        value = worth[objective, other]
        least = min(least, value)
        most = max(most, value)
        if value < own or (value == own and other < one):
            below = max(below, value)
        elif other != one:
            above = min(above, value)
    if below == -math.inf or above == math.inf:
        return math.inf
    return (above - below) / (most - least) if most > least else 0.0


@inlined
def _dominates(worth, one, other):
    """Return whether one is at least as good by both objectives, and better by one of them."""
    return (
        worth[0, one] >= worth[0, other]
        and worth[1, one] >= worth[1, other]
        and (worth[0, one] > worth[0, other] or worth[1, one] > worth[1, other])
    )


@inlined
def _rank(worth, n_kept):
    """Overwrite row 0 with values of which the n largest are to be kept: by front, then by crowding distance.

    Source: Deb, Pratap, Agarwal & Meyarivan (2002), NSGA-II.

    Args:
        worth: (4, m): two objectives, and in row 2 a 0, or -1 for those that are not there. Row 3 is room.
        n_kept: Number of those to be kept.
    """
    m = worth.shape[1]
    for one in range(m):
        worth[3, one] = math.inf if worth[2, one] < 0 else -1.0
        if worth[2, one] < 0:
            continue
        for other in range(m):
            if worth[2, other] >= 0 and _dominates(worth, other, one):
                worth[2, one] += 1  # row 2: how many others of those that have no front dominate it
    left = n_kept
    while left > 0:
        n_front = 0
        for one in range(m):
            if worth[2, one] == 0:
                worth[2, one] = -2
                n_front += 1
        if n_front == 0:
            break
        for one in range(m):
            if worth[2, one] != -2:
                continue
            if n_front <= left:
                worth[3, one] = math.inf
            else:
                far = _crowding(worth, one, 0) + _crowding(worth, one, 1)
                worth[3, one] = min(far, np.finfo(np.float64).max)  # less than of those that are kept anyway
            for other in range(m):
                if worth[2, other] > 0 and _dominates(worth, one, other):
                    worth[2, other] -= 1
        for one in range(m):
            if worth[2, one] == -2:
                worth[2, one] = -3
        left -= n_front
    for one in range(m):
        worth[0, one] = worth[3, one]


@inlined
def _keep_novel(fitness, descriptors, tries, cells, elites, batch, kept):
    """Keep the most novel of the archive and a batch; of equal ones those of lower number.

    By dominated novelty, or by novelty and the number of the nearest neighbors that are less fit.
    """
    c = elites.best.size
    n = fitness.size
    worth = elites.worth
    is_local = worth.shape[0] > 1
    surplus = elites.n_filled[0] + n - c
    for one in range(c + n):
        is_there = one >= c or elites.batch[one] >= 0
        if is_there:
            novelty, n_less_fit = _nearest_to(elites, fitness, descriptors, cells, one, not is_local)
        else:
            novelty = math.inf  # nobody to be removed
            n_less_fit = 0
        worth[0, one] = novelty
        if is_local:
            worth[1, one] = n_less_fit
            worth[2, one] = 0 if is_there else -1
    if is_local:
        _rank(worth, c)
    for row in range(n):
        kept[row] = 0
    for _ in range(surplus):
        least = -1
        for one in range(c + n):
            is_there = elites.batch[one] >= 0 if one < c else kept[one - c] == 0
            if is_there and (least < 0 or worth[0, one] <= worth[0, least]):
                least = one
        if least < c:
            _remove(elites, least, 1)
        else:
            kept[least - c] = -1
    place = 0
    for row in range(n):
        if kept[row] < 0:
            continue
        while elites.batch[place] >= 0:
            place += 1
        kept[row] = place
        _put(elites, place, place, fitness, descriptors, tries, batch, row)


@shared
def place_results(fitness, descriptors, again, tries, cells, elites, batch, kept):
    """Place what individuals of a batch did, in their order, without their genomes.

    One that finds no room in its cell takes the place of the least fit there, the first of several, if it is fitter.
    Without cells the archive keeps those with the largest dominated novelty, or the first by novelty and local
    competition; of equal ones those in lower places, and before those of the batch.

    Args:
        fitness: (n,) finite. Overwritten with the mean over all that was told of a genome.
        descriptors: (n, d) finite. Overwritten in the same way.
        again: (n,) int32 places of the elites that were tried again; -1 for a new genome.
        tries: (n,) int32, written: how often each was told.
        cells: The cells.
        elites: Written. Elites that were tried again leave their places first.
        batch: Number of this batch.
        kept: (n,) int32, written: place in the archive, -1 if there is none.
    """
    d = cells.low.size
    depth = elites.fitness.size // elites.best.size
    for row in range(fitness.size):
        place = again[row]
        tries[row] = 1
        if place < 0:
            continue
        tries[row] += elites.tries[place]
        fitness[row] = elites.fitness[place] + (fitness[row] - elites.fitness[place]) / tries[row]
        for k in range(d):
            mean = elites.descriptors[place, k]
            descriptors[row, k] = mean + (descriptors[row, k] - mean) / tries[row]
        _remove(elites, place, depth)
    if elites.nearest.size:
        _keep_novel(fitness, descriptors, tries, cells, elites, batch, kept)
        return
    for row in range(fitness.size):
        cell = cell_of(descriptors, row, cells)
        place = cell * depth
        for other in range(place + 1, (cell + 1) * depth):
            if elites.fitness[other] < elites.fitness[place]:
                place = other
        kept[row] = -1
        if not fitness[row] > elites.fitness[place]:
            continue
        kept[row] = place
        _put(elites, place, cell, fitness, descriptors, tries, batch, row)


@shared
def place_elites(genomes, fitness, descriptors, again, tries, cells, elites, batch, kept):
    """As `place_results`, and keep the genomes, whose room is that of the elites."""
    place_results(fitness, descriptors, again, tries, cells, elites, batch, kept)
    for row in range(fitness.size):
        if kept[row] >= 0:
            copy_genome(genomes, row, elites.genomes, kept[row])


@inlined
def _least_tried(elites, n, found):
    """Write the places of the n elites that were tried least often, those first whose cells were filled first."""
    k = 0
    tries = 0
    while k < n:
        next_tries = np.iinfo(np.int32).max
        for rank in range(elites.n_filled[0]):
            place = elites.best[elites.filled[rank]]
            if elites.tries[place] > tries:
                next_tries = min(next_tries, elites.tries[place])
            elif elites.tries[place] == tries and k < n:
                found[k] = place
                k += 1
        tries = next_tries


@shared
def vary_elites(elites, share, n_again, rules, innovations, key, replicate, batch, children, parents, again):
    """Fill `children` with elites to be tried again, and with children of elites, which are drawn with equal chances.

    Those are tried again that were tried least often; of those tried equally often, those whose cells were filled
    first.

    Where `children.full` is set afterwards, a gene found no room and everything written is worth nothing.

    Args:
        elites: At least one.
        share: Share of children with two parents. All are mutated, but those that `rules.crossover_only` excepts.
        n_again: Number of elites to be tried again, less than n.
        rules: NEAT's rates and choices; those of species have no effect.
        innovations: The numbers of the run; what arose in the batch before is forgotten first.
        key, replicate, batch: Which random numbers; `batch` is that of the children.
        children: Room for n genomes.
        parents: (n, 2) int32, written: places of elites; -1 where there is no second parent.
        again: (n,) int32, written: place of the elite that is tried again; -1 for a child.
    """
    start_generation(innovations)
    n_filled = elites.n_filled[0]
    cursor = children.cursor
    n_again = min(n_again, n_filled)
    _least_tried(elites, n_again, again)
    for child in range(n_again):
        copy_genome(elites.genomes, again[child], children, child)
        parents[child, 0] = again[child]
        parents[child, 1] = -1
    for child in range(n_again, children.n_connections.size):
        again[child] = -1
        stream = make_stream(key, replicate, batch, child, FIRST, PURPOSE_CHILD)
        cursor[0] = 0
        first = elites.best[elites.filled[next_below(stream, cursor, n_filled)]]
        second = np.int32(-1)
        if next_uniform(stream, cursor) < share:
            second = elites.best[elites.filled[next_below(stream, cursor, n_filled)]]
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
