"""From commands to motion, in lanes."""

from __future__ import annotations

import numpy as np

from ._compile import stage
from ._lanes import LANES
from ._math import TWO_PI, sin_cos_of_turns
from ._trial import as_command


@stage
def _take(command, kept):
    for lane in range(LANES):
        kept[lane] = as_command(command[lane])


@stage
def take_commands(move, turn, lanes):
    """Keep the commands of a step, limited to -1..1."""
    _take(move, lanes.commands[0])
    _take(turn, lanes.commands[1])


@stage
def _straight_then_turn(length, turn, pose, proposed):
    x, y, heading, sine, cosine = pose.x, pose.y, pose.heading, pose.sine, pose.cosine
    to_x, to_y, to_heading = proposed.x, proposed.y, proposed.heading
    to_sine, to_cosine = proposed.sine, proposed.cosine
    real = x.dtype.type
    for lane in range(LANES):
        to_x[lane] = x[lane] + length[lane] * cosine[lane]
        to_y[lane] = y[lane] + length[lane] * sine[lane]
        turned = heading[lane] + turn[lane]
        turned = turned - np.floor(turned + real(0.5))
        to_heading[lane] = turned
        sine_now, cosine_now = sin_cos_of_turns(turned)
        to_sine[lane] = sine_now
        to_cosine[lane] = cosine_now


@stage
def _plain(move, turn, speed, turn_rate, track, step_s, left, right, length, angle):
    real = move.dtype.type
    seconds = real(step_s)
    for lane in range(LANES):
        forward = move[lane] * speed[lane] * seconds
        turned = turn[lane] * turn_rate[lane] * seconds
        half = real(0.5 * TWO_PI) * track[lane] * turned
        length[lane] = forward
        angle[lane] = turned
        left[lane] = left[lane] + (forward - half)
        right[lane] = right[lane] + (forward + half)


@stage
def drive(shape, rules, key, lanes, step):
    """Where the commands of a step would carry the robots, if nothing is in the way.

    Args:
        shape, rules, key: Structure, how trials are run, and of the random numbers.
        lanes: Commands, numbers and state are read; state, `moved` and `proposed` written.
        step: Number of the step.
    """
    p, d = lanes.p, shape.row_drive
    _plain(
        lanes.commands[0], lanes.commands[1], p[d], p[d + 3], p[d + 1], rules.step_s,
        lanes.wheels[0], lanes.wheels[1], lanes.moved[0], lanes.moved[1],
    )  # fmt: skip
    _straight_then_turn(lanes.moved[0], lanes.moved[1], lanes.pose, lanes.proposed)
