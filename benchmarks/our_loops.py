"""Loops over our NEAT in the core, compiled as the kernels are: what `ours.py` times."""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import kernel
from realitygap.kernels.jyro.trial import draw_lanes
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.math.philox import FIRST
from realitygap.kernels.neat.genome import first_genomes
from realitygap.kernels.neat.mutation import clear_innovations
from realitygap.kernels.neat.network import activate, decode
from realitygap.kernels.neat.reproduction import next_generation
from realitygap.kernels.neat.species import clear_species, speciate
from realitygap.kernels.neat.wiring import think
from realitygap.kernels.tasks.xor import try_xor


@kernel
def begin_run(room, rules, key, replicate):
    """The first generation of a run, in its species."""
    clear_innovations(rules, room.innovations)
    clear_species(rules, room.species)
    genomes = room.genomes
    first_genomes(genomes, rules, key, replicate, FIRST)
    speciate(genomes, genomes, room.fitness, room.species_of, room.species, rules, key, replicate, FIRST)


@kernel
def breed(genomes, children, room, rules, key, replicate, generation):
    """The next generation of a run."""
    next_generation(
        genomes,
        room.fitness,
        room.species_of,
        room.species,
        rules,
        room.innovations,
        key,
        replicate,
        generation,
        children,
        room.parents,
    )


@kernel
def trivial_runs(room, rules, key, first_run, n_runs, n_generations):
    """Runs in which every fitness is 1, one after the other; False where a gene found no room."""
    for run in range(first_run, first_run + n_runs):
        begin_run(room, rules, key, run)
        genomes, children = room.genomes, room.children
        for generation in range(n_generations):
            if generation > 0:
                breed(genomes, children, room, rules, key, run, generation - 1)
                genomes, children = children, genomes
            for row in range(room.fitness.size):
                room.fitness[row] = 1.0
        if genomes.full[0] or children.full[0]:
            return False
    return True


@kernel
def xor_run(room, rules, key, replicate, n_generations):
    """A run on XOR that no solution ends; False where a gene found no room."""
    begin_run(room, rules, key, replicate)
    genomes, children = room.genomes, room.children
    for generation in range(n_generations):
        for row in range(room.fitness.size):
            decode(genomes, row, rules, room.networks, FIRST)
            room.fitness[row], _ = try_xor(room.networks, FIRST, rules, 1.0, room.values, room.before)
        breed(genomes, children, room, rules, key, replicate, generation)
        genomes, children = children, genomes
    return not (genomes.full[0] or children.full[0])


@kernel
def passes(networks, rules, values, before, n):
    """Passes of one network, each fed with an output of the one before, so that none can be left out."""
    for _ in range(n):
        activate(networks, FIRST, rules, values, before)
        values[0] = values[rules.n_inputs]


@kernel
def passes_side_by_side(wiring, rules, values, before, total, n):
    """The same for a block of networks in lanes."""
    for _ in range(n):
        think(wiring, rules, values, before, total)
        for lane in range(LANES):
            values[0, lane] = values[rules.n_inputs, lane]


@kernel
def draws(counters, key, words, n):
    """Random words as a step of a block of trials draws them."""
    for step in range(n):
        draw_lanes(step, counters, key, words)
        for lane in range(LANES):
            counters[2, lane] ^= words[3, lane]


KEY = np.uint64(20_02)
