"""Fitness sharing, offspring, survival, stagnation and the next generation in its species (EC02, 3.3 and 4.1)."""

from __future__ import annotations

import math

from realitygap.kernels.compile.decorators import inlined, shared
from realitygap.kernels.math.philox import FIRST, PURPOSE_CHILD, make_stream

from .crossover import crossover
from .genome import copy_genome, next_below, next_uniform
from .mutation import mutate, start_generation
from .species import BEST_EVER, N_SPECIES, speciate


@inlined
def note_improvement(fitness, species_of, species, generation):
    """Keep for each species, and for the run, the best fitness and the generation that first had it."""
    for k in range(species.counts[N_SPECIES]):
        best = -math.inf
        for row in range(fitness.size):
            if species_of[row] == species.identity[k]:
                best = max(best, fitness[row])
        if best > species.best[k]:
            species.best[k] = best
            species.improved[k] = generation
    best = -math.inf
    for row in range(fitness.size):
        best = max(best, fitness[row])
    if best > species.floats[BEST_EVER]:
        species.floats[BEST_EVER] = best
        species.improved_at[0] = generation


# What Stanley's C++ makes of a negative fitness.
LOWEST_FITNESS = 0.0001


@inlined
def not_negative(fitness, rules, shared):
    """Write to `shared` the fitness that sharing can use: lifted by the lowest, or cut off below."""
    lowest = 0.0
    for row in range(fitness.size):
        lowest = min(lowest, fitness[row])
    for row in range(fitness.size):
        if rules.clip_negative:
            shared[row] = fitness[row] if fitness[row] >= 0.0 else LOWEST_FITNESS
        else:
            shared[row] = fitness[row] - lowest


@inlined
def round_to_sum(share, total, count, rest):
    """Whole numbers in proportion to `share` that add up to `total`, by largest remainder.

    Args:
        share: (k,) not negative; all zero is not allowed.
        total: What the counts add up to.
        count: (k,) int64, written. Of equal remainders the earlier one is rounded up.
        rest: (k,) room.
    """
    whole = 0.0
    for k in range(share.size):
        whole += share[k]
    given = 0
    for k in range(share.size):
        exact = share[k] / whole * total
        count[k] = int(math.floor(exact))
        rest[k] = exact - count[k]
        given += count[k]
    while given < total:
        largest = 0
        for k in range(1, share.size):
            if rest[k] > rest[largest]:
                largest = k
        count[largest] += 1
        rest[largest] -= 1.0
        given += 1
    while given > total:  # only where a rounding error lifted a quota over a whole number
        most = 0
        for k in range(1, share.size):
            if count[k] > count[most]:
                most = k
        count[most] -= 1
        given -= 1


@inlined
def share_offspring(fitness, species_of, species, rules, generation, offspring):
    """Compute the number of children of each species; they add up to the size of the population.

    A species' share is the mean fitness of its members (that is explicit fitness sharing). One whose best
    fitness has not risen for `stagnation` generations counts with `stagnation_factor`; when the whole
    population has not improved for more than `population_stagnation` generations, only the two best species
    have children. Where every share is zero the shares are the sizes. `fitness` must not be negative.
    """
    n = fitness.size
    n_species = species.counts[N_SPECIES]
    share, best_now, rest = (
        species.shares[0, :n_species],
        species.shares[1, :n_species],
        species.shares[2, :n_species],
    )
    for k in range(n_species):
        share[k] = 0.0
        best_now[k] = -math.inf
        for row in range(n):
            if species_of[row] == species.identity[k]:
                share[k] += fitness[row] / species.size[k]
                best_now[k] = max(best_now[k], fitness[row])
    if n_species > 2 and generation - species.improved_at[0] > rules.population_stagnation:
        first = 0
        for k in range(1, n_species):
            if best_now[k] > best_now[first]:
                first = k
        second = 1 if first == 0 else 0
        for k in range(n_species):
            if k != first and best_now[k] > best_now[second]:
                second = k
        for k in range(n_species):
            share[k] = 0.0
        share[first] = 1.0
        share[second] = 1.0
    else:
        leader = 0
        for k in range(1, n_species):
            if best_now[k] > best_now[leader]:
                leader = k
        for k in range(n_species):
            stagnant = generation - species.improved[k] >= rules.stagnation
            if stagnant and not (rules.best_species_spared and k == leader):
                share[k] *= rules.stagnation_factor
    total = 0.0
    for k in range(n_species):
        total += share[k]
    if not (0.0 < total < math.inf):
        for k in range(n_species):
            share[k] = species.size[k]
    round_to_sum(share, n, offspring, rest)


