"""Trials of the platform `sim` for fits: commands given one by one, or networks, in lanes, every step kept.

The physics is that of `trial.py`. What is new: many trials get the same commands, and a robot may be put back, before
a step, to where it was seen then, while its wheels, its queue of commands and its averages go on.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import kernel, stage
from realitygap.kernels.math.bits import shift_left
from realitygap.kernels.math.elementary import sin_cos_of_turns
from realitygap.kernels.math.lanes import LANES, words_of
from realitygap.kernels.neat.wiring import think, wire
from realitygap.kernels.tasks.marks import mark_line, place_line

from .contact import settle
from .drive import drive, take_answers, take_commands
from .lanes import start_block
from .senses import feel_motion
from .trial import observe, sense


class Rehearsed(NamedTuple):
    """The steps of n trials; row 0 is the start. Arrays of no rows record nothing."""

    poses: NDArray[
        np.floating
    ]  # (t + 1, 3, n) x, y [m from the origin], heading [turns], before any putting back
    readings: NDArray[np.floating]  # (t + 1, s, n) of the range sensors, 0..1
    stalled: NDArray[np.bool_]  # (t + 1, n)
    wheels: NDArray[np.floating]  # (t + 1, 2, n) as encoders tell it, or true where the robot has none [m]
    commands: NDArray[np.floating]  # (t, 2, n)
    cells: NDArray[np.bool_]  # (n, c) those on the line


@kernel
def _keep_pose(kept, lanes, first, n_lanes, row):
    if row < kept.poses.shape[0]:
        for lane in range(n_lanes):
            kept.poses[row, 0, first + lane] = lanes.pose.x[lane]
            kept.poses[row, 1, first + lane] = lanes.pose.y[lane]
            kept.poses[row, 2, first + lane] = lanes.pose.heading[lane]


@kernel
def _keep_senses(shape, kept, lanes, first, n_lanes, row):
    if row < kept.readings.shape[0]:
        for s in range(kept.readings.shape[1]):
            for lane in range(n_lanes):
                kept.readings[row, s, first + lane] = lanes.readings[s, lane]
    if row < kept.stalled.shape[0]:
        for lane in range(n_lanes):
            kept.stalled[row, first + lane] = lanes.stalled[lane] > 0
    if row < kept.wheels.shape[0]:
        for w in range(2):
            for lane in range(n_lanes):
                kept.wheels[row, w, first + lane] = (
                    lanes.senses.counted[w, lane] if shape.encoders else lanes.wheels[w, lane]
                )


@kernel
def _keep_commands(kept, lanes, first, n_lanes, step):
    if step < kept.commands.shape[0]:
        for k in range(2):
            for lane in range(n_lanes):
                kept.commands[step, k, first + lane] = lanes.commands[k, lane]


@kernel
def _keep_cells(shape, lanes, first, n_lanes, cells):
    words = words_of(shape.columns)
    for row in range(shape.rows):
        for column in range(shape.columns):
            bit = shift_left(np.uint32(1), np.uint32(column & 31))
            for lane in range(n_lanes):
                there = lanes.visited[row * words + (column >> 5), lane] & bit
                cells[first + lane, shape.columns * row + column] = there != 0


@kernel
def _hear(commands, tried, lanes, first, n_lanes, step):
    """The commands of a step into the lanes' first two spare rows."""
    for lane in range(LANES):
        trial = tried[first + min(lane, n_lanes - 1)]
        lanes.spare[0, lane] = commands[step, 0, trial]
        lanes.spare[1, lane] = commands[step, 1, trial]


@kernel
def _put_back(anchors, tried, grid, lanes, first, n_lanes, row):
    """Put robots to where they were seen before a step; a place that is no number leaves them where they are."""
    was, line = lanes.senses.was, lanes.line
    for lane in range(LANES):
        trial = tried[first + min(lane, n_lanes - 1)]
        x, y, heading = anchors[row, 0, trial], anchors[row, 1, trial], anchors[row, 2, trial]
        if x == x:
            sine, cosine = sin_cos_of_turns(heading)
            lanes.pose.x[lane] = x
            lanes.pose.y[lane] = y
            lanes.pose.heading[lane] = heading
            lanes.pose.sine[lane] = sine
            lanes.pose.cosine[lane] = cosine
            was[0, lane] = sine
            was[1, lane] = cosine
            was[2, lane] = x
            was[3, lane] = y
            line.to_u[lane] = grid[0] + x * grid[2]
            line.to_v[lane] = grid[1] + y * grid[2]


@stage
def _arrive(shape, rules, lanes):
    place_line(rules.grid, lanes.pose.x, lanes.pose.y, lanes.line)
    mark_line(
        lanes.line, rules.grid[3], shape.columns, shape.rows, lanes.words, lanes.visited, lanes.fresh,
        lanes.any_fresh,
    )  # fmt: skip


@kernel
def rehearse(shape, table, rules, neat, networks, which, commands, tried, anchors, key, counters, room, kept):
    """Run n trials, one block after the other.

    Args:
        shape: Structure of robot and arena, `SimShape`.
        table: (p, n) their numbers, a column for each trial.
        rules: `SimRules`.
        neat, networks: How networks are activated, and the networks, at least one.
        which: (n,) int32, the network of each trial.
        commands: (t, 2, k) move and turn; of no rows where networks drive.
        tried: (n,) int32, which of the k each trial is of.
        anchors: (t + 1, 3, k) where robots are put back to before a step: x, y [m from the origin], heading [turns],
            x not a number for nowhere; of no rows for never.
        key: uint64, of the random numbers.
        counters: (n, 3) uint32, the fixed words of each trial's random numbers, with the purpose NOISE.
        room: `SimRoom`.
        kept: `Rehearsed`, written.
    """
    lanes = room.lanes
    driven = commands.shape[0] == 0
    for first in range(0, tried.size, LANES):
        n_lanes = min(LANES, tried.size - first)
        if driven:
            wire(networks, which, first, n_lanes, neat, room.wiring)
        start_block(shape, rules, table, counters, first, n_lanes, lanes)
        for step in range(-1, rules.n_steps):
            if step >= 0:
                if driven:
                    observe(shape, rules, lanes, step)
                    think(room.wiring, neat, lanes.values, lanes.before, lanes.total)
                    take_answers(neat, lanes)
                else:
                    _hear(commands, tried, lanes, first, n_lanes, step)
                    take_commands(lanes.spare[0], lanes.spare[1], lanes)
                _keep_commands(kept, lanes, first, n_lanes, step)
                drive(shape, rules, key, lanes, step)
                settle(shape, lanes, room.near)
                feel_motion(shape, rules, key, lanes, step)
            _arrive(shape, rules, lanes)
            _keep_pose(kept, lanes, first, n_lanes, step + 1)
            if anchors.shape[0] > 0:
                _put_back(anchors, tried, rules.grid, lanes, first, n_lanes, step + 1)
            sense(shape, rules, key, lanes, step + 1)
            _keep_senses(shape, kept, lanes, first, n_lanes, step + 1)
        _keep_cells(shape, lanes, first, n_lanes, kept.cells)
