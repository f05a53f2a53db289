"""Crossover against the reference, by rule and by frequency."""

from __future__ import annotations

import copy
import random
from typing import Any

import numpy as np
import pytest

from realitygap.evolution import Population
from realitygap.kernels.neat import crossover
from realitygap.kernels.neat.genome import make_genomes
from tests.kernels.genome_arrays import cursor, from_arrays, rules_of, settings, to_arrays
from tests.reference.effort import cases
from tests.reference.neat import Gene, Genome, Neat, has_cycle
from tests.reference.philox import CHILD, Stream

pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered")

EQUAL, A_FITTER, B_FITTER = (1.0, 1.0), (2.0, 1.0), (1.0, 2.0)


def child_of(neat: Neat, a: Genome, b: Genome, fitness: tuple[float, float], seed: int) -> Genome:
    old = to_arrays(neat, [a, b])
    new = make_genomes(1, neat.n_outputs, old.innovation.shape[1] * 2, old.hidden.shape[1] * 2)
    stream = tuple(map(np.uint32, [CHILD, 1 << 12, 0, seed, 0]))
    reached = np.empty(new.innovation.shape[1] + 1, np.int32)
    crossover.crossover(
        old,
        np.int64(0),
        np.int64(1),
        np.array(fitness),
        rules_of(neat),
        new,
        np.int64(0),
        stream,
        cursor(),
        reached,
    )
    assert not new.full[0]
    return from_arrays(neat, new, 0)


def relatives(neat: Neat, seed: int, n: int = 4) -> list[Genome]:
    """Genomes that evolved apart for a while from one ancestor, in one history, and lost some of their genes.

    Half of the generations only one of them finds something, so that equal links get different numbers.
    """
    rng = random.Random(seed)
    history = neat.history()
    ancestor = neat.first_genome(Stream(seed, 0, 0, 0, CHILD))
    genomes = [copy.deepcopy(ancestor) for _ in range(n)]
    for generation in range(1, 12):
        for k, genome in enumerate(genomes):
            stream = Stream(seed, 0, generation, k, CHILD)
            if rng.random() < 0.7:
                (neat.add_node if rng.random() < 0.5 else neat.add_link)(genome, history, stream)
            neat.mutate_weights(genome, stream)
            for gene in genome.genes.values():
                gene.enabled = gene.enabled != (rng.random() < 0.15)
        history.forget()
    return genomes


def random_neat(rng: random.Random, **changes: Any) -> Neat:
    chosen = {
        "recurrent": rng.random() < 0.3,
        "node_bias": rng.random() < 0.5,
        "average_weights": rng.choice([0.0, 0.4, 1.0]),
        "equal_parents": rng.choice(["mix", "mix", "smaller"]),
        "disabled_rule": rng.choice(["coin", "inherit"]),
        "stay_disabled": rng.choice([0.0, 0.75, 1.0]),
        **changes,
    }
    return Neat(settings(**chosen), rng.randint(1, 3), rng.randint(1, 3))


@pytest.mark.slow
def test_children_equal_the_reference() -> None:
    for seed in range(cases(150, 15)):
        rng = random.Random(seed)
        neat = random_neat(rng)
        genomes = relatives(neat, seed)
        for k in range(6):
            a, b = rng.sample(genomes, 2)
            fitness = rng.choice([EQUAL, EQUAL, A_FITTER, B_FITTER])
            expected = neat.crossover(a, b, *fitness, Stream(k, 0, 1, 0, CHILD))
            assert child_of(neat, a, b, fitness, k) == expected, seed


def test_a_child_has_the_structure_of_the_fitter_parent() -> None:
    for seed in range(cases(60, 8)):
        neat = random_neat(random.Random(seed))
        a, b = relatives(neat, seed, 2)
        for fitness, fitter in [(A_FITTER, a), (B_FITTER, b)]:
            child = child_of(neat, a, b, fitness, seed)
            assert child.genes.keys() == fitter.genes.keys()
            assert child.biases.keys() == fitter.biases.keys()
            for number, gene in child.genes.items():
                assert gene.link == fitter.genes[number].link


