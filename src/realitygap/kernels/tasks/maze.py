"""A disc with range finders in a maze: Lehman & Stanley's trial, many side by side.

Lengths are in the unit of the walls and count from the start, headings are counter-clockwise from +x in whole
turns, and speeds are per step. A network's inputs are the range finders, four pie slices and perhaps a constant;
its two outputs, 0..1, change the turning and the speed.

Source: Lehman & Stanley (2011), section 4, and public re-implementations of its simulator.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import inlined, kernel, stage
from realitygap.kernels.math.bits import unmasked
from realitygap.kernels.math.elementary import sin_cos_of_turns
from realitygap.kernels.math.lanes import LANES, Row, Rows, fill
from realitygap.kernels.neat.network import IDENTITY, TANH
from realitygap.kernels.neat.wiring import make_wiring, think, wire

NEVER = np.int32(-1)


class MazeScene(NamedTuple):
    """A maze and where in it trials begin, in the precision of the trials."""

    walls: NDArray[np.floating]  # (w, 4) x1, y1, x2, y2
    rays: NDArray[np.floating]  # (s, 2) cosine and sine of each range finder's direction, from ahead
    exit: NDArray[np.floating]  # (2,)
    heading: NDArray[np.floating]  # (1,) of the start [turns]


class MazeRules(NamedTuple):
    """The agent and how long it has."""

    n_steps: int
    radius: float  # of the disc
    reach: float  # of the range finders
    arrival: float  # nearer than this to the exit is at the exit
    push: float  # speed gained in a step for each whole that an output is above one half
    top_speed: float
    twist: float  # turning gained [turns a step]
    top_spin: float
    bias_value: float  # of the constant input


class MazeLanes(NamedTuple):
    """The state of a block of trials."""

    x: Row
    y: Row
    heading: Row
    sine: Row
    cosine: Row
    speed: Row
    spin: Row
    to_x: Row  # where a step would end
    to_y: Row
    low: Row  # square of the distance from there to the nearest wall
    arrived: NDArray[np.int32]  # (LANES,) step in which the exit was reached, -1 before
    ray_cosine: Rows  # (s,) direction of each ray in the maze
    ray_sine: Rows
    nearness: Rows  # (s,) 1 over the distance to the nearest wall along each ray
    from_x: Row  # ends of one wall as seen from each robot, and 1 over their cross product
    from_y: Row
    over_x: Row
    over_y: Row
    inverse: Row
    values: Rows  # (m,) activations: inputs, outputs, hidden nodes
    before: Rows
    total: Row


class MazeTrace(NamedTuple):
    """The steps of the first k lanes; row 0 is the start. Arrays of no rows record nothing."""

    poses: NDArray[np.floating]  # (t + 1, 3, k)
    inputs: NDArray[np.floating]  # (t, i, k)


def make_maze_lanes(like, n_rays, n_nodes):
    """Room for a block of trials in the precision of the array `like`."""
    real = like.dtype
    sizes = {
        "ray_cosine": n_rays,
        "ray_sine": n_rays,
        "nearness": n_rays,
        "values": n_nodes,
        "before": n_nodes,
    }
    arrays = {
        name: np.zeros((sizes[name], LANES) if name in sizes else LANES, real) for name in MazeLanes._fields
    }
    return MazeLanes(**{**arrays, "arrived": np.zeros(LANES, np.int32)})


def make_maze_block(scene, neat, hidden_room):
    """Return room for a block of trials of networks with `hidden_room` hidden nodes: lanes and wiring."""
    n_nodes = neat.n_inputs + neat.n_outputs + hidden_room
    return make_maze_lanes(scene.heading, len(scene.rays), n_nodes), make_wiring(
        scene.heading, neat, hidden_room
    )


def make_maze_trace(like, n_inputs, n_steps, n_kept):
    """Return room for the steps of `n_kept` trials; `n_steps` < 0: for none."""
    real = like.dtype
    return MazeTrace(
        np.zeros((n_steps + 1, 3, n_kept), real), np.zeros((max(n_steps, 0), n_inputs, n_kept), real)
    )


@stage
def _turn_rays(rays, sine, cosine, ray_cosine, ray_sine):
    """Directions of the rays in the maze."""
    for s in range(rays.shape[0]):
        ahead = rays[s, 0]
        aside = rays[s, 1]
        for lane in range(LANES):
            ray_cosine[s, lane] = ahead * cosine[lane] - aside * sine[lane]
            ray_sine[s, lane] = ahead * sine[lane] + aside * cosine[lane]


@stage
def _see_wall(x1, y1, x2, y2, x, y, from_x, from_y, over_x, over_y, inverse):
    real = x.dtype.type
    for lane in range(LANES):
        ax = x1 - x[lane]
        ay = y1 - y[lane]
        bx = x2 - x[lane]
        by = y2 - y[lane]
        from_x[lane] = ax
        from_y[lane] = ay
        over_x[lane] = bx
        over_y[lane] = by
        inverse[lane] = real(1.0) / (ax * by - ay * bx)


@stage
def _nearest_along(cosine, sine, from_x, from_y, over_x, over_y, inverse, nearness):
    """Take a wall into account where it is nearer than those before.

    With a and b the wall's ends and r the ray's direction, r meets the wall where r x a and r x b differ in
    sign, at the distance (a x b) / (r x b - r x a), which is below zero behind.
    """
    real = nearness.dtype.type
    for lane in range(LANES):
        one = cosine[lane] * from_y[lane] - sine[lane] * from_x[lane]
        other = cosine[lane] * over_y[lane] - sine[lane] * over_x[lane]
        nearer = (other - one) * inverse[lane]
        nearest = unmasked(nearness[lane])
        hit = (one * other <= real(0.0)) & (nearer > nearest)
        nearness[lane] = nearer if hit else nearest


@stage
def _find_ranges(walls, reach, lanes, ranges):
    """Compute the range finders' readings: the distance to the nearest wall as a part of their reach, 1 beyond it.

    Args:
        walls: (w, 4) ends of each wall; one along a ray is not seen.
        reach: Of the rays.
        lanes: Of the robots.
        ranges: (>= s, LANES) the first s are written.
    """
    real = ranges.dtype.type
    nearness = lanes.nearness
    n_rays = nearness.shape[0]
    for s in range(n_rays):
        fill(nearness[s], real(1.0) / real(reach))
    for w in range(walls.shape[0]):
        _see_wall(
            walls[w, 0],
            walls[w, 1],
            walls[w, 2],
            walls[w, 3],
            lanes.x,
            lanes.y,
            lanes.from_x,
            lanes.from_y,
            lanes.over_x,
            lanes.over_y,
            lanes.inverse,
        )
        for s in range(n_rays):
            _nearest_along(
                lanes.ray_cosine[s],
                lanes.ray_sine[s],
                lanes.from_x,
                lanes.from_y,
                lanes.over_x,
                lanes.over_y,
                lanes.inverse,
                nearness[s],
            )
    for s in range(n_rays):
        for lane in range(LANES):
            ranges[s, lane] = real(1.0) / (nearness[s, lane] * real(reach))


@stage
def _find_exit(exit_x, exit_y, x, y, sine, cosine, ahead, left, behind, right):
    """1 in the quarter that holds the exit, 0 in the others; a border belongs to the quarter left of it."""
    real = x.dtype.type
    for lane in range(LANES):
        dx = exit_x - x[lane]
        dy = exit_y - y[lane]
        forward = dx * cosine[lane] + dy * sine[lane]
        aside = dy * cosine[lane] - dx * sine[lane]
        one = forward - aside
        other = forward + aside
        ahead[lane] = real(1.0) if (one > real(0.0)) & (other >= real(0.0)) else real(0.0)
        left[lane] = real(1.0) if (one <= real(0.0)) & (other > real(0.0)) else real(0.0)
        behind[lane] = real(1.0) if (one < real(0.0)) & (other <= real(0.0)) else real(0.0)
        right[lane] = real(1.0) if (one >= real(0.0)) & (other < real(0.0)) else real(0.0)


@inlined
def _limited(value, most):
    value = value if value < most else most
    return value if value > -most else -most


@inlined
def _around_half(output, activation):
    """Return an output's difference from half of its range 0..1; tanh is stretched to that, identity cut off."""
    real = type(output)
    if activation == TANH:
        return real(0.5) * output
    if activation == IDENTITY:
        return _limited(output - real(0.5), real(0.5))
    return output - real(0.5)


