"""A block of runs that go forward together: what each does between the trials of its generations."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import inlined, kernel, shared
from realitygap.kernels.math.philox import FIRST, PURPOSE_NOISE, make_stream

from .distances import Behaviors, Measure, describe, make_behaviors, make_measure
from .elites import place_elites, vary_elites
from .genome import Genomes, first_genomes
from .mutation import Innovations, clear_innovations
from .network import decode
from .novelty import Archive, NearestRoom, nearest_archive_step, paper_archive_step
from .reproduction import next_generation
from .species import SpeciesTable, clear_species, speciate

COVERAGE = 0
NOVELTY = 1
NEAREST_NOVELTY = 2
RANDOM = 3
ELITES = 4


class RunRules(NamedTuple):
    """The settings of a run: its length, its population and its selection."""

    n_generations: int
    population: int
    selection: int
    count_ends: bool  # whether selection counts the cells at the ends of steps, else those along the line
    archive_size: int
    above_all: bool  # whether a newcomer must be more novel than everyone in the paper's archive
    by_column: bool  # whether behaviors are sorted by x first
    distance: int  # of behaviors: a kind of `_distances`
    neighbors: int
    archive_threshold: float
    archive_patience: int


class RunRows(NamedTuple):
    """The results of r runs of g generations of n individuals, with room for genomes."""

    fitness: NDArray[np.float64]  # (r, g, n)
    novelty: NDArray[np.float64]  # (r, g, n) NaN where selection is not novelty
    counts: NDArray[np.int32]  # (r, g, n, 3) cells along the line, at the ends of steps; blocked steps
    cells: NDArray[np.uint8]  # (r, g, n, c) along the line, in order of first visit
    species: NDArray[np.int32]  # (r, g, n)
    parents: NDArray[np.int32]  # (r, g, n, 2) -1: none
    n_connections: NDArray[np.int32]  # (r, g, n)
    n_hidden: NDArray[np.int32]  # (r, g, n)
    innovation: NDArray[np.int32]  # (r, g, n, room)
    source: NDArray[np.int32]  # (r, g, n, room)
    target: NDArray[np.int32]  # (r, g, n, room)
    weight: NDArray[np.float64]  # (r, g, n, room)
    enabled: NDArray[np.bool_]  # (r, g, n, room)
    hidden: NDArray[np.int32]  # (r, g, n, hidden room)
    bias: NDArray[np.float64]  # (r, g, n, outputs + hidden room)
    ended: NDArray[np.float64]  # (r, g, n, 2) [m from the start]
    # Written by the staged road only
    drawn: NDArray[np.float64]  # (r, g, n, d)
    task_fitness: NDArray[np.float64]  # (r, g, n)
    descriptor: NDArray[np.float64]  # (r, g, n, d) where selection is by elites
    tries: NDArray[np.int32]  # (r, g, n) how often a genome was tried; where elites are tried again


class Runs(NamedTuple):
    """The state of a block of r runs of n individuals, without their genomes."""

    species_of: NDArray[np.int32]  # (r, n)
    parents: NDArray[np.int32]  # (r, n, 2)
    fitness: NDArray[np.float64]  # (r, n)
    novelty: NDArray[np.float64]  # (r, n)
    # Of each run, with the run as first axis
    innovations: Innovations
    species: SpeciesTable
    archive: Archive
    archive_counters: NDArray[np.int64]  # (r, 2)
    archive_threshold: NDArray[np.float64]  # (r, 1)


class NoveltyRoom(NamedTuple):
    """Room for the novelty of a generation of n individuals in an arena of k cells."""

    behaviors: Behaviors  # n
    measure: Measure
    nearest: NearestRoom


@inlined
def rows_of(genomes, first, n):
    """The genomes of n individuals among others."""
    last = first + n
    return Genomes(
        genomes.n_connections[first:last],
        genomes.n_hidden[first:last],
        genomes.innovation[first:last],
        genomes.source[first:last],
        genomes.target[first:last],
        genomes.weight[first:last],
        genomes.enabled[first:last],
        genomes.hidden[first:last],
        genomes.bias[first:last],
        genomes.full,
        genomes.reached,
        genomes.cursor,
    )


@inlined
def _innovations_of(innovations, run):
    return Innovations(
        innovations.counters[run],
        innovations.link_source[run],
        innovations.link_target[run],
        innovations.link_number[run],
        innovations.split_gene[run],
        innovations.split_node[run],
        innovations.split_number[run],
    )


@inlined
def _species_of_run(species, run):
    return SpeciesTable(
        species.identity[run],
        species.size[run],
        species.best[run],
        species.improved[run],
        species.counts[run],
        species.floats[run],
        species.improved_at[run],
        species.numbers,
        species.shares,
    )


@inlined
def _archive_of(archive, run):
    return Archive(
        Behaviors(
            archive.behaviors.marks[run], archive.behaviors.n_cells[run], archive.behaviors.points[run]
        ),
        archive.among[run],
        archive.state[run],
        archive.place_of,
        archive.distance,
        archive.archived,
    )


def make_runs(rules, cells, n_runs):
    """Return the room of `n_runs` runs in an arena with a number of `cells`."""
    n = rules.population
    archive_room = rules.archive_size if rules.selection == NOVELTY else 0
    if rules.selection == NEAREST_NOVELTY:
        archive_room = n * rules.n_generations
    return Runs(
        species_of=np.zeros((n_runs, n), np.int32),
        parents=np.zeros((n_runs, n, 2), np.int32),
        fitness=np.zeros((n_runs, n)),
        novelty=np.full((n_runs, n), math.nan),
        innovations=Innovations(
            np.zeros((n_runs, 4), np.int64),
            np.zeros((n_runs, n), np.int32),
            np.zeros((n_runs, n), np.int32),
            np.zeros((n_runs, n), np.int32),
            np.zeros((n_runs, n), np.int32),
            np.zeros((n_runs, n), np.int32),
            np.zeros((n_runs, n), np.int32),
        ),
        species=SpeciesTable(
            np.zeros((n_runs, n), np.int32),
            np.zeros((n_runs, n), np.int32),
            np.zeros((n_runs, n)),
            np.zeros((n_runs, n), np.int32),
            np.zeros((n_runs, 2), np.int64),
            np.zeros((n_runs, 2)),
            np.zeros((n_runs, 1), np.int64),
            np.zeros((3, 2 * n), np.int64),
            np.zeros((4, n)),
        ),
        archive=Archive(
            Behaviors(
                np.zeros((n_runs, archive_room, cells), np.int32),
                np.zeros((n_runs, archive_room), np.int32),
                np.zeros((n_runs, archive_room, 2)),
            ),
            np.zeros((n_runs, rules.archive_size, rules.archive_size)),
            np.zeros((n_runs, 2), np.int64),
            np.zeros(n, np.int64),
            np.zeros((n, rules.archive_size)),
            np.zeros(rules.archive_size),
        ),
        archive_counters=np.zeros((n_runs, 2), np.int64),
        archive_threshold=np.zeros((n_runs, 1)),
    )


@kernel
def _begin(runs, genomes, run, neat, rules, key, replicate):
    """First genomes, in their species."""
    n = rules.population
    clear_innovations(neat, _innovations_of(runs.innovations, run))
    species = _species_of_run(runs.species, run)
    clear_species(neat, species)
    archive = _archive_of(runs.archive, run)
    archive.state[0] = archive.state[1] = 0
    runs.archive_counters[run, 0] = runs.archive_counters[run, 1] = 0
    runs.archive_threshold[run, 0] = rules.archive_threshold
    for row in range(n):
        runs.species_of[run, row] = 0
        runs.parents[run, row, 0] = runs.parents[run, row, 1] = -1
    own = rows_of(genomes, run * n, n)
    first_genomes(own, neat, key, replicate, FIRST)
    if rules.selection != RANDOM and rules.selection != ELITES:
        speciate(own, own, runs.fitness[run], runs.species_of[run], species, neat, key, replicate, FIRST)


@kernel
def _go_on(runs, genomes, children, run, neat, rules, key, replicate, generation):
    """The next generation of a run, into `children`."""
    n = rules.population
    new = rows_of(children, run * n, n)
    if rules.selection == RANDOM:
        first_genomes(new, neat, key, replicate, generation + 1)
        return
    next_generation(
        rows_of(genomes, run * n, n),
        runs.fitness[run],
        runs.species_of[run],
        _species_of_run(runs.species, run),
        neat,
        _innovations_of(runs.innovations, run),
        key,
        replicate,
        generation,
        new,
        runs.parents[run],
    )


@kernel
def _keep(runs, genomes, run, rows, to_run, generation):
    """Copy a generation of a run into the rows."""
    outputs = genomes.bias.shape[1] - genomes.hidden.shape[1]
    population = runs.fitness.shape[1]
    for k in range(population):
        row = run * population + k
        rows.fitness[to_run, generation, k] = runs.fitness[run, k]
        rows.novelty[to_run, generation, k] = runs.novelty[run, k]
        rows.species[to_run, generation, k] = runs.species_of[run, k]
        rows.parents[to_run, generation, k, 0] = runs.parents[run, k, 0]
        rows.parents[to_run, generation, k, 1] = runs.parents[run, k, 1]
        n = genomes.n_connections[row]
        h = genomes.n_hidden[row]
        rows.n_connections[to_run, generation, k] = n
        rows.n_hidden[to_run, generation, k] = h
        for gene in range(n):
            rows.innovation[to_run, generation, k, gene] = genomes.innovation[row, gene]
            rows.source[to_run, generation, k, gene] = genomes.source[row, gene]
            rows.target[to_run, generation, k, gene] = genomes.target[row, gene]
            rows.weight[to_run, generation, k, gene] = genomes.weight[row, gene]
            rows.enabled[to_run, generation, k, gene] = genomes.enabled[row, gene]
        for node in range(h):
            rows.hidden[to_run, generation, k, node] = genomes.hidden[row, node]
        for node in range(outputs + h):
            rows.bias[to_run, generation, k, node] = genomes.bias[row, node]


def make_novelty_room(rules, columns, rows):
    """Room for one run's novelty at a time."""
    n = rules.population
    archive_room = n * rules.n_generations if rules.selection == NEAREST_NOVELTY else 0
    return NoveltyRoom(
        behaviors=make_behaviors(n, columns * rows),
        measure=make_measure(rules.distance, columns, rows, rules.by_column),
        nearest=NearestRoom(np.zeros(n + archive_room), np.zeros(rules.neighbors), np.zeros(n, np.bool_)),
    )


