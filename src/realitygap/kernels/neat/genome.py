"""Genomes as arrays, one row an individual, and the first ones of a run.

Node ids: inputs 0 .. i-1, outputs i .. i+o-1, hidden nodes from i+o on, numbered as they arise.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import inlined, shared
from realitygap.kernels.math.philox import FIRST, PURPOSE_GENOME, draw_words, make_stream, unit


class Genomes(NamedTuple):
    """The genomes of n individuals, with room for c connection genes and h hidden nodes each."""

    n_connections: NDArray[np.int32]  # (n,)
    n_hidden: NDArray[np.int32]  # (n,)
    innovation: NDArray[np.int32]  # (n, c) ascending in a row
    source: NDArray[np.int32]  # (n, c) node ids
    target: NDArray[np.int32]  # (n, c) node ids
    weight: NDArray[np.float64]  # (n, c)
    enabled: NDArray[np.bool_]  # (n, c)
    hidden: NDArray[np.int32]  # (n, h) ids of hidden nodes, ascending
    bias: NDArray[np.float64]  # (n, o + h) of each output and hidden node; zero without node biases
    full: NDArray[np.bool_]  # (1,) set when a gene found no room: the rows are then worth nothing
    reached: NDArray[np.int32]  # (c + 1,) room for the ids of nodes
    cursor: NDArray[np.int64]  # (5,) room for what `next_uniform` knows


class NeatRules(NamedTuple):
    """Every rate and choice of NEAT in the form that kernels read; `NeatSettings` explains them."""

    n_inputs: int
    n_outputs: int
    recurrent: bool
    node_bias: bool
    bias_input: int  # id of the input that is constant, -1 where there is none
    activation: int
    activation_slope: float
    start_hidden: int
    start_random: bool
    start_layer: bool  # no links from inputs to outputs but of the constant one
    initial_weight: float
    weight_limit: float
    mutate_weights: float
    replace_weight: float
    weight_step: float
    replaced_weight: float
    add_node: float
    add_link: float
    add_link_tries: int
    reenable: float
    one_structural_mutation: bool
    split_bias_links: bool
    crossover: float
    crossover_only: float
    average_weights: float
    interspecies: float
    stay_disabled: float
    disabled_bit_inherited: bool
    equal_parents_mix: bool
    excess_coefficient: float
    disjoint_coefficient: float
    weight_coefficient: float
    normalize_from: int  # genes from which distances are divided by size; a huge number: never
    threshold: float
    nearest_species: bool
    champion_represents: bool
    target_species: int  # 0: the threshold stays as it is
    threshold_step: float
    survival: float
    champion_from: int
    champion_by_members: bool
    stagnation: int
    stagnation_factor: float
    best_species_spared: bool
    population_stagnation: int
    clip_negative: bool
    drives_wheels: bool  # outputs are wheel speeds, left and right, and not move and turn

    @property
    def n_first_genes(self) -> int:
        """The most connection genes that a genome of the first generation has."""
        return _count_first_numbers(self)  # not compiled for this alone


def _count_first_numbers(rules):
    """Return the count of innovation numbers of a start's links; one between hidden nodes leads to the later one."""
    h = rules.start_hidden
    return rules.n_inputs * rules.n_outputs + h * (rules.n_inputs + rules.n_outputs) + h * (h - 1) // 2


first_number_after_start = inlined(_count_first_numbers)


def make_genomes(n, n_outputs, room, hidden_room):
    """Return empty genomes of n individuals with room for `room` connection genes and `hidden_room` hidden nodes."""
    return Genomes(
        np.zeros(n, np.int32),
        np.zeros(n, np.int32),
        np.zeros((n, room), np.int32),
        np.zeros((n, room), np.int32),
        np.zeros((n, room), np.int32),
        np.zeros((n, room)),
        np.zeros((n, room), np.bool_),
        np.zeros((n, hidden_room), np.int32),
        np.zeros((n, n_outputs + hidden_room)),
        np.zeros(1, np.bool_),
        np.zeros(room + 1, np.int32),
        np.zeros(5, np.int64),
    )


