"""Strategy direct: no simulation, all trials of the budget on evolving on the target itself."""

from __future__ import annotations

import numpy as np

from realitygap.evolution import Genome
from realitygap.runs import Condition, Evolution

from .attempt import Attempt
from .simulated import Champion

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
