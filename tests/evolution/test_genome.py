"""Genomes and networks as Python sees them."""

from __future__ import annotations

import json
import math
import random

import pytest

from realitygap.errors import RecordError
from realitygap.evolution import (
    Genome,
    NeatSettings,
    Population,
    decode_all,
    genome_from_record,
)
from realitygap.evolution._genome import ConnectionGene, NodeGene
from realitygap.kernels.neat.network import activate
from tests.kernels.genome_arrays import from_arrays
from tests.reference.effort import cases
from tests.reference.neat import Neat, Recurrent, feed_forward

pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered")


def evolved(generations: int = 8, *, bias: bool = True, **changes: object) -> Population:
    settings = NeatSettings.model_validate(
        {"population": 10, "add_node": 0.4, "add_link": 0.5, "bias_value": 0.5, **changes}
    )
    population = Population(2, 2, settings, seed=3, bias=bias)
    rng = random.Random(1)
    for _ in range(generations):
        population.tell([rng.random() for _ in range(10)])
    return population


def test_a_first_genome_is_inputs_wired_to_outputs() -> None:
    genome = evolved(0).ask()[0]
    assert genome.nodes == (
        NodeGene(0, "input"),
        NodeGene(1, "input"),
        NodeGene(2, "bias"),
        NodeGene(3, "output"),
        NodeGene(4, "output"),
    )
    links = [(gene.innovation, gene.source, gene.target) for gene in genome.connections]
    assert links == [(0, 0, 3), (1, 1, 3), (2, 2, 3), (3, 0, 4), (4, 1, 4), (5, 2, 4)]
    assert (genome.n_hidden, genome.n_enabled) == (0, 6)
    assert repr(genome) == "Genome(2→2, 0 hidden nodes, 6 connections)"
    assert all(node.kind != "bias" for node in evolved(0, bias=False).ask()[0].nodes)


def test_a_genome_is_what_the_arrays_hold() -> None:
    population = evolved(node_bias=True)
    neat = Neat(population.settings, 3, 2, 2)
    for genome in population.ask():
        plain = from_arrays(neat, genome._genomes, genome._row)
        assert {
            node.id: node.bias for node in genome.nodes if node.kind in ("output", "hidden")
        } == plain.biases
        expected = [
            ConnectionGene(n, g.source, g.target, g.weight, g.enabled) for n, g in plain.genes.items()
        ]
        assert list(genome.connections) == expected
        assert genome.n_enabled == len(plain.enabled())
        assert genome.n_hidden == len(neat.hidden(plain))
    assert max(genome.n_hidden for genome in population.ask()) > 2


@pytest.mark.parametrize("recurrent", [False, True])
def test_networks_equal_the_plain_evaluation_the_constant_input_included(recurrent: bool) -> None:
    population = evolved(12, recurrent=recurrent, activation="tanh", activation_slope=0.5, node_bias=True)
    neat = Neat(population.settings, 3, 2, 2)
    rng = random.Random(2)
    for genome in population.ask():
        plain = from_arrays(neat, genome._genomes, genome._row)
        network, remembers = genome.network(), Recurrent(neat, plain)
        assert (network.n_inputs, network.n_outputs) == (2, 2)
        for _ in range(5):
            inputs = [rng.uniform(-1, 1), rng.uniform(-1, 1)]
            seen = [*inputs, 0.5]
            expected = remembers.step(seen) if recurrent else feed_forward(neat, plain, seen)
            assert network.activate(inputs).tolist() == pytest.approx(expected, abs=1e-9)


def test_a_recurrent_network_forgets_when_it_is_reset() -> None:
    for genome in evolved(12, recurrent=True).ask():
        network = genome.network()
        first = [network.activate([0.3, -0.2]).tolist() for _ in range(4)]
        network.reset()
        assert [network.activate([0.3, -0.2]).tolist() for _ in range(4)] == first


def test_two_networks_of_one_genome_do_not_share_their_memory() -> None:
    genome = evolved(12, recurrent=True).ask()[0]
    one, other = genome.network(), genome.network()
    expected = other.activate([0.3, -0.2]).tolist()
    other.reset()
    for _ in range(3):
        one.activate([1.0, 1.0])
    assert other.activate([0.3, -0.2]).tolist() == expected