@inlined
def next_uniform(stream, cursor):
    """Return the next number of a stream; `cursor` holds the count taken, and four words drawn together."""
    index = cursor[0]
    cursor[0] = index + 1
    if index & 3 == 0:
        words = draw_words(stream, index >> 2)
        cursor[1] = words[0]
        cursor[2] = words[1]
        cursor[3] = words[2]
        cursor[4] = words[3]
    return unit(cursor[1 + (index & 3)])


@inlined
def next_below(stream, cursor, n):
    """The next whole number in 0 .. n-1 of a stream."""
    value = int(next_uniform(stream, cursor) * n)
    return min(value, n - 1)


@inlined
def next_signed(stream, cursor, size):
    """The next number in (-size, size) of a stream."""
    return (2.0 * next_uniform(stream, cursor) - 1.0) * size


@shared
def first_genomes(genomes, rules, key, replicate, generation):
    """Fill all rows with inputs fully wired to outputs and random weights (EC02, section 3.4).

    Where the settings want hidden nodes at the start, each is wired from all inputs and to all outputs; as a
    layer, they stand between all inputs but the constant one and the outputs. A random start has some of
    these nodes, and each link, those between hidden nodes too, with a chance of `RANDOM_LINK`. The same link
    has the same number in all. Sets `full` where there is no room.
    """
    cursor = genomes.cursor
    n = genomes.n_connections.size
    for row in range(n):
        stream = make_stream(key, replicate, generation, row, FIRST, PURPOSE_GENOME)
        cursor[0] = 0
        genomes.n_connections[row] = 0
        genomes.n_hidden[row] = 0
        n_hidden = rules.start_hidden
        if rules.start_random:
            n_hidden = next_below(stream, cursor, n_hidden + 1)
        number = np.int32(0)
        for output in range(rules.n_outputs):
            for source in range(rules.n_inputs):
                target = rules.n_inputs + output
                if not rules.start_layer or source == rules.bias_input:
                    _first_link(genomes, row, rules, number, source, target, stream, cursor)
                number += 1
        for k in range(n_hidden):
            node = rules.n_inputs + rules.n_outputs + k
            insert_hidden(genomes, row, node, 0.0)
            for source in range(rules.n_inputs):
                _first_link(genomes, row, rules, number, source, node, stream, cursor)
                number += 1
            for source in range(rules.n_inputs + rules.n_outputs, node):
                if rules.start_random:
                    _first_link(genomes, row, rules, number, source, node, stream, cursor)
                number += 1
            for output in range(rules.n_outputs):
                target = rules.n_inputs + output
                _first_link(genomes, row, rules, number, node, target, stream, cursor)
                number += 1
        for node in range(rules.n_outputs + genomes.n_hidden[row]):
            genomes.bias[row, node] = (
                next_signed(stream, cursor, rules.initial_weight) if rules.node_bias else 0.0
            )


# Of Stanley's C++, where it starts the double pole from networks at random.
RANDOM_LINK = 0.3


@inlined
def _first_link(genomes, row, rules, number, source, target, stream, cursor):
    """Put a link of the start into a genome; into a random one with a chance of `RANDOM_LINK`."""
    if rules.start_random and next_uniform(stream, cursor) >= RANDOM_LINK:
        return
    weight = next_signed(stream, cursor, rules.initial_weight)
    insert_gene(genomes, row, number, source, target, weight, ENABLED)


@inlined
def copy_genome(old, from_row, new, to_row):
    """Copy one individual's genome into a row of other arrays."""
    n = old.n_connections[from_row]
    h = old.n_hidden[from_row]
    outputs = old.bias.shape[1] - old.hidden.shape[1]
    new.n_connections[to_row] = n
    new.n_hidden[to_row] = h
    for gene in range(n):
        new.innovation[to_row, gene] = old.innovation[from_row, gene]
        new.source[to_row, gene] = old.source[from_row, gene]
        new.target[to_row, gene] = old.target[from_row, gene]
        new.weight[to_row, gene] = old.weight[from_row, gene]
        new.enabled[to_row, gene] = old.enabled[from_row, gene]
    for node in range(h):
        new.hidden[to_row, node] = old.hidden[from_row, node]
    for node in range(outputs + h):
        new.bias[to_row, node] = old.bias[from_row, node]


