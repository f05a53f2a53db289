"""Trials of several robots of the platform `sim` in one arena, in lanes: lane k of each robot is of the same trial.

A step is that of `trial.py`. In it robots move one after the other, in order, each among the others where they are at
that moment. Then all sensors answer. All robots mark the same cells.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import kernel
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.math.stack import member_of
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
from .drive import drive, take_answers
from .lanes import SimRoom, SimRules, SimTrace, start_block
from .outline import place_obstacle
from .senses import feel_motion
from .shape import SimShape
from .trial import _keep_answers, _keep_state, observe, sense

_shape_of = member_of(SimShape)
_rules_of = member_of(SimRules)
_room_of = member_of(SimRoom)
_trace_of = member_of(SimTrace)


class Team(NamedTuple):
    """The r robots of an arena; each is simulated from its own origin."""

    shapes: SimShape  # stacked: the others' outlines are the last obstacles of each
    rules: SimRules  # stacked
    origins: NDArray[np.float64]  # (r, 2) [m]
    first_other: int  # number of the obstacle that is the first of the others
    parts: int  # of the outline of a robot


@kernel
def _meet(team, shape, rooms, robot):
    """Put the others where they are now, in the trials of a robot."""
    p = rooms.lanes.p[robot]
    pose, origins = rooms.lanes.pose, team.origins
    real = p.dtype.type
    number = team.first_other
    for other in range(origins.shape[0]):
        if other != robot:
            for _ in range(team.parts):
                row = shape.row_obstacle[number]
                for lane in range(LANES):
                    x = origins[other, 0] + float(pose.x[other, lane])
                    y = origins[other, 1] + float(pose.y[other, lane])
                    p[row, lane] = real(x - origins[robot, 0])
                    p[row + 1, lane] = real(y - origins[robot, 1])
                    p[row + 2, lane] = pose.heading[other, lane]
                number += 1


@kernel
def _place_others(team, shape, lanes):
    for number in range(team.first_other, shape.row_obstacle.size):
        place_obstacle(shape, lanes, number)


@kernel
def _run_block(team, tables, neat, key, counters, first, n_lanes, rooms, cells, counts, trace):
    n_robots = team.origins.shape[0]
    keep = trace.stalled.shape[1] > 0 and first < trace.stalled.shape[2]
    visited, ends, n_line = rooms.lanes.visited[0], rooms.lanes.ends[0], rooms.lanes.n_line[0]
    for robot in range(n_robots):
        shape, rules, room = (
            _shape_of(team.shapes, robot),
            _rules_of(team.rules, robot),
            _room_of(rooms, robot),
        )
        start_block(shape, rules, tables[robot], counters[robot], first, n_lanes, room.lanes)
    for step in range(-1, team.rules.n_steps):
        for robot in range(n_robots):
            shape, rules, room = (
                _shape_of(team.shapes, robot),
                _rules_of(team.rules, robot),
                _room_of(rooms, robot),
            )
            lanes = room.lanes
            if step >= 0:
                observe(shape, rules, lanes, step)
                think(room.wiring, neat, lanes.values, lanes.before, lanes.total)
                take_answers(neat, lanes)
                if keep:
                    _keep_answers(_trace_of(trace, robot), lanes, neat, first, n_lanes, step)
                _meet(team, shape, rooms, robot)
                _place_others(team, shape, lanes)
                drive(shape, rules, key, lanes, step)
                settle(shape, lanes, room.near)
                feel_motion(shape, rules, key, lanes, step)
            place_line(rules.grid, lanes.pose.x, lanes.pose.y, lanes.line)
            mark_line(
                lanes.line, rules.grid[3], shape.columns, shape.rows, lanes.words, visited, lanes.fresh,
                lanes.any_fresh,
            )  # fmt: skip
            mark_ends(lanes.line, shape.columns, shape.rows, ends)
            list_fresh(
                lanes.line, shape.columns, shape.rows, lanes.fresh, lanes.any_fresh, n_lanes, cells, first, n_line
            )  # fmt: skip
        for robot in range(n_robots):
            shape, rules, room = (
                _shape_of(team.shapes, robot),
                _rules_of(team.rules, robot),
                _room_of(rooms, robot),
            )
            if step >= 0:
                _meet(team, shape, rooms, robot)
                _place_others(team, shape, room.lanes)
            sense(shape, rules, key, room.lanes, step + 1)
            if keep:
                _keep_state(_trace_of(trace, robot), room.lanes, first, n_lanes, step + 1)
    for lane in range(n_lanes):
        counts[first + lane, 0] = n_line[lane]
        counts[first + lane, 1] = count_cells(ends, lane)
        counts[first + lane, 2] = 0
        for robot in range(n_robots):
            counts[first + lane, 2] += rooms.lanes.n_stalls[robot, lane]


@kernel
def run_team_trials(
    team, tables, neat, networks, which, key, counters, rooms, cells, ends, ended, counts, trace
):
    """Run n trials of r robots, a block after the other.

    Args:
        team: `Team`.
        tables: (r, p, n) the numbers of each robot and its surroundings, or (r, p, 1) for all trials.
        neat, networks: How networks are activated, and the networks, at least one.
        which: (r, n) int32, the network of each robot.
        key: uint64, of the random numbers.
        counters: (r, n, 3) uint32, the fixed words of each robot's random numbers, with the purpose NOISE.
        rooms: `SimRoom`, stacked.
        cells: (n, c) uint8, written: cells visited by any robot along its line, in order of first visit.
        ends: (n, c) uint8, written: cells at the ends of steps of any robot, in ascending order; (0, c) keeps none.
        ended: (n, 2) float64, written: where the first robot ended [m from its origin].
        counts: (n, 3) int32, written: cells along the lines, cells at the ends of steps, and stalled steps of all.
        trace: `SimTrace`, stacked; arrays of no rows keep nothing.
    """
    n = which.shape[1]
    for first in range(0, n, LANES):
        n_lanes = min(LANES, n - first)
        for robot in range(which.shape[0]):
            wire(networks, which[robot], first, n_lanes, neat, _room_of(rooms, robot).wiring)
        _run_block(team, tables, neat, key, counters, first, n_lanes, rooms, cells, counts, trace)
        for lane in range(n_lanes):
            ended[first + lane, 0] = rooms.lanes.pose.x[0, lane]
            ended[first + lane, 1] = rooms.lanes.pose.y[0, lane]
            if ends.shape[0] > 0:
                list_cells(
                    rooms.lanes.ends[0], lane, team.shapes.columns, team.shapes.rows, ends[first + lane]
                )
