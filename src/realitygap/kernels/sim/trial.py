"""Trials of the platform `sim`: networks, robots of any outline, contact, noisy drives and sensors, in lanes.

A step: the sensors answer, the networks think, the drive proposes a motion, contact says what comes of it, and
the cells on the way are marked. Positions are from the origin of the table, headings in whole turns.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import kernel, shared_stage, stage
from realitygap.kernels.math.bits import unmasked
from realitygap.kernels.math.lanes import LANES, copy_row, fill
from realitygap.kernels.math.philox import FIRST
from realitygap.kernels.neat.wiring import think, wire
from realitygap.kernels.tasks.marks import (
    count_cells,
    list_cells,
    list_fresh,
    mark_ends,
    mark_line,
    place_line,
)

from .contact import settle
from .drive import drive, take_answers, take_commands
from .encoders import as_input
from .goal import see_goal_distance, see_goal_sector
from .lanes import start_block
from .rays import cast_rays
from .senses import answer, feel_motion
from .shape import (
    BIAS,
    ENCODER,
    GOAL_DISTANCE,
    GOAL_SECTOR,
    LAST_MOVE,
    LAST_TURN,
    OBSTACLE,
    READING,
    STALL,
    TIME,
)


@shared_stage
def sense(shape, rules, key, lanes, step):
    """Compute the readings of the sensors before a step, with noise, into `lanes.readings`."""
    cast_rays(shape, lanes)
    answer(shape, rules, key, lanes, step)


@stage
def _larger(reading, value):
    for lane in range(LANES):
        one = reading[lane]
        largest = unmasked(value[lane])
        value[lane] = one if one > largest else largest


@stage
def observe(shape, rules, lanes, step):
    """Write what the networks see before a step to the first of `lanes.values`."""
    real = lanes.low.dtype.type
    goal, start = shape.row_goal, shape.row_start
    for i in range(shape.inputs.shape[0]):
        kind, index, value = shape.inputs[i, 0], shape.inputs[i, 1], lanes.values[i]
        if kind == OBSTACLE:
            fill(value, real(-np.inf))
            for s in range(shape.row_range.size):
                _larger(lanes.readings[s], value)
        elif kind == TIME:
            fill(value, real(step) / real(rules.n_steps))
        elif kind == BIAS:
            fill(value, real(rules.bias_value))
        elif kind == STALL:
            copy_row(lanes.stalled, value)
        elif kind == READING:
            copy_row(lanes.readings[index], value)
        elif kind == ENCODER:
            as_input(lanes.senses.counted_step[index], lanes.p[shape.row_drive], rules.step_s, value)
        elif kind == GOAL_SECTOR:
            see_goal_sector(lanes.p[goal], lanes.p[goal + 1], index, lanes.pose, value)
        elif kind == GOAL_DISTANCE:
            see_goal_distance(
                lanes.p[goal], lanes.p[goal + 1], lanes.p[start], lanes.p[start + 1], lanes.pose, value
            )
        elif kind == LAST_MOVE:
            copy_row(lanes.commands[0], value)
        elif kind == LAST_TURN:
            copy_row(lanes.commands[1], value)


@stage
def arrive(shape, rules, lanes):
    """Mark the cells on the way to where the robots are now."""
    place_line(rules.grid, lanes.pose.x, lanes.pose.y, lanes.line)
    mark_line(
        lanes.line, rules.grid[3], shape.columns, shape.rows, lanes.words, lanes.visited, lanes.fresh,
        lanes.any_fresh,
    )  # fmt: skip
    mark_ends(lanes.line, shape.columns, shape.rows, lanes.ends)


@kernel
def _list(shape, lanes, n_lanes, cells, first):
    list_fresh(
        lanes.line,
        shape.columns,
        shape.rows,
        lanes.fresh,
        lanes.any_fresh,
        n_lanes,
        cells,
        first,
        lanes.n_line,
    )


@kernel
def _keep_state(trace, lanes, first, n_lanes, step):
    for lane in range(min(n_lanes, trace.stalled.shape[1] - first)):
        k = first + lane
        trace.poses[step, 0, k] = lanes.pose.x[lane]
        trace.poses[step, 1, k] = lanes.pose.y[lane]
        trace.poses[step, 2, k] = lanes.pose.heading[lane]
        trace.stalled[step, k] = lanes.stalled[lane] > 0
        for w in range(2):
            trace.wheels[step, w, k] = lanes.wheels[w, lane]
        for s in range(trace.readings.shape[1]):
            trace.readings[step, s, k] = lanes.readings[s, lane]
        for s in range(trace.distances.shape[1]):
            trace.distances[step, s, k] = lanes.senses.near[s, lane]


@kernel
def _keep_answers(trace, lanes, neat, first, n_lanes, step):
    for lane in range(min(n_lanes, trace.stalled.shape[1] - first)):
        k = first + lane
        for i in range(neat.n_inputs):
            trace.inputs[step, i, k] = lanes.values[i, lane]
        trace.commands[step, 0, k] = lanes.commands[0, lane]
        trace.commands[step, 1, k] = lanes.commands[1, lane]


@kernel
def _run_block(shape, table, rules, neat, key, counters, first, n_lanes, room, cells, counts, trace):
    lanes = room.lanes
    keep = trace.stalled.shape[0] > 0 and first < trace.stalled.shape[1]
    start_block(shape, rules, table, counters, first, n_lanes, lanes)
    for step in range(-1, rules.n_steps):
        if step >= 0:
            observe(shape, rules, lanes, step)
            think(room.wiring, neat, lanes.values, lanes.before, lanes.total)
            take_answers(neat, lanes)
            if keep:
                _keep_answers(trace, lanes, neat, first, n_lanes, step)
            drive(shape, rules, key, lanes, step)
            settle(shape, lanes, room.near)
            feel_motion(shape, rules, key, lanes, step)
        arrive(shape, rules, lanes)
        _list(shape, lanes, n_lanes, cells, first)
        sense(shape, rules, key, lanes, step + 1)
        if keep:
            _keep_state(trace, lanes, first, n_lanes, step + 1)
    for lane in range(n_lanes):
        counts[first + lane, 0] = lanes.n_line[lane]
        counts[first + lane, 1] = count_cells(lanes.ends, lane)
        counts[first + lane, 2] = lanes.n_stalls[lane]


@kernel
def run_sim_trials(
    shape, table, rules, neat, networks, which, key, counters, room, cells, ends, ended, counts, trace
):
    """Run n trials, one block after the other.

    Args:
        shape: Structure of robot and arena, `SimShape`.
        table: (p, n) their numbers, a column for each trial, or (p, 1) one for all.
        rules: `SimRules`.
        neat, networks: How networks are activated, and the networks, at least one.
        which: (n,) int32, the network of each trial.
        key: uint64, of the random numbers.
        counters: (n, 3) uint32, the fixed words of each trial's random numbers, with the purpose NOISE.
        room: `SimRoom`.
        cells: (n, c) uint8, written: cells visited along the line, in order of first visit.
        ends: (n, c) uint8, written: cells at the ends of steps, in ascending order; (0, c) keeps none.
        ended: (n, 2) float64, written: where trials ended [m from the origin of the table].
        counts: (n, 3) int32, written: cells along the line, cells at the ends of steps (the start counts for
            both), stalled steps.
        trace: `SimTrace`; arrays of no rows keep nothing.
    """
    for first in range(0, which.size, LANES):
        n_lanes = min(LANES, which.size - first)
        wire(networks, which, first, n_lanes, neat, room.wiring)
        _run_block(shape, table, rules, neat, key, counters, first, n_lanes, room, cells, counts, trace)
        lanes = room.lanes
        for lane in range(n_lanes):
            ended[first + lane, 0] = lanes.pose.x[lane]
            ended[first + lane, 1] = lanes.pose.y[lane]
            if ends.shape[0] > 0:
                list_cells(lanes.ends, lane, shape.columns, shape.rows, ends[first + lane])


@kernel
def start_sim(shape, table, rules, key, counters, n, room, cells):
    """Put n robots, at most LANES, at their starts; their first readings are in `room.lanes.readings`.

    Arguments as in `run_sim_trials`; n columns of the table are used, or the only one.
    """
    lanes = room.lanes
    start_block(shape, rules, table, counters, FIRST, n, lanes)
    arrive(shape, rules, lanes)
    _list(shape, lanes, n, cells, 0)
    sense(shape, rules, key, lanes, 0)


@kernel
def step_sim(shape, rules, key, n, room, cells, step, commands):
    """Execute one command of each robot; the sensors' readings after it are in `room.lanes.readings`.

    A network that answers each observation drives the very trial that `run_sim_trials` gives it.

    Args:
        shape, rules, key, n, room, cells: As in `start_sim`.
        step: Number of the step, from 0 on.
        commands: (2, LANES) move and turn of each robot, limited to -1..1.
    """
    lanes = room.lanes
    take_commands(commands[0], commands[1], lanes)
    drive(shape, rules, key, lanes, step)
    settle(shape, lanes, room.near)
    feel_motion(shape, rules, key, lanes, step)
    arrive(shape, rules, lanes)
    _list(shape, lanes, n, cells, 0)
    sense(shape, rules, key, lanes, step + 1)
