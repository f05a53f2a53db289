"""A block of networks, different in structure, activated side by side.

The edges that occur in any of them form one list; a network without one of them has the weight 0 there. Adding
0 changes no sum, so a network's outputs do not depend on the others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import shared, stage
from realitygap.kernels.math.elementary import exp_series, sigmoid, tanh_of_series, tanh_remainder
from realitygap.kernels.math.lanes import LANES, copy_row

from .network import IDENTITY_LIMIT, SIGMOID, TANH


class Wiring(NamedTuple):
    """The networks of a block: nodes and edges as in `Networks`, each a row of lanes."""

    n_hidden: NDArray[np.int32]  # (1,) of the network with the most
    first_edge: NDArray[np.int32]  # (h + o + 1,)
    source: NDArray[np.int32]  # (e,)
    weight: NDArray[np.floating]  # (e, LANES)
    bias: NDArray[np.floating]  # (h + o, LANES)
    edge_of: NDArray[np.int32]  # (h + o, i + o + h) room


def make_wiring(like, rules, hidden_room):
    """Return room for networks with `hidden_room` hidden nodes, in the precision of the array `like`."""
    active = rules.n_outputs + hidden_room
    nodes = rules.n_inputs + active
    return Wiring(
        n_hidden=np.zeros(1, np.int32),
        first_edge=np.zeros(active + 1, np.int32),
        source=np.zeros(active * nodes, np.int32),
        weight=np.zeros((active * nodes, LANES), like.dtype),
        bias=np.zeros((active, LANES), like.dtype),
        edge_of=np.zeros((active, nodes), np.int32),
    )


@shared
def wire(networks, rows, first, n_lanes, rules, wiring):
    """Lay out n networks in lanes; lane k gets network `rows[first + k]`."""
    most = np.int32(0)
    for lane in range(n_lanes):
        most = max(most, networks.n_hidden[rows[first + lane]])
    wiring.n_hidden[0] = most
    n_active = most + rules.n_outputs
    n_nodes = n_active + rules.n_inputs
    for k in range(n_active):
        for node in range(n_nodes):
            wiring.edge_of[k, node] = 0
    for lane in range(n_lanes):
        row = rows[first + lane]
        n_hidden = networks.n_hidden[row]
        for k in range(n_hidden + rules.n_outputs):
            to = k if k < n_hidden else most + k - n_hidden
            for edge in range(networks.first_edge[row, k], networks.first_edge[row, k + 1]):
                wiring.edge_of[to, networks.source[row, edge]] = 1
    edges = np.int32(0)
    for k in range(n_active):
        wiring.first_edge[k] = edges
        for node in range(n_nodes):
            if wiring.edge_of[k, node] > 0:
                wiring.edge_of[k, node] = edges
                wiring.source[edges] = node
                edges += np.int32(1)
    wiring.first_edge[n_active] = edges
    for edge in range(edges):
        for lane in range(LANES):
            wiring.weight[edge, lane] = 0.0
    for k in range(n_active):
        for lane in range(LANES):
            wiring.bias[k, lane] = 0.0
    for lane in range(n_lanes):
        row = rows[first + lane]
        n_hidden = networks.n_hidden[row]
        for k in range(n_hidden + rules.n_outputs):
            to = k if k < n_hidden else most + k - n_hidden
            wiring.bias[to, lane] = networks.bias[row, k]
            for edge in range(networks.first_edge[row, k], networks.first_edge[row, k + 1]):
                place = wiring.edge_of[to, networks.source[row, edge]]
                wiring.weight[place, lane] = networks.weight[row, edge]


@stage
def _add_edge(weight, value, total):
    for lane in range(LANES):
        total[lane] += weight[lane] * value[lane]


@stage
def _tanh(slope, total, value):
    # In three passes: a processor does not look far enough ahead to take such long chains side by side.
    real = total.dtype.type
    for lane in range(LANES):
        value[lane] = tanh_remainder(real(slope) * total[lane])
    for lane in range(LANES):
        value[lane] = exp_series(value[lane])
    for lane in range(LANES):
        value[lane] = tanh_of_series(real(slope) * total[lane], value[lane])


@stage
def _sigmoid(slope, total, value):
    real = total.dtype.type
    for lane in range(LANES):
        value[lane] = sigmoid(real(slope) * total[lane])


@stage
def _identity(total, value):
    real = total.dtype.type
    for lane in range(LANES):
        one = total[lane]
        one = one if one < real(IDENTITY_LIMIT) else real(IDENTITY_LIMIT)
        value[lane] = one if one > real(-IDENTITY_LIMIT) else real(-IDENTITY_LIMIT)


@stage
def think(wiring, rules, values, before, total):
    """One pass of all networks, as `activate` does it for one.

    Args:
        wiring: The networks.
        rules: NEAT's rates and choices (activation, recurrence, sizes).
        values: (m, LANES) activations by node number: inputs to be read, all others written.
        before: (m, LANES) room, used by recurrent networks.
        total: (LANES,) room.
    """
    n_hidden = wiring.n_hidden[0]
    first_hidden = rules.n_inputs + rules.n_outputs
    if rules.recurrent:
        for node in range(first_hidden + n_hidden):
            copy_row(values[node], before[node])
    for k in range(n_hidden + rules.n_outputs):
        copy_row(wiring.bias[k], total)
        for edge in range(wiring.first_edge[k], wiring.first_edge[k + 1]):
            source = wiring.source[edge]
            if rules.recurrent:
                _add_edge(wiring.weight[edge], before[source], total)
            else:
                _add_edge(wiring.weight[edge], values[source], total)
        node = first_hidden + k if k < n_hidden else rules.n_inputs + k - n_hidden
        if rules.activation == TANH:
            _tanh(rules.activation_slope, total, values[node])
        elif rules.activation == SIGMOID:
            _sigmoid(rules.activation_slope, total, values[node])
        else:
            _identity(total, values[node])
