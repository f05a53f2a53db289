"""Genomes of the plain reference as the arrays of the kernels, and back."""

from __future__ import annotations

import random
from collections.abc import Sequence

import numpy as np

from realitygap.evolution import NeatSettings
from realitygap.kernels.neat.genome import Genomes, NeatRules, make_genomes
from tests.reference.neat import Gene, Genome, History, Neat
from tests.reference.philox import Stream


def rules_of(neat: Neat) -> NeatRules:
    bias_input = -1 if neat.bias_input is None else neat.bias_input
    return neat.settings.rules(neat.n_inputs, neat.n_outputs, bias_input=bias_input)


def to_arrays(
    neat: Neat, genomes: Sequence[Genome], room: int | None = None, hidden_room: int | None = None
) -> Genomes:
    """The genomes as rows; with plenty of room where none is given."""
    room = room or max(len(genome.genes) for genome in genomes) + 40
    hidden_room = hidden_room or max(len(neat.hidden(genome)) for genome in genomes) + 20
    arrays: Genomes = make_genomes(len(genomes), neat.n_outputs, room, hidden_room)
    for row, genome in enumerate(genomes):
        hidden = neat.hidden(genome)
        arrays.n_connections[row] = len(genome.genes)
        arrays.n_hidden[row] = len(hidden)
        for place, (number, gene) in enumerate(sorted(genome.genes.items())):
            arrays.innovation[row, place] = number
            arrays.source[row, place] = gene.source
            arrays.target[row, place] = gene.target
            arrays.weight[row, place] = gene.weight
            arrays.enabled[row, place] = gene.enabled
        arrays.hidden[row, : len(hidden)] = hidden
        biases = [genome.biases[node] for node in [*neat.outputs, *hidden]]
        arrays.bias[row, : len(biases)] = biases
    return arrays


def from_arrays(neat: Neat, arrays: Genomes, row: int) -> Genome:
    genome = Genome()
    for place in range(arrays.n_connections[row]):
        number = int(arrays.innovation[row, place])
        assert number not in genome.genes, "an innovation number twice in one genome"
        genome.genes[number] = Gene(
            int(arrays.source[row, place]),
            int(arrays.target[row, place]),
            float(arrays.weight[row, place]),
            bool(arrays.enabled[row, place]),
        )
    numbers = list(genome.genes)
    assert numbers == sorted(numbers)
    hidden = arrays.hidden[row, : arrays.n_hidden[row]].tolist()
    assert hidden == sorted(set(hidden))
    for k, node in enumerate([*neat.outputs, *hidden]):
        genome.biases[node] = float(arrays.bias[row, k])
    return genome


def grown(neat: Neat, seed: int, n_mutations: int, history: History | None = None) -> Genome:
    """A genome after so many rounds of structural mutation, some of its genes disabled."""
    rng = random.Random(seed)
    genome = neat.first_genome(Stream(seed, 0, 0, 0, 2))
    history = history or neat.history()
    stream = Stream(seed, 1, 0, 0, 3)
    for _ in range(n_mutations):
        if rng.random() < 0.5:
            neat.add_node(genome, history, stream)
        else:
            neat.add_link(genome, history, stream)
        history.forget()
    for gene in genome.genes.values():
        gene.enabled = gene.enabled and rng.random() < 0.8
    for node in genome.biases:
        genome.biases[node] = rng.uniform(-1, 1) if neat.settings.node_bias else 0.0
    return genome


def cursor() -> np.ndarray:
    """No number taken yet."""
    return np.zeros(5, np.int64)


def settings(**changes: object) -> NeatSettings:
    return NeatSettings.model_validate(changes)