@kernel
def _select_novel(runs, run, visited, counts, ended, rules, room):
    """Make the novelty of a run's generation what selection uses."""
    for row in range(rules.population):
        trial = run * rules.population + row
        counted = counts[trial, 1] if rules.count_ends else counts[trial, 0]
        x, y = ended[trial, 0], ended[trial, 1]
        describe(room.measure, visited[trial], counted, x, y, room.behaviors, row)
    archive = _archive_of(runs.archive, run)
    novelty = runs.novelty[run]
    if rules.selection == NOVELTY:
        paper_archive_step(room.behaviors, room.measure, archive, rules.above_all, novelty)
    else:
        nearest_archive_step(
            room.behaviors,
            room.measure,
            rules.archive_patience,
            archive.behaviors,
            archive.state,
            runs.archive_counters[run],
            runs.archive_threshold[run],
            room.nearest,
            novelty,
        )
    for row in range(rules.population):
        runs.fitness[run, row] = novelty[row]


@shared
def begin_runs(runs, genomes, n_runs, neat, rules, key, first_replicate):
    """First genomes of the first `n_runs` runs, in their species, and empty archives.

    Where `genomes.full` is set afterwards, a gene found no room and everything written is worth nothing.
    """
    for run in range(n_runs):
        _begin(runs, genomes, run, neat, rules, key, first_replicate + run)


