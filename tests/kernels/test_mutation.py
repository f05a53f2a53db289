"""Mutation and innovation numbers: against the reference, by rule, and by frequency."""

from __future__ import annotations

import copy
import random
from typing import Any

import numpy as np
import pytest

from realitygap.kernels.neat import mutation
from realitygap.kernels.neat.mutation import Innovations
from tests.kernels.genome_arrays import cursor, from_arrays, grown, rules_of, settings, to_arrays
from tests.reference.effort import cases
from tests.reference.neat import Genome, Neat, has_cycle
from tests.reference.philox import CHILD, Stream

pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered")


class Mutator:
    """The kernels on one genome at a time, with the innovations of a run."""

    def __init__(self, neat: Neat, *, next_number: int | None = None) -> None:
        """Begin a run, or be in the middle of one, when the next number and node are `next_number`."""
        self.neat = neat
        self.rules = rules_of(neat)
        self.innovations: Innovations = mutation.make_innovations(self.rules, 1_000)
        if next_number is not None:
            self.innovations.counters[:2] = next_number

    def __call__(self, what: str, genome: Genome, seed: int) -> tuple[Genome, Any]:
        """The genome after the kernel called `what`, and what the kernel returned."""
        arrays = to_arrays(self.neat, [genome])
        stream = tuple(
            map(np.uint32, [CHILD, 1 << 12, 0, seed, 0])
        )  # replicate 0, generation 1, individual 0
        reached = np.empty(arrays.innovation.shape[1] + 1, np.int32)
        row, taken = np.int64(0), cursor()
        if what == "add_node":
            done = mutation.add_node(arrays, row, self.rules, self.innovations, stream, taken)
        elif what == "add_link":
            done = mutation.add_link(arrays, row, self.rules, self.innovations, stream, taken, reached)
        else:
            done = mutation.mutate(arrays, row, self.rules, self.innovations, stream, taken, reached)
        assert not arrays.full[0]
        return from_arrays(self.neat, arrays, 0), done

    def new_generation(self) -> None:
        mutation.start_generation(self.innovations)


def stream_of(seed: int) -> Stream:
    return Stream(seed, 0, 1, 0, CHILD)


def random_neat(rng: random.Random, **changes: Any) -> Neat:
    n_inputs, bias = rng.randint(1, 4), rng.random() < 0.5
    chosen = {
        "recurrent": rng.random() < 0.5,
        "node_bias": rng.random() < 0.5,
        "add_node": rng.choice([0.03, 0.5, 1.0]),
        "add_link": rng.choice([0.05, 0.5, 1.0]),
        "add_link_tries": rng.choice([1, 20]),
        "structural_mutations": rng.choice(["one", "independent"]),
        "split_bias_links": rng.random() < 0.5,
        "reenable": rng.choice([0.0, 0.5]),
        "replace_weight": rng.choice([0.0, 0.1, 1.0]),
        "weight_limit": rng.choice([1.5, 8.0]),
        **changes,
    }
    return Neat(settings(**chosen), n_inputs + bias, rng.randint(1, 3), n_inputs if bias else None)


def test_mutation_equals_the_reference() -> None:
    """Chains of mutations, one of each of two genomes in a generation."""
    for seed in range(cases(120, 12)):
        neat = random_neat(random.Random(seed))
        mutator, history = Mutator(neat), neat.history()
        genomes = [neat.first_genome(stream_of(k)) for k in range(2)]
        for k in range(24):
            if k % 2 == 0:
                mutator.new_generation()
                history.forget()
            expected = copy.deepcopy(genomes[k % 2])
            neat.mutate(expected, history, stream_of(k))
            genomes[k % 2], _ = mutator("mutate", genomes[k % 2], k)
            assert genomes[k % 2] == expected


# innovation numbers


def test_the_same_link_gets_the_same_number_in_one_generation_and_a_new_one_later() -> None:
    mutator = Mutator(Neat(settings(), 2, 1))
    links = [(0, 5), (1, 5), (5, 0)]
    numbers = [mutation.number_of_link(mutator.innovations, np.int32(a), np.int32(b)) for a, b in links]
    assert numbers == [2, 3, 4]  # after the two of the first genomes; direction matters
    again = [mutation.number_of_link(mutator.innovations, np.int32(a), np.int32(b)) for a, b in links]
    assert again == numbers
    mutator.new_generation()
    later = [mutation.number_of_link(mutator.innovations, np.int32(a), np.int32(b)) for a, b in links]
    assert later == [5, 6, 7]


def test_the_same_split_gets_the_same_node_and_numbers_in_one_generation_and_new_ones_later() -> None:
    neat = Neat(settings(), 1, 1)  # one gene, so everybody splits the same
    mutator = Mutator(neat)
    first, second = neat.first_genome(stream_of(1)), neat.first_genome(stream_of(2))
    (one, _), (other, _) = mutator("add_node", first, 1), mutator("add_node", second, 2)
    assert one.biases.keys() == other.biases.keys() == {1, 2}
    assert one.genes.keys() == other.genes.keys() == {0, 1, 2}
    assert one.links() == {(0, 1), (0, 2), (2, 1)}
    mutator.new_generation()
    later, _ = mutator("add_node", first, 1)
    assert later.biases.keys() == {1, 3}
    assert later.genes.keys() == {0, 3, 4}


