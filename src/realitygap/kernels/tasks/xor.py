"""XOR, the first task of Stanley & Miikkulainen (2002), section 4.2."""

from __future__ import annotations

from realitygap.kernels.compile.decorators import kernel
from realitygap.kernels.neat.network import IDENTITY, TANH, activate


@kernel
def unit_output(values, rules):
    """The first output as a number in 0..1, whatever the activation: tanh is stretched to it, identity cut off."""
    value = values[rules.n_inputs]
    if rules.activation == TANH:
        return 0.5 * (value + 1.0)
    if rules.activation == IDENTITY:
        return min(max(value, 0.0), 1.0)
    return value


@kernel
def try_xor(networks, row, rules, bias_value, values, before):
    """Fitness (4 - sum of errors) squared of a network, and whether all four answers lie right of one half.

    Args:
        networks, row: Which network; two inputs and, where `rules.bias_input` is 2, a constant one.
        rules: NEAT's rates and choices; feed-forward.
        bias_value: Of the constant input.
        values, before: (m,) room for activations.
    """
    errors = 0.0
    right = True
    for case in range(4):
        a = case // 2
        b = case % 2
        values[0] = a
        values[1] = b
        if rules.bias_input >= 0:
            values[rules.bias_input] = bias_value
        activate(networks, row, rules, values, before)
        output = unit_output(values, rules)
        if a != b:
            errors += 1.0 - output
            right = right and output > 0.5
        else:
            errors += output
            right = right and output < 0.5
    return (4.0 - errors) * (4.0 - errors), right
