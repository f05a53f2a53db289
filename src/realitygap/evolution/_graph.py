"""A genome as a graph for networkx."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from realitygap.errors import from_extra

from ._genome import Genome
from ._json import head
from ._picture import node_names


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