@inlined
def has_link(genomes, row, source, target):
    """Whether a genome holds a gene, enabled or not, from one node to another."""
    for gene in range(genomes.n_connections[row]):
        if genomes.source[row, gene] == source and genomes.target[row, gene] == target:
            return True
    return False


@inlined
def closes_cycle(genomes, row, source, target, reached):
    """Whether a link from `source` to `target` would close a cycle, disabled genes counted.

    `reached` is room for the ids of nodes: one more than the row has genes is always enough.
    """
    if source == target:
        return True
    n_reached = 1
    reached[0] = target
    at = 0
    while at < n_reached:
        node = reached[at]
        at += 1
        for gene in range(genomes.n_connections[row]):
            if genomes.source[row, gene] != node:
                continue
            onward = genomes.target[row, gene]
            if onward == source:
                return True
            known = False
            for k in range(n_reached):
                if reached[k] == onward:
                    known = True
                    break
            if not known:
                reached[n_reached] = onward
                n_reached += 1
    return False


ENABLED = np.bool_(True)


@inlined
def insert_gene(genomes, row, innovation, source, target, weight, enabled):
    """Put a connection gene where its innovation number belongs; sets `full` where there is no room."""
    gene = genomes.n_connections[row]
    if gene == genomes.innovation.shape[1]:
        genomes.full[0] = True
        return
    while gene > 0 and genomes.innovation[row, gene - 1] > innovation:
        genomes.innovation[row, gene] = genomes.innovation[row, gene - 1]
        genomes.source[row, gene] = genomes.source[row, gene - 1]
        genomes.target[row, gene] = genomes.target[row, gene - 1]
        genomes.weight[row, gene] = genomes.weight[row, gene - 1]
        genomes.enabled[row, gene] = genomes.enabled[row, gene - 1]
        gene -= 1
    genomes.innovation[row, gene] = innovation
    genomes.source[row, gene] = source
    genomes.target[row, gene] = target
    genomes.weight[row, gene] = weight
    genomes.enabled[row, gene] = enabled
    genomes.n_connections[row] += 1


@inlined
def insert_hidden(genomes, row, node, bias):
    """Put a hidden node where its id belongs, unless the genome has it; sets `full` where there is no room."""
    outputs = genomes.bias.shape[1] - genomes.hidden.shape[1]
    n = genomes.n_hidden[row]
    for k in range(n):
        if genomes.hidden[row, k] == node:
            return
    if n == genomes.hidden.shape[1]:
        genomes.full[0] = True
        return
    place = n
    while place > 0 and genomes.hidden[row, place - 1] > node:
        genomes.hidden[row, place] = genomes.hidden[row, place - 1]
        genomes.bias[row, outputs + place] = genomes.bias[row, outputs + place - 1]
        place -= 1
    genomes.hidden[row, place] = node
    genomes.bias[row, outputs + place] = bias
    genomes.n_hidden[row] += 1


@inlined
def node_bias_of(genomes, row, rules, node):
    """The bias of an output or hidden node; 0 where the genome lacks the node."""
    if node < rules.n_inputs + rules.n_outputs:
        return genomes.bias[row, node - rules.n_inputs]
    for k in range(genomes.n_hidden[row]):
        if genomes.hidden[row, k] == node:
            return genomes.bias[row, rules.n_outputs + k]
    return 0.0


@inlined
def has_node(genomes, row, rules, node):
    """Whether a genome has a node; inputs and outputs are in every genome."""
    if node < rules.n_inputs + rules.n_outputs:
        return True
    for k in range(genomes.n_hidden[row]):
        if genomes.hidden[row, k] == node:
            return True
    return False
