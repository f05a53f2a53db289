"""Controllers evolved in simulation, each tried on several noises: many runs go forward together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import StudyError
from realitygap.evolution import Genome, NoveltyArchive, Population
from realitygap.kernels._philox import MAX_REPEATS
from realitygap.runs import Condition
from realitygap.trials import NoiseKey, TrialBatch, paper_inputs, retry_genomes

RETRIES = 64
"""Trials on fresh noise by which champions are ranked: the one that a run found best was partly lucky."""


@dataclass(frozen=True)
class Champion:
    """The best individual of a run in simulation.

    Attributes:
        genome: Its genes.
        simulated: Mean share of cells that it visits in simulation, over fresh trials.
        visits: (c,) share of these trials in which it visits each cell.
    """

    genome: Genome
    simulated: float
    visits: NDArray[np.float64]


def refuse_other_tasks(condition: Condition) -> None:
    """Refuse conditions whose controllers a robot cannot be driven by, or whose worth nobody sees from outside.

    Raises:
        StudyError: Another task than coverage, other inputs than the paper's, a robot, or nothing selected.
    """
    if condition.coverage is None:
        raise StudyError(
            f"Condition {condition.name!r} has the task {condition.fitness_task.name!r}, expected coverage: of a trial "
            "on a target the visited cells are known. Choose another with --condition."
        )
    if condition.network_inputs != paper_inputs(condition.neat_rules):
        raise StudyError(
            f"The networks of condition {condition.name!r} see {', '.join(condition.network_inputs)}, expected the "
            f"paper's inputs: {', '.join(paper_inputs(condition.neat_rules))}."
        )
    if condition.is_physical or condition.selection == "random":
        raise StudyError(
            f"Condition {condition.name!r} has platform {condition.platform!r} and selection {condition.selection!r}, "
            "expected evolution in simulation: platform 'sim' or 'jyro', selection 'coverage' or 'novelty'."
        )


def evolve_champions(
    condition: Condition, runs: range, *, repeats: int, rank_on: Condition | None = None
) -> list[Champion]:
    """The champions of some runs, the best in simulation first.

    An individual is worth the mean over its repeats; novelty, where that selects, is of the first repeat. A champion is
    the individual that covered most on average in all generations of its run.

    Args:
        condition: Of the runs, on platform `sim` or `jyro`, with the task coverage.
        runs: Numbers of the replicates.
        repeats: Trials of each individual, every one on noise of its own.
        rank_on: The condition on whose platform and noise champions are ranked; `condition` when not given.

    Raises:
        StudyError: A condition as `refuse_other_tasks` says.
    """
    refuse_other_tasks(condition)
    populations = [_population(condition, run) for run in runs]
    archives = [_archive(condition) for _ in runs]
    best: list[tuple[float, Genome] | None] = [None] * len(runs)
    n = condition.neat.population
    for generation in range(condition.neat.generations):
        genomes = list(chain.from_iterable(each.ask() for each in populations))
        keys = [NoiseKey(condition.key, run, generation, k) for run in runs for k in range(n)]
        batch = try_repeatedly(condition, genomes, keys, range(repeats))
        coverage = batch.coverage_line.reshape(len(runs), n, repeats).mean(axis=2)
        for row, population in enumerate(populations):
            k = int(coverage[row].argmax())
            found = best[row]
            if found is None or coverage[row, k] > found[0]:
                best[row] = coverage[row, k], genomes[row * n + k]
            archive = archives[row]
            first = [batch.behavior((row * n + k) * repeats) for k in range(n)]
            population.tell(coverage[row] if archive is None else archive.update(first))
    champions = [found[1] for found in best if found is not None]
    return rank_genomes(rank_on or condition, champions, runs.start)


def rank_genomes(condition: Condition, genomes: Sequence[Genome], first: int = 0) -> list[Champion]:
    """Genomes tried `RETRIES` times in simulation, the best first.

    Args:
        condition: Whose platform and noise.
        genomes: At least one.
        first: Which random numbers: those of this replicate.
    """
    # beyond the generations that evolution uses, so that the noise is fresh
    key = NoiseKey(condition.key, first, condition.neat.generations)
    keys = [NoiseKey(key.key, key.replicate, key.generation, k) for k in range(len(genomes))]
    batch = try_repeatedly(condition, genomes, keys, range(RETRIES))
    coverage = batch.coverage_line.reshape(len(genomes), RETRIES).mean(axis=1)
    visits = visited_share(batch, RETRIES)
    order = np.argsort(-coverage, kind="stable")
    return [Champion(genomes[k], float(coverage[k]), visits[k]) for k in order]


def try_repeatedly(
    condition: Condition, genomes: Sequence[Genome], keys: Sequence[NoiseKey], repeats: range
) -> TrialBatch:
    """Genomes tried on the condition's platform, each once for each repeat; see `retry_genomes`."""
    if len(repeats) and repeats[-1] >= MAX_REPEATS:
        raise StudyError(f"There are {len(repeats)} repeats, expected at most {MAX_REPEATS}.")
    return retry_genomes(
        condition.simulated_on,
        condition.arena.arena(),
        genomes,
        noise=condition.noise,
        noise_keys=keys,
        repeats=repeats,
        inputs=condition.network_inputs,
    )


def crossed_cells(batch: TrialBatch, repeats: int) -> NDArray[np.bool_]:
    """(n, repeats, c) whether each of n genomes crosses each cell in each of its trials, which lie together."""
    n_trials, n_cells = batch.cells.shape
    crossed = np.zeros((n_trials, n_cells), np.bool_)
    rows, places = np.nonzero(np.arange(n_cells) < batch.n_line[:, None])
    crossed[rows, batch.cells[rows, places]] = True
    return np.reshape(crossed, (-1, repeats, n_cells))


def visited_share(batch: TrialBatch, repeats: int) -> NDArray[np.float64]:
    """(n, c) share of the repeats in which each of n genomes visits each cell; repeats of one lie together."""
    return np.asarray(crossed_cells(batch, repeats).mean(axis=1), np.float64)


def _population(condition: Condition, run: int) -> Population:
    bias = condition.has_bias_input
    return Population(3, 2, condition.neat, replicate=run, bias=bias, key=condition.key)


def _archive(condition: Condition) -> NoveltyArchive | None:
    if condition.selection != "novelty":
        return None
    grid = condition.arena.arena().grid
    return NoveltyArchive(condition.novelty, columns=grid.columns, rows=grid.rows)
