"""Whole runs on the classical tasks: the kernel against populations that are asked and told."""

from __future__ import annotations

import numpy as np
import pytest

from realitygap.evolution import Genome, NeatSettings, Population, decode_all
from realitygap.kernels.tasks import double_pole, run
from realitygap.kernels.tasks.xor import try_xor
from realitygap.runs import TaskRun, run_task
from realitygap.runs import _published as classical_module
from realitygap.study import task_settings
from realitygap.tasks import CLASSICAL_TASKS
from tests.reference.effort import COMPILED

pytestmark = [
    pytest.mark.slow,
    pytest.mark.filterwarnings("ignore:overflow encountered", "ignore:invalid value encountered"),
]

FIRST = np.int64(0)


class Tries:
    """One network after the other, tried by the kernels."""

    def __init__(self, task: str, genome: Genome) -> None:
        self.rules, self.bias_value = genome.rules, genome.bias_value
        self.velocities = task == "double-pole"
        self.networks = decode_all([genome])
        self.values = np.zeros(self.rules.n_inputs + self.networks.bias.shape[1])
        self.before = np.zeros_like(self.values)
        self.shaking = np.zeros(double_pole.SHAKE_ACTIONS)

    def xor(self) -> tuple[float, bool]:
        return try_xor(self.networks, FIRST, self.rules, self.bias_value, self.values, self.before)

    def actions(self, most: int) -> int:
        return double_pole.balance(
            self.networks,
            FIRST,
            self.rules,
            self.bias_value,
            self.velocities,
            np.int64(most),
            double_pole.first_start(),
            self.values,
            self.before,
            self.shaking,
        )

    def generalization(self) -> int:
        return double_pole.generalization(
            self.networks, FIRST, self.rules, self.bias_value, self.values, self.before, self.shaking
        )


def fitness_and_solved(task: str, genome: Genome) -> tuple[float, bool]:
    tries = Tries(task, genome)
    if task == "xor":
        return tries.xor()
    if task == "double-pole":
        actions = tries.actions(100_000)
        return float(actions), actions == 100_000
    return double_pole.gruau_fitness(tries.actions(1_000), tries.shaking), False


def plain_run(task: str, settings: NeatSettings, seed: int, replicate: int) -> TaskRun:
    """A run by ask and tell."""
    population = Population(CLASSICAL_TASKS[task].n_inputs, 1, settings, seed=seed, replicate=replicate)
    tested: set[float] = set()

    def done(generation: int, evaluations: int, genome: Genome, starts: int = 0) -> TaskRun:
        return TaskRun(True, evaluations, generation + 1, genome.n_hidden, genome.n_enabled, starts)

    for generation in range(settings.generations):
        genomes, fitness = population.ask(), []
        for row, genome in enumerate(genomes):
            value, solved = fitness_and_solved(task, genome)
            fitness.append(value)
            if solved:
                return done(generation, generation * len(genomes) + row + 1, genome)
        if task == "double-pole-no-velocity":
            order = sorted(range(len(genomes)), key=lambda row: -fitness[row])
            champions = {int(population.species[row]): row for row in reversed(order)}
            fresh = [row for row in order if row in champions.values() and fitness[row] not in tested]
            chosen = (fresh or order)[0]
            tested.add(fitness[chosen])
            tries = Tries(task, genomes[chosen])
            if tries.actions(100_000) == 100_000 and (starts := tries.generalization()) >= 200:
                return done(generation, (generation + 1) * len(genomes), genomes[chosen], starts)
        population.tell(fitness)
    return TaskRun(False, settings.generations * settings.population, settings.generations, 0, 0, 0)


SMALL: list[tuple[str, dict[str, object], int]] = [
    ("xor", {}, 2),
    ("xor", {"population": 20, "generations": 4}, 3),
    ("double-pole", {"population": 100}, 2),
    ("double-pole", {"population": 5, "generations": 2}, 2),
    ("double-pole-no-velocity", {"population": 1000, "generations": 60}, 1),
    ("double-pole-no-velocity", {"population": 20, "generations": 3}, 2),
]


@pytest.mark.parametrize(("task", "changes", "n"), SMALL if COMPILED else [SMALL[1], SMALL[3]])
def test_runs_equal_those_by_ask_and_tell(
    task: str, changes: dict[str, object], n: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From little room, which has to grow."""
    monkeypatch.setattr(classical_module, "FIRST_ROOM", 1)
    monkeypatch.setattr(classical_module, "FIRST_HIDDEN_ROOM", 1)
    settings = task_settings(task, "default", changes)
    for replicate in range(n):
        found = run_task(CLASSICAL_TASKS[task], settings, 5, replicate)
        assert found == plain_run(task, settings, 5, replicate)
        if settings.generations >= 60:
            assert found.solved
            assert found.generations == -(-found.evaluations // settings.population)


def chosen_to_test(fitness: list[float], species_of: list[int], tested: list[float]) -> int:
    population = Population(1, 1, NeatSettings(population=len(fitness)))
    species = population._species
    numbers = sorted(set(species_of))
    species.counts[0] = len(numbers)
    species.identity[: len(numbers)] = numbers
    return run._next_to_test(
        np.array(fitness),
        np.array(species_of, np.int32),
        species,
        np.array([*tested, 0.0]),
        np.int64(len(tested)),
    )


def test_the_fittest_champion_of_a_species_that_was_not_tested_is_next() -> None:
    fitness, species_of = [1.0, 5.0, 4.0, 3.0], [0, 0, 0, 7]
    assert chosen_to_test(fitness, species_of, []) == 1
    assert chosen_to_test(fitness, species_of, [5.0]) == 3
    assert chosen_to_test(fitness, species_of, [3.0, 5.0]) == 1
