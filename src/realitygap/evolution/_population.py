"""A population that is asked for genomes and told their fitness."""

from __future__ import annotations

import reprlib

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap.errors import whole_number
from realitygap.kernels._evolve import next_generation
from realitygap.kernels._genome import Genomes, first_genomes, make_genomes
from realitygap.kernels._mutation import Innovations, make_innovations
from realitygap.kernels._species import SpeciesTable, make_species, speciate

from ._genome import Genome
from ._random import random_key
from ._settings import NeatSettings

# Room beyond the first genes; doubled whenever a child does not fit.
FIRST_ROOM = 32
FIRST_HIDDEN_ROOM = 8


class Population:
    """One evolution by NEAT, for any task: `ask` for genomes, `tell` their fitness.

        population = Population(n_inputs=2, n_outputs=1, seed=1)
        for _ in range(100):
            genomes = population.ask()
            population.tell([fitness_of(genome.network()) for genome in genomes])

    The same kernels carry out the whole runs of a study; both roads give the same genomes. What comes is a
    function of the seed, the settings and the fitness told, on any machine.
    """

    def __init__(
        self,
        n_inputs: int,
        n_outputs: int,
        settings: NeatSettings | None = None,
        *,
        seed: int = 0,
        replicate: int = 0,
        bias: bool = True,
        key: int | None = None,
    ) -> None:
        """Make the first generation.

        Args:
            n_inputs: Inputs that the task gives, >= 1.
            n_outputs: Outputs that it reads, >= 1.
            settings: NEAT's settings; the set 'default', which is `NeatSettings()`, when not given.
            seed: Of the random numbers, 0 to 2**63 - 1.
            replicate: Which of many runs from one seed, 0 to 2**32 - 1.
            bias: Whether networks have a constant input as their last (EC02, section 4.1).
            key: The key of the random numbers in place of the seed's, 0 to 2**64 - 1.

        Raises:
            TypeError: A number is not a whole one, or the settings are something else.
            ValueError: A count below 1, or a number out of its range, beyond which random numbers would repeat.
        """
        n_inputs = whole_number("n_inputs", n_inputs, 1)
        n_outputs = whole_number("n_outputs", n_outputs, 1)
        replicate = whole_number("replicate", replicate, 0, 2**32 - 1)
        seed = whole_number("seed", seed, 0, 2**63 - 1)
        key = random_key(seed) if key is None else whole_number("key", key, 0, 2**64 - 1)
        if not isinstance(settings, NeatSettings | None):
            raise TypeError(
                f"settings is {settings!r}, expected NeatSettings, such as NeatSettings.named('default')."
            )
        self.settings = settings or NeatSettings()
        self._rules = self.settings.rules(n_inputs + bias, n_outputs, bias_input=n_inputs if bias else -1)
        self._key = np.uint64(key)
        self._replicate = replicate
        self.generation = 0
        n = self.settings.population
        room = self._rules.n_first_genes + FIRST_ROOM
        hidden_room = self._rules.start_hidden + FIRST_HIDDEN_ROOM
        self._genomes: Genomes = make_genomes(n, n_outputs, room, hidden_room)
        self._innovations: Innovations = make_innovations(self._rules, n)
        self._species: SpeciesTable = make_species(self._rules, n)
        self._species_of = np.zeros(n, np.int32)
        self._parents = np.full((n, 2), -1, np.int32)
        first_genomes(self._genomes, self._rules, self._key, replicate, 0)
        speciate(
            self._genomes,
            self._genomes,
            np.empty(n),
            self._species_of,
            self._species,
            self._rules,
            self._key,
            replicate,
            0,
        )

    def __len__(self) -> int:
        return self.settings.population

    @property
    def species(self) -> NDArray[np.int32]:
        """(n,) the species of each individual of this generation, by a number never used again."""
        return self._species_of.copy()

    @property
    def parents(self) -> NDArray[np.int32]:
        """(n, 2) each individual's parents in the generation before; -1 where there is none."""
        return self._parents.copy()

    @property
    def threshold(self) -> float:
        """The compatibility threshold in force."""
        return float(self._species.floats[0])

    def ask(self) -> list[Genome]:
        """The genomes of this generation, in the order in which `tell` wants their fitness."""
        bias_value = float(self.settings.bias_value)
        return [Genome(self._genomes, row, self._rules, bias_value) for row in range(len(self))]

    def tell(self, fitness: ArrayLike) -> None:
        """Take the fitness of this generation and breed the next.

        Args:
            fitness: (n,) finite; more is fitter.

        Raises:
            TypeError: Something else than real numbers.
            ValueError: Another shape, or a value that is not finite. The population stays as it is.
        """
        n = len(self)
        told = _as_numbers(fitness, n)
        if told.shape != (n,):
            raise ValueError(
                f"fitness has shape {told.shape}, expected ({n},): one number for each genome asked."
            )
        if not np.isfinite(told).all():
            row = int(np.flatnonzero(~np.isfinite(told))[0])
            raise ValueError(f"fitness[{row}] is {told[row]}, expected a finite number.")
        room = self._genomes.innovation.shape[1]
        hidden_room = self._genomes.hidden.shape[1]
        while True:
            children = make_genomes(n, self._rules.n_outputs, room, hidden_room)
            innovations = Innovations._make(array.copy() for array in self._innovations)
            species = SpeciesTable._make(array.copy() for array in self._species)
            species_of = self._species_of.copy()
            parents = self._parents.copy()
            next_generation(
                self._genomes,
                told,
                species_of,
                species,
                self._rules,
                innovations,
                self._key,
                self._replicate,
                self.generation,
                children,
                parents,
            )
            if not children.full[0]:
                break
            room, hidden_room = 2 * room, 2 * hidden_room
        self._genomes, self._innovations, self._species = children, innovations, species
        self._species_of, self._parents = species_of, parents
        self.generation += 1


def _as_numbers(fitness: ArrayLike, n: int) -> NDArray[np.float64]:
    try:
        given = np.asarray(fitness)
        if given.dtype.kind not in "biufO":  # of an object, such as a Fraction, its number is taken
            raise TypeError
        return np.ascontiguousarray(given, np.float64)
    except (TypeError, ValueError):
        raise TypeError(
            f"fitness is {reprlib.repr(fitness)}, expected {n} real numbers, one for each genome asked."
        ) from None
