"""Compatibility distance and speciation, against the reference and by hand."""

from __future__ import annotations

import math
import random
from typing import Any

import numpy as np
import pytest

from realitygap.evolution import Population
from realitygap.kernels.neat import species as species_kernels
from realitygap.kernels.neat.species import SpeciesTable
from tests.kernels.genome_arrays import grown, rules_of, settings, to_arrays
from tests.reference.effort import cases
from tests.reference.neat import Gene, Genome, Neat
from tests.reference.philox import SPECIES, Stream

pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered")


def distance(neat: Neat, a: Genome, b: Genome) -> float:
    arrays = to_arrays(neat, [a, b])
    return float(species_kernels.genome_distance(arrays, np.int64(0), arrays, np.int64(1), rules_of(neat)))


def genome(*genes: tuple[int, float], disabled: int = -1) -> Genome:
    """Genes of given numbers and weights; where they lead does not matter to the distance."""
    return Genome({number: Gene(0, 1, weight, number != disabled) for number, weight in genes}, {1: 0.0})


# distance

COEFFICIENTS = {"excess_coefficient": 2.0, "disjoint_coefficient": 3.0, "weight_coefficient": 0.5}


def test_the_distance_of_the_papers_figure_is_reproduced() -> None:
    """EC02, figure 4: genes 1-5 and 8 against 1-7, 9, 10: disjoint 6, 7, 8; excess 9, 10."""
    neat = Neat(settings(**COEFFICIENTS), 1, 1)
    one = genome(*((number, 1.0) for number in (1, 2, 3, 4, 5, 8)))
    other = genome(*((number, 1.5) for number in (1, 2, 3, 4, 5, 6, 7, 9, 10)))
    assert distance(neat, one, other) == 2.0 * 2 + 3.0 * 3 + 0.5 * 0.5
    assert distance(neat, other, one) == distance(neat, one, other)


def test_excess_and_disjoint_are_divided_by_the_larger_size_as_said() -> None:
    for rule, n_genes, divided in [
        ("never", 30, False),
        ("large", 19, False),
        ("large", 20, True),
        ("always", 3, True),
    ]:
        neat = Neat(settings(normalize_genes=rule, **COEFFICIENTS), 1, 1)
        one, other = genome((0, 0.0)), genome(*((number, 1.0) for number in range(n_genes)))
        size = n_genes if divided else 1
        assert distance(neat, one, other) == pytest.approx(2.0 * (n_genes - 1) / size + 0.5)


def test_disabled_genes_count_as_others_do() -> None:
    neat = Neat(settings(**COEFFICIENTS), 1, 1)
    one, other = genome((0, 1.0), (1, 2.0)), genome((0, 1.0), (1, 5.0), disabled=1)
    assert distance(neat, one, other) == 0.5 * 1.5


def test_genomes_without_a_gene_in_common_are_infinitely_far_apart() -> None:
    neat = Neat(settings(), 1, 1)
    assert distance(neat, genome((0, 1.0)), genome((1, 1.0))) == math.inf


def test_structure_alone_counts_if_no_gene_is_common_and_weights_do_not_count() -> None:
    neat = Neat(settings(**{**COEFFICIENTS, "weight_coefficient": 0.0}), 1, 1)
    assert distance(neat, genome((0, 1.0)), genome((1, 1.0), (2, 1.0))) == 3.0 + 2.0 * 2


def test_genomes_of_a_random_start_are_one_species_where_no_difference_counts() -> None:
    """So that NEAT without speciation has one species; a high threshold alone leaves those that share no gene."""
    n = 40
    nothing = {"excess_coefficient": 0, "disjoint_coefficient": 0, "weight_coefficient": 0}
    for changes, several in ((nothing, False), ({"threshold": 1_000_000}, True)):
        chosen = settings(start_hidden=10, start_topology="random", target_species=0, **changes)
        population = Population(6, 1, chosen.model_copy(update={"population": n}), seed=3)
        assert (len(set(population.species.tolist())) > 1) == several


def test_a_genome_is_at_distance_0_from_itself() -> None:
    neat = Neat(settings(node_bias=True), 3, 2)
    one = grown(neat, 1, 12)
    assert distance(neat, one, one) == 0.0


def test_random_distances_equal_the_reference() -> None:
    for seed in range(cases(300, 40)):
        rng = random.Random(seed)
        neat = Neat(
            settings(
                **COEFFICIENTS,
                normalize_genes=rng.choice(["never", "large", "always"]),
                node_bias=rng.random() < 0.5,
            ),
            3,
            2,
        )
        one, other = (grown(neat, 10 * seed + k, rng.randint(0, 15)) for k in range(2))
        assert distance(neat, one, other) == pytest.approx(neat.distance(one, other), rel=1e-13)


# speciation


class Speciation:
    """Species over generations of genomes that are told apart by one weight: distance = difference."""

    def __init__(self, n: int, **changes: Any) -> None:
        self.neat = Neat(
            settings(weight_coefficient=1.0, **{"threshold": 1.0, "target_species": 0, **changes}), 1, 1
        )
        self.rules = rules_of(self.neat)
        self.table: SpeciesTable = species_kernels.make_species(self.rules, n)
        self.species_of = np.zeros(n, np.int32)
        self.old = to_arrays(self.neat, [genome((0, 0.0))] * n)
        self.generation = 0

    def place(self, *weights: float, fitness: list[float] | None = None) -> list[int]:
        new = to_arrays(self.neat, [genome((0, weight)) for weight in weights])
        fit = np.array(fitness or [0.0] * len(weights))
        species_kernels.speciate(
            new,
            self.old,
            fit,
            self.species_of,
            self.table,
            self.rules,
            np.uint64(5),
            np.int64(0),
            np.int64(self.generation),
        )
        self.old = new
        self.generation += 1
        n = int(self.table.counts[0])
        listed = self.table.identity[:n].tolist()
        sizes = self.table.size[:n].tolist()
        found = self.species_of.tolist()
        assert sizes == [found.count(identity) for identity in listed]
        assert sum(sizes) == len(weights)
        assert listed == sorted(listed)
        return found

    @property
    def threshold(self) -> float:
        return float(self.table.floats[0])