@shared
def decode_runs(genomes, networks, counters, n_runs, neat, rules, key, first_replicate, generation):
    """The networks of a generation, and the fixed words of the random numbers of their trials."""
    n = rules.population
    for run in range(n_runs):
        for row in range(n):
            at = run * n + row
            decode(genomes, at, neat, networks, at)
            stream = make_stream(key, first_replicate + run, generation, row, FIRST, PURPOSE_NOISE)
            counters[at, 0] = stream[0]
            counters[at, 1] = stream[1]
            counters[at, 2] = stream[2]


@shared
def cover_runs(runs, n_runs, counts, rules, n_cells):
    """Coverage as what selection uses.

    Args:
        counts: (t, 3) int32 of all trials, run by run: cells along the line, cells at the ends of steps, stalls.
        n_cells: Reachable ones.
    """
    for run in range(n_runs):
        for row in range(rules.population):
            trial = run * rules.population + row
            counted = counts[trial, 1] if rules.count_ends else counts[trial, 0]
            runs.fitness[run, row] = counted / n_cells


@shared
def select_novel(runs, n_runs, visited, counts, ended, rules, room):
    """Make novelty by the distance of the rules what selection uses, and bring the archives up to date.

    Args:
        visited: (t, c) uint8 the cells that count of each trial, run by run; in order of first visit where the
            distance looks at it.
        counts: (t, 3) as in `cover_runs`.
        ended: (t, 2) where each trial ended [m].
    """
    for run in range(n_runs):
        _select_novel(runs, run, visited, counts, ended, rules, room)