@stage
def _accelerate(rules, activation, turn, push, spin, speed):
    real = spin.dtype.type
    for lane in range(LANES):
        gained = spin[lane] + real(rules.twist) * _around_half(turn[lane], activation)
        spin[lane] = _limited(gained, real(rules.top_spin))
        gained = speed[lane] + real(rules.push) * _around_half(push[lane], activation)
        speed[lane] = _limited(gained, real(rules.top_speed))


@stage
def _propose(speed, x, y, sine, cosine, to_x, to_y):
    for lane in range(LANES):
        to_x[lane] = x[lane] + speed[lane] * cosine[lane]
        to_y[lane] = y[lane] + speed[lane] * sine[lane]


@stage
def _turn(spin, heading, sine, cosine):
    real = spin.dtype.type
    for lane in range(LANES):
        turned = heading[lane] + spin[lane]
        turned = turned - np.floor(turned + real(0.5))
        heading[lane] = turned
        sine_now, cosine_now = sin_cos_of_turns(turned)
        sine[lane] = sine_now
        cosine[lane] = cosine_now


@stage
def _nearest_wall(walls, to_x, to_y, low):
    """Square of the distance from each place to the nearest wall."""
    real = low.dtype.type
    fill(low, real(np.inf))
    for w in range(walls.shape[0]):
        x1 = walls[w, 0]
        y1 = walls[w, 1]
        wall_x = walls[w, 2] - x1
        wall_y = walls[w, 3] - y1
        length = wall_x * wall_x + wall_y * wall_y
        part = real(1.0) / length if length > real(0.0) else real(0.0)
        for lane in range(LANES):
            dx = to_x[lane] - x1
            dy = to_y[lane] - y1
            along = (dx * wall_x + dy * wall_y) * part
            along = along if along > real(0.0) else real(0.0)
            along = along if along < real(1.0) else real(1.0)
            dx = dx - along * wall_x
            dy = dy - along * wall_y
            square = dx * dx + dy * dy
            nearest = unmasked(low[lane])
            low[lane] = square if square < nearest else nearest


