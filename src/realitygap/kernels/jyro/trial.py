"""Trials: networks, robots with range sensors, one arena of straight walls, many at a time.

The platform `jyro`: the box that collides, a blocked move that changes nothing, one thin ray a sensor and the
paper's uniform noise (Jyro's model, sections 3 to 6; the paper, section 2.3). Headings here are
counter-clockwise from +x, in whole turns; positions count from the start.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import inlined, kernel, shared_lanes, shared_stage, stage
from realitygap.kernels.math.bits import unmasked
from realitygap.kernels.math.elementary import sin_cos_of_turns
from realitygap.kernels.math.lanes import LANES, copy_row, fill, keep_where_low, make_lanes
from realitygap.kernels.math.philox import philox
from realitygap.kernels.neat.wiring import make_wiring, think, wire
from realitygap.kernels.tasks.marks import (
    count_cells,
    list_cells,
    list_fresh,
    mark_ends,
    mark_line,
    place_line,
)

from .walls import gap_to_planes, sense_planes, sense_segments, touch_segments


class TrialScene(NamedTuple):
    """The place and the body of trials, in the precision of the trials; lengths [m] from the start."""

    walls: NDArray[np.floating]  # (w, 4) x1, y1, x2, y2
    normals: NDArray[np.floating]  # (w, 3) unit normal into the room and offset of each wall's line
    is_enclosed: bool  # whether a wall is where its line is, for all that a trial can reach
    body: NDArray[np.floating]  # (b, 2) corners, forward and left of the center, in order
    sensors: NDArray[np.floating]  # (s, 4) mount forward and left, cosine and sine of its direction
    heading: NDArray[np.floating]  # (1,) of the start [turns]
    grid: NDArray[np.floating]  # (4,) the start in grid units, cells per meter, how near to a border is on it
    columns: int
    rows: int


OBSTACLE, STALL, TIME, BIAS, RANGE = range(5)
INPUTS = {"obstacle": OBSTACLE, "stall": STALL, "time": TIME, "bias": BIAS, "range": RANGE}
"""Kinds of inputs by their names."""


class TrialRules(NamedTuple):
    """The rules of trials. The arrays have one number for all trials, or one for each."""

    n_steps: int
    clip: bool  # whether a noisy reading is limited to 0..1
    bias_input: bool  # whether the network has a fourth input, constant
    bias_value: float
    step_length: NDArray[np.floating]  # at full output [m]
    step_turn: NDArray[np.floating]  # at full output [turns]
    noise: NDArray[np.floating]  # each reading is moved by noise * U(-1, 1)
    sensor_range: NDArray[np.floating]  # [m]
    inputs: NDArray[np.int32] = np.zeros(
        (0, 2), np.int32
    )  # (i, 2) kind and sensor; no rows: the paper's inputs


class Trace(NamedTuple):
    """The steps of the first k trials; row 0 is the start. Arrays of no rows record nothing."""

    poses: NDArray[np.floating]  # (t + 1, 3, k)
    readings: NDArray[np.floating]  # (t + 1, s, k) parts of the range, without noise
    inputs: NDArray[np.floating]  # (t, i, k) what the networks saw
    commands: NDArray[np.floating]  # (t, 2, k) what they answered, -1..1
    stalled: NDArray[np.bool_]  # (t + 1, k)


@stage
def _draw(step, c1, c2, c3, k0, k1, w0, w1, w2, w3):
    for lane in range(LANES):
        a, b, c, d = philox(np.uint32(step), c1[lane], c2[lane], c3[lane], k0, k1)
        w0[lane] = a
        w1[lane] = b
        w2[lane] = c
        w3[lane] = d


@stage
def draw_lanes(step, counters, key, words):
    """Four random words a lane.

    Args:
        step: First word of the counter.
        counters: (3, LANES) the other three.
        key: uint64.
        words: (4, LANES) written.
    """
    k0 = np.uint32(np.uint64(key) & np.uint64(0xFFFFFFFF))
    k1 = np.uint32(np.uint64(key) >> np.uint64(32))
    _draw(step, counters[0], counters[1], counters[2], k0, k1, words[0], words[1], words[2], words[3])


@stage
def _larger_noisy(fraction, words, noise, clip, value):
    real = value.dtype.type
    for lane in range(LANES):
        # Odd, from 1 - 2^24 to 2^24 - 1, which both precisions hold exactly: the mean is 0 in either.
        odd = np.int32(np.int32(words[lane] >> np.uint32(8)) * np.int32(2) + np.int32(1 - (1 << 24)))
        one = real(1.0) - fraction[lane] + noise[lane] * (real(odd) * real(1.0 / (1 << 24)))
        if clip:
            one = one if one > real(0.0) else real(0.0)
            one = one if one < real(1.0) else real(1.0)
        largest = unmasked(value[lane])
        value[lane] = one if one > largest else largest


@stage
def largest_noisy_readings(fractions, noise, clip, step, counters, key, words, value):
    """Compute the networks' view of the obstacle sensors: the largest of the inverted, noisy readings.

    Each reading becomes (R - d) / R and is moved by noise * U(-1, 1); then the largest is taken (the paper,
    section 2.3). With several sensors and noise this has a mean above that of one. Sensor k takes number k of
    the step's random words, 24 bits of it.

    Args:
        fractions: (s, LANES) d / R of each sensor, 0..1.
        noise: Level.
        clip: Whether a noisy reading is limited to 0..1.
        step, counters, key, words: As in `draw_lanes`.
        value: Written.
    """
    real = value.dtype.type
    for lane in range(LANES):
        value[lane] = real(-np.inf)
    n = fractions.shape[0]
    blocks = (n + 3) >> 2
    for block in range(blocks):
        draw_lanes(step * blocks + block, counters, key, words)
        for s in range(4 * block, min(4 * block + 4, n)):
            _larger_noisy(fractions[s], words[s & 3], noise, clip, value)


@shared_stage
def _observe_named(rules, key, lanes, step):
    """Write the inputs that `rules.inputs` names to the first of `lanes.values`."""
    real = lanes.low.dtype.type
    words_a_step = (lanes.fractions.shape[0] + 3) >> 2
    for i in range(rules.inputs.shape[0]):
        kind, sensor, value = rules.inputs[i, 0], rules.inputs[i, 1], lanes.values[i]
        if kind == OBSTACLE:
            largest_noisy_readings(
                lanes.fractions, lanes.noise, rules.clip, step, lanes.counters, key, lanes.words, value
            )
        elif kind == RANGE:
            draw_lanes(step * words_a_step + (sensor >> 2), lanes.counters, key, lanes.words)
            fill(value, real(-np.inf))
            _larger_noisy(lanes.fractions[sensor], lanes.words[sensor & 3], lanes.noise, rules.clip, value)
        elif kind == STALL:
            copy_row(lanes.stalled, value)
        elif kind == TIME:
            fill(value, real(step) / real(rules.n_steps))
        else:
            fill(value, real(rules.bias_value))


@inlined
def as_command(output):
    """A network's output as a command: limited to -1..1."""
    real = type(output)
    limited = output if output < real(1.0) else real(1.0)
    return limited if limited > real(-1.0) else real(-1.0)