def test_equal_parents_give_the_structure_of_the_smaller_where_that_is_the_rule() -> None:
    for seed in range(cases(60, 8)):
        neat = random_neat(random.Random(seed), equal_parents="smaller")
        a, b = relatives(neat, seed, 2)
        child = child_of(neat, a, b, EQUAL, seed)
        smaller = a if len(a.genes) <= len(b.genes) else b
        assert child.genes.keys() == smaller.genes.keys()


def test_equal_parents_give_each_other_gene_by_a_coin() -> None:
    """Disjoint genes of independent links; four standard errors: 1 in 16,000 by chance."""
    neat = Neat(settings(recurrent=True, stay_disabled=0.75), 8, 8)
    first = neat.first_genome(Stream(1, 0, 0, 0, 2))
    a = Genome({n: g for n, g in first.genes.items() if n % 3 != 1}, dict(first.biases))
    b = Genome({n: g for n, g in first.genes.items() if n % 3 != 2}, dict(first.biases))
    alone = sorted(a.genes.keys() ^ b.genes.keys())
    n = cases(300, 30)
    children = [child_of(neat, a, b, EQUAL, seed) for seed in range(n)]
    taken = np.array([[number in child.genes for number in alone] for child in children])
    assert abs(taken.mean() - 0.5) < 4 * 0.5 / np.sqrt(taken.size)
    matching = a.genes.keys() & b.genes.keys()
    assert all(matching <= child.genes.keys() for child in children)


def test_matching_weights_come_from_either_parent_or_are_averaged() -> None:
    """Four standard errors: 1 in 16,000 by chance."""
    neat = Neat(settings(node_bias=True, average_weights=0.0), 5, 4)
    a, b = (neat.first_genome(Stream(k, 0, 0, 0, 2)) for k in (1, 2))
    from_a = []
    for seed in range(cases(200, 20)):
        child = child_of(neat, a, b, A_FITTER, seed)
        for number, gene in child.genes.items():
            assert gene.weight in (a.genes[number].weight, b.genes[number].weight)
            from_a.append(gene.weight == a.genes[number].weight)
        for node, bias in child.biases.items():
            assert bias in (a.biases[node], b.biases[node])
            from_a.append(bias == a.biases[node])
    assert abs(np.mean(from_a) - 0.5) < 4 * 0.5 / np.sqrt(len(from_a))
    neat = Neat(settings(node_bias=True, average_weights=1.0), 5, 4)
    child = child_of(neat, a, b, A_FITTER, 1)
    for number, gene in child.genes.items():
        assert gene.weight == (a.genes[number].weight + b.genes[number].weight) / 2
    for node, bias in child.biases.items():
        assert bias == (a.biases[node] + b.biases[node]) / 2


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_the_share_of_averaged_children_is_that_of_the_settings(share: float) -> None:
    """Four standard errors: 1 in 16,000 by chance."""
    neat = Neat(settings(average_weights=share), 3, 2)
    a, b = (neat.first_genome(Stream(k, 0, 0, 0, 2)) for k in (1, 2))
    n = cases(500, 50)
    averaged = [
        child_of(neat, a, b, EQUAL, seed).genes[0].weight not in (a.genes[0].weight, b.genes[0].weight)
        for seed in range(n)
    ]
    assert abs(np.mean(averaged) - share) <= 4 * np.sqrt(share * (1 - share) / n)


