"""Whole runs: evolution from one seed, many of them in one call."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._compile import kernel
from ._evolve import next_generation
from ._genome import first_genomes, make_genomes
from ._mutation import make_innovations
from ._network import decode, make_networks
from ._novelty import nearest_archive_step, paper_archive_step, sort_cells
from ._philox import FIRST, PURPOSE_NOISE, make_stream
from ._species import make_species, speciate
from ._trial import make_trace, make_workspace, run_trial

COVERAGE = 0
NOVELTY = 1
NEAREST_NOVELTY = 2
RANDOM = 3


class RunRules(NamedTuple):
    """What a run selects for, and for how long."""

    n_generations: int
    population: int
    selection: int
    count_ends: bool  # whether selection counts the cells at the ends of steps, else those along the line
    archive_size: int
    above_all: bool  # whether a newcomer must be more novel than everyone in the paper's archive
    by_column: bool  # whether behaviors are sorted by x first
    padding: float  # distance for a cell without a counterpart [cells]
    neighbors: int
    archive_threshold: float
    archive_patience: int


class RunRows(NamedTuple):
    """What r runs of g generations of n individuals leave behind, with room for genomes."""

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


@kernel
def _keep_genomes(genomes, rows, run, generation):
    """Copy a generation's genomes into the rows."""
    outputs = genomes.bias.shape[1] - genomes.hidden.shape[1]
    for row in range(genomes.n_connections.size):
        n = genomes.n_connections[row]
        h = genomes.n_hidden[row]
        rows.n_connections[run, generation, row] = n
        rows.n_hidden[run, generation, row] = h
        for gene in range(n):
            rows.innovation[run, generation, row, gene] = genomes.innovation[row, gene]
            rows.source[run, generation, row, gene] = genomes.source[row, gene]
            rows.target[run, generation, row, gene] = genomes.target[row, gene]
            rows.weight[run, generation, row, gene] = genomes.weight[row, gene]
            rows.enabled[run, generation, row, gene] = genomes.enabled[row, gene]
        for node in range(h):
            rows.hidden[run, generation, row, node] = genomes.hidden[row, node]
        for node in range(outputs + h):
            rows.bias[run, generation, row, node] = genomes.bias[row, node]


@kernel
def run_replicates(scene, trial, neat, rules, key, first_replicate, rows):
    """Carry out one run for each place of `rows`, replicate `first_replicate` and on.

    Args:
        scene, trial, neat, rules: Where, how, by which NEAT and for what.
        key: The key of the condition's random numbers.
        first_replicate: Number of the first run.
        rows: Written; its genome room is the most that a genome may hold.

    Returns:
        Whether all genomes found room; if not, the rows are worth nothing and want more room.
    """
    n = rules.population
    room = rows.innovation.shape[3]
    hidden_room = rows.hidden.shape[3]
    cells = scene.columns * scene.rows
    genomes = make_genomes(n, neat.n_outputs, room, hidden_room)
    children = make_genomes(n, neat.n_outputs, room, hidden_room)
    networks = make_networks(n, neat, room, hidden_room)
    work = make_workspace(scene, neat.n_inputs + neat.n_outputs + hidden_room)
    trace = make_trace(scene, neat.n_inputs, -1)
    points = np.empty((n, cells, 2))
    n_points = np.empty(n, np.int32)
    is_novelty = rules.selection == NOVELTY or rules.selection == NEAREST_NOVELTY
    archive_room = rules.archive_size if rules.selection == NOVELTY else 0
    if rules.selection == NEAREST_NOVELTY:
        archive_room = n * rules.n_generations
    archive = np.empty((archive_room, cells, 2))
    n_archive = np.zeros(archive_room, np.int32)
    archive_state = np.zeros(2, np.int64)
    archive_counters = np.zeros(2, np.int64)
    archive_threshold = np.empty(1)
    fitness = np.empty(n)
    novelty = np.empty(n)
    for row in range(n):
        novelty[row] = math.nan
    species_of = np.zeros(n, np.int32)
    parents = np.empty((n, 2), np.int32)
    for run in range(rows.fitness.shape[0]):
        replicate = first_replicate + run
        innovations = make_innovations(neat, n)
        species = make_species(neat, n)
        archive_state[0] = archive_state[1] = 0
        archive_counters[0] = archive_counters[1] = 0
        archive_threshold[0] = rules.archive_threshold
        for row in range(n):
            species_of[row] = 0
            parents[row, 0] = parents[row, 1] = -1
        first_genomes(genomes, neat, key, replicate, FIRST)
        if rules.selection != RANDOM:
            speciate(genomes, genomes, fitness, species_of, species, neat, key, replicate, FIRST)
        for generation in range(rules.n_generations):
            for row in range(n):
                decode(genomes, row, neat, networks, row)
                stream = make_stream(key, replicate, generation, row, FIRST, PURPOSE_NOISE)
                n_line, n_ends, n_stalls = run_trial(
                    scene, trial, networks, row, neat, stream, work, rows.cells[run, generation, row], trace
                )
                rows.counts[run, generation, row, 0] = n_line
                rows.counts[run, generation, row, 1] = n_ends
                rows.counts[run, generation, row, 2] = n_stalls
                counted = n_ends if rules.count_ends else n_line
                fitness[row] = counted / cells
                if is_novelty:
                    visited = work.order_ends if rules.count_ends else rows.cells[run, generation, row]
                    sort_cells(visited, counted, scene.columns, scene.rows, rules.by_column, points[row])
                    n_points[row] = counted
            if rules.selection == NOVELTY:
                paper_archive_step(
                    points,
                    n_points,
                    rules.padding,
                    archive,
                    n_archive,
                    archive_state,
                    rules.above_all,
                    novelty,
                )
            elif rules.selection == NEAREST_NOVELTY:
                nearest_archive_step(
                    points,
                    n_points,
                    rules.padding,
                    rules.neighbors,
                    rules.archive_patience,
                    archive,
                    n_archive,
                    archive_state,
                    archive_counters,
                    archive_threshold,
                    novelty,
                )
            for row in range(n):
                if is_novelty:
                    fitness[row] = novelty[row]
                rows.fitness[run, generation, row] = fitness[row]
                rows.novelty[run, generation, row] = novelty[row]
                rows.species[run, generation, row] = species_of[row]
                rows.parents[run, generation, row, 0] = parents[row, 0]
                rows.parents[run, generation, row, 1] = parents[row, 1]
            _keep_genomes(genomes, rows, run, generation)
            if generation + 1 == rules.n_generations:
                break
            if rules.selection == RANDOM:
                first_genomes(genomes, neat, key, replicate, generation + 1)
                continue
            next_generation(
                genomes,
                fitness,
                species_of,
                species,
                neat,
                innovations,
                key,
                replicate,
                generation,
                children,
                parents,
            )
            if children.full[0]:
                return False
            genomes, children = children, genomes
    return True