def test_links_found_by_two_genomes_line_up() -> None:
    """Whatever arises in one generation: equal links made from equal ancestors carry equal numbers."""
    neat = Neat(settings(), 3, 2)
    ancestor = grown(neat, 3, 6)
    mutator = Mutator(neat, next_number=1_000)
    children = [mutator("add_link", ancestor, seed)[0] for seed in range(cases(200, 30))]
    made = {}
    for child in children:
        for number in child.genes.keys() - ancestor.genes.keys():
            assert made.setdefault(child.genes[number].link, number) == number
    assert len(made) > 3
    assert len(set(made.values())) == len(made)


# adding a node


def test_a_split_keeps_what_the_link_carried() -> None:
    """Weight 1 in, the old weight out; the old gene is disabled, all others stay (EC02, 3.1)."""
    for seed in range(cases(200, 20)):
        neat = random_neat(random.Random(seed))
        genome = grown(neat, seed, 5)
        mutator = Mutator(neat, next_number=500)
        child, done = mutator("add_node", genome, seed)
        assert done == bool(neat.splittable(genome))
        if not done:
            assert child == genome
            continue
        (split,) = [number for number in genome.genes if child.genes[number] != genome.genes[number]]
        old = genome.genes[split]
        assert split in neat.splittable(genome)
        assert not child.genes[split].enabled
        assert child.genes[split].weight == old.weight
        into, out = child.genes[500], child.genes[501]
        assert (into.link, into.weight, into.enabled) == ((old.source, 500), 1.0, True)
        assert (out.link, out.weight, out.enabled) == ((500, old.target), old.weight, True)
        assert child.biases == {**genome.biases, 500: 0.0}
        assert len(child.genes) == len(genome.genes) + 2


@pytest.mark.parametrize("allowed", [False, True])
def test_links_out_of_the_constant_input_are_split_only_where_that_is_allowed(allowed: bool) -> None:
    neat = Neat(settings(split_bias_links=allowed), 3, 2, 2)
    genome = neat.first_genome(stream_of(1))
    sources = set()
    for seed in range(100):
        mutator = Mutator(neat)
        child, _ = mutator("add_node", genome, seed)
        sources.add(child.genes[6].source)
    assert sources == ({0, 1, 2} if allowed else {0, 1})


def test_every_enabled_link_is_split_as_often() -> None:
    """Chi-square of six classes below 25: 1 in 7,000 by chance."""
    neat = Neat(settings(), 3, 2)
    genome = neat.first_genome(stream_of(1))
    n = cases(3_000, 300)
    split = np.zeros(6)
    for seed in range(n):
        child, _ = Mutator(neat)("add_node", genome, seed)
        split[next(number for number in range(6) if not child.genes[number].enabled)] += 1
    assert ((split - n / 6) ** 2 / (n / 6)).sum() < 25


def test_nothing_is_split_where_all_is_disabled() -> None:
    neat = Neat(settings(), 2, 1)
    genome = neat.first_genome(stream_of(1))
    for gene in genome.genes.values():
        gene.enabled = False
    assert Mutator(neat)("add_node", genome, 1) == (genome, False)


# adding a link


@pytest.mark.parametrize("recurrent", [False, True])
def test_every_allowed_link_and_no_other_is_made(recurrent: bool) -> None:
    """Feed-forward: no cycle, none out of an output. Recurrent: any, but none into an input."""
    neat = Neat(settings(recurrent=recurrent, add_link_tries=200), 2, 2)
    genome = grown(neat, 4, 7)
    for number in list(genome.genes)[1:4:2]:
        del genome.genes[number]
    nodes = [*range(neat.n_inputs), *neat.outputs, *neat.hidden(genome)]
    allowed = {
        (source, target)
        for source in nodes
        for target in nodes
        if target >= neat.n_inputs
        and (source, target) not in genome.links()
        and (recurrent or (source not in neat.outputs and not has_cycle(genome.links() | {(source, target)})))
    }
    assert len(allowed) >= 5
    made = set()
    for seed in range(600):
        child, done = Mutator(neat, next_number=500)("add_link", genome, seed)
        assert done
        (new,) = child.links() - genome.links()
        made.add(new)
        assert len(child.genes) == len(genome.genes) + 1
    assert made == allowed


def test_no_link_is_added_to_a_network_that_has_all() -> None:
    neat = Neat(settings(), 3, 2)
    genome = neat.first_genome(stream_of(1))
    genome.genes[2].enabled = False  # a disabled gene still joins its nodes
    for seed in range(50):
        assert Mutator(neat)("add_link", genome, seed) == (genome, False)


