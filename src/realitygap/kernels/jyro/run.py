"""Whole runs: evolution from one seed, many of them in one call."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import kernel
from realitygap.kernels.math.lanes import LANES, Lanes
from realitygap.kernels.neat.block import (
    NEAREST_NOVELTY,
    NOVELTY,
    NoveltyRoom,
    Runs,
    begin_runs,
    breed_runs,
    cover_runs,
    decode_runs,
    keep_runs,
    make_novelty_room,
    make_runs,
    select_novel,
)
from realitygap.kernels.neat.genome import Genomes, make_genomes
from realitygap.kernels.neat.network import Networks, make_networks
from realitygap.kernels.neat.wiring import Wiring, wire
from realitygap.kernels.tasks.marks import list_cells

from .trial import Trace, make_block, make_trace, run_block


class RunRoom(NamedTuple):
    """Room for a block of r runs of n individuals, t = r * n trials, in an arena of k cells."""

    runs: Runs
    genomes: Genomes
    children: Genomes
    networks: Networks
    lanes: Lanes
    wiring: Wiring
    trace: Trace  # keeps nothing
    which: NDArray[np.int32]  # (t,) 0, 1, ...
    counters: NDArray[np.uint32]  # (t, 3)
    cells: NDArray[np.uint8]  # (t, k)
    ends: NDArray[np.uint8]  # (t, k)
    counts: NDArray[np.int32]  # (t, 3)
    ended: NDArray[np.float64]  # (t, 2) where trials ended [m from the start]
    novelty: NoveltyRoom


def runs_together(population):
    """Runs whose individuals fill blocks of lanes without many being left over."""
    together = 1
    while together * population < 4 * LANES and (together * population) % LANES != 0:
        together += 1
    return together


def make_run_room(scene, neat, rules, n_runs, room, hidden_room):
    """Room for a block of runs, at most `n_runs`, with so much room for genes and hidden nodes a genome."""
    n = rules.population
    together = min(runs_together(n), n_runs)
    trials = together * n
    n_cells = scene.columns * scene.rows
    lanes, wiring = make_block(scene, neat, hidden_room)
    return RunRoom(
        runs=make_runs(rules, n_cells, together),
        genomes=make_genomes(trials, neat.n_outputs, room, hidden_room),
        children=make_genomes(trials, neat.n_outputs, room, hidden_room),
        networks=make_networks(trials, neat, room, hidden_room),
        lanes=lanes,
        wiring=wiring,
        trace=make_trace(scene.heading, scene.sensors.shape[0], neat.n_inputs, -1, 1),
        which=np.arange(trials, dtype=np.int32),
        counters=np.zeros((trials, 3), np.uint32),
        cells=np.zeros((trials, n_cells), np.uint8),
        ends=np.zeros((trials, n_cells), np.uint8),
        counts=np.zeros((trials, 3), np.int32),
        ended=np.zeros((trials, 2)),
        novelty=make_novelty_room(rules, scene.columns, scene.rows),
    )


@kernel
def run_replicates(scene, trial, neat, rules, key, first_replicate, room, rows):
    """Run one run for each place of `rows`, from replicate `first_replicate` upward.

    Runs go forward together, a block of them at a time, so that their trials fill the lanes. What comes of
    one does not depend on the others.

    Args:
        scene, trial, neat, rules: Where, how, by which NEAT and for what.
        key: The key of the condition's random numbers.
        first_replicate: Number of the first run.
        room: For as many genes a genome as `rows`.
        rows: Written; its genome room is the most that a genome may hold.

    Returns:
        Whether all genomes found room; if not, the rows are worth nothing and want more room.
    """
    runs, genomes, children, networks = room.runs, room.genomes, room.children, room.networks
    n = rules.population
    total = rows.fitness.shape[0]
    together = runs.fitness.shape[0]
    novelty = rules.selection == NOVELTY or rules.selection == NEAREST_NOVELTY
    for first_run in range(0, total, together):
        n_runs = min(together, total - first_run)
        first = first_replicate + first_run
        begin_runs(runs, genomes, n_runs, neat, rules, key, first)
        if genomes.full[0]:
            return False
        for generation in range(rules.n_generations):
            decode_runs(genomes, networks, room.counters, n_runs, neat, rules, key, first, generation)
            for first_trial in range(0, n_runs * n, LANES):
                n_lanes = min(LANES, n_runs * n - first_trial)
                wire(networks, room.which, first_trial, n_lanes, neat, room.wiring)
                run_block(
                    scene,
                    trial,
                    neat,
                    room.wiring,
                    key,
                    room.counters,
                    first_trial,
                    n_lanes,
                    room.lanes,
                    room.cells,
                    room.counts,
                    room.trace,
                )
                for lane in range(n_lanes):
                    room.ended[first_trial + lane, 0] = room.lanes.pose.x[lane]
                    room.ended[first_trial + lane, 1] = room.lanes.pose.y[lane]
                if rules.count_ends:
                    for lane in range(n_lanes):
                        list_cells(
                            room.lanes.ends, lane, scene.columns, scene.rows, room.ends[first_trial + lane]
                        )
            cover_runs(runs, n_runs, room.counts, rules, scene.columns * scene.rows)
            if novelty:
                visited = room.ends if rules.count_ends else room.cells
                select_novel(runs, n_runs, visited, room.counts, room.ended, rules, room.novelty)
            keep_runs(runs, genomes, n_runs, room.cells, room.counts, room.ended, rows, first_run, generation)
            if generation + 1 < rules.n_generations:
                breed_runs(runs, genomes, children, n_runs, neat, rules, key, first, generation)
            if children.full[0]:
                return False
            genomes, children = children, genomes
    return True
