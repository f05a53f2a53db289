"""Genomes and networks as JSON, networkx graphs and ONNX models."""

from __future__ import annotations

import json
import random
import sys

import networkx
import numpy as np
import onnx
import onnxruntime
import pytest

from realitygap.errors import MissingExtraError, RecordError, RecordVersionError
from realitygap.evolution import Genome, NeatSettings, Network, Population, to_networkx, to_onnx

KINDS = [
    {},
    {"node_bias": True, "activation": "tanh", "activation_slope": 2.45},
    {"recurrent": True},
    {"recurrent": True, "node_bias": True, "activation": "tanh", "activation_slope": 1.0},
    {"activation": "identity", "bias_value": 0.5},
]
IDS = ["sigmoid", "tanh", "recurrent", "recurrent tanh", "identity"]
ROUNDING = 1e-12  # sums in another order, and another polynomial for tanh


def evolved(changes: dict[str, object], *, bias: bool = True, generations: int = 12) -> list[Genome]:
    settings = NeatSettings.model_validate({"population": 12, "add_node": 0.4, "add_link": 0.5, **changes})
    population = Population(3, 2, settings, seed=5, bias=bias)
    rng = random.Random(2)
    for _ in range(generations):
        population.tell([rng.random() for _ in range(12)])
    genomes = population.ask()
    assert max(genome.n_hidden for genome in genomes) >= 3
    return genomes


def answers(network: Network, n_steps: int = 6) -> list[list[float]]:
    rng = np.random.default_rng(0)
    return [network.activate(rng.uniform(-1, 1, 3)).tolist() for _ in range(n_steps)]


def session(network: Network, **options: object) -> onnxruntime.InferenceSession:
    return onnxruntime.InferenceSession(to_onnx(network, **options).SerializeToString())


# JSON


@pytest.mark.parametrize("bias", [False, True])
@pytest.mark.parametrize("changes", KINDS, ids=IDS)
def test_a_genome_comes_back_from_json_bit_for_bit(changes, bias, tmp_path):
    for genome in evolved(changes, bias=bias):
        genome.save(tmp_path / "genome.json")
        for again in (Genome.from_json(genome.to_json()), Genome.load(tmp_path / "genome.json")):
            assert again == genome
            assert again.to_dict() == genome.to_dict()
            assert answers(again.network()) == answers(genome.network())


@pytest.mark.parametrize("bias", [False, True])
@pytest.mark.parametrize("changes", KINDS, ids=IDS)
def test_a_network_comes_back_from_json_bit_for_bit(changes, bias):
    for genome in evolved(changes, bias=bias):
        network = genome.network()
        again = Network.from_json(network.to_json())
        assert again.to_dict() == network.to_dict()
        assert (again.n_inputs, again.n_outputs) == (network.n_inputs, network.n_outputs)
        assert answers(again) == answers(network)


def test_weights_of_all_sizes_survive():
    genome = evolved({})[0]
    values = genome.to_dict()
    for gene, weight in zip(values["connections"], [0.1, -0.0, 5e-324, 1.7e308, 1 / 3], strict=False):
        gene["weight"] = weight
    again = Genome.from_json(json.dumps(values)).to_dict()
    assert [repr(g["weight"]) for g in again["connections"]] == [
        repr(g["weight"]) for g in values["connections"]
    ]


def changed(values: dict, path: str, value: object) -> str:
    values = json.loads(json.dumps(values))
    *ways, last = path.split(".")
    at = values
    for way in ways:
        at = at[int(way)] if isinstance(at, list) else at[way]
    at[int(last) if isinstance(at, list) else last] = value
    return json.dumps(values)


