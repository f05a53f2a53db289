"""A network in 16-bit integers, for processors without fractions: what Aseba's virtual machine computes, bit for bit.

An activation of 1 is the number `ONE`. The sum of a node is that of 32-bit products, shifted to 16 bits: Aseba's
`math.dot`. The hyperbolic tangent is that of the nearest entry of a table and the addition theorem.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from realitygap.evolution import Network

ONE_BITS = 14
ONE = 1 << ONE_BITS
"""The integer that an activation of 1 is."""
SUM_BITS = 12
"""Bits after the point of the argument of the hyperbolic tangent."""
MOST_SHIFT = 16
MOST_EXCESS = 14
WORD = 0x7FFF
"""Largest 16-bit integer."""
LONG = 0x7FFF_FFFF
"""Largest 32-bit integer, to which the products of a node must sum."""
SPACING_BITS = 10
"""Bits of a sum between two entries of the table: a quarter."""
TABLE = tuple(round(ONE * math.tanh(k / 4)) for k in range(22))
"""Hyperbolic tangents of 0, 1/4, ... 21/4."""
SATURATED = (len(TABLE) << SPACING_BITS) - (1 << (SPACING_BITS - 1)) - 1
"""Largest sum that has an entry of the table; the tangent of larger ones is 1."""
CUBE = 1536
"""d * d / 8192 * d / 1536 is the third of the cube of d / 4096, in units of 1 / 16384."""


@dataclass(frozen=True)
class FixedNode:
    """A node that computes.

    Attributes:
        node: Number of the node.
        sources: Numbers of the nodes that it sees.
        weights: An integer for each of them, at most 16 bits.
        constant: Two factors whose product is added to the sum.
        shift: Bits by which the sum is shifted down.
        excess: Bits by which the sum may be larger than 16 bits; 0 if it never is.
        bits: Bits after the point of its activation.
    """

    node: int
    sources: tuple[int, ...]
    weights: tuple[int, ...]
    constant: tuple[int, int]
    shift: int
    excess: int
    bits: int

    @property
    def limit(self) -> int:
        """Largest sum, shifted by `excess`, that has 16 bits when it is not."""
        return (0x8000 >> self.excess) - 1


@dataclass(frozen=True)
class FixedNetwork:
    """A network in integers.

    Attributes:
        activation: tanh, sigmoid, or identity.
        n_inputs: Inputs to be given.
        n_nodes: Largest number of a node, and 1.
        outputs: Numbers of the outputs.
        nodes: Outputs and hidden nodes in the order of activation.
        is_recurrent: True if nodes get the values that the others had after the step before.
    """

    activation: str
    n_inputs: int
    n_nodes: int
    outputs: tuple[int, ...]
    nodes: tuple[FixedNode, ...]
    is_recurrent: bool

    def step(self, inputs: Sequence[int], before: Sequence[int]) -> list[int]:
        """Return all nodes after a step.

        Args:
            inputs: (n_inputs,) integers, at most `ONE` and at least -`ONE`.
            before: (n_nodes,) nodes after the step before; zeros at first.
        """
        now = [*inputs, *before[self.n_inputs :]]
        seen = list(now) if self.is_recurrent else now
        for node in self.nodes:
            now[node.node] = self._answer(node, seen)
        return now

    def _answer(self, node: FixedNode, seen: Sequence[int]) -> int:
        total = node.constant[0] * node.constant[1]
        total += sum(weight * seen[k] for k, weight in zip(node.sources, node.weights, strict=True))
        total >>= node.shift
        if node.excess:
            far = total >> node.excess
            total = WORD if far > node.limit else -WORD if far < -node.limit else total
        if self.activation == "identity":
            return total
        answer = tangent(total)
        return answer if self.activation == "tanh" else (ONE >> 1) + (answer >> 1)

    def command(self, nodes: Sequence[int]) -> list[int]:
        """Return the outputs, limited to -`ONE` and `ONE`."""
        bits = {node.node: node.bits for node in self.nodes}
        return [to_one(nodes[k], bits[k]) for k in self.outputs]


def tangent(total: int) -> int:
    """Return `ONE` times the hyperbolic tangent of total / 4096."""
    size = abs(total)
    answer = ONE
    if size <= SATURATED:
        entry = (size + (1 << (SPACING_BITS - 1))) >> SPACING_BITS
        rest = size - (entry << SPACING_BITS)
        rest = 4 * rest - _quotient(_quotient(rest * rest, 8192) * rest, CUBE)
        base = TABLE[entry]
        answer = _quotient((base + rest) * ONE, ONE + _quotient(base * rest, ONE))
    return answer if total > 0 else -answer


def to_one(value: int, bits: int) -> int:
    """Return a value with `bits` bits after its point as a share of `ONE`, limited to -`ONE` and `ONE`."""
    if bits < 0:
        return max(min(value, 1), -1) * ONE
    limit = 1 << bits
    return max(min(value, limit), -limit) << (ONE_BITS - bits)


def _quotient(dividend: int, divisor: int) -> int:
    """Divide as C does: towards zero."""
    quotient = abs(dividend) // abs(divisor)
    return quotient if (dividend < 0) == (divisor < 0) else -quotient


def fixed_point(network: Network) -> FixedNetwork:
    """Return a network in 16-bit integers.

    Raises:
        ValueError: It is recurrent with the activation identity, so that its nodes have no bound, or a weight is too
            large.
    """
    values = network.to_dict()
    activation, is_recurrent = values["activation"], values["recurrent"]
    if activation == "identity" and is_recurrent:
        raise ValueError(
            "The nodes of a recurrent network with the activation 'identity' have no bound, and 16 bits have one. "
            "Evolve with the activation 'tanh' or 'sigmoid'."
        )
    gain = {
        "tanh": values["activation_slope"],
        "sigmoid": values["activation_slope"] / 2,
        "identity": 1.0,
    }[activation]
    first_output = values["n_inputs"]
    outputs = tuple(range(first_output, first_output + values["n_outputs"]))
    constant = first_output - 1 if values["constant"] else -1
    bounds = dict.fromkeys(range(first_output), 1.0)
    bits = dict.fromkeys(range(first_output), ONE_BITS)
    if activation != "identity":
        bounds |= {node["node"]: 1.0 for node in values["nodes"]}
        bits |= {node["node"]: ONE_BITS for node in values["nodes"]}
    are_seen = {source for node in values["nodes"] for source in node["sources"]}
    nodes = []
    for node in values["nodes"]:
        edges = list(zip(node["sources"], node["weights"], strict=True))
        base = node["bias"] + sum(
            weight * values["bias_value"] for source, weight in edges if source == constant
        )
        pairs = [(source, gain * weight) for source, weight in edges if source != constant]
        bound = abs(gain * base) + sum(abs(weight) * bounds[source] for source, weight in pairs)
        if activation == "identity":
            bounds[node["node"]] = bound
            is_limited = node["node"] in outputs and node["node"] not in are_seen
            bits[node["node"]] = ONE_BITS if is_limited else _bits_for(bound)
        nodes.append(_fixed_node(node["node"], pairs, gain * base, bound, bits, activation))
    n_nodes = 1 + max([first_output - 1, *(node.node for node in nodes)])
    return FixedNetwork(activation, network.n_inputs, n_nodes, outputs, tuple(nodes), is_recurrent)


def _bits_for(bound: float) -> int:
    """Return the bits after the point that leave room for a bound."""
    return min(ONE_BITS, math.floor(math.log2((WORD - 1) / bound)) if bound else ONE_BITS)


def _fixed_node(
    node: int,
    pairs: Sequence[tuple[int, float]],
    base: float,
    bound: float,
    bits: dict[int, int],
    activation: str,
) -> FixedNode:
    """Return a node with the largest shift whose sum has 32 bits, and its factors 16."""
    sum_bits = bits[node] if activation == "identity" else SUM_BITS
    excess = 0
    while (bound * 2.0**sum_bits + 2) / 2**excess > WORD:
        excess += 1
    for shift in range(MOST_SHIFT if excess <= MOST_EXCESS else -1, -1, -1):
        weights = [round(weight * 2.0 ** (sum_bits + shift - bits[source])) for source, weight in pairs]
        added = round(base * 2.0 ** (sum_bits + shift)) + (1 << shift >> 1)
        largest = abs(added) + sum(
            abs(weight) * (WORD if activation == "identity" else ONE) for weight in weights
        )
        has_factors = max([abs(added) / ONE, *map(abs, weights)]) <= WORD
        if has_factors and largest <= LONG:
            return FixedNode(
                node,
                tuple(source for source, _ in pairs),
                tuple(weights),
                _factors(added),
                shift,
                excess,
                bits[node],
            )
    raise ValueError(
        f"The weights of node {node} are too large for 16 bits: the argument of its activation reaches {bound:.3g}, "
        f"expected at most {2.0 ** (15 + MOST_EXCESS - sum_bits):,.0f}. Evolve with a smaller `weight_limit`."
    )


def _factors(number: int) -> tuple[int, int]:
    """Return two 16-bit integers whose product is nearest to a number."""
    power = 0
    while abs(round(number / 2**power)) > WORD:
        power += 1
    return 1 << power, round(number / 2**power)


def errors(network: Network, fixed: FixedNetwork, inputs: Sequence[Sequence[int]]) -> tuple[float, float]:
    """Return the largest and the median difference between outputs in integers and those of the network.

    Both begin without memory and see the same inputs. Outputs are limited to -1..1, as commands are.

    Args:
        network: The network.
        fixed: The same network in integers.
        inputs: (t, n_inputs) integers, shares of `ONE`.
    """
    twin = Network.from_dict(network.to_dict())
    nodes = [0] * fixed.n_nodes
    errors = []
    for given in inputs:
        nodes = fixed.step(given, nodes)
        wanted = np.clip(twin.activate([value / ONE for value in given]), -1.0, 1.0)
        errors.append(np.abs(np.array(fixed.command(nodes)) / ONE - wanted))
    return float(np.max(errors)), float(np.median(errors))
