"""One generation after the other: the kernels against the whole of the plain reference, bit for bit."""

from __future__ import annotations

import random
from typing import Any

import pytest

from realitygap.evolution import NeatSettings, Population
from realitygap.evolution import _population as population_module
from tests.kernels.genome_arrays import from_arrays, settings
from tests.reference.effort import cases
from tests.reference.neat import Evolution, Neat

pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered")


def random_settings(rng: random.Random) -> NeatSettings:
    """Any choice that there is, rates up to very high, populations down to two."""
    choices: dict[str, list[Any]] = {
        "population": [2, 3, 5, 8, 12],
        "recurrent": [False, True],
        "node_bias": [False, True],
        "start_hidden": [0, 0, 1, 4],
        "start_topology": ["full", "layer", "random"],
        "initial_weight": [0.0, 1.0, 2.5],
        "mutate_weights": [0.0, 0.8, 1.0],
        "replace_weight": [0.0, 0.1, 1.0],
        "weight_step": [0.5, 2.5],
        "weight_limit": [3.0, 8.0],
        "add_node": [0.03, 0.3, 0.8],
        "add_link": [0.05, 0.5, 0.9],
        "add_link_tries": [1, 20],
        "structural_mutations": ["one", "independent"],
        "split_bias_links": [False, True],
        "reenable": [0.0, 0.3],
        "crossover": [0.75, 1.0],
        "crossover_only": [0.2, 0.8],
        "average_weights": [0.0, 0.4],
        "interspecies": [0.001, 0.5],
        "equal_parents": ["mix", "smaller"],
        "stay_disabled": [0.75, 0.2],
        "disabled_rule": ["coin", "inherit"],
        "excess_coefficient": [1.0, 0.5],
        "disjoint_coefficient": [1.0, 0.3],
        "weight_coefficient": [0.4, 3.0],
        "normalize_genes": ["never", "large", "always"],
        "threshold": [0.5, 1.5, 3.0, 10.0],
        "assign": ["first", "nearest"],
        "representative": ["random", "champion"],
        "target_species": [0, 3],
        "survival": [0.0, 0.2, 0.5, 1.0],
        "champion_from": [1, 3, 6],
        "champion_counts": ["members", "offspring"],
        "stagnation": [2, 15],
        "stagnation_factor": [0.0, 0.01, 1.0],
        "best_species_spared": [False, True],
        "population_stagnation": [2, 20],
        "negative_fitness": ["shift", "clip"],
    }
    return settings(**{name: rng.choice(values) for name, values in choices.items()})


def random_fitness(rng: random.Random, kind: str, n: int) -> list[float]:
    if kind == "many equal":
        return [float(rng.randint(0, 2)) for _ in range(n)]
    if kind == "none":
        return [0.0] * n
    return [rng.uniform(-2.0 if kind == "negative" else 0.0, 1.0) for _ in range(n)]


def assert_equal_generations(population: Population, plain: Evolution) -> None:
    for row, expected in enumerate(plain.genomes):
        assert from_arrays(plain.neat, population._genomes, row) == expected
    assert population.species.tolist() == plain.species_of
    assert population.parents.tolist() == [list(pair) for pair in plain.parents]
    assert population.threshold == plain.threshold


@pytest.mark.slow
def test_evolution_equals_the_reference_whatever_the_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every gene, parent, species and threshold, generation by generation, from little room that has to grow."""
    monkeypatch.setattr(population_module, "FIRST_ROOM", 1)
    monkeypatch.setattr(population_module, "FIRST_HIDDEN_ROOM", 1)
    largest = most_species = 0
    for seed in range(cases(150, 12)):
        rng = random.Random(seed)
        chosen = random_settings(rng)
        n_inputs, n_outputs, bias = rng.randint(1, 4), rng.randint(1, 3), rng.random() < 0.7
        kind = rng.choice(["distinct", "many equal", "negative", "none"])
        population = Population(n_inputs, n_outputs, chosen, key=seed, replicate=seed % 5, bias=bias)
        neat = Neat(chosen, n_inputs + bias, n_outputs, n_inputs if bias else None)
        plain = Evolution(neat, seed, seed % 5)
        for _ in range(10):
            assert_equal_generations(population, plain)
            fitness = random_fitness(rng, kind, chosen.population)
            population.tell(fitness)
            plain.tell(fitness)
        assert_equal_generations(population, plain)
        largest = max(largest, *(len(neat.hidden(genome)) for genome in plain.genomes))
        most_species = max(most_species, len(plain.species))
    assert largest >= 5
    assert most_species >= 5


@pytest.mark.parametrize(
    "name", ["default", "stanley-2002", "rosenzweig-remy", "rosenzweig-remy-neat-python"]
)
def test_evolution_equals_the_reference_with_named_settings(name: str) -> None:
    chosen = NeatSettings.named(name)
    if name in ("default", "stanley-2002"):
        chosen = NeatSettings.named(name, population=cases(60, 20))
    rng = random.Random(7)
    population = Population(3, 2, chosen, key=2**64 - 1)
    plain = Evolution(Neat(chosen, 4, 2, 3), 2**64 - 1)
    for _ in range(cases(12, 4)):
        fitness = random_fitness(rng, "distinct", chosen.population)
        population.tell(fitness)
        plain.tell(fitness)
        assert_equal_generations(population, plain)
