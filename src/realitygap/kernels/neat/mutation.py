"""Mutation, and the innovation numbers that let genomes be lined up."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import inlined

from .genome import (
    ENABLED,
    closes_cycle,
    first_number_after_start,
    has_link,
    insert_gene,
    insert_hidden,
    next_below,
    next_signed,
    next_uniform,
)


class Innovations(NamedTuple):
    """The innovations of this generation, so that the same structure gets the same numbers (EC02, section 3.2).

    `counters` holds the next innovation number, the next node id, and how many links and splits this
    generation has seen so far; the first two go on counting for the whole run.
    """

    counters: NDArray[np.int64]  # (4,)
    link_source: NDArray[np.int32]  # (m,)
    link_target: NDArray[np.int32]  # (m,)
    link_number: NDArray[np.int32]  # (m,)
    split_gene: NDArray[np.int32]  # (m,) innovation number of the gene that was split
    split_node: NDArray[np.int32]  # (m,) the node that arose
    split_number: NDArray[np.int32]  # (m,) number of the link into it; the link out has the next one


NEXT_NUMBER = 0
NEXT_NODE = 1
N_LINKS = 2
N_SPLITS = 3


@inlined
def clear_innovations(rules, innovations):
    """No innovation yet: the next numbers are those after the first genomes'."""
    first_node = rules.n_inputs + rules.n_outputs
    innovations.counters[NEXT_NUMBER] = first_number_after_start(rules)
    innovations.counters[NEXT_NODE] = first_node + rules.start_hidden
    start_generation(innovations)


def make_innovations(rules, n):
    """No innovation yet, with room for the n children of a generation."""
    innovations = Innovations(
        np.zeros(4, np.int64),
        np.empty(n, np.int32),
        np.empty(n, np.int32),
        np.empty(n, np.int32),
        np.empty(n, np.int32),
        np.empty(n, np.int32),
        np.empty(n, np.int32),
    )
    clear_innovations(rules, innovations)
    return innovations


@inlined
def start_generation(innovations):
    """Forget the innovations of the generation before; the counters continue."""
    innovations.counters[N_LINKS] = 0
    innovations.counters[N_SPLITS] = 0


@inlined
def number_of_link(innovations, source, target):
    """The innovation number of a new link: known in this generation, or the next one."""
    n = innovations.counters[N_LINKS]
    for k in range(n):
        if innovations.link_source[k] == source and innovations.link_target[k] == target:
            return innovations.link_number[k]
    number = innovations.counters[NEXT_NUMBER]
    innovations.counters[NEXT_NUMBER] = number + 1
    innovations.link_source[n] = source
    innovations.link_target[n] = target
    innovations.link_number[n] = number
    innovations.counters[N_LINKS] = n + 1
    return innovations.link_number[n]


@inlined
def place_of_split(innovations, gene_number):
    """Return the place at which the split of a gene is listed: as known in this generation, or newly."""
    n = innovations.counters[N_SPLITS]
    for k in range(n):
        if innovations.split_gene[k] == gene_number:
            return k
    innovations.split_gene[n] = gene_number
    innovations.split_node[n] = innovations.counters[NEXT_NODE]
    innovations.split_number[n] = innovations.counters[NEXT_NUMBER]
    innovations.counters[NEXT_NODE] += 1
    innovations.counters[NEXT_NUMBER] += 2
    innovations.counters[N_SPLITS] = n + 1
    return n


