"""Crossover by innovation numbers (EC02, section 3.2)."""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import inlined

from .genome import closes_cycle, has_link, has_node, insert_gene, insert_hidden, next_uniform, node_bias_of


@inlined
def _enabled_in_child(rules, everywhere, chosen, stream, cursor):
    """Whether an inherited gene is on: `everywhere`, in all parents that have it; `chosen`, in the one taken."""
    if everywhere:
        return True
    if next_uniform(stream, cursor) < rules.stay_disabled:
        return False
    return chosen if rules.disabled_bit_inherited else True


@inlined
def _mixed_bias(old, a, b, rules, node, average, stream, cursor):
    """The bias of a child's node: from the parent that has it; from either, or the mean, where both do."""
    in_a = has_node(old, a, rules, node)
    in_b = has_node(old, b, rules, node)
    if in_a and in_b:
        bias_a = node_bias_of(old, a, rules, node)
        bias_b = node_bias_of(old, b, rules, node)
        if average:
            return 0.5 * (bias_a + bias_b)
        return bias_a if next_uniform(stream, cursor) < 0.5 else bias_b
    return node_bias_of(old, a if in_a else b, rules, node)


@inlined
def crossover(old, a, b, fitness, rules, new, row, stream, cursor, reached):
    """Write a child of the individuals `a` and `b` of `old` into a row of `new`.

    Matching genes come from either parent; disjoint and excess ones from the fitter, or by coin from both
    (or from the smaller) where both are equally fit. A gene is left out when the child already joins the
    same two nodes under another number, or when it would close a cycle in a feed-forward network: a mixture
    of two parents can do both.
    """
    from_a = 1.0
    from_b = 0.0
    if fitness[b] > fitness[a]:
        from_a = 0.0
        from_b = 1.0
    elif fitness[b] == fitness[a]:
        if rules.equal_parents_mix:
            from_a = 0.5
            from_b = 0.5
        elif old.n_connections[b] < old.n_connections[a]:
            from_a = 0.0
            from_b = 1.0
    mixed = from_a == 0.5
    average = next_uniform(stream, cursor) < rules.average_weights
    new.n_connections[row] = 0
    new.n_hidden[row] = 0
    first_hidden = rules.n_inputs + rules.n_outputs
    i = 0
    j = 0
    while i < old.n_connections[a] or j < old.n_connections[b]:
        in_a = i < old.n_connections[a] and (
            j >= old.n_connections[b] or old.innovation[a, i] <= old.innovation[b, j]
        )
        in_b = j < old.n_connections[b] and (
            i >= old.n_connections[a] or old.innovation[b, j] <= old.innovation[a, i]
        )
        if in_a and in_b:
            take_a = next_uniform(stream, cursor) < 0.5
            parent, gene = (a, i) if take_a else (b, j)
            weight = 0.5 * (old.weight[a, i] + old.weight[b, j]) if average else old.weight[parent, gene]
            everywhere = old.enabled[a, i] and old.enabled[b, j]
            i += 1
            j += 1
        else:
            if in_a:
                parent, gene, share = a, i, from_a
                i += 1
            else:
                parent, gene, share = b, j, from_b
                j += 1
            if share == 0.0 or (share < 1.0 and next_uniform(stream, cursor) >= share):
                continue
            weight = old.weight[parent, gene]
            everywhere = old.enabled[parent, gene]
        enabled = _enabled_in_child(rules, everywhere, old.enabled[parent, gene], stream, cursor)
        source = old.source[parent, gene]
        target = old.target[parent, gene]
        if has_link(new, row, source, target):
            continue
        if (
            mixed
            and not rules.recurrent
            and source >= first_hidden
            and target >= first_hidden
            and closes_cycle(new, row, source, target, reached)
        ):
            continue
        insert_gene(new, row, old.innovation[parent, gene], source, target, weight, enabled)
        if source >= first_hidden:
            insert_hidden(new, row, source, 0.0)
        if target >= first_hidden:
            insert_hidden(new, row, target, 0.0)
    for node in range(rules.n_outputs + new.n_hidden[row]):
        if rules.node_bias:
            identity = np.int32(rules.n_inputs + node)
            if node >= rules.n_outputs:
                identity = new.hidden[row, node - rules.n_outputs]
            new.bias[row, node] = _mixed_bias(old, a, b, rules, identity, average, stream, cursor)
        else:
            new.bias[row, node] = 0.0
