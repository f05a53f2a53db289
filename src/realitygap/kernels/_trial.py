"""One trial: one network, one robot with range sensors, one arena of straight walls.

The platform `jyro`: the box that collides, a blocked move that changes nothing, one thin ray a sensor and the
paper's uniform noise (Jyro's model, sections 3 to 6; the paper, section 2.3). Headings here are
counter-clockwise from +x.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._compile import kernel
from ._coverage import to_grid, visit, visit_line
from ._geometry import ray_fraction, segments_touch
from ._math import sin_cos, wrap_heading
from ._network import activate
from ._philox import FIRST, PURPOSE_NOISE, draw_words, make_stream, unit

# Two lines may differ from their distance as computed by rounding; beyond this margin [m] they cannot touch.
REACH_MARGIN = 1e-9


class TrialScene(NamedTuple):
    """Where and with what body a trial takes place; lengths [m], angles [rad]."""

    walls: NDArray[np.float64]  # (w, 4) x1, y1, x2, y2
    normals: NDArray[np.float64]  # (w, 3) unit normal and offset of each wall's line
    body: NDArray[np.float64]  # (b, 2) corners, forward and left of the center, in order
    body_radius: float  # no corner is farther from the center
    sensors: NDArray[np.float64]  # (s, 4) mount forward and left, cosine and sine of its direction
    sensor_radius: float  # no end of a ray is farther from the center
    sensor_range: float
    start: NDArray[np.float64]  # (3,) x, y, heading
    grid: NDArray[np.float64]  # (3,) x and y of the lower left corner of the reachable cells, size of a cell
    columns: int
    rows: int


class TrialRules(NamedTuple):
    """How a trial is run."""

    n_steps: int
    step_s: float
    speed: float  # at full output [m/s]
    turn_rate: float  # at full output [rad/s]
    noise: float  # each reading is moved by noise * U(-1, 1)
    clip: bool  # whether a noisy reading is limited to 0..1
    bias_input: bool  # whether the network has a fourth input, constant
    bias_value: float


class Workspace(NamedTuple):
    """Room that trials share, one after the other."""

    values: NDArray[np.float64]  # (m,)
    before: NDArray[np.float64]  # (m,)
    readings: NDArray[np.float64]  # (s,) [m]
    corners: NDArray[np.float64]  # (b, 2) [m]
    visited: NDArray[np.bool_]  # (c,)
    visited_ends: NDArray[np.bool_]  # (c,)
    order_ends: NDArray[np.uint8]  # (c,)


class Trace(NamedTuple):
    """What happened step by step; row 0 is the start. Arrays of no rows: nothing is kept."""

    poses: NDArray[np.float64]  # (t + 1, 3)
    readings: NDArray[np.float64]  # (t + 1, s) [m], without noise
    inputs: NDArray[np.float64]  # (t, i) what the network saw
    commands: NDArray[np.float64]  # (t, 2) what it answered, -1..1
    stalled: NDArray[np.bool_]  # (t + 1,)


@kernel
def make_workspace(scene, n_nodes):
    """Room for trials in a scene by networks of up to so many nodes."""
    cells = scene.columns * scene.rows
    return Workspace(
        np.zeros(n_nodes),
        np.zeros(n_nodes),
        np.zeros(scene.sensors.shape[0]),
        np.zeros((scene.body.shape[0], 2)),
        np.zeros(cells, np.bool_),
        np.zeros(cells, np.bool_),
        np.zeros(cells, np.uint8),
    )


@kernel
def make_trace(scene, n_inputs, n_steps):
    """Room for the steps of one trial; `n_steps` < 0: for none."""
    sensors = scene.sensors.shape[0]
    return Trace(
        np.zeros((n_steps + 1, 3)),
        np.zeros((n_steps + 1, sensors)),
        np.zeros((max(n_steps, 0), n_inputs)),
        np.zeros((max(n_steps, 0), 2)),
        np.zeros(n_steps + 1, np.bool_),
    )


@kernel
def blocked(scene, x, y, cosine, sine, corners):
    """Whether the body at a pose touches a wall."""
    n = scene.body.shape[0]
    placed = False
    for w in range(scene.walls.shape[0]):
        gap = abs(scene.normals[w, 0] * x + scene.normals[w, 1] * y - scene.normals[w, 2])
        if gap > scene.body_radius + REACH_MARGIN:
            continue
        if not placed:
            for b in range(n):
                forward = scene.body[b, 0]
                left = scene.body[b, 1]
                corners[b, 0] = x + forward * cosine - left * sine
                corners[b, 1] = y + forward * sine + left * cosine
            placed = True
        for b in range(n):
            to = b + 1 if b + 1 < n else 0
            if segments_touch(
                corners[b, 0],
                corners[b, 1],
                corners[to, 0],
                corners[to, 1],
                scene.walls[w, 0],
                scene.walls[w, 1],
                scene.walls[w, 2],
                scene.walls[w, 3],
            ):
                return True
    return False


@kernel
def sense(scene, x, y, cosine, sine, readings):
    """Distance from each sensor to the nearest wall straight ahead of it, at most the range [m]."""
    for s in range(readings.size):
        readings[s] = 1.0
    for w in range(scene.walls.shape[0]):
        gap = abs(scene.normals[w, 0] * x + scene.normals[w, 1] * y - scene.normals[w, 2])
        if gap > scene.sensor_radius + REACH_MARGIN:
            continue
        for s in range(readings.size):
            forward = scene.sensors[s, 0]
            left = scene.sensors[s, 1]
            px = x + forward * cosine - left * sine
            py = y + forward * sine + left * cosine
            ahead = scene.sensors[s, 2]
            aside = scene.sensors[s, 3]
            qx = px + scene.sensor_range * (ahead * cosine - aside * sine)
            qy = py + scene.sensor_range * (ahead * sine + aside * cosine)
            fraction = ray_fraction(
                px, py, qx, qy, scene.walls[w, 0], scene.walls[w, 1], scene.walls[w, 2], scene.walls[w, 3]
            )
            readings[s] = min(readings[s], fraction)
    for s in range(readings.size):
        readings[s] *= scene.sensor_range


@kernel
def largest_noisy_reading(readings, sensor_range, noise, clip, stream, step):
    """What the network sees of the obstacle sensors: the largest of the inverted, noisy readings.

    Each reading becomes (R - d) / R, limited to 1, and is moved by noise * U(-1, 1); then the largest is
    taken (the paper, section 2.3). With several sensors and noise this has a mean above that of one.
    """
    n = readings.size
    blocks = (n + 3) >> 2
    largest = -math.inf
    for s in range(n):
        value = min((sensor_range - readings[s]) / sensor_range, 1.0)
        lane = s & 3
        if lane == 0:
            words = draw_words(stream, step * blocks + (s >> 2))
        if lane == 0:
            word = words[0]
        elif lane == 1:
            word = words[1]
        elif lane == 2:
            word = words[2]
        else:
            word = words[3]
        value += noise * (2.0 * unit(word) - 1.0)
        if clip:
            value = min(max(value, 0.0), 1.0)
        largest = max(largest, value)
    return largest


@kernel
def as_command(output):
    """A network's output as a command: limited to -1..1, and 0 where it is no number.

    Only `identity` gives such outputs; a recurrent network of it can grow without limit.
    """
    if output > 1.0:
        return 1.0
    if output < -1.0:
        return -1.0
    return output if output == output else 0.0


@kernel
def run_trial(scene, rules, networks, row, neat, stream, work, order, trace):
    """Drive one network from the start for all steps.

    Args:
        scene, rules: Where and how.
        networks, row, neat: Which network, and how it is activated.
        stream: The random numbers of the trial's noise.
        work: Room.
        order: (c,) uint8, written: cells visited along the line, in order of first visit.
        trace: Where to keep the steps; arrays of no rows keep nothing.

    Returns:
        Cells along the line, cells at the ends of steps (the start counts for both), and blocked steps.
    """
    keep = trace.stalled.size > 0
    for cell in range(work.visited.size):
        work.visited[cell] = False
        work.visited_ends[cell] = False
    for node in range(work.values.size):
        work.values[node] = 0.0
    x = scene.start[0]
    y = scene.start[1]
    heading = scene.start[2]
    sine, cosine = sin_cos(heading)
    u = to_grid(x, scene.grid[0], scene.grid[2])
    v = to_grid(y, scene.grid[1], scene.grid[2])
    column = int(math.floor(u))
    line = int(math.floor(v))
    n_line = visit(column, line, scene.columns, scene.rows, work.visited, order, FIRST)
    n_ends = visit(column, line, scene.columns, scene.rows, work.visited_ends, work.order_ends, FIRST)
    sense(scene, x, y, cosine, sine, work.readings)
    stalled = False
    n_stalls = 0
    if keep:
        trace.poses[0, 0] = x
        trace.poses[0, 1] = y
        trace.poses[0, 2] = heading
        trace.stalled[0] = False
        for s in range(work.readings.size):
            trace.readings[0, s] = work.readings[s]
    for step in range(rules.n_steps):
        work.values[0] = largest_noisy_reading(
            work.readings, scene.sensor_range, rules.noise, rules.clip, stream, step
        )
        work.values[1] = 1.0 if stalled else 0.0
        work.values[2] = step / rules.n_steps
        if rules.bias_input:
            work.values[3] = rules.bias_value
        activate(networks, row, neat, work.values, work.before)
        move = as_command(work.values[neat.n_inputs])
        turn = as_command(work.values[neat.n_inputs + 1])
        distance = move * rules.speed * rules.step_s
        new_x = x + distance * cosine
        new_y = y + distance * sine
        new_heading = wrap_heading(heading + turn * rules.turn_rate * rules.step_s)
        new_sine, new_cosine = sin_cos(new_heading)
        stalled = blocked(scene, new_x, new_y, new_cosine, new_sine, work.corners)
        if stalled:
            n_stalls += 1
        else:
            x = new_x
            y = new_y
            heading = new_heading
            sine = new_sine
            cosine = new_cosine
            new_u = to_grid(x, scene.grid[0], scene.grid[2])
            new_v = to_grid(y, scene.grid[1], scene.grid[2])
            n_line = visit_line(u, v, new_u, new_v, scene.columns, scene.rows, work.visited, order, n_line)
            u = new_u
            v = new_v
            column = int(math.floor(u))
            line = int(math.floor(v))
            n_ends = visit(
                column, line, scene.columns, scene.rows, work.visited_ends, work.order_ends, n_ends
            )
            sense(scene, x, y, cosine, sine, work.readings)
        if keep:
            for k in range(neat.n_inputs):
                trace.inputs[step, k] = work.values[k]
            trace.commands[step, 0] = move
            trace.commands[step, 1] = turn
            trace.poses[step + 1, 0] = x
            trace.poses[step + 1, 1] = y
            trace.poses[step + 1, 2] = heading
            trace.stalled[step + 1] = stalled
            for s in range(work.readings.size):
                trace.readings[step + 1, s] = work.readings[s]
    return n_line, n_ends, n_stalls


@kernel
def run_trials(
    scene, rules, networks, neat, key, replicate, generation, first, repeat, work, order, counts, trace
):
    """Try each of n networks once; network k draws the noise of individual `first` + k.

    Args:
        scene, rules, networks, neat, work, trace: As in `run_trial`; the trace is that of the last trial.
        key, replicate, generation, first, repeat: Which random numbers.
        order: (n, c) uint8, written: cells along the line in order of first visit.
        counts: (n, 3) int32, written: cells along the line, cells at the ends of steps, blocked steps.
    """
    for row in range(counts.shape[0]):
        stream = make_stream(key, replicate, generation, first + row, repeat, PURPOSE_NOISE)
        n_line, n_ends, n_stalls = run_trial(
            scene, rules, networks, row, neat, stream, work, order[row], trace
        )
        counts[row, 0] = n_line
        counts[row, 1] = n_ends
        counts[row, 2] = n_stalls