@inlined
def add_node(genomes, row, rules, innovations, stream, cursor):
    """Split an enabled connection: weight 1 into the new node, the old weight out of it (EC02, 3.1).

    Returns False where no connection can be split.
    """
    n_splittable = 0
    for gene in range(genomes.n_connections[row]):
        if genomes.enabled[row, gene] and (
            rules.split_bias_links or genomes.source[row, gene] != rules.bias_input
        ):
            n_splittable += 1
    if n_splittable == 0:
        return False
    wanted = next_below(stream, cursor, n_splittable)
    split = -1
    for gene in range(genomes.n_connections[row]):
        if genomes.enabled[row, gene] and (
            rules.split_bias_links or genomes.source[row, gene] != rules.bias_input
        ):
            if wanted == 0:
                split = gene
                break
            wanted -= 1
    place = place_of_split(innovations, genomes.innovation[row, split])
    node = innovations.split_node[place]
    number = innovations.split_number[place]
    source = genomes.source[row, split]
    target = genomes.target[row, split]
    weight = genomes.weight[row, split]
    genomes.enabled[row, split] = False
    insert_hidden(genomes, row, node, 0.0)
    insert_gene(genomes, row, number, source, node, 1.0, ENABLED)
    insert_gene(genomes, row, np.int32(number + 1), node, target, weight, ENABLED)
    return True


@inlined
def add_link(genomes, row, rules, innovations, stream, cursor, reached):
    """Join two nodes that are not joined yet; False when none was found in the allowed tries."""
    first_hidden = rules.n_inputs + rules.n_outputs
    n_hidden = genomes.n_hidden[row]
    n_sources = rules.n_inputs + n_hidden
    if rules.recurrent:
        n_sources += rules.n_outputs
    n_targets = rules.n_outputs + n_hidden
    for _ in range(rules.add_link_tries):
        k = next_below(stream, cursor, n_sources)
        if k < rules.n_inputs:
            source = np.int32(k)
        elif k < rules.n_inputs + n_hidden:
            source = genomes.hidden[row, k - rules.n_inputs]
        else:
            source = np.int32(k - n_hidden)
        k = next_below(stream, cursor, n_targets)
        target = (
            np.int32(rules.n_inputs + k) if k < rules.n_outputs else genomes.hidden[row, k - rules.n_outputs]
        )
        if has_link(genomes, row, source, target):
            continue
        if (
            not rules.recurrent
            and source >= first_hidden
            and closes_cycle(genomes, row, source, target, reached)
        ):
            continue
        number = number_of_link(innovations, source, target)
        weight = next_signed(stream, cursor, rules.initial_weight)
        insert_gene(genomes, row, number, source, target, weight, ENABLED)
        return True
    return False


@inlined
def mutated_weight(weight, rules, stream, cursor):
    """A weight moved by a step, or now and then replaced, within the limit (EC02, 4.1)."""
    if next_uniform(stream, cursor) < rules.replace_weight:
        weight = next_signed(stream, cursor, rules.replaced_weight)
    else:
        weight += next_signed(stream, cursor, rules.weight_step)
    return min(max(weight, -rules.weight_limit), rules.weight_limit)


@inlined
def mutate_weights(genomes, row, rules, stream, cursor):
    """Move every weight, and every node bias where there are such."""
    for gene in range(genomes.n_connections[row]):
        genomes.weight[row, gene] = mutated_weight(genomes.weight[row, gene], rules, stream, cursor)
    if rules.node_bias:
        for node in range(rules.n_outputs + genomes.n_hidden[row]):
            genomes.bias[row, node] = mutated_weight(genomes.bias[row, node], rules, stream, cursor)


@inlined
def reenable(genomes, row):
    """Switch the oldest disabled gene on again, as C++ 1.2.1 does."""
    for gene in range(genomes.n_connections[row]):
        if not genomes.enabled[row, gene]:
            genomes.enabled[row, gene] = True
            return


@inlined
def mutate(genomes, row, rules, innovations, stream, cursor, reached):
    """Mutate one genome: structure and weights, in the order node, link, weights, re-enabling."""
    changed = False
    if next_uniform(stream, cursor) < rules.add_node:
        changed = add_node(genomes, row, rules, innovations, stream, cursor)
    if next_uniform(stream, cursor) < rules.add_link and not (changed and rules.one_structural_mutation):
        changed = add_link(genomes, row, rules, innovations, stream, cursor, reached) or changed
    if changed and rules.one_structural_mutation:
        return
    if next_uniform(stream, cursor) < rules.mutate_weights:
        mutate_weights(genomes, row, rules, stream, cursor)
    if next_uniform(stream, cursor) < rules.reenable:
        reenable(genomes, row)