@stage
def _settle(low, nearest, arrived, to_x, to_y, x, y):
    """Go where nothing nearer than the radius is in the way; who has reached the exit stays there."""
    for lane in range(LANES):
        was_x = unmasked(x[lane])
        was_y = y[lane]
        new_x = to_x[lane]
        new_y = to_y[lane]
        stays = (low[lane] < nearest) | (arrived[lane] >= 0)
        x[lane] = was_x if stays else new_x
        y[lane] = was_y if stays else new_y


@stage
def _note_arrivals(step, exit_x, exit_y, nearest, x, y, arrived):
    for lane in range(LANES):
        dx = exit_x - x[lane]
        dy = exit_y - y[lane]
        before = unmasked(arrived[lane])
        now = (dx * dx + dy * dy < nearest) & (before < 0)
        arrived[lane] = np.int32(step) if now else before


@stage
def _start(scene, lanes):
    real = lanes.x.dtype.type
    sine, cosine = sin_cos_of_turns(scene.heading[0])
    fill(lanes.x, real(0.0))
    fill(lanes.y, real(0.0))
    fill(lanes.heading, scene.heading[0])
    fill(lanes.sine, sine)
    fill(lanes.cosine, cosine)
    fill(lanes.speed, real(0.0))
    fill(lanes.spin, real(0.0))
    fill(lanes.arrived, NEVER)
    for node in range(lanes.values.shape[0]):
        fill(lanes.values[node], real(0.0))