@inlined
def ranked_members(fitness, species_of, identity, members):
    """Rows of a species from the fittest down, equally fit ones in their order; returns how many."""
    n = 0
    for row in range(fitness.size):
        if species_of[row] != identity:
            continue
        place = n
        while place > 0 and fitness[members[place - 1]] < fitness[row]:
            members[place] = members[place - 1]
            place -= 1
        members[place] = row
        n += 1
    return n


@inlined
def _other_champion(fitness, species_of, species, own, stream, cursor):
    """The fittest individual of another species drawn at random."""
    k = next_below(stream, cursor, species.counts[N_SPECIES] - 1)
    if k >= own:
        k += 1
    champion = -1
    for row in range(fitness.size):
        if species_of[row] == species.identity[k] and (champion < 0 or fitness[row] > fitness[champion]):
            champion = row
    return champion


@inlined
def reproduce(
    old, fitness, species_of, species, rules, innovations, key, replicate, generation, new, parents
):
    """Fill `new` with the next generation, whole; `old` stays as it is.

    Args:
        old: The n genomes that were tried.
        fitness: (n,) finite.
        species_of: (n,) identity of each one's species.
        species: The species; best fitness and stagnation are brought up to date.
        rules: NEAT's rates and choices.
        innovations: The numbers of the run; what arose in the generation before is forgotten first.
        key, replicate, generation: Which random numbers; `generation` is that of `old`.
        new: Room for the n children.
        parents: (n, 2) int32, written: rows of `old`; -1 where there is no second parent.
    """
    n = fitness.size
    note_improvement(fitness, species_of, species, generation)
    n_species = species.counts[N_SPECIES]
    offspring, members = species.numbers[0, :n_species], species.numbers[1, :n]
    shared = species.shares[3]
    not_negative(fitness, rules, shared)
    share_offspring(shared, species_of, species, rules, generation, offspring)
    start_generation(innovations)
    # As many as there are genes, and not nodes: a row without room for its hidden nodes still holds their genes.
    reached = new.reached
    cursor = new.cursor
    child = FIRST
    for k in range(n_species):
        if offspring[k] == 0:
            continue
        size = ranked_members(fitness, species_of, species.identity[k], members)
        n_parents = min(int(math.floor(rules.survival * size + 1.0)), size)
        counted = size if rules.champion_by_members else offspring[k]
        for place in range(offspring[k]):
            # Each of copying, mating and mutating stands here once, as it becomes part of this function.
            stream = make_stream(key, replicate, generation + 1, child, FIRST, PURPOSE_CHILD)
            cursor[0] = 0
            second = -1
            if place == 0 and counted >= rules.champion_from:
                first = members[0]
                mutated = False
            else:
                first = members[next_below(stream, cursor, n_parents)]
                mutated = True
                if next_uniform(stream, cursor) < rules.crossover:
                    if n_species > 1 and next_uniform(stream, cursor) < rules.interspecies:
                        second = _other_champion(fitness, species_of, species, k, stream, cursor)
                    else:
                        second = members[next_below(stream, cursor, n_parents)]
                    if second == first:
                        second = -1
            if second < 0:
                copy_genome(old, first, new, child)
            else:
                crossover(old, first, second, fitness, rules, new, child, stream, cursor, reached)
                mutated = next_uniform(stream, cursor) >= rules.crossover_only
            if mutated:
                mutate(new, child, rules, innovations, stream, cursor, reached)
            parents[child, 0] = first
            parents[child, 1] = second
            child += 1


@shared
def next_generation(
    old, fitness, species_of, species, rules, innovations, key, replicate, generation, children, parents
):
    """Breed `children` from `old` and place them in species; arguments as in `reproduce` and `speciate`.

    Where `children.full` is set, a gene found no room and everything written is worth nothing.
    """
    reproduce(
        old, fitness, species_of, species, rules, innovations, key, replicate, generation, children, parents
    )
    if not children.full[0]:
        speciate(children, old, fitness, species_of, species, rules, key, replicate, generation + 1)
