"""Genomes and the networks they decode to, as Python sees them."""

from __future__ import annotations

import graphlib
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, Self, TypedDict, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from realitygap.drawing import ShownAsCard, picture_of
from realitygap.errors import ControllerError, RecordError, finite_numbers
from realitygap.kernels.neat.genome import Genomes, NeatRules, make_genomes
from realitygap.kernels.neat.network import Networks, activate, decode_rows, make_networks
from realitygap.records import write_whole

from . import _json
from ._interface import CONSTANT, ControllerInterface, paper_interface

T = TypeVar("T", Genomes, Networks)


@dataclass(frozen=True)
class NodeGene:
    """A node: its id, kind and bias (0 unless nodes have biases)."""

    id: int
    kind: Literal["input", "bias", "output", "hidden"]
    bias: float = 0.0


@dataclass(frozen=True)
class ConnectionGene:
    """A connection from node `source` to node `target`. A disabled one is stored but has no effect."""

    innovation: int
    source: int
    target: int
    weight: float
    enabled: bool


class Network(_json.Written[_json.NetworkForm]):
    """The network that a genome decodes to. It maps inputs to outputs, one pass a call.

    A recurrent network remembers its nodes between calls; `reset` makes it forget.
    """

    _kind, _form = "network", _json.NetworkForm

    def __init__(self, networks: Networks, row: int, rules: NeatRules, bias_value: float) -> None:
        self._networks = networks
        self._row = row
        self._rules = rules
        self._bias_value = bias_value
        room = rules.n_inputs + networks.bias.shape[1]
        self._values = np.zeros(room)
        self._before = np.zeros(room)

    def __getstate__(self) -> dict[str, Any]:
        """Return the state to pickle, with only the network's own row of arrays that may hold a whole population."""
        return self.__dict__ | {"_networks": _row_of(self._networks, self._row), "_row": 0}

    @property
    def n_inputs(self) -> int:
        """Number of inputs to give, without the constant one."""
        return self._rules.n_inputs - (self._rules.bias_input >= 0)

    @property
    def n_outputs(self) -> int:
        """Outputs."""
        return self._rules.n_outputs

    def reset(self) -> None:
        """Forget all earlier activations."""
        self._values[:] = 0.0

    def activate(self, inputs: ArrayLike) -> NDArray[np.float64]:
        """Return the outputs for one set of inputs.

        Args:
            inputs: (n_inputs,) finite, without the constant input.

        Returns:
            (n_outputs,) float64: -1..1 with tanh, 0..1 with sigmoid.

        Raises:
            TypeError: Something other than numbers.
            ValueError: Wrong number of inputs, or one that is infinite or NaN.
        """
        given = finite_numbers("inputs", inputs)
        if given.shape != (self.n_inputs,):
            raise ValueError(f"inputs has shape {given.shape}, expected ({self.n_inputs},).")
        self._values[: self.n_inputs] = given
        if self._rules.bias_input >= 0:
            self._values[self._rules.bias_input] = self._bias_value
        activate(self._networks, self._row, self._rules, self._values, self._before)
        first = self._rules.n_inputs
        return self._values[first : first + self._rules.n_outputs].copy()

    def to_dict(self) -> dict[str, Any]:
        """Return the network as plain values with a version, as after `reset`.

        `nodes` lists outputs and hidden nodes in the order of activation. Nodes are numbered inputs (the constant
        one last among them), outputs, hidden nodes.
        """
        rules, networks, row = self._rules, self._networks, self._row
        nodes = []
        n_hidden = int(networks.n_hidden[row])
        first_hidden = rules.n_inputs + rules.n_outputs
        for k in range(n_hidden + rules.n_outputs):
            edges = slice(int(networks.first_edge[row, k]), int(networks.first_edge[row, k + 1]))
            nodes.append(
                {
                    "node": first_hidden + k if k < n_hidden else rules.n_inputs + k - n_hidden,
                    "bias": float(networks.bias[row, k]),
                    "sources": networks.source[row, edges].tolist(),
                    "weights": networks.weight[row, edges].tolist(),
                }
            )
        return {
            **_json.head("network", rules, self._bias_value),
            "n_inputs": rules.n_inputs,
            "n_outputs": rules.n_outputs,
            "constant": rules.bias_input >= 0,
            "nodes": nodes,
        }

    @classmethod
    def _from(cls, form: _json.NetworkForm, where: str) -> Self:
        _check_network(form, where)
        rules = form.rules(form.n_inputs, form.n_outputs, constant=form.constant, node_bias=True)
        edges = [len(node.sources) for node in form.nodes]
        networks = make_networks(1, rules, max(sum(edges), 1), len(edges) - rules.n_outputs)
        first_hidden = rules.n_inputs + rules.n_outputs
        hidden = [node for node in form.nodes if node.node >= first_hidden]
        outputs = sorted(
            (node for node in form.nodes if node.node < first_hidden), key=lambda node: node.node
        )
        number = {node: node for node in range(first_hidden)}
        number |= {node.node: first_hidden + k for k, node in enumerate(hidden)}
        networks.n_hidden[0] = len(hidden)
        edge = 0
        for k, node in enumerate([*hidden, *outputs]):
            networks.bias[0, k] = node.bias
            pairs = zip((number[source] for source in node.sources), node.weights, strict=True)
            for source, weight in sorted(pairs):
                networks.source[0, edge], networks.weight[0, edge] = source, weight
                edge += 1
            networks.first_edge[0, k + 1] = edge
        return cls(networks, 0, rules, form.bias_value)


