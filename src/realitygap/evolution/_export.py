"""Genomes for the libraries of others: networks for ONNX, graphs for networkx."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from realitygap._version import __version__
from realitygap.errors import from_extra

from ._genome import Genome, Network
from ._interface import given_names
from ._json import head
from ._picture import node_names

OPSET = 13
IR_VERSION = 8
"""Old enough for every runtime of recent years; nothing newer is needed."""

_ACTIVATIONS = {"tanh": "Tanh", "sigmoid": "Sigmoid", "identity": "Identity"}


def to_onnx(
    network: Network,
    input_names: Sequence[str] | None = None,
    output_names: Sequence[str] | None = None,
    *,
    precision: Literal["double", "single"] = "double",
) -> Any:
    """Return the network as an `onnx.ModelProto`, whose `SerializeToString()` is what goes into a file.

    A feed-forward network maps `inputs` (b, n_inputs) to `outputs` (b, n_outputs), a row for each of b sets of inputs.
    A recurrent one is exported as one step. It also takes `state` (b, m), the activations of its m outputs and hidden
    nodes after the step before (zeros at first), and returns `next_state`. The constant input is part of the biases.

    In double precision the outputs are those of `Network.activate` but for rounding, below 1e-12.

    Args:
        network: Network of any genome. Its memory is not exported.
        input_names: Names of the inputs, without the constant one. They are stored in the model's metadata.
        output_names: Names of the outputs. They are stored in the model's metadata.
        precision: Precision of all numbers: double (float64) or single (float32).

    Raises:
        MissingExtraError: onnx is not installed.
        TypeError: Something else than a network, such as a genome.
        ValueError: Another number of names than of inputs or outputs, or an unknown precision.
    """
    check_network(network, precision)
    given_names("input_names", input_names, range(network.n_inputs))
    given_names("output_names", output_names, range(network.n_outputs))
    onnx = from_extra("onnx", "export")
    values = network.to_dict()
    parts = _Parts(values, np.float64 if precision == "double" else np.float32)
    ends = _recurrent(parts) if values["recurrent"] else _feed_forward(parts)
    kind = onnx.helper.np_dtype_to_tensor_dtype(np.dtype(parts.dtype))
    inputs, outputs = (
        [onnx.helper.make_tensor_value_info(name, kind, ["b", size]) for name, size in side] for side in ends
    )
    graph = onnx.helper.make_graph(
        [onnx.helper.make_node(*step[:3], **step[3]) for step in parts.steps],
        "network",
        inputs,
        outputs,
        [onnx.numpy_helper.from_array(array, name) for name, array in parts.arrays.items()],
    )
    model = onnx.helper.make_model(
        graph,
        opset_imports=[onnx.helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        producer_name="realitygap",
        producer_version=__version__,
    )
    names = {"input_names": input_names, "output_names": output_names}
    onnx.helper.set_model_props(
        model, {key: json.dumps(list(given)) for key, given in names.items() if given is not None}
    )
    onnx.checker.check_model(model, full_check=True)
    return model


def check_network(network: object, precision: str) -> None:
    """Raise an error if something is no network, or there is no such precision.

    Raises:
        TypeError: Something else than a network, such as a genome.
        ValueError: An unknown precision.
    """
    if not isinstance(network, Network):
        raise TypeError(f"network is {network!r}, expected a Network, such as genome.network().")
    if precision not in ("double", "single"):
        raise ValueError(f"precision is {precision!r}, expected 'double' or 'single'.")


Ends = tuple[list[tuple[str, int]], list[tuple[str, int]]]
"""Names and widths of the inputs and of the outputs."""


@dataclass
class _Parts:
    """The steps of a model as they are put together, and the arrays in it."""

    values: dict[str, Any]
    dtype: type[np.floating[Any]]
    steps: list[tuple[str, list[str], list[str], dict[str, Any]]] = field(default_factory=list)
    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)

    @property
    def n_given(self) -> int:
        """Inputs to be given."""
        return int(self.values["n_inputs"]) - bool(self.values["constant"])

    def array(self, name: str, values: NDArray[Any]) -> str:
        """Add an array; returns its name."""
        self.arrays[name] = values
        return name

    def step(self, kind: str, given: list[str], result: str, **attributes: Any) -> str:
        """Add a step; returns the name of its result."""
        self.steps.append((kind, given, [result], attributes))
        return result

    def layer(self, seen: str, columns: dict[int, int], nodes: list[dict[str, Any]], name: str) -> str:
        """Add activations of some nodes: activation(slope * (seen @ weights + biases)).

        Args:
            seen: The result whose columns the nodes see.
            columns: Column of each node.
            nodes: Nodes in the order of the result's columns.
            name: Name of the result. Other names begin with it.
        """
        weights = np.zeros((len(columns), len(nodes)))
        biases = np.array([node["bias"] for node in nodes])
        constant = self.values["n_inputs"] - 1 if self.values["constant"] else -1
        for k, node in enumerate(nodes):
            for source, weight in zip(node["sources"], node["weights"], strict=True):
                if source == constant:
                    biases[k] += weight * self.values["bias_value"]
                elif source in columns:
                    weights[columns[source], k] += weight
        given = [
            seen,
            self.array(f"{name}_weights", weights.astype(self.dtype)),
            self.array(f"{name}_biases", biases.astype(self.dtype)),
        ]
        total = self.step("Gemm", given, f"{name}_sums")
        if self.values["activation"] != "identity":
            slope = self.array(f"{name}_slope", np.array(self.values["activation_slope"], self.dtype))
            total = self.step("Mul", [total, slope], f"{name}_scaled")
        return self.step(_ACTIVATIONS[self.values["activation"]], [total], name)


def _feed_forward(parts: _Parts) -> Ends:
    """Add layer after layer, each of which sees all before it, and pick the outputs last."""
    values = parts.values
    columns = {node: node for node in range(parts.n_given)}
    layers: dict[int, list[dict[str, Any]]] = {}
    depth = dict.fromkeys(range(values["n_inputs"]), 0)
    for node in values["nodes"]:
        depth[node["node"]] = 1 + max((depth.get(source, 0) for source in node["sources"]), default=0)
        layers.setdefault(depth[node["node"]], []).append(node)
    seen = "inputs"
    for number, nodes in sorted(layers.items()):
        layer = parts.layer(seen, columns, nodes, f"layer_{number}")
        columns |= {node["node"]: len(columns) + k for k, node in enumerate(nodes)}
        seen = parts.step("Concat", [seen, layer], f"seen_{number}", axis=1)
    first, n = values["n_inputs"], values["n_outputs"]
    picked = np.array([columns[first + k] for k in range(n)], np.int64)
    parts.step("Gather", [seen, parts.array("output_columns", picked)], "outputs", axis=1)
    return [("inputs", parts.n_given)], [("outputs", n)]


def _recurrent(parts: _Parts) -> Ends:
    """Add one step, in which all nodes get the present inputs and the activations of the step before."""
    values = parts.values
    nodes = sorted(values["nodes"], key=lambda node: int(node["node"]))
    columns = {node: node for node in range(parts.n_given)}
    columns |= {node["node"]: parts.n_given + k for k, node in enumerate(nodes)}
    seen = parts.step("Concat", ["inputs", "state"], "seen", axis=1)
    parts.layer(seen, columns, nodes, "next_state")
    n = values["n_outputs"]
    first = parts.array("output_columns", np.arange(n))
    parts.step("Gather", ["next_state", first], "outputs", axis=1)
    return (
        [("inputs", parts.n_given), ("state", len(nodes))],
        [("outputs", n), ("next_state", len(nodes))],
    )


def to_networkx(
    genome: Genome,
    input_names: Sequence[str] | None = None,
    output_names: Sequence[str] | None = None,
    *,
    disabled: bool = True,
) -> Any:
    """Return the genome as a `networkx.DiGraph`, a node for each node gene and an edge for each connection gene.

    Nodes are the ids; they have `kind`, `bias` and `name`. Edges have `innovation`, `weight` and `enabled`. The graph
    has `activation`, `activation_slope`, `recurrent` and `bias_value`. All are plain values, so that any of networkx's
    formats can hold them.

    Args:
        genome: Genome to convert.
        input_names: Name of each input, including the constant one. Default: numbers.
        output_names: Name of each output. Default: numbers.
        disabled: True to include disabled connections as edges.

    Raises:
        MissingExtraError: networkx is not installed.
        TypeError: Something else than a genome, such as a network.
        ValueError: Another number of names than of inputs or outputs.
    """
    if not isinstance(genome, Genome):
        raise TypeError(f"genome is {genome!r}, expected a Genome.")
    networkx = from_extra("networkx", "export")
    names = node_names(genome, input_names, output_names)
    graph = networkx.DiGraph(**head("genome", genome.rules, genome.bias_value))
    for node in genome.nodes:
        graph.add_node(node.id, kind=node.kind, bias=node.bias, name=names.get(node.id, f"hidden {node.id}"))
    for gene in genome.connections:
        if gene.enabled or disabled:
            graph.add_edge(
                gene.source, gene.target, innovation=gene.innovation, weight=gene.weight, enabled=gene.enabled
            )
    return graph