@stage
def observe_maze(scene, rules, neat, lanes):
    """Write what the networks see to the first of `lanes.values`."""
    values = lanes.values
    _turn_rays(scene.rays, lanes.sine, lanes.cosine, lanes.ray_cosine, lanes.ray_sine)
    _find_ranges(scene.walls, rules.reach, lanes, values)
    n = scene.rays.shape[0]
    _find_exit(
        scene.exit[0],
        scene.exit[1],
        lanes.x,
        lanes.y,
        lanes.sine,
        lanes.cosine,
        values[n],
        values[n + 1],
        values[n + 2],
        values[n + 3],
    )
    if neat.bias_input >= 0:
        fill(values[neat.bias_input], lanes.x.dtype.type(rules.bias_value))


@stage
def drive_maze(scene, rules, neat, lanes, step):
    """Execute the commands of the networks: outputs `turn` and `push`."""
    real = lanes.x.dtype.type
    turn, push = lanes.values[neat.n_inputs], lanes.values[neat.n_inputs + 1]
    _accelerate(rules, neat.activation, turn, push, lanes.spin, lanes.speed)
    _propose(lanes.speed, lanes.x, lanes.y, lanes.sine, lanes.cosine, lanes.to_x, lanes.to_y)
    _turn(lanes.spin, lanes.heading, lanes.sine, lanes.cosine)
    _nearest_wall(scene.walls, lanes.to_x, lanes.to_y, lanes.low)
    radius, arrival = real(rules.radius), real(rules.arrival)
    _settle(lanes.low, radius * radius, lanes.arrived, lanes.to_x, lanes.to_y, lanes.x, lanes.y)
    _note_arrivals(step, scene.exit[0], scene.exit[1], arrival * arrival, lanes.x, lanes.y, lanes.arrived)


@kernel
def _keep(trace, lanes, n_inputs, step):
    for k in range(trace.poses.shape[2]):
        trace.poses[step + 1, 0, k] = lanes.x[k]
        trace.poses[step + 1, 1, k] = lanes.y[k]
        trace.poses[step + 1, 2, k] = lanes.heading[k]
        if step >= 0:
            for i in range(n_inputs):
                trace.inputs[step, i, k] = lanes.values[i, k]


@kernel
def run_maze_trials(scene, rules, neat, networks, rows, lanes, wiring, ends, arrived, trace):
    """Try networks one after the other, until the first that reaches the exit and its block are done.

    Args:
        scene, rules: The maze and the agent.
        neat: How networks are activated.
        networks: At least one.
        rows: (n,) int32, which network each trial is of.
        lanes, wiring: Room.
        ends: (n, 2) float64, written: where each trial ended.
        arrived: (n,) int32, written: the step in which it reached the exit, from 0; -1 where it did not.
        trace: Where to keep the steps of each block's first lanes; arrays of no rows keep nothing.

    Returns:
        How many trials were carried out.
    """
    n = rows.size
    for first in range(0, n, LANES):
        n_lanes = min(LANES, n - first)
        wire(networks, rows, first, n_lanes, neat, wiring)
        _start(scene, lanes)
        if trace.poses.shape[0] > 0:
            _keep(trace, lanes, neat.n_inputs, -1)
        for step in range(rules.n_steps):
            observe_maze(scene, rules, neat, lanes)
            think(wiring, neat, lanes.values, lanes.before, lanes.total)
            drive_maze(scene, rules, neat, lanes, step)
            if trace.poses.shape[0] > 0:
                _keep(trace, lanes, neat.n_inputs, step)
        solved = False
        for lane in range(n_lanes):
            ends[first + lane, 0] = lanes.x[lane]
            ends[first + lane, 1] = lanes.y[lane]
            arrived[first + lane] = lanes.arrived[lane]
            solved = solved or lanes.arrived[lane] >= 0
        if solved:
            return first + n_lanes
    return n