@shared
def keep_runs(runs, genomes, n_runs, cells, counts, ended, rows, first_run, generation):
    """Copy a generation of all runs into rows `first_run` and on."""
    population = runs.fitness.shape[1]
    for run in range(n_runs):
        to_run = first_run + run
        for row in range(population):
            trial = run * population + row
            for k in range(3):
                rows.counts[to_run, generation, row, k] = counts[trial, k]
            for k in range(2):
                rows.ended[to_run, generation, row, k] = ended[trial, k]
            for k in range(counts[trial, 0]):
                rows.cells[to_run, generation, row, k] = cells[trial, k]
        _keep(runs, genomes, run, rows, to_run, generation)


@shared
def breed_runs(runs, genomes, children, n_runs, neat, rules, key, first_replicate, generation):
    """The next generation of all runs, into `children`; `children.full` as in `begin_runs`."""
    for run in range(n_runs):
        _go_on(runs, genomes, children, run, neat, rules, key, first_replicate + run, generation)


@shared
def breed_elites(
    runs,
    genomes,
    children,
    run,
    descriptors,
    again,
    tries,
    kept,
    cells,
    elites,
    share,
    n_again,
    neat,
    rules,
    key,
    replicate,
    generation,
):
    """Keep the elites of a batch of one run, and write their children; `children.full` as in `begin_runs`.

    Args:
        descriptors, again, tries, kept, cells, elites, share, n_again: As in `place_elites` and `vary_elites`; `again`
            is read and written.
        runs: Fitness is overwritten with means. Parents are written: numbers of individuals, counted from the first of
            the run.
    """
    n = rules.population
    own = rows_of(genomes, run * n, n)
    place_elites(own, runs.fitness[run], descriptors, again, tries, cells, elites, generation, kept)
    parents = runs.parents[run]
    vary_elites(
        elites,
        share,
        n_again,
        neat,
        _innovations_of(runs.innovations, run),
        key,
        replicate,
        generation + 1,
        rows_of(children, run * n, n),
        parents,
        again,
    )
    for child in range(n):
        for k in range(2):
            place = parents[child, k]
            if place >= 0:
                parents[child, k] = elites.batch[place] * n + elites.individual[place]
