"""Many runs of one condition, generation by generation: the road for every platform and task.

A block of runs goes forward together. Each stage of a generation (decode, try, score, keep, breed) is one call of a
compiled function over the whole block, and the stages are those that the whole-run kernel of `jyro` composes: where
both roads apply, they give the same rows, bit for bit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.neat import block as block_kernels
from realitygap.kernels.neat.block import NoveltyRoom, RunRows, RunRules, Runs
from realitygap.kernels.neat.genome import Genomes, make_genomes
from realitygap.kernels.neat.network import Networks, make_networks
from realitygap.platforms import open_trials, scores_of, traced_at_once

from ._condition import Condition
from ._map_elites import Archives
from ._teams import draw_teams, mean_of_teams

# Trials of a block: enough that the overhead of calls from Python is small, but few enough to fit into the cache.
BLOCK_TRIALS = 4096
LEAST_RUNS = 32

# Cells of the archives of a block: with some 1,000 bytes for the elite of each, 100 MB.
MOST_ELITES = 100_000


class _Block(NamedTuple):
    """Room for a block of r runs of n individuals, t = r * n trials."""

    runs: Runs
    genomes: Genomes
    children: Genomes
    networks: Networks
    which: NDArray[np.int32]  # (t,) 0, 1, ...
    counters: NDArray[np.uint32]  # (t, 3)
    novelty: NoveltyRoom


class _Scored(NamedTuple):
    """The results of the trials of one generation."""

    cells: NDArray[np.uint8]  # (t, c) along the line, in order of first visit
    ends: NDArray[np.uint8]  # (t, c) at the ends of steps, where they were asked for
    counts: NDArray[np.int32]  # (t, 3)
    ended: NDArray[np.float64]  # (t, 2)
    drawn: NDArray[np.float64]  # (t, d)
    fitness: NDArray[np.float64]  # (t,) by the task; (0,) where that is coverage
    descriptors: NDArray[np.float64]  # (t, d) where selection is by elites


def runs_together(population: int) -> int:
    """Return the number of runs in a full block."""
    return max(LEAST_RUNS, -(-BLOCK_TRIALS // population))


def run_staged(
    condition: Condition, rules: RunRules, first_replicate: int, rows: RunRows, room: int, hidden_room: int
) -> bool:
    """Run one replicate for each place of `rows`, numbered from `first_replicate`.

    Args:
        condition: Condition as resolved.
        rules: Rules of the run.
        first_replicate: Number of the first run.
        rows: Written.
        room, hidden_room: Genes and hidden nodes that a genome may have; those of `rows`.

    Returns:
        True if there was room for all genomes. Otherwise the rows are invalid and need more room.

    Raises:
        TaskError: A function of the user's own failed.
    """
    total = rows.fitness.shape[0]
    together = runs_together(rules.population)
    if condition.selection == "map-elites":
        in_trials = -(-BLOCK_TRIALS // (rules.population * condition.repeats))
        together = max(1, min(in_trials, MOST_ELITES // condition.archive.n_places))
    together = min(together, total)
    staged = _Staged(condition, rules, together, room, hidden_room)
    for first_run in range(0, total, staged.together):
        n_runs = min(staged.together, total - first_run)
        if not staged.carry_out(first_replicate + first_run, n_runs, rows, first_run):
            return False
    return True


class _Staged:
    """Room and rules for blocks of at most `together` runs, one block after the other."""

    def __init__(
        self, condition: Condition, rules: RunRules, together: int, room: int, hidden_room: int
    ) -> None:
        self.condition, self.rules, self.together = condition, rules, together
        self.arena = condition.arena.arena()
        self.neat = condition.neat_rules
        self.task = None if condition.coverage is not None else condition.task_of_trials
        self.trials = open_trials(
            condition.on,
            self.arena,
            self.neat,
            inputs=condition.network_inputs,
            noise=condition.noise,
            bias_value=condition.neat.bias_value,
        )
        grid, n_trials = self.arena.grid, together * rules.population
        self.block = _Block(
            runs=block_kernels.make_runs(rules, grid.n_cells, together),
            genomes=make_genomes(n_trials, self.neat.n_outputs, room, hidden_room),
            children=make_genomes(n_trials, self.neat.n_outputs, room, hidden_room),
            networks=make_networks(n_trials, self.neat, room, hidden_room),
            which=np.arange(n_trials, dtype=np.int32),
            counters=np.zeros((n_trials, 3), np.uint32),
            novelty=block_kernels.make_novelty_room(rules, grid.columns, grid.rows),
        )
        self.which = self.block.which
        self.needs_trace = self.task is not None and self.task.needs_trace
        self.archives: Archives | None = None
        if condition.selection == "map-elites":
            self.needs_trace |= condition.archive.needs_trace
            self.archives = Archives(
                condition.archive,
                self.trials.arena,
                condition.key,
                together,
                rules.population,
                self.neat,
                room,
                hidden_room,
            )
        self.teams = np.empty((0, rules.population, self.arena.n_robots), np.int32)

    def carry_out(self, first_replicate: int, n_runs: int, rows: RunRows, first_row: int) -> bool:
        """Run a block from the first generation to the last. Return whether all genomes found room."""
        neat, rules, block = self.neat, self.rules, self.block
        key, first = np.uint64(self.condition.key), np.int64(first_replicate)
        runs, genomes, children = block.runs, block.genomes, block.children
        block_kernels.begin_runs(runs, genomes, n_runs, neat, rules, key, first)
        if self.archives is not None:
            self.archives.empty()
        if genomes.full[0]:
            return False
        for generation in range(rules.n_generations):
            block_kernels.decode_runs(
                genomes, block.networks, block.counters, n_runs, neat, rules, key, first, generation
            )
            self._choose_teams(first_replicate, n_runs, generation)
            scored = self._try(n_runs * rules.population)
            scored = self._select(scored, n_runs)
            block_kernels.keep_runs(
                runs,
                genomes,
                n_runs,
                scored.cells,
                scored.counts,
                scored.ended,
                rows,
                first_row,
                generation,
            )
            self._keep(scored, n_runs, rows, first_row, generation)
            if generation + 1 < rules.n_generations and self.archives is not None:
                places = scored.descriptors.reshape(n_runs, rules.population, -1)
                self.archives.breed(
                    runs,
                    genomes,
                    children,
                    places,
                    neat,
                    rules,
                    self.condition.key,
                    first_replicate,
                    generation,
                )
            elif generation + 1 < rules.n_generations:
                block_kernels.breed_runs(runs, genomes, children, n_runs, neat, rules, key, first, generation)
            if children.full[0]:
                return False
            genomes, children = children, genomes
        return True

    def _choose_teams(self, first_replicate: int, n_runs: int, generation: int) -> None:
        """Choose the networks of the trials of a generation, if each robot has another one."""
        if self.condition.arena.networks == "one":
            return
        n, key, n_robots = self.rules.population, self.condition.key, self.arena.n_robots
        self.teams = np.stack(
            [draw_teams(key, first_replicate + run, generation, n, n_robots) for run in range(n_runs)]
        )
        first = np.arange(n_runs, dtype=np.int32)[:, None, None] * np.int32(n)
        self.which = (self.teams + first).reshape(-1, n_robots)

    def _try(self, n: int) -> _Scored:
        """Run all trials of n individuals: together, or in portions if every step is kept."""
        n *= self.condition.repeats
        if not self.needs_trace:
            return self._try_some(0, n)
        size = traced_at_once(self.trials, self.neat.n_inputs, is_single=self.condition.on.is_single)
        parts = [self._try_some(first, min(first + size, n)) for first in range(0, n, size)]
        return _Scored(*(np.concatenate(values) for values in zip(*parts, strict=True)))

    def _try_some(self, first: int, last: int) -> _Scored:
        """Return trials `first` up to `last` of a generation, scored by the task."""
        which, counters = self.which[first:last], self.block.counters[first:last]
        if self.condition.repeats > 1:
            who, repeat = np.divmod(np.arange(first, last), self.condition.repeats)
            which, counters = self.which[who], self.block.counters[who]
            counters[:, 1] += repeat.astype(np.uint32)  # as `make_stream` numbers repeats
        tried = self.trials.carry_out(
            self.block.networks,
            which,
            self.condition.key,
            counters,
            ends=self._is_novelty and self.rules.count_ends,
            trace=self.needs_trace,
        )
        batch = tried.batch
        fitness = np.empty(0)
        if self.task is not None:
            fitness = scores_of(self.task, self.trials, tried, self.condition.network_inputs)
        counts = np.stack([batch.n_line, batch.n_ends, batch.n_stalls], axis=1)
        descriptors = np.empty((len(which), 0))
        if self.archives is not None:
            descriptors = self.condition.archive.describe(tried, self.trials, self.condition.network_inputs)
        return _Scored(batch.cells, tried.ends, counts, tried.ended, batch.drawn, fitness, descriptors)

    @property
    def _is_novelty(self) -> bool:
        return self.rules.selection in (block_kernels.NOVELTY, block_kernels.NEAREST_NOVELTY)

    def _select(self, scored: _Scored, n_runs: int) -> _Scored:
        """Write the values that selection uses into the block's fitness.

        Returns:
            One trial of each individual, its first, with the means of its descriptors.
        """
        runs, rules = self.block.runs, self.rules
        if self.archives is not None:
            return self._average(scored, n_runs)
        if self.task is None:
            block_kernels.cover_runs(runs, n_runs, scored.counts, rules, self.arena.grid.n_cells)
        else:
            runs.fitness[:n_runs] = scored.fitness.reshape(n_runs, -1)
        if self.condition.arena.networks == "each":
            for run, teams in enumerate(self.teams):
                runs.fitness[run] = mean_of_teams(runs.fitness[run], teams)
        if self._is_novelty:
            visited = scored.ends if rules.count_ends else scored.cells
            block_kernels.select_novel(
                runs, n_runs, visited, scored.counts, scored.ended, rules, self.block.novelty
            )

        return scored

    def _average(self, scored: _Scored, n_runs: int) -> _Scored:
        """As `_select`, of individuals that were each tried several times."""
        repeats, fitness = self.condition.repeats, scored.fitness
        if self.task is None:
            fitness = scored.counts[:, int(self.rules.count_ends)] / self.arena.grid.n_cells
        self.block.runs.fitness[:n_runs] = fitness.reshape(n_runs, -1, repeats).mean(axis=2)
        first = _Scored._make(np.ascontiguousarray(values[::repeats]) for values in scored)
        means = scored.descriptors.reshape(len(first.counts), repeats, -1).mean(axis=1)
        return first._replace(descriptors=means)

    def _keep(self, scored: _Scored, n_runs: int, rows: RunRows, first_row: int, generation: int) -> None:
        """Copy the values that the kernels do not keep into the rows."""
        place = (slice(first_row, first_row + n_runs), generation)
        n = self.rules.population
        rows.drawn[place] = scored.drawn.reshape(n_runs, n, -1)
        rows.descriptor[place] = scored.descriptors.reshape(n_runs, n, -1)
        if self.condition.retries_elites and self.archives is not None:
            rows.tries[place] = self.archives.tries(n_runs)
        if self.task is not None:
            rows.task_fitness[place] = scored.fitness.reshape(n_runs, n)
