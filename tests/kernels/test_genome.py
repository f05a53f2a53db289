"""Genomes as arrays: first ones, genes put in their places, cycles found."""

from __future__ import annotations

import random

import numpy as np
import pytest

from realitygap.kernels.neat import genome as genome_kernels
from tests.kernels.genome_arrays import cursor, from_arrays, grown, rules_of, settings, to_arrays
from tests.reference.effort import cases
from tests.reference.neat import Gene, Genome, Neat, has_cycle
from tests.reference.philox import GENOME, Stream

pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered")


@pytest.mark.parametrize(
    "start", [{}] + [{"start_hidden": 3, "start_topology": name} for name in ("full", "layer", "random")]
)
@pytest.mark.parametrize("node_bias", [False, True])
def test_first_genomes_equal_the_reference(node_bias: bool, start: dict[str, object]) -> None:
    neat = Neat(settings(node_bias=node_bias, initial_weight=1.5, **start), 4, 2, 3)
    genomes = genome_kernels.make_genomes(20, 2, 29, 3)
    genome_kernels.first_genomes(genomes, rules_of(neat), np.uint64(2**63 + 5), np.int64(7), np.int64(3))
    for row in range(20):
        expected = neat.first_genome(Stream(2**63 + 5, 7, 3, row, GENOME))
        assert from_arrays(neat, genomes, row) == expected
    assert not genomes.full[0]


def test_first_genomes_are_fully_wired_with_the_same_numbers_and_uniform_weights() -> None:
    """Mean and variance of 8,000 weights in +-1; four standard errors each: 1 in 8,000 by chance."""
    n = cases(1_000, 100)
    neat = Neat(settings(initial_weight=1.0), 4, 2, 3)
    genomes = genome_kernels.make_genomes(n, 2, 8, 1)
    genome_kernels.first_genomes(genomes, rules_of(neat), np.uint64(1), np.int64(0), np.int64(0))
    assert (genomes.n_connections == 8).all()
    assert (genomes.n_hidden == 0).all()
    assert (genomes.innovation == np.arange(8)).all()
    assert genomes.enabled.all()
    links = set(zip(genomes.source[0].tolist(), genomes.target[0].tolist(), strict=True))
    assert links == {(source, target) for source in range(4) for target in (4, 5)}
    weights = genomes.weight.ravel()
    assert abs(weights.mean()) < 4 * np.sqrt(1 / 3 / weights.size)
    assert abs(weights.var() - 1 / 3) < 4 * np.sqrt(4 / 45 / weights.size)
    assert np.abs(weights).max() < 1.0


def test_drawing_below_a_number_gives_each_as_often() -> None:
    """Chi-square of six classes below 25: 1 in 7,000 by chance."""
    taken, n = cursor(), cases(12_000, 1_200)
    stream = tuple(map(np.uint32, (3, 0, 0, 1, 2)))
    drawn = np.bincount(
        [genome_kernels.next_below(stream, taken, np.int64(6)) for _ in range(n)], minlength=6
    )
    assert taken[0] == n
    assert drawn.size == 6
    assert ((drawn - n / 6) ** 2 / (n / 6)).sum() < 25


def test_a_copy_leaves_nothing_of_what_the_row_held() -> None:
    neat = Neat(settings(node_bias=True), 3, 2, 2)
    large, small = grown(neat, 1, 25), grown(neat, 2, 3)
    old, new = to_arrays(neat, [small, large]), to_arrays(neat, [large, large])
    genome_kernels.copy_genome(old, np.int64(0), new, np.int64(1))
    assert from_arrays(neat, new, 1) == small
    assert from_arrays(neat, new, 0) == large


def test_genes_and_hidden_nodes_go_where_their_numbers_belong() -> None:
    neat = Neat(settings(node_bias=True), 2, 1)
    rng = random.Random(1)
    for _ in range(cases(100, 10)):
        arrays = to_arrays(neat, [Genome({}, {2: 0.25})], room=12, hidden_room=6)
        expected = Genome({}, {2: 0.25})
        for number in rng.sample(range(50), 12):
            gene = Gene(rng.randint(0, 9), rng.randint(0, 9), rng.random(), rng.random() < 0.5)
            genome_kernels.insert_gene(
                arrays,
                np.int64(0),
                np.int32(number),
                np.int32(gene.source),
                np.int32(gene.target),
                gene.weight,
                np.bool_(gene.enabled),
            )
            expected.genes[number] = gene
        for node in rng.sample(range(3, 40), 6):
            expected.biases[node] = rng.random()
            genome_kernels.insert_hidden(arrays, np.int64(0), np.int32(node), expected.biases[node])
            genome_kernels.insert_hidden(arrays, np.int64(0), np.int32(node), 9.0)  # it is there already
        assert from_arrays(neat, arrays, 0) == expected
        assert not arrays.full[0]


def test_a_gene_without_room_marks_the_genome_as_full() -> None:
    neat = Neat(settings(), 2, 1)
    arrays = to_arrays(neat, [grown(neat, 1, 0)], room=2, hidden_room=1)
    genome_kernels.insert_gene(
        arrays, np.int64(0), np.int32(9), np.int32(0), np.int32(2), 1.0, np.bool_(True)
    )
    assert arrays.full[0]
    assert arrays.n_connections[0] == 2
    arrays = to_arrays(neat, [grown(neat, 1, 0)], room=2, hidden_room=1)
    genome_kernels.insert_hidden(arrays, np.int64(0), np.int32(3), 0.0)
    assert not arrays.full[0]
    genome_kernels.insert_hidden(arrays, np.int64(0), np.int32(4), 0.0)
    assert arrays.full[0]


def test_cycles_are_found_disabled_genes_counted() -> None:
    neat = Neat(settings(), 2, 2)
    found = {True: 0, False: 0}
    for seed in range(cases(150, 15)):
        genome = grown(neat, seed, 14)
        arrays = to_arrays(neat, [genome])
        reached = np.empty(len(genome.genes) + 1, np.int32)
        nodes = [*neat.outputs, *neat.hidden(genome)]
        for source in nodes:
            for target in nodes:
                closes = has_cycle(genome.links() | {(source, target)})
                assert (
                    genome_kernels.closes_cycle(
                        arrays, np.int64(0), np.int32(source), np.int32(target), reached
                    )
                    == closes
                )
                assert genome_kernels.has_link(arrays, np.int64(0), np.int32(source), np.int32(target)) == (
                    (source, target) in genome.links()
                )
                found[closes] += 1
    assert min(found.values()) > 100


def test_biases_are_found_by_node() -> None:
    neat = Neat(settings(node_bias=True), 3, 2, 2)
    genome = grown(neat, 5, 12)
    arrays = to_arrays(neat, [genome])
    rules = rules_of(neat)
    for node in range(neat.first_hidden + 30):
        is_input = node < neat.n_inputs
        assert genome_kernels.has_node(arrays, np.int64(0), rules, np.int32(node)) == (
            is_input or node in genome.biases
        )
        if not is_input:
            assert genome_kernels.node_bias_of(
                arrays, np.int64(0), rules, np.int32(node)
            ) == genome.biases.get(node, 0.0)