@pytest.mark.parametrize(
    ("rule", "in_a", "in_b", "chance"),
    [
        ("coin", False, True, 0.75),
        ("coin", False, False, 0.75),
        ("coin", True, True, 0.0),
        ("inherit", False, True, 0.875),
        ("inherit", True, False, 0.875),
        ("inherit", False, False, 1.0),
        ("inherit", True, True, 0.0),
        ("coin", False, None, 0.75),  # a gene of the fitter parent alone
        ("inherit", False, None, 1.0),
        ("coin", True, None, 0.0),
    ],
)
def test_genes_are_disabled_as_often_as_the_rule_states(
    rule: str, in_a: bool, in_b: bool | None, chance: float
) -> None:
    """Four standard errors: 1 in 16,000 by chance."""
    neat = Neat(settings(disabled_rule=rule, stay_disabled=0.75), 10, 4)
    a, b = (neat.first_genome(Stream(k, 0, 0, 0, 2)) for k in (1, 2))
    for gene in a.genes.values():
        gene.enabled = in_a
    for gene in b.genes.values():
        gene.enabled = bool(in_b)
    if in_b is None:
        b.genes = {0: b.genes[0]}
    numbers = [number for number in a.genes if in_b is not None or number not in b.genes]
    disabled = []
    for seed in range(cases(100, 10)):
        child = child_of(neat, a, b, A_FITTER, seed)
        disabled += [not child.genes[number].enabled for number in numbers]
    assert abs(np.mean(disabled) - chance) <= 4 * np.sqrt(chance * (1 - chance) / len(disabled))


def test_a_link_that_has_two_numbers_comes_once() -> None:
    neat = Neat(settings(), 2, 1)
    first = neat.first_genome(Stream(1, 0, 0, 0, 2))
    shared = {0: first.genes[0]}
    a = Genome({**shared, 5: Gene(1, 2, 0.5)}, {2: 0.0})
    b = Genome({**shared, 9: Gene(1, 2, -0.5)}, {2: 0.0})
    both = 0
    for seed in range(100):
        child = child_of(neat, a, b, EQUAL, seed)
        links = [gene.link for gene in child.genes.values()]
        assert len(links) == len(set(links))
        both += len(child.genes) == 2
    assert both > 50  # with either number; chance alone leaves both out of a quarter


def test_two_links_that_would_close_a_cycle_do_not_come_together() -> None:
    neat = Neat(settings(), 1, 1)
    biases = {1: 0.0, 2: 0.0, 3: 0.0}
    shared = {
        0: Gene(0, 1, 1.0),
        1: Gene(0, 2, 1.0),
        2: Gene(2, 1, 1.0),
        3: Gene(0, 3, 1.0),
        4: Gene(3, 1, 1.0),
    }
    a = Genome({**shared, 5: Gene(2, 3, 1.0)}, biases)
    b = Genome({**shared, 6: Gene(3, 2, 1.0)}, biases)
    found = set()
    for seed in range(100):
        found.add(frozenset(child_of(neat, a, b, EQUAL, seed).genes.keys() - shared.keys()))
    assert found == {frozenset(), frozenset({5}), frozenset({6})}
    recurrent = Neat(settings(recurrent=True), 1, 1)
    found = {
        frozenset(child_of(recurrent, a, b, EQUAL, seed).genes.keys() - shared.keys()) for seed in range(100)
    }
    assert frozenset({5, 6}) in found


@pytest.mark.parametrize("equal", [True, False])
def test_children_of_evolved_genomes_have_no_cycle_and_no_link_twice(equal: bool) -> None:
    """Thousands of pairs out of populations that evolved with much structural mutation."""
    changes: dict[str, Any] = {
        "population": 12,
        "add_node": 0.4,
        "add_link": 0.8,
        "structural_mutations": "independent",
        "threshold": 100,
        "survival": 1.0,
    }
    neat = Neat(settings(**changes), 3, 2, 2)
    n_pairs = n_cycles_avoided = 0
    for seed in range(cases(12, 1)):
        rng = random.Random(seed)
        population = Population(2, 2, neat.settings, seed=seed)
        for _ in range(12):
            population.tell([rng.random() for _ in range(12)])
        rows = [from_arrays(neat, population._genomes, row) for row in range(12)]
        for a in rows:
            for b in rows:
                child = child_of(neat, a, b, EQUAL if equal else A_FITTER, n_pairs)
                n_pairs += 1
                links = [gene.link for gene in child.genes.values()]
                assert len(links) == len(set(links))
                assert not has_cycle(links)
                n_cycles_avoided += has_cycle(a.links() | b.links())
    assert n_pairs == cases(12, 1) * 144
    assert n_cycles_avoided > 0
