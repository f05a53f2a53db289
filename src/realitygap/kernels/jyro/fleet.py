"""Many robots in parallel, each given one command a step from outside: a trial, one step at a time.

The stages are those of `trial.py`, so that robots under the commands of networks drive the trials of
`run_trials`, bit for bit. A fleet is blocks of lanes, whose states are kept; room is shared.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import inlined, kernel
from realitygap.kernels.math.lanes import LANES, Lanes, Line, Poses, make_lanes
from realitygap.kernels.tasks.marks import count_cells, list_fresh

from .trial import _larger_noisy as larger_noisy
from .trial import arrive, draw_lanes, largest_noisy_readings, move, start_lanes


class Fleet(NamedTuple):
    """The state of b blocks of robots in the course of their trials."""

    poses: NDArray[np.floating]  # (b, 5, LANES) as in `Poses`
    stalled: NDArray[np.floating]  # (b, LANES)
    n_stalls: NDArray[np.int32]  # (b, LANES)
    n_line: NDArray[np.int32]  # (b, LANES)
    fractions: NDArray[np.floating]  # (b, s, LANES)
    counters: NDArray[np.uint32]  # (b, 3, LANES)
    places: NDArray[np.floating]  # (b, 2, LANES) in grid units
    visited: NDArray[np.uint32]  # (b, words, LANES)
    ends: NDArray[np.uint32]  # (b, words, LANES)
    commands: NDArray[np.floating]  # (2, LANES) room
    work: Lanes  # room


def make_fleet(scene, n):
    """Room for n robots in a scene."""
    work = make_lanes(scene.heading, scene.sensors.shape[0], 3, scene.columns, scene.rows)
    blocks = -(-n // LANES)
    real = scene.heading.dtype
    return Fleet(
        poses=np.zeros((blocks, 5, LANES), real),
        stalled=np.zeros((blocks, LANES), real),
        n_stalls=np.zeros((blocks, LANES), np.int32),
        n_line=np.zeros((blocks, LANES), np.int32),
        fractions=np.zeros((blocks, *work.fractions.shape), real),
        counters=np.zeros((blocks, 3, LANES), np.uint32),
        places=np.zeros((blocks, 2, LANES), real),
        visited=np.zeros((blocks, *work.visited.shape), np.uint32),
        ends=np.zeros((blocks, *work.ends.shape), np.uint32),
        commands=np.zeros((2, LANES), real),
        work=work,
    )


@inlined
def _lanes_of(fleet, block):
    work = fleet.work
    poses = fleet.poses[block]
    line = work.line
    return Lanes(
        pose=Poses(poses[0], poses[1], poses[2], poses[3], poses[4]),
        proposed=work.proposed,
        low=work.low,
        stalled=fleet.stalled[block],
        n_stalls=fleet.n_stalls[block],
        step_length=work.step_length,
        step_turn=work.step_turn,
        noise=work.noise,
        sensor_range=work.sensor_range,
        fractions=fleet.fractions[block],
        rates=work.rates,
        seen=work.seen,
        counters=fleet.counters[block],
        words=work.words,
        values=work.values,
        before=work.before,
        total=work.total,
        line=Line(
            from_u=line.from_u,
            from_v=line.from_v,
            to_u=fleet.places[block, 0],
            to_v=fleet.places[block, 1],
            slope=line.slope,
            shift=line.shift,
            leftmost=line.leftmost,
            rightmost=line.rightmost,
            bottom=line.bottom,
            top=line.top,
            at_bottom=line.at_bottom,
            at_top=line.at_top,
            below=line.below,
            above=line.above,
            entry=line.entry,
        ),
        visited=fleet.visited[block],
        fresh=work.fresh,
        any_fresh=work.any_fresh,
        ends=fleet.ends[block],
        n_line=fleet.n_line[block],
    )


@kernel
def _arrive(scene, lanes, first, n_lanes, cells, counts):
    arrive(scene, lanes)
    list_fresh(
        lanes.line,
        scene.columns,
        scene.rows,
        lanes.fresh,
        lanes.any_fresh,
        n_lanes,
        cells,
        first,
        lanes.n_line,
    )
    for lane in range(n_lanes):
        counts[first + lane, 0] = lanes.n_line[lane]
        counts[first + lane, 1] = count_cells(lanes.ends, lane)
        counts[first + lane, 2] = lanes.n_stalls[lane]


@kernel
def start_robots(scene, rules, fleet, counters, cells, counts):
    """Put n robots at the start; its cell counts as visited.

    Args:
        scene, rules, fleet: Where, how, and who.
        counters: (n, 3) uint32, the fixed words of each robot's random numbers.
        cells: (n, c) uint8, written: cells along the line in order of first visit.
        counts: (n, 3) int32, written: cells along the line, cells at the ends of steps, blocked steps.
    """
    n = counts.shape[0]
    for block in range(fleet.stalled.shape[0]):
        first = block * LANES
        n_lanes = min(LANES, n - first)
        lanes = _lanes_of(fleet, block)
        start_lanes(scene, rules, counters, first, n_lanes, lanes)
        _arrive(scene, lanes, first, n_lanes, cells, counts)


@kernel
def observe_robots(rules, fleet, key, step, observations):
    """Write the inputs that the networks of all robots would have before a step.

    Args:
        rules, fleet: How, and who.
        key: Of the random numbers.
        step: Number of the step, from 0.
        observations: (n, 3) written: largest noisy reading, stall, time.
    """
    n = observations.shape[0]
    for block in range(fleet.stalled.shape[0]):
        lanes = _lanes_of(fleet, block)
        seen = lanes.total
        largest_noisy_readings(
            lanes.fractions, lanes.noise, rules.clip, step, lanes.counters, key, lanes.words, seen
        )
        for lane in range(min(LANES, n - block * LANES)):
            observations[block * LANES + lane, 0] = seen[lane]
            observations[block * LANES + lane, 1] = lanes.stalled[lane]
            observations[block * LANES + lane, 2] = seen.dtype.type(step) / seen.dtype.type(rules.n_steps)


@kernel
def read_robots(rules, fleet, key, step, readings):
    """Write each sensor's reading of all robots before a step; `observe_robots` has the largest of each robot.

    Args:
        rules, fleet: How, and who.
        key: Of the random numbers.
        step: Number of the step, from 0.
        readings: (n, s) written: 0 (nothing within range) to 1 (touching), and noise.
    """
    n, n_sensors = readings.shape
    words_a_step = (n_sensors + 3) >> 2
    for block in range(fleet.stalled.shape[0]):
        lanes = _lanes_of(fleet, block)
        one = lanes.total
        for sensor in range(n_sensors):
            draw_lanes(step * words_a_step + (sensor >> 2), lanes.counters, key, lanes.words)
            one[:] = -np.inf
            larger_noisy(lanes.fractions[sensor], lanes.words[sensor & 3], lanes.noise, rules.clip, one)
            for lane in range(min(LANES, n - block * LANES)):
                readings[block * LANES + lane, sensor] = one[lane]


@kernel
def step_robots(scene, fleet, commands, cells, counts):
    """Execute one command of each robot.

    Args:
        scene, fleet: Where, and who.
        commands: (n, 2) move and turn; limited to -1..1, and 0 where they are no number.
        cells, counts: As in `start_robots`, changed.
    """
    n = counts.shape[0]
    ahead, turn = fleet.commands[0], fleet.commands[1]
    for block in range(fleet.stalled.shape[0]):
        first = block * LANES
        n_lanes = min(LANES, n - first)
        lanes = _lanes_of(fleet, block)
        for lane in range(n_lanes):
            one = commands[first + lane, 0]
            other = commands[first + lane, 1]
            ahead[lane] = one if one == one else 0.0
            turn[lane] = other if other == other else 0.0
        move(scene, lanes, ahead, turn)
        _arrive(scene, lanes, first, n_lanes, cells, counts)
