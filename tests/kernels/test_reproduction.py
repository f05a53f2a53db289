"""Shares of offspring, survival and the making of children: by rule, by frequency and by property."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from realitygap.evolution import NeatSettings
from realitygap.kernels.neat import reproduction
from realitygap.kernels.neat.genome import make_genomes
from realitygap.kernels.neat.mutation import make_innovations
from realitygap.kernels.neat.species import make_species
from tests.kernels.genome_arrays import from_arrays, rules_of, settings, to_arrays
from tests.reference.effort import cases
from tests.reference.neat import Gene, Genome, Neat, Species
from tests.reference.philox import Stream

pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered")

FEW = hypothesis_settings(max_examples=cases(300, 50), deadline=None, derandomize=True)


# whole numbers in proportion


def rounded(share: list[float], total: int) -> list[int]:
    count = np.zeros(len(share), np.int64)
    reproduction.round_to_sum(np.array(share, np.float64), np.int64(total), count, np.empty(len(share)))
    return count.tolist()


shares = st.lists(
    st.one_of(st.just(0.0), st.floats(1e-6, 1e6), st.integers(0, 9).map(float), st.floats(1e-300, 1e300)),
    min_size=1,
    max_size=12,
).filter(lambda share: 0.0 < sum(share) < math.inf)


@given(shares, st.integers(0, 1_000))
@FEW
def test_rounded_shares_add_up_and_are_within_one_of_the_exact_ones(share: list[float], total: int) -> None:
    count = rounded(share, total)
    assert sum(count) == total
    whole = sum(map(Fraction, share))
    for given_, part in zip(count, share, strict=True):
        exact = Fraction(part) * total / whole
        assert abs(given_ - exact) < 1 + Fraction(1, 10**9)
        assert given_ >= 0
        if part == 0.0:
            assert given_ == 0


@given(shares, st.integers(1, 1_000))
@FEW
def test_shares_that_are_rounded_up_have_the_largest_remainders(share: list[float], total: int) -> None:
    count = rounded(share, total)
    whole = sum(map(Fraction, share))
    over = [Fraction(part) * total / whole - given_ for given_, part in zip(count, share, strict=True)]
    up = [1 + rest for rest in over if rest < 0]
    down = [rest for rest in over if rest > 0]
    if up and down:
        assert min(up) > max(down) - Fraction(1, 10**9)


def test_the_earlier_of_equal_remainders_is_rounded_up() -> None:
    assert rounded([1.0, 1.0, 1.0], 8) == [3, 3, 2]
    assert rounded([1.0, 1.0], 3) == [2, 1]
    assert rounded([1.0, 3.0], 2) == [1, 1]
    assert rounded([0.0, 2.0, 0.0], 7) == [0, 7, 0]


# shares of offspring


def offspring(
    neat_settings: NeatSettings,
    members: list[list[float]],
    *,
    generation: int = 0,
    improved: list[int] | None = None,
    improved_at: int = 0,
) -> list[int]:
    """Children of species whose members have these fitnesses; checked against the reference."""
    neat = Neat(neat_settings, 1, 1)
    rules = rules_of(neat)
    fitness = [f for kind in members for f in kind]
    species_of = [10 + k for k, kind in enumerate(members) for _ in kind]
    improved = improved or [0] * len(members)
    table = make_species(rules, len(fitness))
    table.counts[0] = len(members)
    for k, kind in enumerate(members):
        table.identity[k], table.size[k], table.improved[k] = 10 + k, len(kind), improved[k]
    table.improved_at[0] = improved_at
    shared = np.empty(len(fitness))
    reproduction.not_negative(np.array(fitness, np.float64), rules, shared)
    count = np.zeros(len(members), np.int64)
    reproduction.share_offspring(
        shared, np.array(species_of, np.int32), table, rules, np.int64(generation), count
    )
    species = [Species(10 + k, improved[k]) for k in range(len(members))]
    expected = neat.offspring(shared.tolist(), species_of, species, generation, improved_at)
    assert count.tolist() == expected
    return count.tolist()


def test_a_species_share_is_its_mean_fitness_not_its_size() -> None:
    """Explicit fitness sharing: six members of fitness 1 against two of fitness 3: 1 to 3 of 8 children."""
    assert offspring(settings(), [[1.0] * 6, [3.0] * 2]) == [2, 6]
    assert offspring(settings(), [[1.0] * 4, [1.0], [1.0, 0.0, 2.0]]) == [3, 3, 2]


def test_negative_fitness_is_lifted_or_cut_off() -> None:
    members = [[-4.0, -4.0], [0.0, 0.0], [-2.0, -2.0], [-4.0, 4.0]]
    assert offspring(settings(negative_fitness="shift"), members) == [0, 3, 2, 3]  # means 0, 4, 2, 4
    assert offspring(settings(negative_fitness="clip"), members) == [0, 0, 0, 8]  # means 1e-4, 0, 1e-4, 2
    assert offspring(settings(negative_fitness="clip"), [[-9.0] * 3, [-1.0] * 5]) == [4, 4]


def test_positive_fitness_is_not_shifted() -> None:
    assert offspring(settings(negative_fitness="shift"), [[1.0] * 4, [3.0] * 4]) == [2, 6]


def test_species_keep_their_sizes_if_all_fitness_is_zero_or_equal_and_negative() -> None:
    assert offspring(settings(), [[0.0] * 5, [0.0] * 2, [0.0]]) == [5, 2, 1]
    assert offspring(settings(), [[-3.0] * 5, [-3.0] * 2, [-3.0]]) == [5, 2, 1]


def test_fitness_too_large_to_be_summed_leaves_species_their_sizes() -> None:
    assert offspring(settings(), [[1e308] * 5, [1e308] * 3]) == [5, 3]


def test_a_stagnant_species_counts_with_the_factor() -> None:
    members = [[1.0] * 4, [1.0] * 4]
    rules = {"stagnation": 15, "population_stagnation": 1_000, "best_species_spared": False}
    for factor, expected in [(0.0, [0, 8]), (0.01, [0, 8]), (0.3, [2, 6]), (1.0, [4, 4])]:
        neat_settings = settings(stagnation_factor=factor, **rules)
        assert offspring(neat_settings, members, generation=15, improved=[0, 1]) == expected
        assert offspring(neat_settings, members, generation=14, improved=[0, 1]) == [4, 4]


def test_the_species_of_the_fittest_is_spared_where_that_is_said() -> None:
    members = [[1.0] * 4, [1.0, 1.0, 1.0, 1.5]]
    rules = {"stagnation": 2, "stagnation_factor": 0.0, "population_stagnation": 1_000}
    stale = {"generation": 9, "improved": [0, 0]}
    assert offspring(settings(best_species_spared=True, **rules), members, **stale) == [0, 8]
    assert offspring(settings(best_species_spared=False, **rules), members, **stale) == [
        4,
        4,
    ]  # all are: sizes


def test_a_stagnant_population_leaves_children_to_the_two_best_species() -> None:
    members = [[1.0, 9.0], [5.0, 5.0], [8.0, 0.0], [7.0, 7.0]]
    rules = settings(population_stagnation=20)
    fresh = {"improved": [20] * 4}
    assert offspring(rules, members, generation=21, **fresh) == [4, 0, 4, 0]  # best members: 9 and 8
    assert offspring(rules, members, generation=20, **fresh) == [2, 2, 1, 3]  # shares 5, 5, 4, 7
    assert offspring(rules, members, generation=21, improved_at=1, **fresh) == [2, 2, 1, 3]
    two = [[1.0] * 2, [3.0] * 6]  # with two species nothing changes
    assert offspring(rules, two, generation=21, improved=[20, 20]) == [2, 6]


members_of = st.lists(
    st.lists(
        st.one_of(st.just(0.0), st.floats(-10, 10), st.integers(-2, 3).map(float)), min_size=1, max_size=6
    ),
    min_size=1,
    max_size=6,
).filter(lambda kinds: sum(map(len, kinds)) >= 2)


@given(
    members_of,
    st.sampled_from(["shift", "clip"]),
    st.booleans(),
    st.sampled_from([0.0, 0.01, 1.0]),
    st.integers(0, 12),
    st.integers(0, 12),
)
@FEW
def test_the_population_keeps_its_size_whatever_the_fitness(
    members: list[list[float]], negative: str, spared: bool, factor: float, generation: int, improved: int
) -> None:
    neat_settings = settings(
        negative_fitness=negative,
        best_species_spared=spared,
        stagnation_factor=factor,
        stagnation=3,
        population_stagnation=6,
    )
    count = offspring(
        neat_settings, members, generation=generation, improved=[min(improved, generation)] * len(members)
    )
    assert sum(count) == sum(map(len, members))
    assert min(count) >= 0


# ranks and improvement


def test_members_are_ranked_by_fitness_equal_ones_in_their_order() -> None:
    fitness = np.array([1.0, 5.0, 3.0, 5.0, 9.0, 3.0])
    species_of = np.array([7, 7, 7, 7, 8, 7], np.int32)
    members = np.empty(6, np.int64)
    n = reproduction.ranked_members(fitness, species_of, np.int32(7), members)
    assert members[:n].tolist() == [1, 3, 2, 5, 0]


def test_only_a_better_best_fitness_is_an_improvement() -> None:
    rules = rules_of(Neat(settings(), 1, 1))
    table = make_species(rules, 4)
    table.counts[0] = 2
    table.identity[:2] = 3, 5
    table.best[:2] = -math.inf
    species_of = np.array([3, 3, 5, 5], np.int32)
    for generation, fitness in enumerate([[1.0, 2.0, 4.0, 3.0], [2.0, 2.0, 4.0, 4.0], [0.0, 3.0, 1.0, 1.0]]):
        reproduction.note_improvement(np.array(fitness), species_of, table, np.int64(generation))
    assert table.best[:2].tolist() == [3.0, 4.0]
    assert table.improved[:2].tolist() == [2, 0]
    assert (table.floats[1], table.improved_at[0]) == (4.0, 0)


# children


class Brood:
    """One generation of children of genomes that can be told apart by the weight of their first gene."""

    def __init__(
        self, members: list[list[float]], *, key: int = 1, genomes: list[Genome] | None = None, **changes: Any
    ) -> None:
        fitness = [f for kind in members for f in kind]
        n = len(fitness)
        self.neat = Neat(settings(population=max(n, 2), **changes), 2, 1)
        rules = rules_of(self.neat)
        if genomes is None:
            genomes = [self.neat.first_genome(Stream(key, 0, 0, row, 2)) for row in range(n)]
        self.genomes = genomes
        room = max(len(genome.genes) for genome in genomes) + 40
        old = to_arrays(self.neat, genomes, room, 20)
        new = make_genomes(n, 1, room, 20)
        table = make_species(rules, n)
        table.counts[0] = len(members)
        for k, kind in enumerate(members):
            table.identity[k], table.size[k], table.best[k] = k, len(kind), -math.inf
        self.parents = np.empty((n, 2), np.int32)
        innovations = make_innovations(rules, n)
        innovations.counters[:2] = 1_000
        reproduction.reproduce(
            old,
            np.array(fitness),
            np.array([k for k, kind in enumerate(members) for _ in kind], np.int32),
            table,
            rules,
            innovations,
            np.uint64(key),
            np.int64(0),
            np.int64(0),
            new,
            self.parents,
        )
        self.is_full = bool(new.full[0])
        self.children = [] if self.is_full else [from_arrays(self.neat, new, row) for row in range(n)]


def test_the_champion_of_a_large_species_is_copied_unchanged() -> None:
    members = [[1.0, 2.0, 9.0, 3.0, 4.0, 5.0], [1.0] * 5]
    brood = Brood(members, mutate_weights=1.0, champion_counts="members")
    assert brood.children[0] == brood.genomes[2]
    assert brood.parents[0].tolist() == [2, -1]
    others = brood.children[1:]
    assert sum(child in brood.genomes for child in others) < 3  # unmutated crossovers at most


def test_large_means_many_members_or_many_children_to_come() -> None:
    few_with_many_children = [[1.0] * 7, [9.0] * 3]  # children: 1 and 9
    for counts, first_of in [("members", 0), ("offspring", 7)]:
        brood = Brood(
            few_with_many_children, champion_counts=counts, mutate_weights=1.0, crossover=0.0, weight_step=1.0
        )
        copied = [child in brood.genomes for child in brood.children]
        assert copied.count(True) == 1
        assert brood.children[copied.index(True)] == brood.genomes[first_of]


@pytest.mark.parametrize(
    ("survival", "allowed"), [(0.0, {4}), (0.2, {4, 3, 2}), (0.5, {4, 3, 2, 1, 0, 5}), (1.0, set(range(10)))]
)
def test_parents_are_the_fittest_part_of_their_species(survival: float, allowed: set[int]) -> None:
    """floor(share * 10 + 1) of ten: 1, 3, 6 and all."""
    fitness = [6.0, 7.0, 8.0, 9.0, 10.0, 5.0, 4.0, 3.0, 2.0, 1.0]
    seen = set()
    for key in range(40):
        brood = Brood([fitness], key=key, survival=survival)
        seen |= set(brood.parents.ravel().tolist()) - {-1}
    assert seen == allowed


@pytest.mark.parametrize("crossover", [0.0, 0.75, 1.0])
def test_the_stated_share_of_children_has_two_parents(crossover: float) -> None:
    """With ten possible parents a tenth of the pairs are one and the same: those have one.

    Four standard errors: 1 in 16,000 by chance.
    """
    two = np.concatenate(
        [
            Brood([[1.0] * 10], key=key, survival=1.0, crossover=crossover, champion_from=99).parents[:, 1]
            >= 0
            for key in range(cases(100, 20))
        ]
    )
    share = crossover * 0.9
    assert abs(two.mean() - share) <= 4 * np.sqrt(share * (1 - share) / two.size)


def test_the_stated_share_of_children_of_two_parents_is_not_mutated() -> None:
    """Four standard errors: 1 in 16,000 by chance."""
    untouched = []
    for key in range(cases(100, 20)):
        brood = Brood(
            [[1.0] * 10],
            key=key,
            survival=1.0,
            crossover=1.0,
            crossover_only=0.3,
            mutate_weights=1.0,
            champion_from=99,
            structural_mutations="independent",
        )
        for child, (a, b) in zip(brood.children, brood.parents.tolist(), strict=True):
            if b >= 0:
                inherited = {brood.genomes[a].genes[0].weight, brood.genomes[b].genes[0].weight}
                untouched.append(child.genes[0].weight in inherited)
    assert abs(np.mean(untouched) - 0.3) < 4 * np.sqrt(0.3 * 0.7 / len(untouched))


def test_parents_of_another_species_are_its_champions() -> None:
    members = [[1.0, 2.0, 3.0], [5.0, 4.0], [6.0, 9.0, 6.0]]
    species_of = [0, 0, 0, 1, 1, 2, 2, 2]
    champions = {0: 2, 1: 3, 2: 6}
    n_other = n_two = 0
    seen = set()
    for key in range(cases(150, 60)):
        brood = Brood(members, key=key, interspecies=0.5, crossover=1.0, survival=1.0, champion_from=99)
        for a, b in brood.parents.tolist():
            if b >= 0:
                n_two += 1
                if species_of[a] != species_of[b]:
                    n_other += 1
                    assert b == champions[species_of[b]]
                    seen.add((species_of[a], species_of[b]))
    assert seen == {(a, b) for a in range(3) for b in range(3) if a != b}
    assert 0.5 < n_other / n_two < 0.8  # half of the draws, and of the others some name one parent twice


def test_children_stay_in_order_of_species() -> None:
    brood = Brood([[1.0] * 3, [2.0] * 3, [3.0] * 3], interspecies=0.0)
    firsts = [a // 3 for a, _ in brood.parents.tolist()]
    assert firsts == sorted(firsts)
    assert [firsts.count(k) for k in range(3)] == [2, 3, 4]


def test_reproduction_leaves_the_old_generation_as_it_is() -> None:
    """The child of a row is written while its parents may still be needed."""
    neat = Neat(settings(population=6), 2, 1)
    genomes = [neat.first_genome(Stream(1, 0, 0, row, 2)) for row in range(6)]
    before = [Genome({n: Gene(**vars(g)) for n, g in one.genes.items()}, dict(one.biases)) for one in genomes]
    brood = Brood([[1.0] * 6], genomes=genomes, add_node=1.0)
    assert brood.genomes == before


def test_a_child_with_more_hidden_nodes_than_there_is_room_for_is_said_and_harms_nothing() -> None:
    """Looking for cycles in such a child needed more room than its nodes had, and wrote beyond it.

    Both parents have all the hidden nodes that fit, around one that they share. (Only with compilation off would
    that be an error: compiled code does not check bounds.)
    """
    shared = {0: Gene(0, 2, 1.0), 1: Gene(1, 2, 1.0), 2: Gene(0, 3, 1.0), 3: Gene(3, 2, 1.0)}

    def star(nodes: range) -> Genome:
        """Links from the shared node 3 to each of these, and from there to the output."""
        into = {10 * node: Gene(3, node, 1.0) for node in nodes}
        out = {10 * node + 1: Gene(node, 2, 1.0) for node in nodes}
        return Genome({**shared, **into, **out}, dict.fromkeys([2, 3, *nodes], 0.0))

    one, other = star(range(4, 23)), star(range(30, 48))
    other.genes |= {
        2_000: Gene(1, 60, 1.0),
        2_001: Gene(60, 3, 1.0),
    }  # looked at last: does it close a cycle?
    other.biases[60] = 0.0
    found_no_room = 0
    for key in range(50):
        brood = Brood(
            [[1.0, 1.0]], key=key, genomes=[one, other], survival=1.0, crossover=1.0, champion_from=99
        )
        found_no_room += brood.is_full
    assert found_no_room > 5
