"""Genomes decoded to networks, and networks activated."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._compile import kernel
from ._math import sigmoid, tanh

TANH = 0
SIGMOID = 1
IDENTITY = 2


class Networks(NamedTuple):
    """n networks, with room for m nodes and e edges each.

    Nodes are numbered inputs, outputs, hidden; `order` lists outputs and hidden nodes so that in a
    feed-forward network every source comes before its target. The edges into `order[k]` are those from
    `first_edge[k]` up to `first_edge[k + 1]`.
    """

    n_nodes: NDArray[np.int32]  # (n,)
    order: NDArray[np.int32]  # (n, m)
    first_edge: NDArray[np.int32]  # (n, m + 1)
    source: NDArray[np.int32]  # (n, e)
    weight: NDArray[np.float64]  # (n, e)
    bias: NDArray[np.float64]  # (n, m) of order[k]


@kernel
def make_networks(n, rules, room, hidden_room):
    """Empty networks for genomes with so much room."""
    nodes = rules.n_outputs + hidden_room
    return Networks(
        np.zeros(n, np.int32),
        np.zeros((n, nodes), np.int32),
        np.zeros((n, nodes + 1), np.int32),
        np.zeros((n, room), np.int32),
        np.zeros((n, room)),
        np.zeros((n, nodes)),
    )


@kernel
def _index_of(genomes, row, rules, node):
    """Number of a node in its network."""
    first_hidden = rules.n_inputs + rules.n_outputs
    if node < first_hidden:
        return node
    for k in range(genomes.n_hidden[row]):
        if genomes.hidden[row, k] == node:
            return first_hidden + k
    return -1


@kernel
def decode(genomes, row, rules, networks, to_row):
    """Decode one genome: its enabled genes become edges, grouped by target in order of activation.

    The hidden nodes are ordered so that sources come first (in a recurrent network, where there may be no
    such order: as their ids), outputs last. Edges of a node keep the order of their innovation numbers.
    """
    first_hidden = rules.n_inputs + rules.n_outputs
    n_hidden = genomes.n_hidden[row]
    n_genes = genomes.n_connections[row]
    target = np.empty(n_genes, np.int32)
    source = np.empty(n_genes, np.int32)
    for gene in range(n_genes):
        source[gene] = _index_of(genomes, row, rules, genomes.source[row, gene])
        target[gene] = _index_of(genomes, row, rules, genomes.target[row, gene])
    placed = np.zeros(first_hidden + n_hidden, np.bool_)
    for node in range(rules.n_inputs):
        placed[node] = True
    n_placed = 0
    while n_placed < n_hidden:
        before = n_placed
        for k in range(n_hidden):
            node = first_hidden + k
            if placed[node]:
                continue
            ready = True
            if not rules.recurrent:
                for gene in range(n_genes):
                    if genomes.enabled[row, gene] and target[gene] == node and not placed[source[gene]]:
                        ready = False
                        break
            if ready:
                placed[node] = True
                networks.order[to_row, n_placed] = node
                n_placed += 1
        if n_placed == before:
            break
    for k in range(rules.n_outputs):
        networks.order[to_row, n_placed + k] = rules.n_inputs + k
    n_active = n_placed + rules.n_outputs
    edge = 0
    for k in range(n_active):
        node = networks.order[to_row, k]
        networks.first_edge[to_row, k] = edge
        bias_at = node - rules.n_inputs
        networks.bias[to_row, k] = genomes.bias[row, bias_at]
        for gene in range(n_genes):
            if genomes.enabled[row, gene] and target[gene] == node:
                networks.source[to_row, edge] = source[gene]
                networks.weight[to_row, edge] = genomes.weight[row, gene]
                edge += 1
    networks.first_edge[to_row, n_active] = edge
    networks.n_nodes[to_row] = rules.n_inputs + n_active


@kernel
def activation_of(kind, slope, x):
    """A node's activation function at x."""
    if kind == TANH:
        return tanh(slope * x)
    if kind == SIGMOID:
        return sigmoid(slope * x)
    return x


@kernel
def activate(networks, row, rules, values, before):
    """One pass of one network over `values`, whose first entries are the inputs.

    Feed-forward: sources come first, so that one pass carries the inputs to the outputs. Recurrent: every
    node sees its inputs of now and the other nodes as they were after the pass before, as in C++ 1.2.1.

    Args:
        networks, row: Which network.
        rules: NEAT's rates and choices (activation, recurrence, sizes).
        values: (m,) activations by node number: inputs to be read, all others written.
        before: (m,) room, used by recurrent networks.
    """
    n_active = networks.n_nodes[row] - rules.n_inputs
    if rules.recurrent:
        for k in range(networks.n_nodes[row]):
            before[k] = values[k]
        seen = before
    else:
        seen = values
    for k in range(n_active):
        total = networks.bias[row, k]
        for edge in range(networks.first_edge[row, k], networks.first_edge[row, k + 1]):
            total += networks.weight[row, edge] * seen[networks.source[row, edge]]
        values[networks.order[row, k]] = activation_of(rules.activation, rules.activation_slope, total)
