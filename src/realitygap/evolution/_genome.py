"""Genomes and the networks they decode to, as Python sees them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap.kernels._genome import Genomes, NeatRules, make_genomes
from realitygap.kernels._network import Networks, activate, decode, make_networks

T = TypeVar("T", Genomes, Networks)


@dataclass(frozen=True)
class NodeGene:
    """A node: its id, kind and bias (0 unless nodes have biases)."""

    id: int
    kind: Literal["input", "bias", "output", "hidden"]
    bias: float = 0.0


@dataclass(frozen=True)
class ConnectionGene:
    """A connection from node `source` to node `target`; a disabled one is kept but carries nothing."""

    innovation: int
    source: int
    target: int
    weight: float
    enabled: bool


class Network:
    """What a genome decodes to: maps inputs to outputs, one pass a call.

    A recurrent network remembers its nodes between calls; `reset` makes it forget.
    """

    def __init__(self, networks: Networks, row: int, rules: NeatRules, bias_value: float) -> None:
        self._networks = networks
        self._row = row
        self._rules = rules
        self._bias_value = bias_value
        room = rules.n_inputs + networks.order.shape[1]
        self._values = np.zeros(room)
        self._before = np.zeros(room)

    def __getstate__(self) -> dict[str, Any]:
        """Of the arrays, which may hold a whole population, only the network's own row."""
        return self.__dict__ | {"_networks": _row_of(self._networks, self._row), "_row": 0}

    @property
    def n_inputs(self) -> int:
        """Inputs to be given; the constant one, where there is one, is not among them."""
        return self._rules.n_inputs - (self._rules.bias_input >= 0)

    @property
    def n_outputs(self) -> int:
        """Outputs."""
        return self._rules.n_outputs

    def reset(self) -> None:
        """Forget all earlier activations."""
        self._values[:] = 0.0

    def activate(self, inputs: ArrayLike) -> NDArray[np.float64]:
        """The outputs for one set of inputs.

        Args:
            inputs: (n_inputs,) without the constant input.

        Returns:
            (n_outputs,) float64: -1..1 with tanh, 0..1 with sigmoid.

        Raises:
            ValueError: Wrong number of inputs.
        """
        given = np.asarray(inputs, np.float64)
        if given.shape != (self.n_inputs,):
            raise ValueError(f"inputs has shape {given.shape}, expected ({self.n_inputs},).")
        self._values[: self.n_inputs] = given
        if self._rules.bias_input >= 0:
            self._values[self._rules.bias_input] = self._bias_value
        activate(self._networks, self._row, self._rules, self._values, self._before)
        first = self._rules.n_inputs
        return self._values[first : first + self._rules.n_outputs].copy()


class Genome:
    """One individual's genes: a view of a row of a population's arrays."""

    def __init__(self, genomes: Genomes, row: int, rules: NeatRules, bias_value: float = 1.0) -> None:
        self._genomes = genomes
        self._row = row
        self.rules = rules
        self.bias_value = bias_value

    def __getstate__(self) -> dict[str, Any]:
        """Of the arrays, which hold a whole population, only the genome's own row."""
        return self.__dict__ | {"_genomes": _row_of(self._genomes, self._row), "_row": 0}

    @property
    def nodes(self) -> tuple[NodeGene, ...]:
        """Inputs, outputs and hidden nodes."""
        rules, row = self.rules, self._row
        nodes = [
            NodeGene(node, "bias" if node == rules.bias_input else "input") for node in range(rules.n_inputs)
        ]
        for k in range(rules.n_outputs):
            nodes.append(NodeGene(rules.n_inputs + k, "output", float(self._genomes.bias[row, k])))
        for k in range(int(self._genomes.n_hidden[row])):
            bias = float(self._genomes.bias[row, rules.n_outputs + k])
            nodes.append(NodeGene(int(self._genomes.hidden[row, k]), "hidden", bias))
        return tuple(nodes)

    @property
    def connections(self) -> tuple[ConnectionGene, ...]:
        """Connection genes, in the order of their innovation numbers."""
        row = self._row
        genomes = self._genomes
        return tuple(
            ConnectionGene(
                int(genomes.innovation[row, k]),
                int(genomes.source[row, k]),
                int(genomes.target[row, k]),
                float(genomes.weight[row, k]),
                bool(genomes.enabled[row, k]),
            )
            for k in range(int(genomes.n_connections[row]))
        )

    @property
    def n_hidden(self) -> int:
        """Hidden nodes."""
        return int(self._genomes.n_hidden[self._row])

    @property
    def n_enabled(self) -> int:
        """Enabled connections."""
        n = int(self._genomes.n_connections[self._row])
        return int(self._genomes.enabled[self._row, :n].sum())

    def network(self) -> Network:
        """The network that this genome decodes to."""
        return Network(decode_all([self]), 0, self.rules, self.bias_value)

    def to_dict(self) -> dict[str, Any]:
        """The genes as plain values: `nodes` and `connections`."""
        return {
            "nodes": [asdict(node) for node in self.nodes],
            "connections": [asdict(connection) for connection in self.connections],
        }

    def _repr_svg_(self) -> str:
        from ._picture import network_picture

        return network_picture(self).to_svg(300.0)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Genome):
            return NotImplemented
        return self.nodes == other.nodes and self.connections == other.connections

    __hash__ = None  # type: ignore[assignment]  # arrays behind it may be large; compare, do not index

    def __repr__(self) -> str:
        return f"Genome({len(self.nodes)} nodes, {self.n_enabled} of {len(self.connections)} connections enabled)"


def _row_of(table: T, row: int) -> T:
    """One row of each array of a table; what belongs to no row is kept whole."""
    n = len(table[0])
    arrays: list[Any] = [array[row : row + 1].copy() if len(array) == n else array for array in table]
    return type(table)(*arrays)


def decode_all(genomes: Sequence[Genome]) -> Networks:
    """The networks of n genomes with the same inputs and outputs, as the kernels read them."""
    room = max(genome._genomes.innovation.shape[1] for genome in genomes)
    hidden_room = max(genome._genomes.hidden.shape[1] for genome in genomes)
    networks: Networks = make_networks(len(genomes), genomes[0].rules, room, hidden_room)
    for k, genome in enumerate(genomes):
        decode(genome._genomes, genome._row, genome.rules, networks, k)
    return networks


def genome_from_record(
    record: Mapping[str, Sequence[Any]], rules: NeatRules, bias_value: float = 1.0
) -> Genome:
    """The genome of a row of results.

    Args:
        record: The row's `genome`: lists hidden, biases, innovation, source, target, weight, enabled.
        rules: Sizes and activation, from the condition's settings.
        bias_value: Of the constant input.
    """
    n = len(record["innovation"])
    h = len(record["hidden"])
    genomes = make_genomes(1, rules.n_outputs, max(n, 1), max(h, 1))
    genomes.n_connections[0] = n
    genomes.n_hidden[0] = h
    genomes.innovation[0, :n] = record["innovation"]
    genomes.source[0, :n] = record["source"]
    genomes.target[0, :n] = record["target"]
    genomes.weight[0, :n] = record["weight"]
    genomes.enabled[0, :n] = record["enabled"]
    genomes.hidden[0, :h] = record["hidden"]
    biases = record["biases"]
    genomes.bias[0, : len(biases)] = biases
    return Genome(genomes, 0, rules, bias_value)