class Genome(_json.Written[_json.GenomeForm], ShownAsCard):
    """Genes of an individual: a view of a row of a population's arrays."""

    _kind, _form = "genome", _json.GenomeForm

    def __init__(self, genomes: Genomes, row: int, rules: NeatRules, bias_value: float = 1.0) -> None:
        self._genomes = genomes
        self._row = row
        self._interface: ControllerInterface | None = None  # where it is not the paper's
        self.rules = rules
        self.bias_value = bias_value

    def __getstate__(self) -> dict[str, Any]:
        """Return the state to pickle, with only the genome's own row of arrays that hold a whole population."""
        return self.__dict__ | {"_genomes": _row_of(self._genomes, self._row), "_row": 0}

    @property
    def interface(self) -> ControllerInterface:
        """The names of its inputs and outputs; the paper's unless others were given.

        Raises:
            ControllerError: It has other numbers of them than the paper's networks, and no names.
        """
        if self._interface is not None:
            return self._interface
        paper, (n_inputs, n_outputs) = self._paper, self._sizes
        if (n_inputs, n_outputs) != (len(paper.inputs), len(paper.outputs)):
            raise ControllerError(
                f"The controller has {n_inputs} inputs and {n_outputs} outputs, and does not name them. "
                f"Expected {', '.join(paper.inputs)} and {', '.join(paper.outputs)}, or names for them "
                "(`realitygap try --inputs`)."
            )
        return paper

    def with_interface(self, interface: ControllerInterface) -> Self:
        """Return the same genome with these names of inputs and outputs.

        Raises:
            ControllerError: The numbers of names do not fit, or the constant input has another place.
        """
        rules, inputs = self.rules, interface.inputs
        constant = inputs.index(CONSTANT) if CONSTANT in inputs else -1
        if (len(inputs), len(interface.outputs), constant) != (*self._sizes, rules.bias_input):
            n, m = self._sizes
            at = f"input {rules.bias_input} is {CONSTANT}" if rules.bias_input >= 0 else f"none is {CONSTANT}"
            raise ControllerError(
                f"The names are {', '.join(inputs)} and {', '.join(interface.outputs)}, and the controller has {n} "
                f"inputs, of which {at}, and {m} outputs. Name each of them."
            )
        if rules.drives_wheels != interface.drives_wheels:
            rules = rules._replace(drives_wheels=interface.drives_wheels)
        named = type(self)(self._genomes, self._row, rules, self.bias_value)
        named._interface = None if interface == self._paper else interface
        return named

    @property
    def _paper(self) -> ControllerInterface:
        return paper_interface(constant=self.rules.bias_input >= 0)

    @property
    def _sizes(self) -> tuple[int, int]:
        return self.rules.n_inputs, self.rules.n_outputs

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
        """Return the network that this genome decodes to."""
        return Network(decode_all([self]), 0, self.rules, self.bias_value)

    def to_dict(self) -> dict[str, Any]:
        """Return the genes, `nodes` and `connections`, and what decoding needs, as plain values with a version.

        Names of inputs and outputs are among them where they are not the paper's.
        """
        return {
            **_json.head("genome", self.rules, self.bias_value),
            **({} if self._interface is None else _json.interface_to_dict(self._interface)),
            "node_bias": bool(self.rules.node_bias),
            "nodes": [asdict(node) for node in self.nodes],
            "connections": [asdict(connection) for connection in self.connections],
        }

    def save(self, path: str | Path) -> None:
        """Write the genome as JSON. An existing file is replaced once the new one is complete.

        Raises:
            RecordError: It cannot be written.
        """
        write_whole(Path(path), self.to_json().encode("utf-8"))

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Return the genome that `save` or `realitygap export` wrote.

        Raises:
            RecordError: The file cannot be read, or holds no genome.
            RecordVersionError: Another version wrote it.
        """
        return cls._read(_json.from_file(Path(path), "genome"), str(path))

    @classmethod
    def _from(cls, form: _json.GenomeForm, where: str) -> Self:
        _check_genome(form, where)
        kinds = [node.kind for node in form.nodes]
        n_inputs, n_outputs = kinds.count("input") + kinds.count("bias"), kinds.count("output")
        hidden = [node.id for node in form.nodes if node.kind == "hidden"]
        record = _record(hidden, [node.bias for node in form.nodes[n_inputs:]], form.connections)
        rules = form.rules(n_inputs, n_outputs, constant="bias" in kinds, node_bias=form.node_bias)
        made = genome_from_record(record, rules, form.bias_value)
        genome = cls(made._genomes, 0, rules, form.bias_value)
        try:
            named = _json.interface_of(form)
            return genome if named is None else genome.with_interface(named)
        except ControllerError as error:
            raise RecordError(f"{where} is not a whole genome: {error}") from error

    def _repr_svg_(self) -> str:
        return picture_of(self).to_svg(300.0)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Genome):
            return NotImplemented
        same = self.nodes == other.nodes and self.connections == other.connections
        return same and self._interface == other._interface

    def __repr__(self) -> str:
        n_inputs = self.rules.n_inputs - (self.rules.bias_input >= 0)
        hidden = f"{self.n_hidden} hidden node{'s' * (self.n_hidden != 1)}"
        n_off = len(self.connections) - self.n_enabled
        off = f", {n_off} disabled" if n_off else ""
        connections = f"{self.n_enabled} connection{'s' * (self.n_enabled != 1)}"
        return f"Genome({n_inputs}→{self.rules.n_outputs}, {hidden}, {connections}{off})"


_OF_NO_ROW = {"full", "reached", "cursor", "ends"}


def _row_of(table: T, row: int) -> T:
    """Return one row of each array of a table. Values that belong to no row stay whole."""
    arrays: dict[str, Any] = table._asdict()
    return type(table)(
        **{
            name: array if name in _OF_NO_ROW else array[row : row + 1].copy()
            for name, array in arrays.items()
        }
    )


def decode_all(genomes: Sequence[Genome]) -> Networks:
    """Return the networks of n genomes with the same inputs and outputs, as the kernels read them."""
    room = max(genome._genomes.innovation.shape[1] for genome in genomes)
    hidden_room = max(genome._genomes.hidden.shape[1] for genome in genomes)
    networks: Networks = make_networks(len(genomes), genomes[0].rules, room, hidden_room)
    if all(genome._genomes is genomes[0]._genomes for genome in genomes):
        rows = np.array([genome._row for genome in genomes])
        decode_rows(genomes[0]._genomes, rows, genomes[0].rules, networks)
        return networks
    for k, genome in enumerate(genomes):
        row = Networks._make(part if part is networks.ends else part[k : k + 1] for part in networks)
        decode_rows(genome._genomes, np.array([genome._row]), genome.rules, row)
    return networks


class GenomeRecord(TypedDict):
    """A genome as a row of results has it.

    Attributes:
        hidden: Ids of the hidden nodes, ascending.
        biases: Biases of the outputs, then of the hidden nodes; empty if nodes have none.
        innovation: Innovation number of each connection gene.
        source: Id of the node where each connection begins.
        target: Id of the node where each connection ends.
        weight: Weight of each connection.
        enabled: True for each connection that is used.
    """

    hidden: Sequence[int]
    biases: Sequence[float]
    innovation: Sequence[int]
    source: Sequence[int]
    target: Sequence[int]
    weight: Sequence[float]
    enabled: Sequence[bool]


def _record(
    hidden: Sequence[int], biases: Sequence[float], genes: Sequence[ConnectionGene | _json.ConnectionForm]
) -> GenomeRecord:
    return GenomeRecord(
        hidden=hidden,
        biases=biases,
        innovation=[gene.innovation for gene in genes],
        source=[gene.source for gene in genes],
        target=[gene.target for gene in genes],
        weight=[gene.weight for gene in genes],
        enabled=[gene.enabled for gene in genes],
    )


def genome_from_record(record: GenomeRecord, rules: NeatRules, bias_value: float = 1.0) -> Genome:
    """Return the genome of a row of results.

    Args:
        record: The row's `genome`.
        rules: Sizes and activation, from the condition's settings.
        bias_value: Value of the constant input.

    Raises:
        RecordError: The lists do not fit together, or lead kernels to a node that is not there.
    """
    try:
        genomes = _arrays_of(record, rules)
    except (OverflowError, TypeError, ValueError) as error:
        raise RecordError(f"The genome of a row of results is damaged ({error}).") from error
    return Genome(genomes, 0, rules, bias_value)


def _arrays_of(record: GenomeRecord, rules: NeatRules) -> Genomes:
    """Return the genome of a row of results in arrays.

    Raises:
        ValueError: The lists do not fit together, or a gene leads to a node that is not there.
    """
    n = len(record["innovation"])
    h = len(record["hidden"])
    genomes: Genomes = make_genomes(1, rules.n_outputs, max(n, 1), max(h, 1))
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
    first_hidden = rules.n_inputs + rules.n_outputs
    hidden = genomes.hidden[0, :h]
    if h and (hidden[0] < first_hidden or (np.diff(hidden.astype(np.int64)) <= 0).any()):
        raise ValueError("its hidden nodes are not in order")
    nodes = np.concatenate([np.arange(first_hidden), hidden])
    if not np.isin(genomes.source[0, :n], nodes).all():
        raise ValueError("a connection begins at no node")
    if not np.isin(genomes.target[0, :n], nodes[rules.n_inputs :]).all():
        raise ValueError("a connection ends at no output or hidden node")
    return genomes


def genome_record(genome: Genome) -> GenomeRecord:
    """Return the fields of a genome for a row of results; `genome_from_record` reads them."""
    nodes = [node for node in genome.nodes if node.kind in ("output", "hidden")]
    biases = [node.bias for node in nodes] if genome.rules.node_bias else []
    return _record([node.id for node in nodes if node.kind == "hidden"], biases, genome.connections)


def _check_genome(form: _json.GenomeForm, where: str) -> None:
    """Refuse genes that no evolution of ours could have made, and kernels could not read."""
    kinds = "".join(node.kind[0] for node in form.nodes)  # i, b, o, h
    ids = [node.id for node in form.nodes]
    first_hidden = len(kinds.rstrip("h"))
    numbers = [gene.innovation for gene in form.connections]
    links = [(gene.source, gene.target) for gene in form.connections]
    inputs = {node.id for node in form.nodes if node.kind in ("input", "bias")}
    problems = {
        "expected nodes in the order input, bias (one at most), output, hidden, at least one input and one output": (
            kinds != "".join(sorted(kinds, key="iboh".index))
            or kinds.count("b") > 1
            or not {"i", "o"} <= set(kinds)
        ),
        "expected node ids 0, 1, ... for inputs and outputs and then ascending ones": (
            ids[:first_hidden] != list(range(first_hidden)) or ids != sorted(set(ids))
        ),
        "expected ascending innovation numbers": numbers != sorted(set(numbers)),
        "expected one gene at most for each two nodes": len(links) != len(set(links)),
        "a connection starts or ends at no node": not {node for link in links for node in link} <= set(ids),
        "a connection leads to an input": any(target in inputs for _, target in links),
    }
    for problem, is_there in problems.items():
        if is_there:
            raise RecordError(f"{where} is not a genome: {problem}.")
    if not form.recurrent:
        _refuse_cycle(links, f"{where} is not a genome")


def _check_network(form: _json.NetworkForm, where: str) -> None:
    """Refuse what kernels could not read."""
    numbers = {node.node for node in form.nodes}
    known = set(range(form.n_inputs)) | numbers
    problems = {
        "n_inputs counts the constant one, expected another besides": form.constant and form.n_inputs < 2,
        "expected each output and hidden node once, numbered after the inputs": (
            len(numbers) != len(form.nodes)
            or len(numbers) < form.n_outputs
            or numbers != set(range(form.n_inputs, form.n_inputs + len(numbers)))
        ),
        "a node has not as many sources as weights": any(
            len(e.sources) != len(e.weights) for e in form.nodes
        ),
        "a source is no node": any(not set(node.sources) <= known for node in form.nodes),
    }
    for problem, is_there in problems.items():
        if is_there:
            raise RecordError(f"{where} is not a network: {problem}.")
    if not form.recurrent:
        seen = set(range(form.n_inputs))
        for node in form.nodes:
            if not set(node.sources) <= seen:
                raise RecordError(f"{where} is not a network: node {node.node} comes before a source of it.")
            seen.add(node.node)


def _refuse_cycle(links: Sequence[tuple[int, int]], what: str) -> None:
    graph: dict[int, set[int]] = {}
    for source, target in links:
        graph.setdefault(target, set()).add(source)
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        raise RecordError(f"{what}: its connections go in a circle, and it is not recurrent.") from error