def test_outputs_are_not_changed_by_the_next_activation() -> None:
    network = evolved(0).ask()[0].network()
    first = network.activate([1.0, 1.0])
    kept = first.tolist()
    network.activate([-1.0, -1.0])
    assert first.tolist() == kept


def test_a_wrong_number_of_inputs_is_refused() -> None:
    with pytest.raises(ValueError, match=r"inputs has shape \(3,\), expected \(2,\)"):
        evolved(0).ask()[0].network().activate([1.0, 2.0, 3.0])


def test_decoding_all_is_decoding_each() -> None:
    population = evolved()
    genomes = population.ask()
    networks = decode_all(genomes)
    for k, genome in enumerate(genomes):
        network = genome.network()
        expected = network.activate([0.3, 0.7]).tolist()
        network.reset()
        network._values[:3] = 0.3, 0.7, 0.5
        activate(networks, k, genome.rules, network._values, network._before)
        assert network._values[3:5].tolist() == expected


def test_genomes_are_equal_when_their_genes_are() -> None:
    one, other = evolved(6), evolved(6)
    assert one.ask() == other.ask()
    assert one.ask()[0] != one.ask()[1]
    assert one.ask()[0] != "a genome"
    with pytest.raises(TypeError):
        hash(one.ask()[0])


def test_a_genome_becomes_plain_values() -> None:
    genome = evolved().ask()[3]
    values = json.loads(json.dumps(genome.to_dict()))
    assert tuple(NodeGene(**node) for node in values["nodes"]) == genome.nodes
    assert tuple(ConnectionGene(**gene) for gene in values["connections"]) == genome.connections


@pytest.mark.parametrize("node_bias", [False, True])
def test_a_genome_comes_back_from_its_record(node_bias: bool) -> None:
    population = evolved(node_bias=node_bias)
    for genome in population.ask()[: cases(10, 3)]:
        genes = genome.connections
        record = {
            "hidden": [node.id for node in genome.nodes if node.kind == "hidden"],
            "biases": [node.bias for node in genome.nodes if node.kind in ("output", "hidden")] * node_bias,
            **{
                name: [getattr(gene, name) for gene in genes]
                for name in ("innovation", "source", "target", "weight", "enabled")
            },
        }
        again = genome_from_record(record, genome.rules, 0.5)
        assert again == genome
        assert again.network().activate([0.1, 0.2]).tolist() == genome.network().activate([0.1, 0.2]).tolist()


@pytest.mark.parametrize(
    ("name", "values", "problem"),
    [
        ("source", [-5, 1], "begins at no node"),
        ("source", [9, 1], "begins at no node"),
        ("target", [0, 3], "ends at no output"),
        ("target", [2**40, 3], "damaged"),
        ("hidden", [1], "not in order"),
        ("hidden", [4, 4], "not in order"),
        ("weight", [1.0, 2.0, 3.0], "damaged"),
        ("innovation", [None, 1], "damaged"),
    ],
)
def test_damaged_row_is_refused_before_kernels_read_it(name: str, values: list, problem: str) -> None:
    rules = NeatSettings().rules(3, 1)
    row = {"hidden": [4], "innovation": [0, 1], "source": [0, 1], "target": [4, 3]}
    record = {**row, "weight": [1.0, 2.0], "enabled": [True, True], "biases": []}
    assert genome_from_record(record, rules).n_hidden == 1
    with pytest.raises(RecordError, match=problem):
        genome_from_record({**record, name: values}, rules)


def test_an_asked_genome_stays_what_it_was_when_the_population_goes_on() -> None:
    population = evolved(3)
    genomes = population.ask()
    before = [genome.to_dict() for genome in genomes]
    for _ in range(3):
        population.tell([1.0] * 10)
        population.ask()
    assert [genome.to_dict() for genome in genomes] == before


def test_a_network_without_connections_answers_its_biases() -> None:
    rules = NeatSettings(activation="tanh", activation_slope=1.0).rules(2, 1)
    empty = {name: [] for name in ("hidden", "innovation", "source", "target", "weight", "enabled")}
    genome: Genome = genome_from_record({**empty, "biases": [0.5]}, rules)
    assert genome.network().activate([1.0, 1.0]).tolist() == pytest.approx([math.tanh(0.5)])
