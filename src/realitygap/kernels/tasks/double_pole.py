"""Two poles on a cart, with and without velocities as inputs (Stanley & Miikkulainen 2002, section 4.3).

The equations are Wieland's (1991), the constants those of Stanley's own release: x is the cart's place [m], v
its speed [m/s], a and w the angle from upright [rad] and angular speed [rad/s] of the long pole (1) and the
short one (2). An action lasts two Runge-Kutta steps of 0.01 s.
"""

from __future__ import annotations

import math

from realitygap.kernels.compile.decorators import kernel
from realitygap.kernels.math.elementary import sin_cos
from realitygap.kernels.neat.network import activate

from .xor import unit_output

GRAVITY = 9.8  # m/s^2
CART_MASS = 1.0  # kg
MASS_1 = 0.1  # kg
MASS_2 = 0.01  # kg
HALF_LENGTH_1 = 0.5  # m
HALF_LENGTH_2 = 0.05  # m
HINGE_FRICTION = 2e-6  # N m s
LARGEST_FORCE = 10.0  # N

STEP = 0.01  # s
STEPS_PER_ACTION = 2

TRACK = 2.4  # m, either side
LARGEST_ANGLE = 36.0 * math.pi / 180.0
FIRST_ANGLE = 0.07  # rad, of the long pole; all else begins at zero

# What inputs are divided by: half of the track twice over, about 30 degrees, and speeds that are seldom passed.
PLACE_SCALE = 4.8
ANGLE_SCALE = 0.52
SPEED_SCALE = 2.0

LONG_TRIAL = 100_000  # actions
SHORT_TRIAL = 1_000
SHAKE_ACTIONS = 100  # the last of a short trial, over which the shaking is summed

# Starts of the generalization test: these shares of the ranges below, in four variables.
N_SHARES = 5
SHARES = (0.05, 0.25, 0.5, 0.75, 0.95)
RANGE_X = 2.16  # either side
RANGE_V = 1.35
RANGE_A1 = 0.06283152
RANGE_W1 = 0.15009752
N_STARTS = N_SHARES**4
ENOUGH_STARTS = 200


@kernel
def accelerations(force, a1, w1, a2, w2):
    """Return the accelerations of the cart [m/s^2] and of the two poles [rad/s^2] under a force [N]."""
    sin_1, cos_1 = sin_cos(a1)
    sin_2, cos_2 = sin_cos(a2)
    fall_1 = HINGE_FRICTION * w1 / (MASS_1 * HALF_LENGTH_1) - GRAVITY * sin_1
    fall_2 = HINGE_FRICTION * w2 / (MASS_2 * HALF_LENGTH_2) - GRAVITY * sin_2
    force_1 = MASS_1 * (HALF_LENGTH_1 * w1 * w1 * sin_1 + 0.75 * cos_1 * fall_1)
    force_2 = MASS_2 * (HALF_LENGTH_2 * w2 * w2 * sin_2 + 0.75 * cos_2 * fall_2)
    mass = CART_MASS + MASS_1 * (1.0 - 0.75 * cos_1 * cos_1) + MASS_2 * (1.0 - 0.75 * cos_2 * cos_2)
    cart = (force + force_1 + force_2) / mass
    pole_1 = -0.75 * (cart * cos_1 + fall_1) / HALF_LENGTH_1
    pole_2 = -0.75 * (cart * cos_2 + fall_2) / HALF_LENGTH_2
    return cart, pole_1, pole_2


@kernel
def cart_step(force, step, x, v, a1, w1, a2, w2):
    """The six variables one Runge-Kutta step [s] of fourth order later."""
    half = 0.5 * step
    p1, q1, r1 = accelerations(force, a1, w1, a2, w2)
    v2, w12, w22 = v + half * p1, w1 + half * q1, w2 + half * r1
    p2, q2, r2 = accelerations(force, a1 + half * w1, w12, a2 + half * w2, w22)
    v3, w13, w23 = v + half * p2, w1 + half * q2, w2 + half * r2
    p3, q3, r3 = accelerations(force, a1 + half * w12, w13, a2 + half * w22, w23)
    v4, w14, w24 = v + step * p3, w1 + step * q3, w2 + step * r3
    p4, q4, r4 = accelerations(force, a1 + step * w13, w14, a2 + step * w23, w24)
    sixth = step / 6.0
    return (
        x + sixth * (v + 2.0 * (v2 + v3) + v4),
        v + sixth * (p1 + 2.0 * (p2 + p3) + p4),
        a1 + sixth * (w1 + 2.0 * (w12 + w13) + w14),
        w1 + sixth * (q1 + 2.0 * (q2 + q3) + q4),
        a2 + sixth * (w2 + 2.0 * (w22 + w23) + w24),
        w2 + sixth * (r1 + 2.0 * (r2 + r3) + r4),
    )