@stage
def wheels_to_commands(left, right, move, turn):
    """Write the commands (LANES,) that ask for wheel speeds (LANES,), limited to -1..1."""
    real = move.dtype.type
    for lane in range(LANES):
        one = as_command(left[lane])
        two = as_command(right[lane])
        move[lane] = real(0.5) * (one + two)
        turn[lane] = real(0.5) * (two - one)


@stage
def propose(move, turn, step_length, step_turn, pose, proposed):
    """Compute the pose that a step would end at: along the old heading, then turned."""
    x, y, heading, sine, cosine = pose.x, pose.y, pose.heading, pose.sine, pose.cosine
    to_x, to_y, to_heading = proposed.x, proposed.y, proposed.heading
    to_sine, to_cosine = proposed.sine, proposed.cosine
    real = x.dtype.type
    for lane in range(LANES):
        length = as_command(move[lane]) * step_length[lane]
        to_x[lane] = x[lane] + length * cosine[lane]
        to_y[lane] = y[lane] + length * sine[lane]
        turned = heading[lane] + as_command(turn[lane]) * step_turn[lane]
        turned = turned - np.floor(turned + real(0.5))
        to_heading[lane] = turned
        sine_now, cosine_now = sin_cos_of_turns(turned)
        to_sine[lane] = sine_now
        to_cosine[lane] = cosine_now


@stage
def _note_stalls(low, stalled, n_stalls):
    real = low.dtype.type
    for lane in range(LANES):
        so_far = n_stalls[lane]
        hit = low[lane] <= real(0.0)
        stalled[lane] = real(1.0) if hit else real(0.0)
        n_stalls[lane] = np.int32(so_far + np.int32(1 if hit else 0))


@stage
def settle(low, pose, proposed, stalled, n_stalls):
    """Go where the step would end, or stay where it is in touch with a wall there."""
    _note_stalls(low, stalled, n_stalls)
    keep_where_low(low, pose.x, proposed.x)
    keep_where_low(low, pose.y, proposed.y)
    keep_where_low(low, pose.heading, proposed.heading)
    keep_where_low(low, pose.sine, proposed.sine)
    keep_where_low(low, pose.cosine, proposed.cosine)


