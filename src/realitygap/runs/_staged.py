"""Many runs of one condition, generation by generation: the road for every platform and task.

A block of runs goes forward together. Each stage of a generation (decode, try, score, keep, breed) is one call of a
compiled function over the whole block, and the stages are those that the whole-run kernel of `jyro` composes: where
both roads apply, they give the same rows, bit for bit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels import _block
from realitygap.kernels._block import NoveltyRoom, RunRows, RunRules, Runs
from realitygap.kernels._genome import Genomes, NeatRules, make_genomes
from realitygap.kernels._network import Networks, make_networks
from realitygap.trials import PlatformTrials, open_trials

from ._condition import Condition

# Trials of a block: so many that calls from Python cost little beside them, so few that a block stays near.
BLOCK_TRIALS = 4096
LEAST_RUNS = 32


class _Block(NamedTuple):
    """Room for a block of r runs of n individuals, t = r * n trials."""

    runs: Runs
    genomes: Genomes
    children: Genomes
    networks: Networks
    which: NDArray[np.int32]  # (t,) 0, 1, ...
    counters: NDArray[np.uint32]  # (t, 3)
    novelty: NoveltyRoom


def runs_together(population: int) -> int:
    """Runs that a block has where there are enough."""
    return max(LEAST_RUNS, -(-BLOCK_TRIALS // population))


def run_staged(
    condition: Condition, rules: RunRules, first_replicate: int, rows: RunRows, room: int, hidden_room: int
) -> bool:
    """Carry out one run for each place of `rows`, replicate `first_replicate` and on.

    Args:
        condition: As resolved.
        rules: Its rules.
        first_replicate: Number of the first run.
        rows: Written.
        room, hidden_room: Genes and hidden nodes that a genome may have; those of `rows`.

    Returns:
        Whether all genomes found room; if not, the rows are worth nothing and want more room.
    """
    neat = condition.neat_rules
    total = rows.fitness.shape[0]
    together = min(runs_together(rules.population), total)
    trials = open_trials(
        condition.jyro,
        condition.arena.arena(),
        neat,
        inputs=condition.network_inputs,
        noise=condition.noise,
        bias_value=condition.neat.bias_value,
    )
    block = _make_block(condition, neat, rules, together, room, hidden_room)
    for first_run in range(0, total, together):
        n_runs = min(together, total - first_run)
        if not _run_block(
            condition, trials, neat, rules, block, first_replicate + first_run, n_runs, rows, first_run
        ):
            return False
    return True


def _make_block(
    condition: Condition, neat: NeatRules, rules: RunRules, n_runs: int, room: int, hidden_room: int
) -> _Block:
    grid = condition.arena.arena().grid
    n_trials = n_runs * rules.population
    return _Block(
        runs=_block.make_runs(rules, grid.n_cells, n_runs),
        genomes=make_genomes(n_trials, neat.n_outputs, room, hidden_room),
        children=make_genomes(n_trials, neat.n_outputs, room, hidden_room),
        networks=make_networks(n_trials, neat, room, hidden_room),
        which=np.arange(n_trials, dtype=np.int32),
        counters=np.zeros((n_trials, 3), np.uint32),
        novelty=_block.make_novelty_room(rules, grid.columns, grid.rows),
    )


def _run_block(
    condition: Condition,
    trials: PlatformTrials,
    neat: NeatRules,
    rules: RunRules,
    block: _Block,
    first_replicate: int,
    n_runs: int,
    rows: RunRows,
    first_row: int,
) -> bool:
    """A block of runs from the first generation to the last; whether all genomes found room."""
    key, first = np.uint64(condition.key), np.int64(first_replicate)
    n_trials = n_runs * rules.population
    n_cells = condition.arena.arena().grid.n_cells
    is_novelty = rules.selection in (_block.NOVELTY, _block.NEAREST_NOVELTY)
    runs, genomes, children = block.runs, block.genomes, block.children
    _block.begin_runs(runs, genomes, n_runs, neat, rules, key, first)
    if genomes.full[0]:
        return False
    for generation in range(rules.n_generations):
        _block.decode_runs(
            genomes, block.networks, block.counters, n_runs, neat, rules, key, first, generation
        )
        tried = trials.carry_out(
            block.networks,
            block.which[:n_trials],
            condition.key,
            block.counters[:n_trials],
            ends=is_novelty and rules.count_ends,
        )
        batch = tried.batch
        counts = np.stack([batch.n_line, batch.n_ends, batch.n_stalls], axis=1)
        _block.cover_runs(runs, n_runs, counts, rules, n_cells)
        if is_novelty:
            visited = tried.ends if rules.count_ends else batch.cells
            _block.select_novel(runs, n_runs, visited, counts, tried.ended, rules, block.novelty)
        _block.keep_runs(runs, genomes, n_runs, batch.cells, counts, rows, first_row, generation)
        if generation + 1 < rules.n_generations:
            _block.breed_runs(runs, genomes, children, n_runs, neat, rules, key, first, generation)
        if children.full[0]:
            return False
        genomes, children = children, genomes
    return True
