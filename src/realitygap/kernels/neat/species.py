"""Compatibility distance and speciation (EC02, section 3.3)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import inlined, shared
from realitygap.kernels.math.philox import FIRST, PURPOSE_SPECIES, make_stream

from .genome import has_node, next_below, node_bias_of


class SpeciesTable(NamedTuple):
    """The species of a population, oldest first, with room for as many as there are individuals."""

    identity: NDArray[np.int32]  # (n,) a number that is never used again
    size: NDArray[np.int32]  # (n,) members
    best: NDArray[np.float64]  # (n,) best fitness that the species ever had
    improved: NDArray[np.int32]  # (n,) generation in which it had it first
    counts: NDArray[np.int64]  # (2,) species now; next identity
    floats: NDArray[np.float64]  # (2,) compatibility threshold; best fitness of the whole run
    improved_at: NDArray[np.int64]  # (1,) generation of that best fitness
    numbers: NDArray[np.int64]  # (3, 2 n) room
    shares: NDArray[np.float64]  # (4, n) room


N_SPECIES = 0
NEXT_IDENTITY = 1
THRESHOLD = 0
BEST_EVER = 1

# Stanley's C++ never lets a moving threshold fall below this.
LOWEST_THRESHOLD = 0.3


@inlined
def clear_species(rules, species):
    """Make it a table of no species yet."""
    species.counts[N_SPECIES] = 0
    species.counts[NEXT_IDENTITY] = 0
    species.floats[THRESHOLD] = rules.threshold
    species.floats[BEST_EVER] = -math.inf
    species.improved_at[0] = 0


def make_species(rules, n):
    """No species yet, with room for as many as there are individuals."""
    species = SpeciesTable(
        np.zeros(n, np.int32),
        np.zeros(n, np.int32),
        np.zeros(n),
        np.zeros(n, np.int32),
        np.zeros(2, np.int64),
        np.zeros(2),
        np.zeros(1, np.int64),
        np.zeros((3, 2 * n), np.int64),
        np.zeros((4, n)),
    )
    clear_species(rules, species)
    return species


@inlined
def genome_distance(one, a, other, b, rules):
    """Compatibility distance c1 E/N + c2 D/N + c3 W of two genomes.

    W is the mean difference of the weights of matching genes, disabled ones included, and of the biases of
    nodes that both have where nodes have biases; where no gene matches it is infinite, and counts unless c3 is
    0. N is 1 below `normalize_from` genes.
    """
    n_a = one.n_connections[a]
    n_b = other.n_connections[b]
    matching = 0
    disjoint = 0
    difference = 0.0
    i = 0
    j = 0
    while i < n_a and j < n_b:
        number_a = one.innovation[a, i]
        number_b = other.innovation[b, j]
        if number_a == number_b:
            matching += 1
            difference += abs(one.weight[a, i] - other.weight[b, j])
            i += 1
            j += 1
        elif number_a < number_b:
            disjoint += 1
            i += 1
        else:
            disjoint += 1
            j += 1
    if matching == 0 and rules.weight_coefficient > 0.0:
        return math.inf
    excess = (n_a - i) + (n_b - j)
    if rules.node_bias:
        for k in range(rules.n_outputs):
            matching += 1
            difference += abs(one.bias[a, k] - other.bias[b, k])
        for k in range(one.n_hidden[a]):
            node = one.hidden[a, k]
            if has_node(other, b, rules, node):
                matching += 1
                difference += abs(one.bias[a, rules.n_outputs + k] - node_bias_of(other, b, rules, node))
    larger = max(n_a, n_b)
    size = float(larger) if larger >= rules.normalize_from else 1.0
    return (
        rules.excess_coefficient * excess / size
        + rules.disjoint_coefficient * disjoint / size
        + rules.weight_coefficient * difference / max(matching, 1)
    )


@inlined
def _representative(species_of, fitness, which, rules, stream, cursor):
    """A member of a species of the generation before: at random, or its champion."""
    if rules.champion_represents:
        champion = -1
        for row in range(species_of.size):
            if species_of[row] == which and (champion < 0 or fitness[row] > fitness[champion]):
                champion = row
        return champion
    members = 0
    for row in range(species_of.size):
        if species_of[row] == which:
            members += 1
    wanted = next_below(stream, cursor, members)
    for row in range(species_of.size):
        if species_of[row] == which:
            if wanted == 0:
                return row
            wanted -= 1
    return -1


@shared
def speciate(new, old, fitness, species_of, species, rules, key, replicate, generation):
    """Put every genome of `new` into a species; `species_of` changes from the old generation's to the new's.

    A genome goes to the first species whose representative is compatible (or, by choice, the nearest), else
    it founds one. Representatives are members of the generation before. Species left empty disappear.

    Args:
        new: The n genomes to place.
        old: The genomes of the generation before; not read while there is no species.
        fitness: (n,) of the generation before.
        species_of: (n,) identity of each individual's species: read for `old`, written for `new`.
        species: The species; changed in place.
        rules: NEAT's rates and choices.
        key, replicate, generation: Which random numbers; `generation` is that of `new`.
    """
    n = new.n_connections.size
    n_known = species.counts[N_SPECIES]
    representative, identity, size = species.numbers[0], species.numbers[1], species.numbers[2]
    cursor = new.cursor
    for k in range(n_known):
        stream = make_stream(key, replicate, generation, k, FIRST, PURPOSE_SPECIES)
        cursor[0] = 0
        representative[k] = _representative(species_of, fitness, species.identity[k], rules, stream, cursor)
    for k in range(n_known):
        identity[k] = species.identity[k]
        size[k] = 0
    n_all = n_known
    for row in range(n):
        home = -1
        nearest = math.inf
        for k in range(n_all):
            of = old if k < n_known else new
            distance = genome_distance(new, row, of, representative[k], rules)
            if distance < species.floats[THRESHOLD] and (home < 0 or distance < nearest):
                home = k
                nearest = distance
                if not rules.nearest_species:
                    break
        if home < 0:
            home = n_all
            representative[home] = row
            identity[home] = species.counts[NEXT_IDENTITY]
            size[home] = 0
            species.counts[NEXT_IDENTITY] += 1
            n_all += 1
        size[home] += 1
        species_of[row] = identity[home]
    kept = 0
    for k in range(n_all):
        if size[k] == 0:
            continue
        species.identity[kept] = identity[k]
        species.size[kept] = size[k]
        if k < n_known:
            species.best[kept] = species.best[k]
            species.improved[kept] = species.improved[k]
        else:
            species.best[kept] = -math.inf
            species.improved[kept] = generation
        kept += 1
    species.counts[N_SPECIES] = kept
    if rules.target_species > 0:
        step = 0.0
        if kept > rules.target_species:
            step = rules.threshold_step
        elif kept < rules.target_species:
            step = -rules.threshold_step
        species.floats[THRESHOLD] = max(species.floats[THRESHOLD] + step, LOWEST_THRESHOLD)
