"""XOR against its plain reference."""

from __future__ import annotations

import random

import numpy as np
import pytest

from realitygap.kernels.neat.network import decode, make_networks
from realitygap.kernels.tasks.xor import try_xor
from tests.kernels.genome_arrays import grown, rules_of, settings, to_arrays
from tests.reference.effort import cases
from tests.reference.neat import Gene, Genome, Neat, feed_forward
from tests.reference.xor import fitness_and_solved

pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered")

FIRST = np.int64(0)


def tried(neat: Neat, genome: Genome, bias_value: float = 1.0) -> tuple[float, bool]:
    """What the kernel makes of a genome."""
    rules = rules_of(neat)
    arrays = to_arrays(neat, [genome])
    room, hidden_room = arrays.innovation.shape[1], arrays.hidden.shape[1]
    networks = make_networks(np.int64(1), rules, room, hidden_room)
    decode(arrays, FIRST, rules, networks, FIRST)
    values = np.zeros(neat.first_hidden + hidden_room)
    return try_xor(networks, FIRST, rules, bias_value, values, np.zeros_like(values))


@pytest.mark.parametrize("activation", ["sigmoid", "tanh", "identity"])
def test_xor_equals_the_reference(activation: str) -> None:
    neat = Neat(settings(activation=activation), 3, 1, 2)
    for seed in range(cases(100, 20)):
        genome = grown(neat, seed, random.Random(seed).randint(0, 10))

        def answer(inputs: tuple[float, float], genome: Genome = genome) -> float:
            output = feed_forward(neat, genome, [*inputs, 0.7])[0]
            if activation == "tanh":
                return 0.5 * (output + 1.0)
            return min(max(output, 0.0), 1.0)

        fitness, solved = tried(neat, genome, 0.7)
        expected, is_right = fitness_and_solved(answer)
        assert fitness == pytest.approx(expected, rel=1e-9)
        assert solved == is_right


def test_a_network_that_answers_right_is_told_apart_from_one_that_does_nothing() -> None:
    """Hidden node 4 is "and"; the output is "or and not both"."""
    neat = Neat(settings(), 3, 1, 2)
    links = [(0, 3, 4.0), (1, 3, 4.0), (2, 3, -2.0), (0, 4, 4.0), (1, 4, 4.0), (2, 4, -6.0), (4, 3, -8.0)]
    genome = Genome({k: Gene(*link) for k, link in enumerate(links)}, {3: 0.0, 4: 0.0})
    fitness, solved = tried(neat, genome)
    assert solved
    assert fitness > 15.9
    for gene in genome.genes.values():
        gene.weight = 0.0
    assert tried(neat, genome) == (4.0, False)
