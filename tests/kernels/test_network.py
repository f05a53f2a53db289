"""Decoding and activation against a plain recursive and a plain synchronous evaluation."""

from __future__ import annotations

import random

import numpy as np
import pytest

from realitygap.kernels.neat import network as network_kernels
from tests.kernels.genome_arrays import grown, rules_of, settings, to_arrays
from tests.reference.effort import cases
from tests.reference.neat import Gene, Genome, Neat, Recurrent, feed_forward

pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered")

# Sums are made in the same order; the activation functions differ in the last bits, and slopes stretch that.
LAST_BITS = 1e-12


class KernelNetwork:
    def __init__(self, neat: Neat, genome: Genome) -> None:
        self.rules = rules_of(neat)
        arrays = to_arrays(neat, [genome])
        room, hidden_room = arrays.innovation.shape[1], arrays.hidden.shape[1]
        self.networks = network_kernels.make_networks(np.int64(2), self.rules, room, hidden_room)
        self.row = np.int64(1)
        network_kernels.decode(arrays, np.int64(0), self.rules, self.networks, self.row)
        self.values = np.zeros(neat.first_hidden + hidden_room)
        self.before = np.zeros_like(self.values)

    def step(self, inputs: list[float]) -> list[float]:
        self.values[: len(inputs)] = inputs
        network_kernels.activate(self.networks, self.row, self.rules, self.values, self.before)
        return self.values[self.rules.n_inputs : self.rules.n_inputs + self.rules.n_outputs].tolist()


def random_neat(rng: random.Random, *, recurrent: bool) -> Neat:
    chosen = settings(
        recurrent=recurrent,
        node_bias=rng.random() < 0.5,
        activation=rng.choice(["tanh", "sigmoid", "identity"]),
        activation_slope=rng.choice([1.0, 2.45, 4.9]),
    )
    return Neat(chosen, rng.randint(1, 4), rng.randint(1, 3))


def test_feed_forward_networks_equal_the_recursive_evaluation() -> None:
    for seed in range(cases(250, 25)):
        rng = random.Random(seed)
        neat = random_neat(rng, recurrent=False)
        genome = grown(neat, seed, rng.randint(0, 15))
        network = KernelNetwork(neat, genome)
        for _ in range(4):  # what a pass leaves behind has no effect on the next
            inputs = [rng.uniform(-1, 1) for _ in range(neat.n_inputs)]
            expected = feed_forward(neat, genome, inputs)
            assert network.step(inputs) == pytest.approx(expected, rel=LAST_BITS, abs=LAST_BITS)


def test_recurrent_networks_equal_the_synchronous_evaluation() -> None:
    for seed in range(cases(250, 25)):
        rng = random.Random(seed)
        neat = random_neat(rng, recurrent=True)
        genome = grown(neat, seed, rng.randint(0, 15))
        network, plain = KernelNetwork(neat, genome), Recurrent(neat, genome)
        for _ in range(6):
            inputs = [rng.uniform(-1, 1) for _ in range(neat.n_inputs)]
            expected = plain.step(inputs)
            assert network.step(inputs) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def identity(*, recurrent: bool = False, node_bias: bool = False) -> Neat:
    return Neat(
        settings(activation="identity", activation_slope=4.9, recurrent=recurrent, node_bias=node_bias), 2, 1
    )


def test_identity_is_the_sum_whatever_the_slope() -> None:
    genome = Genome({0: Gene(0, 2, 3.0), 1: Gene(1, 2, -2.0)}, {2: 0.5})
    assert KernelNetwork(identity(node_bias=True), genome).step([1.0, 4.0]) == [3.0 - 8.0 + 0.5]


def test_disabled_genes_carry_nothing() -> None:
    genome = Genome({0: Gene(0, 2, 3.0), 1: Gene(1, 2, -2.0, False)}, {2: 0.0})
    assert KernelNetwork(identity(), genome).step([1.0, 4.0]) == [3.0]


def test_a_node_without_links_gives_its_bias_on() -> None:
    genome = Genome({0: Gene(3, 2, 2.0)}, {2: 0.25, 3: 0.5})
    assert KernelNetwork(identity(node_bias=True), genome).step([1.0, 4.0]) == [0.25 + 2.0 * 0.5]


def test_hidden_nodes_wait_for_those_before_them_whatever_their_numbers() -> None:
    """0 -> 5 -> 4 -> 3 -> output, with numbers against the order of activation."""
    genes = {0: Gene(0, 5, 2.0), 1: Gene(5, 4, 3.0), 2: Gene(4, 3, 5.0), 3: Gene(3, 2, 7.0)}
    genome = Genome(genes, dict.fromkeys([2, 3, 4, 5], 0.0))
    assert KernelNetwork(identity(), genome).step([1.0, 0.0]) == [210.0]


def test_a_recurrent_network_takes_a_pass_for_every_link_on_the_way() -> None:
    genes = {0: Gene(0, 3, 2.0), 1: Gene(3, 2, 3.0), 2: Gene(2, 2, 1.0)}
    network = KernelNetwork(identity(recurrent=True), Genome(genes, {2: 0.0, 3: 0.0}))
    assert [network.step([1.0, 0.0]) for _ in range(4)] == [
        [0.0],
        [6.0],
        [12.0],
        [18.0],
    ]  # a loop that adds up
    assert network.step([0.0, 0.0]) == [24.0]  # what was on its way still comes
    assert network.step([0.0, 0.0]) == [24.0]


@pytest.mark.parametrize(("kind", "least", "greatest"), [("tanh", -1.0, 1.0), ("sigmoid", 0.0, 1.0)])
def test_outputs_stay_in_the_range_of_their_activation(kind: str, least: float, greatest: float) -> None:
    neat = Neat(settings(activation=kind, activation_slope=100), 1, 1)
    genome = Genome({0: Gene(0, 1, 8.0)}, {1: 0.0})
    network = KernelNetwork(neat, genome)
    assert network.step([1e6]) == [greatest]
    assert network.step([-1e6]) == [least]
    assert network.step([0.0]) == [(least + greatest) / 2]