def test_the_weight_of_a_new_link_is_within_the_initial_ones() -> None:
    neat = Neat(settings(initial_weight=0.5, recurrent=True), 1, 1)
    genome = neat.first_genome(stream_of(1))
    weights = []
    for seed in range(cases(400, 100)):
        child, done = Mutator(neat)("add_link", genome, seed)
        weights += [child.genes[1].weight] if done else []
    assert max(map(abs, weights)) < 0.5
    assert max(weights) > 0.4
    assert min(weights) < -0.4


# weights


def test_weights_are_replaced_and_moved_as_often_and_as_far_as_said() -> None:
    """Steps within +-0.5 of 3, replacements within +-1: told apart. Four standard errors: 1 in 8,000 by chance."""
    neat = Neat(
        settings(
            mutate_weights=1.0,
            add_node=0,
            add_link=0,
            replace_weight=0.3,
            weight_step=0.5,
            replaced_weight=1.0,
        ),
        10,
        2,
    )
    genome = neat.first_genome(stream_of(1))
    for gene in genome.genes.values():
        gene.weight = 3.0
    weights = np.array(
        [
            [gene.weight for gene in Mutator(neat)("mutate", genome, seed)[0].genes.values()]
            for seed in range(cases(400, 20))
        ]
    ).ravel()
    replaced = np.abs(weights) < 1.0
    assert (np.abs(weights[~replaced] - 3.0) < 0.5).all()
    assert abs(replaced.mean() - 0.3) < 4 * np.sqrt(0.3 * 0.7 / weights.size)
    moved = weights[~replaced] - 3.0
    assert abs(moved.mean()) < 4 * 0.5 / np.sqrt(3 * moved.size)
    assert abs(moved.var() - 0.25 / 3) < 4 * 0.25 * np.sqrt(4 / 45 / moved.size)
    fresh = weights[replaced]
    assert abs(fresh.mean()) < 4 / np.sqrt(3 * fresh.size)
    assert abs(fresh.var() - 1 / 3) < 4 * np.sqrt(4 / 45 / fresh.size)


def test_mutated_weights_and_biases_stay_within_the_limit() -> None:
    neat = Neat(
        settings(mutate_weights=1.0, add_node=0, add_link=0, weight_limit=1.5, weight_step=5, node_bias=True),
        3,
        2,
    )
    genome = neat.first_genome(stream_of(1))
    mutator = Mutator(neat)
    values = []
    for seed in range(50):
        genome, _ = mutator("mutate", genome, seed)
        values += [gene.weight for gene in genome.genes.values()] + list(genome.biases.values())
    assert max(values) == 1.5
    assert min(values) == -1.5
    assert len(set(values)) > 50


# which of them


def what_changed(before: Genome, after: Genome) -> str:
    nodes = len(after.biases) - len(before.biases)
    links = len(after.genes) - len(before.genes) - 2 * nodes
    weights = any(after.genes[number].weight != gene.weight for number, gene in before.genes.items())
    return "node" * nodes + "link" * links + "weights" * weights


@pytest.mark.parametrize("kind", ["one", "independent"])
def test_the_rates_of_mutation_are_those_of_the_settings(kind: str) -> None:
    """Frequencies of all outcomes; four standard errors each, eight outcomes: 1 in 2,000 by chance."""
    node, link, weights = 0.2, 0.3, 0.6
    neat = Neat(
        settings(
            structural_mutations=kind, add_node=node, add_link=link, mutate_weights=weights, recurrent=True
        ),
        3,
        2,
    )
    genome = neat.first_genome(stream_of(1))
    if kind == "one":
        expected = {
            "node": node,
            "link": (1 - node) * link,
            "weights": (1 - node) * (1 - link) * weights,
            "": (1 - node) * (1 - link) * (1 - weights),
        }
    else:
        expected = {
            "node" * a + "link" * b + "weights" * c: (node if a else 1 - node)
            * (link if b else 1 - link)
            * (weights if c else 1 - weights)
            for a in (0, 1)
            for b in (0, 1)
            for c in (0, 1)
        }
    n = cases(4_000, 300)
    outcomes = [what_changed(genome, Mutator(neat)("mutate", genome, seed)[0]) for seed in range(n)]
    assert set(outcomes) <= set(expected)
    for outcome, share in expected.items():
        assert abs(outcomes.count(outcome) / n - share) < 4 * np.sqrt(share * (1 - share) / n), outcome


def test_the_oldest_disabled_gene_is_switched_on_again() -> None:
    neat = Neat(settings(reenable=1.0, add_node=0, add_link=0, mutate_weights=0), 3, 1)
    genome = neat.first_genome(stream_of(1))
    genome.genes[1].enabled = genome.genes[2].enabled = False
    child, _ = Mutator(neat)("mutate", genome, 1)
    assert [gene.enabled for gene in child.genes.values()] == [True, True, False]
