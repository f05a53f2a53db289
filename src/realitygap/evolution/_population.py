"""A population with an ask-and-tell interface for genomes and their fitness."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap.errors import RecordError, check_told_once, finite_numbers, whole_number
from realitygap.kernels.neat.genome import Genomes, first_genomes, make_genomes
from realitygap.kernels.neat.mutation import Innovations, make_innovations
from realitygap.kernels.neat.reproduction import next_generation
from realitygap.kernels.neat.species import SpeciesTable, make_species, speciate
from realitygap.records import read_checkpoint, write_checkpoint

from ._genome import Genome
from ._settings import NeatSettings
from ._tables import MOST_NUMBER, arrays_of, check_shapes, genomes_of, table_of

# Room beyond the first genes; doubled whenever a child does not fit.
FIRST_ROOM = 32
FIRST_HIDDEN_ROOM = 8


def random_key(seed: int, name: str | None = None) -> int:
    """Return the 64-bit key of a study's random numbers, or of one condition's.

    Args:
        seed: Seed of the study.
        name: Name of the condition; None if all conditions share their random numbers.
    """
    text = f"realitygap:{seed}" if name is None else f"realitygap:{seed}:{name}"
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), "little")


class Population:
    """One evolution by NEAT, for any task: `ask` for genomes, `tell` their fitness.

        population = Population(n_inputs=2, n_outputs=1, seed=1)
        for _ in range(100):
            genomes = population.ask()
            population.tell([fitness_of(genome.network()) for genome in genomes])

    The same kernels compute the whole runs of a study, and both methods give the same genomes. The genomes are a
    function of the seed, the settings, and the given fitness, on any machine. They do not depend on the number of
    workers, or on saving and loading the population in between. Genomes and networks can be pickled, so
    `pool.map(fitness_of, population.ask())` works with threads and with processes.
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
            seed: Seed of the random numbers, 0 to 2**63 - 1.
            replicate: Number of the run with this seed, 0 to 2**32 - 1.
            bias: True for a constant input, which is the last one (EC02, section 4.1).
            key: Key of the random numbers, which replaces the seed's, 0 to 2**64 - 1.

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
        self._n_inputs = n_inputs
        self._rules = self.settings.rules(n_inputs + bias, n_outputs, bias_input=n_inputs if bias else -1)
        self._key = np.uint64(key)
        self._replicate = replicate
        self.generation = 0
        self._asked: int | None = None
        n = self.settings.population
        room = self._rules.n_first_genes + FIRST_ROOM
        hidden_room = self._rules.start_hidden + FIRST_HIDDEN_ROOM
        self._genomes: Genomes = make_genomes(n, n_outputs, room, hidden_room)
        self._innovations: Innovations = make_innovations(self._rules, n)
        for array in self._innovations[1:]:  # room that is not read yet, but saved
            array[:] = 0
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
        """Species of each individual of this generation, (n,), as numbers that are never reused."""
        return self._species_of.copy()

    @property
    def parents(self) -> NDArray[np.int32]:
        """Each individual's parents in the generation before, shape (n, 2); -1 for a missing parent."""
        return self._parents.copy()

    @property
    def threshold(self) -> float:
        """The compatibility threshold in force."""
        return float(self._species.floats[0])

    def ask(self) -> list[Genome]:
        """Return the genomes of this generation, in the order in which `tell` wants their fitness."""
        self._asked = self.generation
        bias_value = float(self.settings.bias_value)
        return [Genome(self._genomes, row, self._rules, bias_value) for row in range(len(self))]

    def tell(self, fitness: ArrayLike) -> None:
        """Take the fitness of this generation and breed the next.

        Args:
            fitness: (n,) finite; more is fitter.

        Raises:
            RuntimeError: The generation for which `ask` was last called has its fitness.
            TypeError: Something else than real numbers.
            ValueError: Another shape, or a value that is not finite. The population stays as it is.
        """
        n = len(self)
        check_told_once(self._asked, self.generation)
        values = np.ascontiguousarray(finite_numbers("fitness", fitness))
        if values.shape != (n,):
            raise ValueError(
                f"fitness has shape {values.shape}, expected ({n},): one number for each genome asked."
            )
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
                values,
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

    def save(self, path: str | Path) -> None:
        """Write a checkpoint. An existing file is replaced once the new one is complete.

        Between `ask` and `tell` nothing else needs to be kept: `load`, `ask` and tell the same fitness, and the
        next generation is the same, bit for bit.

        Args:
            path: The file, a NumPy .npz whatever its name.

        Raises:
            RecordError: It cannot be written; a file that was there is as it was.
        """
        about = {
            "n_inputs": self._n_inputs,
            "n_outputs": self._rules.n_outputs,
            "bias": self._rules.bias_input >= 0,
            "settings": self.settings.model_dump(mode="json"),
            "key": int(self._key),
            "replicate": self._replicate,
            "generation": self.generation,
        }
        write_checkpoint(Path(path), "population", about, self._arrays())

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Return the population that `save` wrote.

        Raises:
            RecordError: There is no such file, it is cut off or damaged, or no checkpoint of a population.
            RecordVersionError: A version wrote it whose numbers may differ.
        """
        about, arrays = read_checkpoint(Path(path), "population")
        try:
            population = cls(
                about["n_inputs"],
                about["n_outputs"],
                NeatSettings(**about["settings"]),
                replicate=about["replicate"],
                bias=about["bias"],
                key=about["key"],
            )
            population._restore(arrays)
            population.generation = whole_number("generation", about["generation"], 0, MOST_NUMBER)
        except (IndexError, KeyError, OverflowError, RecordError, TypeError, ValueError) as error:
            raise RecordError(
                f"{path} is a checkpoint, but not one of a population as this version has it ({error})."
            ) from error
        return population

    def _arrays(self) -> dict[str, NDArray[Any]]:
        """Return all that changes from generation to generation, by name; views."""
        tables: dict[str, Any] = {
            "genomes": self._genomes,
            "innovations": self._innovations,
            "species": self._species,
        }
        return arrays_of(tables) | {"species_of": self._species_of, "parents": self._parents}

    def _restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Put `_arrays` back; only the room for genes may differ.

        Kernels trust indices. So everything is checked here: the file may come from elsewhere.

        Raises:
            RecordError: A genome is not one that evolution can make.
            ValueError: Names, types, sizes or numbers do not fit.
        """
        check_shapes(arrays, self._arrays(), self._rules.n_outputs)
        genomes = genomes_of(self._genomes, "genomes", arrays, self._rules, arrays["innovations.counters"])
        n_species, next_identity = (int(number) for number in arrays["species.counts"])
        identities = arrays["species.identity"][: max(n_species, 0)].tolist()
        if len(identities) != n_species or sorted(identities) != sorted({*arrays["species_of"].tolist()}):
            raise ValueError("species and their members do not agree")
        if not (max(identities) < next_identity < MOST_NUMBER):
            raise ValueError(f"the next species is {next_identity}")
        self._genomes = genomes
        self._innovations = table_of(self._innovations, "innovations", arrays)
        self._species = table_of(self._species, "species", arrays)
        self._species_of, self._parents = arrays["species_of"], arrays["parents"]
