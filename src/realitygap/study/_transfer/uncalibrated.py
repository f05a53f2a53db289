"""Strategies without a calibration: plain, select, halving, and direct."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from realitygap.evolution import Genome
from realitygap.runs import Condition, Evolution

from .attempt import Attempt
from .simulated import Champion


def plain(attempt: Attempt) -> Champion:
    """Return the best champion in simulation, without a trial on the target."""
    return attempt.champions()[0]


def select(attempt: Attempt) -> Champion:
    """Try each of the N best champions in simulation once on the target, and return the first of the best."""
    return best_on_target(attempt, attempt.champions())


def halving(attempt: Attempt) -> Champion:
    """Try champions in rounds, and give half of the trials that are left to those that were best so far.

    Source: successive halving (Karnin, Koren & Somekh, 2013). Differs: one trial each in a round, so that rounds halve
    the trials as well; means are over all rounds.
    """
    contenders = attempt.champions()
    sums = [0.0] * len(contenders)
    places = list(range(len(contenders)))
    rounds = 0
    while attempt.left:
        places = places[: max(1, -(-attempt.left // 2))]
        places = places[: attempt.left]
        tried = attempt.score_on_target([contenders[k] for k in places])
        rounds += 1
        for k, score in zip(places, tried, strict=True):
            sums[k] += score
        places.sort(key=lambda k: (-sums[k], k))
    return contenders[places[0]]


def best_on_target(attempt: Attempt, champions: Sequence[Champion]) -> Champion:
    """Spend the rest of the budget on the first champions, once each. Return the best, or the first without budget."""
    tried = champions[: attempt.left]
    if not tried:
        return champions[0]
    scores = attempt.score_on_target(tried)
    return tried[max(range(len(tried)), key=lambda k: (scores[k], -k))]


POPULATION = 8
"""The paper's, section 3."""


def direct(attempt: Attempt) -> Champion:
    """Evolve on the target with the paper's population. The last generation is tried as far as trials are left.

    The champion is the individual with the best score in its one trial, as in the paper; of equals the first one.
    """
    evolution = Evolution(_small(attempt.condition), attempt.replicate)
    best: tuple[float, Champion] | None = None
    while attempt.left or best is None:
        genomes = [asked.genome for asked in evolution.ask()]
        tried = genomes[: attempt.left]
        if not tried:  # no budget at all: an individual that nobody has tried
            return _untried(genomes[0], attempt)
        scores, cells = attempt.try_on_target(tried)
        for genome, score in zip(tried, scores, strict=True):
            if best is None or score > best[0]:
                best = score, _untried(genome, attempt)
        if len(tried) == len(genomes):
            evolution.tell(scores, cells)
    return best[1]


def _untried(genome: Genome, attempt: Attempt) -> Champion:
    """Return a champion of which the simulation knows nothing."""
    n_cells = attempt.target.arena.grid.n_cells
    return Champion(genome, float("nan"), np.full(n_cells, np.nan))


def _small(condition: Condition) -> Condition:
    neat = condition.neat.model_copy(update={"population": POPULATION})
    return condition.model_copy(update={"neat": neat})
