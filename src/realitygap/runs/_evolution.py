"""One run of a condition, generation by generation, with an ask-and-tell interface for slow trials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from realitygap.errors import check_told_once, finite_numbers
from realitygap.evolution import (
    ControllerInterface,
    Genome,
    GenomeRecord,
    NoveltyArchive,
    Population,
    genome_record,
)
from realitygap.kernels.neat.genome import first_genomes, make_genomes

from ._condition import Condition

N_OUTPUTS = 2


@dataclass(frozen=True)
class Candidate:
    """An individual to be tried.

    Attributes:
        genome: Genome of the individual.
        species: Species of the individual.
        parents: Its parents in the generation before.
    """

    genome: Genome
    species: int
    parents: tuple[int, ...]

    @property
    def record(self) -> GenomeRecord:
        """The genome as a row of results has it."""
        return genome_record(self.genome)


@dataclass(frozen=True)
class SelectionScores:
    """The scores by which selection judges a generation.

    Attributes:
        fitness: (n,) the number that it uses.
        novelty: (n,) novelty of each individual; None unless selection is novelty.
    """

    fitness: tuple[float, ...]
    novelty: tuple[float | None, ...]


def population_of(condition: Condition, replicate: int) -> Population:
    """Return the population of one run of a condition.

    Raises:
        ValueError: Selection is map-elites, which has no population.
    """
    if condition.selection == "map-elites":
        raise ValueError(
            f"Condition {condition.name!r} has selection 'map-elites', expected one with a population. For ask and "
            "tell, use MapElites."
        )
    bias = condition.has_bias_input
    n_inputs = len(condition.network_inputs) - bias
    return Population(n_inputs, N_OUTPUTS, condition.neat, replicate=replicate, bias=bias, key=condition.key)


def named(genome: Genome, condition: Condition) -> Genome:
    """Return a genome whose inputs and outputs have the condition's names."""
    return genome.with_interface(ControllerInterface(condition.network_inputs, condition.output_names))


class Evolution:
    """One run with an ask-and-tell interface: `ask` for a generation, `tell` the score of each individual, and so on.

    The generation that `ask` returns is a function of the condition, the replicate, and the scores so far. It is the
    same as in the whole runs of `run_replicates`, with the same kernels and random numbers. The novelty archive is
    updated after the whole generation, in the order of individuals.

    Raises:
        ValueError: Selection is map-elites; see `realitygap.MapElites`.
    """

    def __init__(self, condition: Condition, replicate: int) -> None:
        self._condition = condition
        self._replicate = replicate
        self.generation = 0
        self._asked: int | None = None
        self._population = population_of(condition, replicate)
        self._grid = condition.arena.arena().grid
        grid = self._grid
        is_novelty = condition.selection == "novelty"
        self._archive = (
            NoveltyArchive(condition.novelty, columns=grid.columns, rows=grid.rows) if is_novelty else None
        )

    def ask(self) -> list[Candidate]:
        """Return this generation, in the order in which `tell` wants their scores."""
        self._asked = self.generation
        condition = self._condition
        if condition.selection == "random":
            return [Candidate(named(genome, condition), 0, ()) for genome in self._unrelated()]
        return [
            Candidate(
                named(genome, condition),
                int(species),
                tuple(int(parent) for parent in parents if parent >= 0),
            )
            for genome, species, parents in zip(
                self._population.ask(), self._population.species, self._population.parents, strict=True
            )
        ]

    def tell(self, scores: Sequence[float], cells: Sequence[Sequence[int]]) -> SelectionScores:
        """Take what a generation is worth, and breed the next one.

        Args:
            scores: (n,) scores by the task, in the order of individuals, such as coverage 0..1.
            cells: n lists of visited cells, by which novelty selects; their order within a list does not matter.

        Raises:
            RuntimeError: The generation for which `ask` was last called has its scores.
            ValueError: Another number of individuals, a score that is not finite, or a cell outside the grid.
        """
        check_told_once(self._asked, self.generation)
        finite_numbers("scores", scores)
        n = self._condition.neat.population
        for what, given in (("scores", scores), ("cells", cells)):
            if len(given) != n:
                raise ValueError(f"There are {what} of {len(given)} individuals, expected {n}.")
        if self._archive is None:
            values = SelectionScores(tuple(scores), (None,) * n)
        else:
            novelty = tuple(float(value) for value in self._archive.update(cells))
            values = SelectionScores(novelty, novelty)
        if self._condition.selection != "random":
            self._population.tell(values.fitness)
        self.generation += 1
        return values

    def _unrelated(self) -> list[Genome]:
        """Return networks without parents, others in each generation."""
        rules = self._condition.neat_rules
        genomes = make_genomes(
            self._condition.neat.population, N_OUTPUTS, rules.n_first_genes, rules.start_hidden + 1
        )
        first_genomes(genomes, rules, np.uint64(self._condition.key), self._replicate, self.generation)
        bias_value = float(self._condition.neat.bias_value)
        return [Genome(genomes, row, rules, bias_value) for row in range(self._condition.neat.population)]