@kernel
def balance(networks, row, rules, bias_value, velocities, most, start, values, before, shaking):
    """Return the number of actions for which a network keeps the cart on its track and both poles up, at most `most`.

    Args:
        networks, row: Which network; six inputs with velocities, else three, and perhaps a constant one.
        rules: NEAT's rates and choices.
        bias_value: Of the constant input.
        velocities: Whether the network is told the speeds.
        most: Actions after which the trial ends.
        start: Four numbers: x, v, a1 and w1 at the start; the short pole stands.
        values, before: (m,) room for activations, which begin at zero.
        shaking: (SHAKE_ACTIONS,) written: |x| + |v| + |a1| + |w1| after the last actions, in turn.
    """
    x, v, a1, w1 = start
    a2 = 0.0
    w2 = 0.0
    for k in range(values.size):
        values[k] = 0.0
    for action in range(most):
        if velocities:
            values[0] = x / PLACE_SCALE
            values[1] = v / SPEED_SCALE
            values[2] = a1 / ANGLE_SCALE
            values[3] = w1 / SPEED_SCALE
            values[4] = a2 / ANGLE_SCALE
            values[5] = w2 / SPEED_SCALE
        else:
            values[0] = x / PLACE_SCALE
            values[1] = a1 / ANGLE_SCALE
            values[2] = a2 / ANGLE_SCALE
        if rules.bias_input >= 0:
            values[rules.bias_input] = bias_value
        activate(networks, row, rules, values, before)
        force = (2.0 * unit_output(values, rules) - 1.0) * LARGEST_FORCE
        for _ in range(STEPS_PER_ACTION):
            x, v, a1, w1, a2, w2 = cart_step(force, STEP, x, v, a1, w1, a2, w2)
        if abs(x) > TRACK or abs(a1) > LARGEST_ANGLE or abs(a2) > LARGEST_ANGLE:
            return action
        shaking[action % SHAKE_ACTIONS] = abs(x) + abs(v) + abs(a1) + abs(w1)
    return most


@kernel
def first_start():
    """Return the start of every trial except those of the generalization test."""
    return 0.0, 0.0, FIRST_ANGLE, 0.0


@kernel
def gruau_fitness(actions, shaking):
    """0.1 f1 + 0.9 f2: the share of a short trial that was balanced, and how still it was at the end.

    f2 is 0.75 over the shaking summed over the last 100 actions, 0 where there were no more than 100.
    """
    fitness = 0.1 * actions / SHORT_TRIAL
    if actions > SHAKE_ACTIONS:
        total = 0.0
        for k in range(SHAKE_ACTIONS):
            total += shaking[k]
        # At rest, exactly, the quotient has no bound.
        fitness += 0.9 * 0.75 / max(total, 1e-9)
    return fitness


@kernel
def generalization(networks, row, rules, bias_value, values, before, shaking):
    """From how many of the 625 starts a network balances for 1,000 actions, told no velocities."""
    passed = 0
    for i in range(N_STARTS):
        start = (
            (2.0 * SHARES[i // 125] - 1.0) * RANGE_X,
            (2.0 * SHARES[i // 25 % 5] - 1.0) * RANGE_V,
            (2.0 * SHARES[i // 5 % 5] - 1.0) * RANGE_A1,
            (2.0 * SHARES[i % 5] - 1.0) * RANGE_W1,
        )
        actions = balance(
            networks, row, rules, bias_value, False, SHORT_TRIAL, start, values, before, shaking
        )
        if actions == SHORT_TRIAL:
            passed += 1
    return passed
