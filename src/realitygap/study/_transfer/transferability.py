"""Strategy transferability: evolution that prefers what the simulation is likely to be right about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import Genome
from realitygap.runs import named, population_of
from realitygap.trials import NoiseKey

from .attempt import Attempt
from .simulated import Champion, rank_genomes, try_repeatedly, visited_share

Values = NDArray[np.float64]

POPULATION = 40
FINALISTS = 20
"""Individuals of the best predicted score that are tried on fresh noise in the end."""

SMALLEST = 1e-6
"""Distance below which two behaviors count as the same one."""


def transferability(attempt: Attempt) -> Champion:
    """Evolve for fitness, predicted disparity and diversity. The budget's trials train the prediction one by one.

    A behavior is the share of an individual's trials in simulation that visit each cell; behaviors are compared by the
    generalized Jaccard distance. Disparity is that distance to the cells visited on the target, and is predicted from
    the individuals tried there by weights of 1 / distance². The next one to be tried is the individual of the
    generation that is farthest from all that were; they are spread evenly over the generations. In the end the
    individual with the greatest predicted score on the target is chosen: that in simulation plus the difference
    predicted by the same weights.

    Source: Koos, Mouret & Doncieux (2013), IEEE Transactions on Evolutionary Computation 17(1); selection by Deb et al.
    (2002), NSGA-II. Differs: NEAT breeds, with an individual's place in the order of NSGA-II as its fitness, so that
    parents do not compete with their children, and species share; behavior and disparity are of visited cells; the
    final choice is by predicted score in place of a threshold of disparity.
    """
    condition, replicate = attempt.condition, attempt.replicate * attempt.simulation.runs
    n_generations = _generations(attempt)
    neat = condition.neat.model_copy(update={"population": POPULATION})
    population = population_of(condition.model_copy(update={"neat": neat}), replicate)
    known, fronts = _Known(), _Fronts()
    for generation in range(n_generations):
        genomes = [named(genome, condition) for genome in population.ask()]
        fitness, visits = _simulate(attempt, genomes, replicate, generation)
        due = (generation + 1) * attempt.budget // n_generations
        while attempt.target.spent < due:
            k = known.farthest(fitness, visits)
            (score,), (cells,) = attempt.try_on_target([genomes[k]])
            known.add(visits[k], fitness[k], score, cells)
        diversity = distances(visits, visits).mean(axis=1)
        objectives = np.stack([fitness, -known.disparity(visits), diversity], axis=1)
        order, front = nsga2_order(objectives)
        fronts.add([genomes[k] for k in front], fitness[front], visits[front])
        place = np.empty(len(genomes))
        place[order] = np.arange(len(genomes), 0, -1)
        population.tell(place)
    predicted = fronts.fitness + known.difference(fronts.visits)
    best = np.argsort(-predicted, kind="stable")[:FINALISTS]
    ranked = rank_genomes(condition, [fronts.genomes[k] for k in best], replicate)
    lifted = [each.simulated + float(known.difference(each.visits[None])[0]) for each in ranked]
    return ranked[int(np.argmax(lifted))]


def _generations(attempt: Attempt) -> int:
    """Return the number of generations with as many evaluations as all runs of the other strategies."""
    neat = attempt.condition.neat
    return max(1, attempt.simulation.runs * neat.population * neat.generations // POPULATION)


def _simulate(
    attempt: Attempt, genomes: Sequence[Genome], replicate: int, generation: int
) -> tuple[Values, Values]:
    """Return (n,) mean score, and (n, c) share of repeats in which each cell was visited."""
    key, repeats = attempt.condition.key, attempt.simulation.repeats
    keys = [NoiseKey(key, replicate, generation, k) for k in range(len(genomes))]
    batch, scores = try_repeatedly(attempt.condition, genomes, keys, range(repeats))
    return scores.mean(axis=1), visited_share(batch, repeats)


@dataclass
class _Known:
    """Individuals that were tried on the target."""

    visits: list[Values] = field(default_factory=list)
    disparities: list[float] = field(default_factory=list)
    differences: list[float] = field(default_factory=list)

    def add(self, visits: Values, fitness: float, score: float, cells: Sequence[int]) -> None:
        """Take in one of visits (c,) and fitness in simulation, and its score and cells on the target."""
        on_target = np.zeros_like(visits)
        on_target[list(cells)] = 1.0
        self.visits.append(visits)
        self.disparities.append(float(distances(visits[None], on_target[None])[0, 0]))
        self.differences.append(score - float(fitness))

    def farthest(self, fitness: Values, visits: Values) -> int:
        """Return the individual of n that is farthest from all of them; the fittest if there are none."""
        if not self.visits:
            return int(fitness.argmax())
        return int(distances(visits, np.stack(self.visits)).min(axis=1).argmax())

    def disparity(self, visits: Values) -> Values:
        """Return the predicted values, (n,)."""
        return self._interpolated(visits, self.disparities)

    def difference(self, visits: Values) -> Values:
        """Return the predicted score on the target minus the score in simulation, (n,)."""
        return self._interpolated(visits, self.differences)

    def _interpolated(self, visits: Values, values: Sequence[float]) -> Values:
        if not self.visits:
            return np.zeros(len(visits))
        weights = 1 / np.maximum(distances(visits, np.stack(self.visits)), SMALLEST) ** 2
        return np.asarray(weights @ np.array(values) / weights.sum(axis=1))


@dataclass
class _Fronts:
    """Individuals that none of their generation dominated."""

    genomes: list[Genome] = field(default_factory=list)
    _fitness: list[Values] = field(default_factory=list)
    _visits: list[Values] = field(default_factory=list)

    def add(self, genomes: Sequence[Genome], fitness: Values, visits: Values) -> None:
        self.genomes += genomes
        self._fitness.append(fitness)
        self._visits.append(visits)

    @property
    def fitness(self) -> Values:
        return np.concatenate(self._fitness)

    @property
    def visits(self) -> Values:
        return np.concatenate(self._visits)


def distances(one: Values, other: Values) -> Values:
    """Return the generalized Jaccard distances (n, m) of shares (n, c) and (m, c): 1 - sum of min / sum of max."""
    lesser = np.minimum(one[:, None], other[None]).sum(axis=2)
    greater = np.maximum(one[:, None], other[None]).sum(axis=2)
    return np.where(greater > 0, 1 - lesser / np.where(greater > 0, greater, 1), 0.0)


def nsga2_order(objectives: Values) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return individuals by front and then by crowding distance, the best first; and those of the first front.

    Args:
        objectives: (n, m) more is better.

    Source: Deb, Pratap, Agarwal & Meyarivan (2002), IEEE Transactions on Evolutionary Computation 6(2).
    """
    one, other = objectives[:, None], objectives[None]
    better = np.all(one >= other, axis=2) & np.any(one > other, axis=2)
    left = np.arange(len(objectives))
    order: list[NDArray[np.intp]] = []
    while len(left):
        dominated = np.any(np.asarray(better)[np.ix_(left, left)], axis=0)
        front = left[~dominated]
        order.append(front[np.argsort(-_crowding(objectives[front]), kind="stable")])
        left = left[dominated]
    return np.concatenate(order), np.sort(order[0])


def _crowding(objectives: Values) -> Values:
    """Return (n,) how far the neighbors of each are apart, over all objectives; inf at the ends."""
    crowding = np.zeros(len(objectives))
    for values in objectives.T:
        order = np.argsort(values, kind="stable")
        width = values[order[-1]] - values[order[0]]
        crowding[order[[0, -1]]] = np.inf
        if width > 0 and len(order) > 2:
            crowding[order[1:-1]] += (values[order[2:]] - values[order[:-2]]) / width
    return crowding
