"""Repertoires: controllers that do different things in simulation, each the best of its kind, by MAP-Elites."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import Genome
from realitygap.kernels.math.philox import MAX_GENERATIONS
from realitygap.runs import (
    Condition,
    corrected_archive,
    elites_of,
    genome_of,
    named,
    retry_elites,
    run_replicates,
)
from realitygap.trials import NoiseKey

from .simulated import RETRIES, Champion, try_repeatedly, visited_share

Floats = NDArray[np.float64]

BATCH = 256
"""Controllers of a batch of MAP-Elites."""

MOST_EVALUATIONS = 100_000
"""Controllers of a repertoire. Where more trials are due, each controller gets several: rows of more of them fill the
memory, and by then the cells are full."""

FINALISTS = 60
"""Elites of each of several repertoires, its best ones: all are tried under all conditions."""

POOL_TRIALS = 16
"""Trials of each of them under each condition."""


@dataclass(frozen=True)
class Repertoire:
    """Elites of archives, by fresh trials in simulation: the best of each cell, the best of all first.

    Attributes:
        champions: The m elites, with their mean scores where they evolved.
        descriptors: (m, d) what they do there, each number from 0 to 1 of its range.
        variances: (m,) variance of their scores between trials.
        simulated: (h, m) their mean scores in each of h simulations.
        visits: (h, m, c) share of the trials there in which they visit each cell; (0, m, c) where nobody counted.
    """

    champions: tuple[Champion, ...]
    descriptors: Floats
    variances: Floats
    simulated: Floats
    visits: Floats


def repertoire_condition(condition: Condition, n_trials: int, parts: int = 1) -> Condition:
    """Return the condition with selection by MAP-Elites, and as many trials, or a part of them.

    Args:
        condition: Condition on a platform that computes, with one robot. One with this selection keeps its own number
            of trials, or a part of it, of at least a batch.
        n_trials: Trials in simulation, rounded to whole batches.
        parts: Number of repertoires that share the trials.
    """
    if condition.selection == "map-elites":
        few = max(1, condition.neat.generations // parts)
        neat = condition.neat.model_copy(update={"generations": few})
        return condition.model_copy(update={"neat": neat})
    n_trials = max(1, n_trials // parts)
    repeats = -(-n_trials // MOST_EVALUATIONS)
    population = min(BATCH, n_trials)
    generations = max(1, round(n_trials / (repeats * population)))
    neat = condition.neat.model_copy(update={"population": population, "generations": generations})
    archive = condition.archive.model_copy(update={"repeats": repeats})
    # what networks see may depend on the selection
    controller = condition.controller.model_copy(update={"inputs": condition.network_inputs})
    changes = {"selection": "map-elites", "neat": neat, "archive": archive, "controller": controller}
    return condition.model_copy(update=changes)


def evolve_repertoire(condition: Condition, replicate: int) -> Repertoire:
    """Return the repertoire of a run, corrected by fresh trials.

    Args:
        condition: Condition with selection map-elites.
        replicate: Number of the run.
    """
    elites = elites_of(condition, run_replicates(condition, replicate, 1))
    best = corrected_archive(retry_elites(condition, elites, RETRIES))
    best = best.sort("again_fitness", descending=True, maintain_order=True)
    unknown = np.full(condition.placed_arena.grid.n_cells, np.nan)
    champions = tuple(
        Champion(named(genome_of(condition, row), condition), row["again_fitness"], unknown)
        for row in best.iter_rows(named=True)
    )
    low, high = np.transpose(condition.archive.ranges(condition.placed_arena))
    descriptors = best["again_descriptor"].explode().to_numpy().reshape(best.height, -1)
    return Repertoire(
        champions,
        np.clip((descriptors - low) / (high - low), 0.0, 1.0),
        best["again_deviation"].to_numpy() ** 2,
        best["again_fitness"].to_numpy()[None],
        np.empty((0, best.height, len(unknown))),
    )


def finalists(repertoire: Repertoire) -> Repertoire:
    """Return the best elites of a repertoire."""
    n = FINALISTS
    return Repertoire(
        repertoire.champions[:n],
        repertoire.descriptors[:n],
        repertoire.variances[:n],
        repertoire.simulated[:, :n],
        repertoire.visits[:, :n],
    )


def joined(repertoires: Sequence[Repertoire]) -> Repertoire:
    """Return several repertoires as one; it has no scores yet in all their simulations."""
    champions = tuple(each for one in repertoires for each in one.champions)
    descriptors = np.concatenate([one.descriptors for one in repertoires])
    variances = np.concatenate([one.variances for one in repertoires])
    visits = np.empty((0, len(champions), repertoires[0].visits.shape[2]))
    return Repertoire(champions, descriptors, variances, np.empty((0, len(champions))), visits)


def tried_under(repertoire: Repertoire, conditions: Sequence[Condition], replicate: int) -> Repertoire:
    """Return a repertoire with the scores of its elites in fresh trials under other conditions.

    Args:
        repertoire: The repertoire.
        conditions: The h conditions, which differ in the robot.
        replicate: Number of the run, for the random numbers.
    """
    genomes = [each.genome for each in repertoire.champions]
    scores, visits = map(
        np.stack, zip(*(_tried(each, genomes, replicate) for each in conditions), strict=True)
    )
    variances = scores.var(axis=2).mean(axis=0)
    return replace(repertoire, variances=variances, simulated=scores.mean(axis=2), visits=visits)


def _tried(condition: Condition, genomes: Sequence[Genome], replicate: int) -> tuple[Floats, Floats]:
    """Return (m, `POOL_TRIALS`) scores of genomes in fresh trials, and (m, c) shares of these that visit each cell."""
    # beyond the batches of all evolutions, so that the noise is fresh
    keys = [NoiseKey(condition.key, replicate, MAX_GENERATIONS - 1, k) for k in range(len(genomes))]
    batch, scores = try_repeatedly(condition, genomes, keys, range(POOL_TRIALS))
    return scores, visited_share(batch, POOL_TRIALS)