@stage
def sense(scene, lanes):
    """Distances from each sensor to the nearest wall straight ahead of it, as parts of the range."""
    if scene.is_enclosed:
        sense_planes(
            scene.normals,
            scene.sensors,
            lanes.sensor_range,
            lanes.pose,
            lanes.seen,
            lanes.fractions,
            lanes.rates,
        )
    else:
        sense_segments(
            scene.walls,
            scene.sensors,
            lanes.sensor_range,
            lanes.pose,
            lanes.seen,
            lanes.fractions,
            lanes.rates,
        )


@stage
def observe(scene, rules, key, lanes, step):
    """Write what the networks see before a step to the first of `lanes.values`."""
    real = lanes.low.dtype.type
    if rules.inputs.shape[0] > 0:
        _observe_named(rules, key, lanes, step)
    else:
        largest_noisy_readings(
            lanes.fractions, lanes.noise, rules.clip, step, lanes.counters, key, lanes.words, lanes.values[0]
        )
        copy_row(lanes.stalled, lanes.values[1])
        fill(lanes.values[2], real(step) / real(rules.n_steps))
        if rules.bias_input:
            fill(lanes.values[3], real(rules.bias_value))


@stage
def move(scene, lanes, ahead, turn):
    """Execute commands (LANES,), limited to -1..1, where nothing is in the way."""
    propose(ahead, turn, lanes.step_length, lanes.step_turn, lanes.pose, lanes.proposed)
    if scene.is_enclosed:
        gap_to_planes(scene.normals, scene.body, lanes.proposed, lanes.seen, lanes.low)
    else:
        touch_segments(scene.walls, scene.body, lanes.proposed, lanes.seen, lanes.low)
    settle(lanes.low, lanes.pose, lanes.proposed, lanes.stalled, lanes.n_stalls)


@stage
def arrive(scene, lanes):
    """Mark the cells on the way to where the robots are now, and sense there."""
    place_line(scene.grid, lanes.pose.x, lanes.pose.y, lanes.line)
    mark_line(
        lanes.line, scene.grid[3], scene.columns, scene.rows, lanes.words, lanes.visited, lanes.fresh,
        lanes.any_fresh,
    )  # fmt: skip
    mark_ends(lanes.line, scene.columns, scene.rows, lanes.ends)
    sense(scene, lanes)


@stage
def _spread(values, first, n_lanes, row):
    """Each trial's own number, or the one of all; lanes without a trial get the last one."""
    if values.size == 1:
        fill(row, values[0])
    else:
        for lane in range(LANES):
            row[lane] = values[first + min(lane, n_lanes - 1)]


@stage
def start_lanes(scene, rules, counters, first, n_lanes, lanes):
    """Put the robots of trials `first` and on at the start, where they have yet to `arrive`.

    Args:
        scene, rules: Where and how.
        counters: (n, 3) uint32, the fixed words of each trial's random numbers.
        first, n_lanes: Which of the n trials.
        lanes: Written.
    """
    real = lanes.low.dtype.type
    sine, cosine = sin_cos_of_turns(scene.heading[0])
    fill(lanes.pose.x, real(0.0))
    fill(lanes.pose.y, real(0.0))
    fill(lanes.pose.heading, scene.heading[0])
    fill(lanes.pose.sine, sine)
    fill(lanes.pose.cosine, cosine)
    fill(lanes.stalled, real(0.0))
    fill(lanes.n_stalls, np.int32(0))
    fill(lanes.n_line, np.int32(0))
    fill(lanes.line.to_u, scene.grid[0])
    fill(lanes.line.to_v, scene.grid[1])
    _spread(rules.step_length, first, n_lanes, lanes.step_length)
    _spread(rules.step_turn, first, n_lanes, lanes.step_turn)
    _spread(rules.noise, first, n_lanes, lanes.noise)
    _spread(rules.sensor_range, first, n_lanes, lanes.sensor_range)
    for word in range(3):
        for lane in range(LANES):
            lanes.counters[word, lane] = counters[first + min(lane, n_lanes - 1), word]
    for node in range(lanes.values.shape[0]):
        fill(lanes.values[node], real(0.0))
    for word in range(lanes.visited.shape[0]):
        fill(lanes.visited[word], np.uint32(0))
        fill(lanes.ends[word], np.uint32(0))


