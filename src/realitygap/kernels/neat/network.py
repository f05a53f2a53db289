"""Genomes decoded to networks, and networks activated."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import inlined, kernel
from realitygap.kernels.math.elementary import sigmoid, tanh

TANH = 0
SIGMOID = 1
IDENTITY = 2


class Networks(NamedTuple):
    """n networks, with room for h hidden nodes and e edges each.

    Nodes are numbered inputs, outputs, hidden, the hidden ones in the order of their activation: in a
    feed-forward network every source comes before its target. Node k of that order, outputs last, has the
    edges from `first_edge[k]` up to `first_edge[k + 1]`, by the number of their source.
    """

    n_hidden: NDArray[np.int32]  # (n,)
    first_edge: NDArray[np.int32]  # (n, h + o + 1)
    source: NDArray[np.int32]  # (n, e)
    weight: NDArray[np.float64]  # (n, e)
    bias: NDArray[np.float64]  # (n, h + o)
    place: NDArray[np.int32]  # (n, h) room: where in the order of activation each hidden gene comes
    ends: NDArray[np.int32]  # (3, e + h + o) room


def make_networks(n, rules, room, hidden_room):
    """Empty networks for genomes with so much room."""
    active = rules.n_outputs + hidden_room
    return Networks(
        np.zeros(n, np.int32),
        np.zeros((n, active + 1), np.int32),
        np.zeros((n, room), np.int32),
        np.zeros((n, room)),
        np.zeros((n, active)),
        np.zeros((n, hidden_room), np.int32),
        np.zeros((3, room + active), np.int32),
    )


@kernel
def _place_hidden(genomes, row, rules, networks, to_row):
    """Put the hidden nodes in an order of activation; returns how many have a place in it.

    Sources come first; in a recurrent network, where there may be no such order, nodes come as their ids.
    """
    first_hidden = rules.n_inputs + rules.n_outputs
    n_hidden = genomes.n_hidden[row]
    if rules.recurrent:
        for k in range(n_hidden):
            networks.place[to_row, k] = k
        return n_hidden
    # Which hidden node each gene joins to which, by place in the genome; -1 where it is none.
    source, target = networks.ends[0], networks.ends[1]
    for gene in range(genomes.n_connections[row]):
        source[gene] = target[gene] = -1
        if not genomes.enabled[row, gene]:
            continue
        for k in range(n_hidden):
            if genomes.hidden[row, k] == genomes.source[row, gene] >= first_hidden:
                source[gene] = k
            if genomes.hidden[row, k] == genomes.target[row, gene]:
                target[gene] = k
    for k in range(n_hidden):
        networks.place[to_row, k] = -1
    n_placed = 0
    before = -1
    while n_placed > before:
        before = n_placed
        for k in range(n_hidden):
            if networks.place[to_row, k] >= 0:
                continue
            ready = True
            for gene in range(genomes.n_connections[row]):
                if target[gene] == k and source[gene] >= 0 and networks.place[to_row, source[gene]] < 0:
                    ready = False
                    break
            if ready:
                networks.place[to_row, k] = n_placed
                n_placed += 1
    return n_placed


@inlined
def _place_of(genomes, row, networks, to_row, node):
    """Place of a hidden node in the order of activation; -1 where it has none."""
    for k in range(genomes.n_hidden[row]):
        if genomes.hidden[row, k] == node:
            return networks.place[to_row, k]
    return np.int32(-1)


@kernel
def decode(genomes, row, rules, networks, to_row):
    """Decode one genome: its enabled genes become edges, grouped by target in order of activation.

    A hidden node on a cycle of a feed-forward network has no place in that order, and no edges.
    """
    first_hidden = rules.n_inputs + rules.n_outputs
    n_hidden = _place_hidden(genomes, row, rules, networks, to_row) if genomes.n_hidden[row] > 0 else 0
    networks.n_hidden[to_row] = n_hidden
    n_active = n_hidden + rules.n_outputs
    first_edge = networks.first_edge
    for k in range(n_active + 1):
        first_edge[to_row, k] = 0
    target, source = networks.ends[0], networks.ends[1]
    for gene in range(genomes.n_connections[row]):
        target[gene] = -1
        if not genomes.enabled[row, gene]:
            continue
        node = genomes.source[row, gene]
        if node >= first_hidden:
            place = _place_of(genomes, row, networks, to_row, node)
            if place < 0:
                continue
            node = first_hidden + place
        source[gene] = node
        node = genomes.target[row, gene]
        if node >= first_hidden:
            target[gene] = _place_of(genomes, row, networks, to_row, node)
        else:
            target[gene] = n_hidden + node - rules.n_inputs
        if target[gene] >= 0:
            first_edge[to_row, target[gene] + 1] += 1
    end = networks.ends[2]
    for k in range(n_active):
        first_edge[to_row, k + 1] += first_edge[to_row, k]
        end[k] = first_edge[to_row, k]
    for gene in range(genomes.n_connections[row]):
        k = target[gene]
        if k < 0:
            continue
        edge = end[k]
        end[k] = edge + 1
        while edge > first_edge[to_row, k] and networks.source[to_row, edge - 1] > source[gene]:
            networks.source[to_row, edge] = networks.source[to_row, edge - 1]
            networks.weight[to_row, edge] = networks.weight[to_row, edge - 1]
            edge -= 1
        networks.source[to_row, edge] = source[gene]
        networks.weight[to_row, edge] = genomes.weight[row, gene]
    for k in range(rules.n_outputs):
        networks.bias[to_row, n_hidden + k] = genomes.bias[row, k]
    for k in range(genomes.n_hidden[row]):
        place = networks.place[to_row, k]
        if place >= 0:
            networks.bias[to_row, place] = genomes.bias[row, rules.n_outputs + k]


# What the activation `identity` is limited to, so that no sum of its outputs leaves the numbers there are.
IDENTITY_LIMIT = 1e18


@kernel
def decode_rows(genomes, rows, rules, networks):
    """Decode the genomes of some rows, in their order."""
    for k in range(rows.size):
        decode(genomes, rows[k], rules, networks, k)


@inlined
def activation_of(kind, slope, x):
    """A node's activation function at x, in the precision of x."""
    real = type(x)
    if kind == TANH:
        return tanh(slope * x)
    if kind == SIGMOID:
        return sigmoid(slope * x)
    return min(max(x, real(-IDENTITY_LIMIT)), real(IDENTITY_LIMIT))


@inlined
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
    n_hidden = networks.n_hidden[row]
    first_hidden = rules.n_inputs + rules.n_outputs
    if rules.recurrent:
        for k in range(first_hidden + n_hidden):
            before[k] = values[k]
        seen = before
    else:
        seen = values
    for k in range(n_hidden + rules.n_outputs):
        total = networks.bias[row, k]
        for edge in range(networks.first_edge[row, k], networks.first_edge[row, k + 1]):
            total += networks.weight[row, edge] * seen[networks.source[row, edge]]
        node = first_hidden + k if k < n_hidden else rules.n_inputs + k - n_hidden
        values[node] = activation_of(rules.activation, rules.activation_slope, total)
