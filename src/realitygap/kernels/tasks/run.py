"""One evolution on a classical task, from the first generation to the first network that solves it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import kernel
from realitygap.kernels.math.philox import FIRST
from realitygap.kernels.neat.genome import Genomes, first_genomes, make_genomes
from realitygap.kernels.neat.mutation import Innovations, make_innovations
from realitygap.kernels.neat.network import Networks, decode, make_networks
from realitygap.kernels.neat.reproduction import next_generation
from realitygap.kernels.neat.species import N_SPECIES, SpeciesTable, make_species, speciate

from .double_pole import (
    ENOUGH_STARTS,
    LONG_TRIAL,
    SHAKE_ACTIONS,
    SHORT_TRIAL,
    balance,
    first_start,
    generalization,
    gruau_fitness,
)
from .xor import try_xor

XOR = 0
DOUBLE_POLE = 1
DOUBLE_POLE_NO_VELOCITY = 2


class TaskRules(NamedTuple):
    """Which task, with how many networks for how long."""

    task: int
    population: int
    n_generations: int
    bias_value: float


# Places of what `run_task` writes.
EVALUATIONS = 0  # up to and with the first network that solved the task; all, where none did
SOLVED = 1
N_HIDDEN = 2
N_ENABLED = 3
GENERALIZATION = 4  # starts passed by the solver
N_GENERATIONS = 5  # begun
N_OUTCOMES = 6


class TaskRoom(NamedTuple):
    """Room for one run of n individuals over g generations, with nothing in it yet."""

    genomes: Genomes
    children: Genomes
    networks: Networks
    innovations: Innovations
    species: SpeciesTable
    species_of: NDArray[np.int32]  # (n,)
    parents: NDArray[np.int32]  # (n, 2)
    fitness: NDArray[np.float64]  # (n,)
    tested: NDArray[np.float64]  # (g,)
    shaking: NDArray[np.float64]  # (SHAKE_ACTIONS,)
    values: NDArray[np.float64]  # (m,)
    before: NDArray[np.float64]  # (m,)


def make_task_room(rules, neat, room, hidden_room):
    """Return room for one run, with genomes of at most `room` connection genes and `hidden_room` hidden nodes."""
    n = rules.population
    nodes = neat.n_inputs + neat.n_outputs + hidden_room
    return TaskRoom(
        genomes=make_genomes(n, neat.n_outputs, room, hidden_room),
        children=make_genomes(n, neat.n_outputs, room, hidden_room),
        networks=make_networks(1, neat, room, hidden_room),
        innovations=make_innovations(neat, n),
        species=make_species(neat, n),
        species_of=np.zeros(n, np.int32),
        parents=np.zeros((n, 2), np.int32),
        fitness=np.zeros(n),
        tested=np.zeros(rules.n_generations),
        shaking=np.zeros(SHAKE_ACTIONS),
        values=np.zeros(nodes),
        before=np.zeros(nodes),
    )


@kernel
def _next_to_test(fitness, species_of, species, tested, n_tested):
    """The fittest champion of a species that no test has seen, as far as its fitness tells; else the fittest.

    An unchanged copy of a champion has its fitness to the last bit. Stanley's C++ keeps a mark on species.
    """
    best = 0
    chosen = -1
    for row in range(1, fitness.size):
        if fitness[row] > fitness[best]:
            best = row
    for k in range(species.counts[N_SPECIES]):
        champion = -1
        for row in range(fitness.size):
            if species_of[row] == species.identity[k] and (champion < 0 or fitness[row] > fitness[champion]):
                champion = row
        seen = False
        for i in range(n_tested):
            if tested[i] == fitness[champion]:
                seen = True
                break
        if not seen and (chosen < 0 or fitness[champion] > fitness[chosen]):
            chosen = champion
    return chosen if chosen >= 0 else best


@kernel
def _note(outcome, genomes, row, evaluations, starts, generation):
    outcome[EVALUATIONS] = evaluations
    outcome[SOLVED] = 1
    outcome[N_HIDDEN] = genomes.n_hidden[row]
    enabled = 0
    for gene in range(genomes.n_connections[row]):
        if genomes.enabled[row, gene]:
            enabled += 1
    outcome[N_ENABLED] = enabled
    outcome[GENERALIZATION] = starts
    outcome[N_GENERATIONS] = generation + 1


@kernel
def run_task(rules, neat, key, replicate, room, outcome):
    """Evolve until a network solves the task, or the generations are over.

    With velocities and in XOR the first network to solve the task ends the run. Without velocities a network
    of each generation, chosen when all were tried, has to balance for 100,000 actions and then from 200 of
    625 starts; these tests are not counted as evaluations, the generation is counted whole.

    Args:
        rules: Which task, with how many networks for how long.
        neat: NEAT's rates and choices.
        key, replicate: Which random numbers.
        room: As `make_task_room` made it.
        outcome: (N_OUTCOMES,) int64, written.

    Returns:
        Whether all genomes found room; if not, the outcome is worth nothing and wants more room.
    """
    n = rules.population
    genomes, children, networks = room.genomes, room.children, room.networks
    innovations, species, species_of = room.innovations, room.species, room.species_of
    fitness, tested, shaking = room.fitness, room.tested, room.shaking
    values, before = room.values, room.before
    for k in range(N_OUTCOMES):
        outcome[k] = 0
    first_genomes(genomes, neat, key, replicate, FIRST)
    if genomes.full[0]:
        return False
    speciate(genomes, genomes, fitness, species_of, species, neat, key, replicate, FIRST)
    velocities = rules.task == DOUBLE_POLE
    most = LONG_TRIAL if velocities else SHORT_TRIAL
    for generation in range(rules.n_generations):
        for row in range(n):
            decode(genomes, row, neat, networks, FIRST)
            if rules.task == XOR:
                fitness[row], solved = try_xor(networks, FIRST, neat, rules.bias_value, values, before)
            else:
                actions = balance(
                    networks,
                    FIRST,
                    neat,
                    rules.bias_value,
                    velocities,
                    most,
                    first_start(),
                    values,
                    before,
                    shaking,
                )
                solved = velocities and actions == LONG_TRIAL
                fitness[row] = actions if velocities else gruau_fitness(actions, shaking)
            if solved:
                _note(outcome, genomes, row, generation * n + row + 1, FIRST, generation)
                return True
        if rules.task == DOUBLE_POLE_NO_VELOCITY:
            row = _next_to_test(fitness, species_of, species, tested, generation)
            tested[generation] = fitness[row]
            decode(genomes, row, neat, networks, FIRST)
            actions = balance(
                networks,
                FIRST,
                neat,
                rules.bias_value,
                velocities,
                LONG_TRIAL,
                first_start(),
                values,
                before,
                shaking,
            )
            if actions == LONG_TRIAL:
                starts = generalization(networks, FIRST, neat, rules.bias_value, values, before, shaking)
                if starts >= ENOUGH_STARTS:
                    _note(outcome, genomes, row, (generation + 1) * n, starts, generation)
                    return True
        if generation + 1 == rules.n_generations:
            break
        next_generation(
            genomes,
            fitness,
            species_of,
            species,
            neat,
            innovations,
            key,
            replicate,
            generation,
            children,
            room.parents,
        )
        if children.full[0]:
            return False
        genomes, children = children, genomes
    outcome[EVALUATIONS] = n * rules.n_generations
    outcome[N_GENERATIONS] = rules.n_generations
    return True
