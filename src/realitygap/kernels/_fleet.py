"""Many robots at once, each given one command a step from outside; what a trial does, one step at a time.

The physics is that of `_trial`: the same functions for noise, contact, sensors and cells, in the same order, so that
robots under the commands of networks drive the trials of `run_trial`, bit for bit (`tests/gym` holds them to that).
`run_trial` has a loop of its own: going through a function for each step halves its speed, as Numba then counts
references to every array of scene and workspace at each of them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._compile import kernel
from ._coverage import to_grid, visit, visit_line
from ._math import sin_cos, wrap_heading
from ._philox import FIRST, PURPOSE_NOISE, make_stream
from ._trial import as_command, blocked, largest_noisy_reading, sense


class Fleet(NamedTuple):
    """n robots in the course of their trials."""

    poses: NDArray[np.float64]  # (n, 3) x [m], y [m], heading [rad]
    readings: NDArray[np.float64]  # (n, s) [m], without noise
    stalled: NDArray[np.bool_]  # (n,) whether the last step was blocked
    counts: NDArray[np.int32]  # (n, 3) cells along the line, cells at the ends of steps, blocked steps
    cells: NDArray[np.uint8]  # (n, c) cells along the line in order of first visit
    cells_ends: NDArray[np.uint8]  # (n, c) cells at the ends of steps, likewise
    visited: NDArray[np.bool_]  # (n, c) along the line
    visited_ends: NDArray[np.bool_]  # (n, c)
    corners: NDArray[np.float64]  # (b, 2) room


@kernel
def make_fleet(scene, n):
    """Room for n robots in a scene."""
    c = scene.columns * scene.rows
    return Fleet(
        np.zeros((n, 3)),
        np.zeros((n, scene.sensors.shape[0])),
        np.zeros(n, np.bool_),
        np.zeros((n, 3), np.int32),
        np.zeros((n, c), np.uint8),
        np.zeros((n, c), np.uint8),
        np.zeros((n, c), np.bool_),
        np.zeros((n, c), np.bool_),
        np.zeros((scene.body.shape[0], 2)),
    )


@kernel
def start_robots(scene, fleet):
    """Put all robots at the start; its cell counts as visited."""
    x = scene.start[0]
    y = scene.start[1]
    sine, cosine = sin_cos(scene.start[2])
    column = int(math.floor(to_grid(x, scene.grid[0], scene.grid[2])))
    line = int(math.floor(to_grid(y, scene.grid[1], scene.grid[2])))
    for k in range(fleet.stalled.size):
        fleet.poses[k] = scene.start
        fleet.stalled[k] = False
        fleet.visited[k] = False
        fleet.visited_ends[k] = False
        fleet.counts[k, 0] = visit(
            column, line, scene.columns, scene.rows, fleet.visited[k], fleet.cells[k], FIRST
        )
        fleet.counts[k, 1] = visit(
            column, line, scene.columns, scene.rows, fleet.visited_ends[k], fleet.cells_ends[k], FIRST
        )
        fleet.counts[k, 2] = 0
        sense(scene, x, y, cosine, sine, fleet.readings[k])


@kernel
def observe_robots(scene, rules, fleet, key, replicate, generation, first, repeat, step, observations):
    """What the networks of all robots would see before a step.

    Args:
        scene, rules, fleet: Where, how, and who.
        key, replicate, generation, first, repeat: Which random numbers; robot k draws those of individual `first` + k.
        step: Number of the step, from 0.
        observations: (n, 3) written: largest noisy reading, stall, time.
    """
    for k in range(fleet.stalled.size):
        stream = make_stream(key, replicate, generation, first + k, repeat, PURPOSE_NOISE)
        observations[k, 0] = largest_noisy_reading(
            fleet.readings[k], scene.sensor_range, rules.noise, rules.clip, stream, step
        )
        observations[k, 1] = 1.0 if fleet.stalled[k] else 0.0
        observations[k, 2] = step / rules.n_steps


@kernel
def step_robots(scene, rules, fleet, commands):
    """Carry out one command of each robot.

    Args:
        scene, rules, fleet: Where, how, and who.
        commands: (n, 2) move and turn; limited to -1..1, and 0 where they are no number, as in a trial.
    """
    for k in range(fleet.stalled.size):
        old_x = fleet.poses[k, 0]
        old_y = fleet.poses[k, 1]
        sine, cosine = sin_cos(fleet.poses[k, 2])
        distance = as_command(commands[k, 0]) * rules.speed * rules.step_s
        x = old_x + distance * cosine
        y = old_y + distance * sine
        heading = wrap_heading(
            fleet.poses[k, 2] + as_command(commands[k, 1]) * rules.turn_rate * rules.step_s
        )
        sine, cosine = sin_cos(heading)
        fleet.stalled[k] = blocked(scene, x, y, cosine, sine, fleet.corners)
        if fleet.stalled[k]:
            fleet.counts[k, 2] += 1
            continue
        fleet.poses[k, 0] = x
        fleet.poses[k, 1] = y
        fleet.poses[k, 2] = heading
        u = to_grid(x, scene.grid[0], scene.grid[2])
        v = to_grid(y, scene.grid[1], scene.grid[2])
        fleet.counts[k, 0] = visit_line(
            to_grid(old_x, scene.grid[0], scene.grid[2]),
            to_grid(old_y, scene.grid[1], scene.grid[2]),
            u,
            v,
            scene.columns,
            scene.rows,
            fleet.visited[k],
            fleet.cells[k],
            np.int64(fleet.counts[k, 0]),
        )
        fleet.counts[k, 1] = visit(
            int(math.floor(u)),
            int(math.floor(v)),
            scene.columns,
            scene.rows,
            fleet.visited_ends[k],
            fleet.cells_ends[k],
            np.int64(fleet.counts[k, 1]),
        )
        sense(scene, x, y, cosine, sine, fleet.readings[k])