@kernel
def _keep(trace, lanes, neat, step, first, n_lanes):
    for lane in range(min(n_lanes, trace.stalled.shape[1] - first)):
        k = first + lane
        trace.poses[step + 1, 0, k] = lanes.pose.x[lane]
        trace.poses[step + 1, 1, k] = lanes.pose.y[lane]
        trace.poses[step + 1, 2, k] = lanes.pose.heading[lane]
        trace.stalled[step + 1, k] = lanes.stalled[lane] > 0
        for s in range(trace.readings.shape[1]):
            trace.readings[step + 1, s, k] = lanes.fractions[s, lane]
        if step >= 0:
            for i in range(neat.n_inputs):
                trace.inputs[step, i, k] = lanes.values[i, lane]
            answers = lanes.before if neat.drives_wheels else lanes.values
            trace.commands[step, 0, k] = as_command(answers[neat.n_inputs, lane])
            trace.commands[step, 1, k] = as_command(answers[neat.n_inputs + 1, lane])


def make_trace(like, n_sensors, n_inputs, n_steps, n_kept):
    """Return room for the steps of `n_kept` trials; `n_steps` < 0: for none."""
    real = like.dtype
    return Trace(
        np.zeros((n_steps + 1, 3, n_kept), real),
        np.zeros((n_steps + 1, n_sensors, n_kept), real),
        np.zeros((max(n_steps, 0), n_inputs, n_kept), real),
        np.zeros((max(n_steps, 0), 2, n_kept), real),
        np.zeros((n_steps + 1, n_kept), np.bool_),
    )


@stage
def advance(scene, rules, neat, wiring, key, lanes, step):
    """One step of networks and robots; step -1 is the arrival at the start."""
    if step >= 0:
        observe(scene, rules, key, lanes, step)
        think(wiring, neat, lanes.values, lanes.before, lanes.total)
        first, second = neat.n_inputs, neat.n_inputs + 1
        if neat.drives_wheels:  # `before` is room until the next pass
            wheels_to_commands(
                lanes.values[first], lanes.values[second], lanes.before[first], lanes.before[second]
            )
        answers = lanes.before if neat.drives_wheels else lanes.values
        move(scene, lanes, answers[first], answers[second])
    arrive(scene, lanes)


@kernel
def _list(scene, lanes, n_lanes, cells, first):
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


def make_block(scene, neat, hidden_room):
    """Return room for a block of trials of networks with `hidden_room` hidden nodes: lanes and wiring."""
    n_nodes = neat.n_inputs + neat.n_outputs + hidden_room
    lanes = make_lanes(scene.heading, scene.sensors.shape[0], n_nodes, scene.columns, scene.rows)
    return lanes, make_wiring(scene.heading, neat, hidden_room)


@shared_lanes
def run_block(scene, rules, neat, wiring, key, counters, first, n_lanes, lanes, cells, counts, trace):
    """Drive the networks of a block, from the start for all steps.

    Args:
        scene, rules: Where and how.
        neat, wiring: The networks.
        key, counters, first, n_lanes: Of the random numbers, and which of the n trials, as in `start_lanes`.
        lanes: Room.
        cells: (n, c) uint8, written: cells visited along the line, in order of first visit.
        counts: (n, 3) int32, written: cells along the line, cells at the ends of steps (the start counts for
            both), blocked steps.
        trace: Where to keep the steps; arrays of no rows keep nothing.
    """
    keep = trace.stalled.shape[0] > 0
    start_lanes(scene, rules, counters, first, n_lanes, lanes)
    for step in range(-1, rules.n_steps):
        advance(scene, rules, neat, wiring, key, lanes, step)
        _list(scene, lanes, n_lanes, cells, first)
        if keep:
            _keep(trace, lanes, neat, step, first, n_lanes)
    for lane in range(n_lanes):
        counts[first + lane, 0] = lanes.n_line[lane]
        counts[first + lane, 1] = count_cells(lanes.ends, lane)
        counts[first + lane, 2] = lanes.n_stalls[lane]


@kernel
def run_trials(
    scene, rules, neat, networks, rows, key, counters, lanes, wiring, cells, ends, ended, counts, trace
):
    """Run n trials, one block after the other.

    Args:
        scene, rules, neat: Where, how, and how networks are activated.
        networks: The networks, at least one.
        rows: (n,) int32, which network each trial is of.
        lanes, wiring: Room.
        ends: (n, c) uint8, written: cells at the ends of steps, in ascending order; (0, c) keeps none.
        ended: (n, 2) float64, written: where trials ended [m from the start].
        key, counters, cells, counts, trace: As in `run_block`.
    """
    for first in range(0, rows.size, LANES):
        n_lanes = min(LANES, rows.size - first)
        wire(networks, rows, first, n_lanes, neat, wiring)
        run_block(scene, rules, neat, wiring, key, counters, first, n_lanes, lanes, cells, counts, trace)
        for lane in range(n_lanes):
            ended[first + lane, 0] = lanes.pose.x[lane]
            ended[first + lane, 1] = lanes.pose.y[lane]
        if ends.shape[0] > 0:
            for lane in range(n_lanes):
                list_cells(lanes.ends, lane, scene.columns, scene.rows, ends[first + lane])