def test_the_first_genome_founds_the_first_species() -> None:
    species = Speciation(4)
    assert species.place(0.0, 0.5, 3.0, 2.5) == [0, 0, 1, 1]


def test_a_distance_of_exactly_the_threshold_is_not_compatible() -> None:
    assert Speciation(2).place(0.0, 1.0) == [0, 1]
    assert Speciation(2).place(0.0, math.nextafter(1.0, 0.0)) == [0, 0]


def test_a_genome_joins_the_first_compatible_species_or_the_nearest() -> None:
    weights = (0.0, 1.5, 0.8)  # the last is 0.8 from the first and 0.7 from the second
    assert Speciation(3, assign="first").place(*weights) == [0, 1, 0]
    assert Speciation(3, assign="nearest").place(*weights) == [0, 1, 1]
    assert Speciation(3, assign="nearest").place(0.0, 1.5, 0.75) == [0, 1, 0]  # of two equally near the older


def test_empty_species_disappear_and_numbers_are_never_used_again() -> None:
    species = Speciation(3)
    assert species.place(0.0, 5.0, 10.0) == [0, 1, 2]
    assert species.place(5.0, 5.1, 20.0) == [1, 1, 3]
    assert species.place(0.0, 5.0, 20.0) == [4, 1, 3]
    assert species.table.improved[:3].tolist() == [0, 1, 2]  # founded in these generations
    assert (species.table.best[:3] == -math.inf).all()


def test_a_species_keeps_what_is_known_of_it() -> None:
    species = Speciation(3)
    species.place(0.0, 5.0, 10.0)
    species.table.best[:3] = 1.0, 2.0, 3.0
    species.table.improved[:3] = 7, 8, 9
    assert species.place(10.0, 10.0, 5.0) == [2, 2, 1]
    assert species.table.best[:2].tolist() == [2.0, 3.0]
    assert species.table.improved[:2].tolist() == [8, 9]


def test_the_champion_of_the_generation_before_represents_a_species() -> None:
    species = Speciation(3, representative="champion")
    assert species.place(0.0, 0.9, -0.9) == [0, 0, 0]
    assert species.place(1.7, 0.0, -0.2, fitness=[1.0, 3.0, 3.0]) == [
        0,
        0,
        1,
    ]  # 0.9: the first of the fittest
    assert species.place(0.9, 1.7, -1.1, fitness=[1.0, 5.0, 2.0]) == [0, 2, 1]  # 0.0, and -0.2 alone


def test_the_first_individual_represents_its_species_when_it_is_the_fittest() -> None:
    species = Speciation(3, representative="champion")
    assert species.place(0.0, 0.9, -0.9) == [0, 0, 0]
    assert species.place(-0.95, 1.5, 0.5, fitness=[3.0, 1.0, 2.0]) == [0, 1, 0]  # 0.0


def test_a_table_that_was_cleared_has_no_species_left() -> None:
    species = Speciation(2)
    species.place(0.0, 5.0)
    species.table.floats[:] = 7.0
    species.table.improved_at[0] = 7
    species_kernels.clear_species(species.rules, species.table)
    assert species.table.counts.tolist() == [0, 0]
    assert species.table.floats.tolist() == [1.0, -math.inf]
    assert species.table.improved_at.tolist() == [0]
    assert species.place(3.0, 9.0) == [0, 1]


def test_a_random_member_of_the_generation_before_represents_a_species() -> None:
    """Each of four as often: chi-square of four classes below 21 (1 in 9,000 by chance); and as the stream says."""
    n = cases(400, 60)
    members = [0.0, 0.2, 0.4, 0.6]
    counts = np.zeros(4)
    for seed in range(n):
        species = Speciation(4)
        species.place(*members)
        species.generation = seed
        found = species.place(0.9, 1.1, 1.3, 1.5)  # each within reach of the members from one of them on
        representative = found.count(0) - 1
        assert found[: representative + 1] == [0] * (representative + 1)
        assert representative == Stream(5, 0, seed, 0, SPECIES).below(4)
        counts[representative] += 1
    assert ((counts - n / 4) ** 2 / (n / 4)).sum() < 21


def test_the_threshold_moves_towards_the_wanted_number_of_species() -> None:
    species = Speciation(4, target_species=2, threshold_step=0.3)
    species.place(0.0, 5.0, 10.0, 15.0)
    assert species.threshold == pytest.approx(1.3)  # four are too many
    species.place(0.0, 0.1, 10.0, 10.1)
    assert species.threshold == pytest.approx(1.3)  # two are right
    for _ in range(9):
        species.place(0.0, 0.1, 0.2, 0.1)
    assert species.threshold == 0.3  # one is too few; never below 0.3


def test_the_threshold_stays_where_no_number_is_wanted() -> None:
    species = Speciation(4, threshold=0.1)
    species.place(0.0, 5.0, 10.0, 15.0)
    assert species.threshold == 0.1