@pytest.mark.parametrize(
    ("path", "value", "error", "message"),
    [
        ("version", 3, RecordVersionError, "is a genome of version 3, this realitygap reads version 1 and 2"),
        ("format", "other", RecordError, "has the format 'other', expected 'realitygap genome'"),
        ("format", "realitygap network", RecordError, "has the format 'realitygap network'"),
        ("activation", "relu", RecordError, "activation: Input should be 'tanh', 'sigmoid' or 'identity'"),
        ("nodes", None, RecordError, "nodes: Input should be a valid list"),
        ("nodes", [], RecordError, "at least one input and one output"),
        ("nodes.0.id", 7, RecordError, "expected node ids 0, 1"),
        ("nodes.0.kind", "output", RecordError, "expected nodes in the order"),
        (
            "connections.0.weight",
            "heavy",
            RecordError,
            "connections.0.weight: Input should be a valid number",
        ),
        ("connections.0.innovation", 3, RecordError, "expected ascending innovation numbers"),
        ("connections.0.source", 99, RecordError, "starts or ends at no node"),
        ("connections.0.target", 0, RecordError, "leads to an input"),
        ("connections.0.source", 1, RecordError, "one gene at most for each two nodes"),
    ],
)
def test_a_foreign_or_broken_genome_is_refused_with_one_message(path, value, error, message):
    text = changed(evolved({})[0].to_dict(), path, value)
    with pytest.raises(error) as caught:
        Genome.from_json(text)
    assert message in str(caught.value)


def test_a_circle_is_refused_unless_the_network_is_recurrent():
    genome = next(each for each in evolved({"recurrent": True}) if each.n_hidden)
    values = genome.to_dict()
    hidden = values["nodes"][-1]["id"]
    if not any(gene["source"] == gene["target"] == hidden for gene in values["connections"]):
        gene = {"innovation": 9999, "source": hidden, "target": hidden, "weight": 0.5, "enabled": True}
        values["connections"].append(gene)
    assert Genome.from_dict(values).to_dict() == values
    with pytest.raises(RecordError, match="go in a circle"):
        Genome.from_dict(values | {"recurrent": False})


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("format", "realitygap genome", "expected 'realitygap network'"),
        ("nodes.0.sources.0", 99, "a source is no node"),
        ("nodes.0.node", 99, "expected each output and hidden node once"),
        ("nodes.0.weights", [], "not as many sources as weights"),
        ("n_outputs", 99, "expected each output and hidden node once"),
        ("n_inputs", 0, "n_inputs: Input should be greater than or equal to 1"),
        ("nodes", [], "expected each output and hidden node once"),
    ],
)
def test_a_foreign_or_broken_network_is_refused_with_one_message(path, value, message):
    with pytest.raises(RecordError) as caught:
        Network.from_json(changed(evolved({})[0].network().to_dict(), path, value))
    assert message in str(caught.value)


def test_nodes_of_a_feed_forward_network_must_come_after_their_sources():
    values = next(each for each in evolved({}) if each.n_hidden > 1).network().to_dict()
    values["nodes"].reverse()
    with pytest.raises(RecordError, match="comes before a source of it"):
        Network.from_dict(values)


def test_torn_and_missing_files_are_said(tmp_path):
    path = tmp_path / "genome.json"
    evolved({})[0].save(path)
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(RecordError, match=r"genome\.json is no JSON, or cut off"):
        Genome.load(path)
    with pytest.raises(RecordError, match="No such file"):
        Genome.load(tmp_path / "missing.json")
    with pytest.raises(RecordError, match="has the format None"):
        Genome.from_json("[1, 2]")


# networkx


@pytest.mark.parametrize("changes", KINDS, ids=IDS)
def test_a_graph_has_a_node_and_an_edge_for_each_gene(changes):
    for genome in evolved(changes):
        graph = to_networkx(genome)
        assert [(n, d["kind"], d["bias"]) for n, d in graph.nodes(data=True)] == [
            (node.id, node.kind, node.bias) for node in genome.nodes
        ]
        edges = {(a, b): (d["innovation"], d["weight"], d["enabled"]) for a, b, d in graph.edges(data=True)}
        assert edges == {
            (gene.source, gene.target): (gene.innovation, gene.weight, gene.enabled)
            for gene in genome.connections
        }
        assert to_networkx(genome, disabled=False).number_of_edges() == genome.n_enabled
        assert networkx.is_directed_acyclic_graph(graph) or genome.rules.recurrent


