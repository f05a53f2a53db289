"""Controllers evolved in simulation, each tried on several noises: many runs go forward together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import StudyError
from realitygap.evolution import Genome, NoveltyArchive
from realitygap.kernels.math.philox import MAX_REPEATS
from realitygap.platforms import score_genomes
from realitygap.runs import Condition, named, population_of
from realitygap.trials import NoiseKey, TrialBatch

RETRIES = 64
"""Trials on fresh noise by which champions are ranked: the one that a run found best was partly lucky."""


@dataclass(frozen=True)
class Champion:
    """The best individual of a run in simulation.

    Attributes:
        genome: Genome of the individual.
        simulated: Its mean score in simulation, over fresh trials.
        visits: (c,) share of these trials in which it visits each cell.
    """

    genome: Genome
    simulated: float
    visits: NDArray[np.float64]


def refuse_unevolved(condition: Condition) -> None:
    """Refuse conditions that are not evolved in simulation.

    Raises:
        StudyError: A robot drives its trials, or nothing is selected.
    """
    if condition.is_physical or condition.selection == "random":
        raise StudyError(
            f"Condition {condition.name!r} has platform {condition.platform!r} and selection {condition.selection!r}, "
            "expected evolution in simulation: platform 'sim' or 'jyro', and another selection than 'random'."
        )


def evolve_champions(condition: Condition, runs: range, *, repeats: int) -> list[Champion]:
    """Return the champions of some runs, the best in simulation first.

    An individual is worth its mean score over its repeats; novelty, where that selects, is of the first repeat. A
    champion is the individual with the best mean score in all generations of its run.

    Args:
        condition: Condition of the runs, on platform `sim` or `jyro`.
        runs: Numbers of the replicates.
        repeats: Trials of each individual, every one on noise of its own.

    Raises:
        StudyError: A condition as `refuse_unevolved` says, or one whose selection is of an archive.
    """
    refuse_unevolved(condition)
    if condition.selection == "map-elites":
        raise StudyError(
            f"Condition {condition.name!r} has selection 'map-elites', which has elites in place of champions. "
            "Choose a condition with another selection."
        )
    populations = [population_of(condition, run) for run in runs]
    archives = [_archive(condition) for _ in runs]
    best: list[tuple[float, Genome] | None] = [None] * len(runs)
    n = condition.neat.population
    for generation in range(condition.neat.generations):
        genomes = list(chain.from_iterable(each.ask() for each in populations))
        keys = [NoiseKey(condition.key, run, generation, k) for run in runs for k in range(n)]
        batch, tried = try_repeatedly(condition, genomes, keys, range(repeats))
        scores = tried.reshape(len(runs), n, repeats).mean(axis=2)
        for row, population in enumerate(populations):
            k = int(scores[row].argmax())
            champion = best[row]
            if champion is None or scores[row, k] > champion[0]:
                best[row] = scores[row, k], named(genomes[row * n + k], condition)
            archive = archives[row]
            first = [batch.behavior((row * n + k) * repeats) for k in range(n)]
            population.tell(scores[row] if archive is None else archive.update(first))
    champions = [champion[1] for champion in best if champion is not None]
    return rank_genomes(condition, champions, runs.start)


def rank_genomes(condition: Condition, genomes: Sequence[Genome], first: int) -> list[Champion]:
    """Return genomes tried `RETRIES` times in simulation, the best first.

    Args:
        condition: Condition with the platform and the noise.
        genomes: At least one genome.
        first: Replicate whose random numbers are used.
    """
    # beyond the generations that evolution uses, so that the noise is fresh
    key = NoiseKey(condition.key, first, condition.neat.generations)
    keys = [NoiseKey(key.key, key.replicate, key.generation, k) for k in range(len(genomes))]
    batch, tried = try_repeatedly(condition, genomes, keys, range(RETRIES))
    scores = tried.mean(axis=1)
    visits = visited_share(batch, RETRIES)
    order = np.argsort(-scores, kind="stable")
    return [Champion(genomes[k], float(scores[k]), visits[k]) for k in order]


def try_repeatedly(
    condition: Condition, genomes: Sequence[Genome], keys: Sequence[NoiseKey], repeats: range
) -> tuple[TrialBatch, NDArray[np.float64]]:
    """Return genomes tried on the condition's platform and scored by its task, each once for each repeat.

    Returns:
        As `score_genomes`.
    """
    if len(repeats) and repeats[-1] >= MAX_REPEATS:
        raise StudyError(f"There are {len(repeats)} repeats, expected at most {MAX_REPEATS}.")
    return score_genomes(
        condition.on,
        condition.arena.arena(),
        genomes,
        condition.task_of_trials,
        noise=condition.noise,
        noise_keys=keys,
        repeats=repeats,
        inputs=condition.network_inputs,
    )


def crossed_cells(batch: TrialBatch, repeats: int) -> NDArray[np.bool_]:
    """Return (n, repeats, c) whether each of n genomes crosses each cell in each of its trials, which lie together."""
    n_trials, n_cells = batch.cells.shape
    crossed = np.zeros((n_trials, n_cells), np.bool_)
    rows, places = np.nonzero(np.arange(n_cells) < batch.n_line[:, None])
    crossed[rows, batch.cells[rows, places]] = True
    return np.reshape(crossed, (-1, repeats, n_cells))


def visited_share(batch: TrialBatch, repeats: int) -> NDArray[np.float64]:
    """Return (n, c) share of the repeats in which each of n genomes visits each cell; repeats of one lie together."""
    return np.asarray(crossed_cells(batch, repeats).mean(axis=1), np.float64)


def _archive(condition: Condition) -> NoveltyArchive | None:
    if condition.selection != "novelty":
        return None
    grid = condition.arena.arena().grid
    return NoveltyArchive(condition.novelty, columns=grid.columns, rows=grid.rows)