def test_a_graph_survives_graphml_with_its_names(tmp_path):
    genome = evolved({"recurrent": True})[3]
    graph = to_networkx(genome, ["a", "b", "c", "one"], ["x", "y"])
    networkx.write_graphml(graph, tmp_path / "g.graphml")
    again = networkx.read_graphml(tmp_path / "g.graphml", node_type=int)
    assert dict(again.nodes(data=True)) == dict(graph.nodes(data=True))
    assert list(again.edges(data=True)) == list(graph.edges(data=True))
    assert [again.nodes[k]["name"] for k in range(6)] == ["a", "b", "c", "one", "x", "y"]
    with pytest.raises(ValueError, match="input_names has 1 names, expected 4"):
        to_networkx(genome, ["a"])


# ONNX


@pytest.mark.parametrize("bias", [False, True])
@pytest.mark.parametrize("changes", [each for each in KINDS if not each.get("recurrent")])
def test_onnxruntime_gives_the_outputs_of_a_feed_forward_network(changes, bias):
    given = np.random.default_rng(1).uniform(-2, 2, (50, 3))
    for genome in evolved(changes, bias=bias):
        network = genome.network()
        (outputs,) = session(network).run(None, {"inputs": given})
        expected = np.array([network.activate(each) for each in given])
        assert outputs == pytest.approx(expected, rel=ROUNDING, abs=ROUNDING)
        (single,) = session(network, precision="single").run(None, {"inputs": given.astype(np.float32)})
        assert single.dtype == np.float32
        assert single == pytest.approx(expected, rel=1e-3, abs=1e-4)


@pytest.mark.parametrize("changes", [each for each in KINDS if each.get("recurrent")])
def test_onnxruntime_gives_the_steps_of_a_recurrent_network(changes):
    rng = np.random.default_rng(1)
    for genome in evolved(changes):
        step = session(genome.network())
        networks = [genome.network() for _ in range(4)]
        n_state = step.get_inputs()[1].shape[1]
        assert n_state == 2 + genome.n_hidden
        state = np.zeros((4, n_state))
        for _ in range(10):
            given = rng.uniform(-1, 1, (4, 3))
            outputs, state = step.run(None, {"inputs": given, "state": state})
            expected = np.array([net.activate(each) for net, each in zip(networks, given, strict=True)])
            assert outputs == pytest.approx(
                expected, abs=1e-10
            )  # differences are carried on from step to step


def test_a_model_says_where_it_comes_from_and_is_always_the_same():
    network = evolved({})[0].network()
    model = to_onnx(network, ["a", "b", "c"], ["x", "y"])
    assert model.producer_name == "realitygap"
    about = {each.key: each.value for each in model.metadata_props}
    assert about == {"input_names": '["a", "b", "c"]', "output_names": '["x", "y"]'}
    assert model.SerializeToString() == to_onnx(network, ["a", "b", "c"], ["x", "y"]).SerializeToString()
    onnx.checker.check_model(model, full_check=True)


def test_a_model_wants_names_for_the_inputs_that_are_given():
    network = evolved({})[0].network()
    with pytest.raises(ValueError, match="input_names has 4 names, expected 3"):
        to_onnx(network, ["a", "b", "c", "bias"])
    with pytest.raises(ValueError, match="output_names has 1 names, expected 2"):
        to_onnx(network, output_names=["x"])
    with pytest.raises(ValueError, match="precision is 'half'"):
        to_onnx(network, precision="half")


@pytest.mark.parametrize("wrong", [3, [1], "genome"])
def test_from_dict_refuses_values_that_are_no_mappings(wrong):
    for kind in (Genome, Network):
        with pytest.raises(RecordError, match="The mapping has the format None"):
            kind.from_dict(wrong)


def test_a_genome_is_no_network_and_a_network_no_genome():
    genome = evolved({})[0]
    with pytest.raises(TypeError, match=r"expected a Network, such as genome\.network\(\)"):
        to_onnx(genome)
    with pytest.raises(TypeError, match="expected a Genome"):
        to_networkx(genome.network())


@pytest.mark.parametrize(("module", "export"), [("networkx", to_networkx), ("onnx", to_onnx)])
def test_a_missing_extra_is_one_message_with_the_command(monkeypatch, module, export):
    monkeypatch.setitem(sys.modules, module, None)
    genome = evolved({})[0]
    with pytest.raises(MissingExtraError, match=r"(--extra |\[)export") as caught:
        export(genome if export is to_networkx else genome.network())
    assert module in str(caught.value)
