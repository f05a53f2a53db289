"""The state of a block of trials of the platform `sim`, and their numbers laid out in lanes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import kernel, shared_stage, stage
from realitygap.kernels.math.elementary import sin_cos_of_turns
from realitygap.kernels.math.lanes import LANES, Line, Poses, Row, Rows, Words, fill, zeros
from realitygap.kernels.math.philox import PURPOSE_DRIVE
from realitygap.kernels.neat.wiring import Wiring, make_wiring

from .outline import bounds_of, outline_of, place_obstacle, reach_of
from .senses import Senses, make_senses, start_senses

N_SPARE = 24  # rows for what stages work out on the way


class SimRules(NamedTuple):
    """The rules of the trials of a call."""

    n_steps: int
    step_s: float  # how long a command lasts [s]
    clip: bool  # whether a noisy linear reading is limited to 0..1
    bias_value: float  # of the constant input
    grid: NDArray[
        np.floating
    ]  # (4,) the origin in grid units, cells per meter, how near to a border is on it


class SimLanes(NamedTuple):
    """The state of a block of trials. Positions are from the origin of the table [m], headings in turns."""

    p: Rows  # (n_all_rows,) the numbers of each trial, and what follows from them
    pose: Poses
    proposed: Poses
    low: Row  # how far the body's nearest point is from what it can touch [m]
    stalled: Row  # 1 where the last step was blocked, else 0
    n_stalls: NDArray[np.int32]
    speeds: Rows  # (2,) of the wheels [m/s]
    asked: Rows  # (2,) speeds that the wheels were last asked for, where they rise [m/s]
    level: Row  # the faster one's, as it rises; 1: full speed
    targets: Rows  # (2 * (delay_steps + 2),) speeds asked for, latest first, left and right in turn
    wheels: Rows  # (2,) driven since the start, as an encoder without error would say [m]
    commands: Rows  # (2,) of the last step, -1..1
    moved: (
        Rows  # (4,) what the step asks for: length [m] and turn [turns] by the old command, then the new one
    )
    lasts: Rows  # (2,) how long the step goes on by the old command, and by the new one [s]
    distances: Rows  # (rays,) [m]
    rates: Rows  # (rays,) room
    clips: Rows  # (4 * rays,) room
    readings: Rows  # (n_readings,) 0..1, 1 is near
    senses: Senses
    counters: Words  # (3,) the fixed words of each trial's random numbers
    drive_counters: Words  # (3,) likewise, for another purpose
    words: Words  # (4,) random, and room
    values: Rows  # (m,) activations: inputs, outputs, hidden nodes
    before: Rows  # (m,) those of the step before, in recurrent networks
    total: Row  # room
    line: Line
    visited: Words
    fresh: Words
    any_fresh: NDArray[np.uint32]
    ends: Words
    n_line: NDArray[np.int32]
    spare: Rows  # (N_SPARE,) room


class SimRoom(NamedTuple):
    """Room for a block of trials."""

    lanes: SimLanes
    near: Near
    wiring: Wiring


class Contact(NamedTuple):
    """The contacts of bodies, in the frames of their axles."""

    gap: Row  # [m]
    facing: Row  # the normal, towards the body: ahead and left
    beside: Row
    corner_x: Row  # the body's corner that is met, grown by a radius [m]
    corner_y: Row
    radius: Row


class Near(NamedTuple):
    """The results of contact for a block of trials in a step. Poses are of the axle."""

    pose: Poses
    before: Poses  # at the beginning of a part of the step
    start: Poses  # at the beginning of the step
    first: Contact  # the deepest
    second: Contact  # the next
    active: Row  # above 0 where contact is of interest
    low: Row  # the least gap met so far
    give: Rows  # (4,) what the body gives when it is pushed: `unsaturated` of `push.py`
    pushes: Rows  # (28,) room of `give_way`
    moved: Rows  # (5,) how it is pushed free: `give_way`
    arc: Rows  # (4,) of a part of the step: chord [m], sine and cosine of half the turn, turn [turns]
    effort: Rows  # (4,) asked for, as lengths: straight on and by turning; carried out: length and turn
    gaps: Rows  # (n_walls,) how far the body is from each wall [m]
    heights: Rows  # (n_walls * parts,) how low the lowest corner of each part is along each wall's normal [m]
    walls: Rows  # (8,) of the nearest two: normal x, y, offset and gap
    seen: Rows  # (5 * most corners of an obstacle + 1,) its corners and normals from the body, and its radius
    met: Rows  # likewise, of the obstacle that each body is about to meet


class SimTrace(NamedTuple):
    """The steps of the first k trials; row 0 is the start. Arrays of no rows record nothing."""

    poses: NDArray[np.floating]  # (t + 1, 3, k) x, y [m from the origin], heading [turns]
    readings: NDArray[np.floating]  # (t + 1, s, k) with their noise, 0..1
    inputs: NDArray[np.floating]  # (t, i, k) what the networks saw
    commands: NDArray[np.floating]  # (t, 2, k) what they answered, -1..1
    stalled: NDArray[np.bool_]  # (t + 1, k)
    wheels: NDArray[np.floating]  # (t + 1, 2, k) driven since the start by the left and right wheel [m]
    distances: NDArray[
        np.floating
    ]  # (t + 1, r, k) from each range sensor to what is nearest, without noise [m]


def make_sim_trace(shape, n_inputs, n_steps, n_kept, dtype):
    """Room for the steps of the first `n_kept` trials; `n_steps` < 0: for none."""
    t = n_steps + 1
    return SimTrace(
        np.zeros((t, 3, n_kept), dtype),
        np.zeros((t, shape.n_readings, n_kept), dtype),
        np.zeros((max(n_steps, 0), n_inputs, n_kept), dtype),
        np.zeros((max(n_steps, 0), 2, n_kept), dtype),
        np.zeros((t, n_kept), np.bool_),
        np.zeros((t, 2, n_kept), dtype),
        np.zeros((t, shape.row_range.size, n_kept), dtype),
    )


def make_near(shape, dtype):
    """Room for the contact of a block of trials."""

    def row():
        return zeros(LANES, dtype)

    def poses():
        return Poses(*(row() for _ in Poses._fields))

    def contact():
        return Contact(*(row() for _ in Contact._fields))

    def rows(n):
        return zeros((n, LANES), dtype)

    return Near(
        pose=poses(),
        before=poses(),
        start=poses(),
        first=contact(),
        second=contact(),
        active=row(),
        low=row(),
        give=rows(4),
        pushes=rows(28),
        moved=rows(5),
        arc=rows(4),
        effort=rows(4),
        gaps=rows(shape.n_walls),
        heights=rows(shape.n_walls * shape.part_corners.size),
        walls=rows(8),
        seen=rows(5 * int(shape.shape_corners.max(initial=1)) + 1),
        met=rows(5 * int(shape.shape_corners.max(initial=1)) + 1),
    )


def make_sim_room(shape, neat, hidden_room, dtype):
    """Return room for a block of trials with networks of `hidden_room` hidden nodes, in a precision."""
    n_nodes = neat.n_inputs + neat.n_outputs + hidden_room
    words = -(-shape.columns // 32)
    n_rays = int(shape.first_ray[-1])

    def row():
        return zeros(LANES, dtype)

    def rows(n):
        return zeros((n, LANES), dtype)

    def bits(n):
        return zeros((n, LANES), np.uint32)

    lanes = SimLanes(
        p=rows(shape.n_all_rows),
        pose=Poses(*(row() for _ in Poses._fields)),
        proposed=Poses(*(row() for _ in Poses._fields)),
        low=row(),
        stalled=row(),
        n_stalls=np.zeros(LANES, np.int32),
        speeds=rows(2),
        asked=rows(2),
        level=row(),
        targets=rows(2 * (shape.delay_steps + 2)),
        wheels=rows(2),
        commands=rows(2),
        moved=rows(4),
        lasts=rows(2),
        distances=rows(n_rays),
        rates=rows(n_rays),
        clips=rows(4 * n_rays),
        readings=rows(shape.n_readings),
        senses=make_senses(shape, dtype),
        counters=bits(3),
        drive_counters=bits(3),
        words=bits(4),
        values=rows(n_nodes),
        before=rows(n_nodes),
        total=row(),
        line=Line(*(row() for _ in Line._fields)),
        visited=bits(shape.rows * words),
        fresh=bits((shape.rows + 1) * words),
        any_fresh=np.zeros(LANES, np.uint32),
        ends=bits(shape.rows * words),
        n_line=np.zeros(LANES, np.int32),
        spare=rows(N_SPARE),
    )
    return SimRoom(lanes, make_near(shape, dtype), make_wiring(np.zeros(0, dtype), neat, hidden_room))


@stage
def _take(numbers, row):
    """Copy numbers to the first lanes of a row, and the last number to the others."""
    for lane in range(numbers.size):
        row[lane] = numbers[lane]
    for lane in range(numbers.size, LANES):
        row[lane] = numbers[numbers.size - 1]


@kernel
def _load(table, counters, first, n_lanes, lanes):
    """Lay out the numbers of trials `first` and on; lanes without a trial get those of the last one."""
    for row in range(table.shape[0]):
        if table.shape[1] == 1:
            for lane in range(LANES):
                lanes.p[row, lane] = table[row, 0]
        else:
            _take(table[row, first : first + n_lanes], lanes.p[row])
    for word in range(3):
        for lane in range(LANES):
            given = counters[first + min(lane, n_lanes - 1), word]
            lanes.counters[word, lane] = given
            if word == 0:
                given = np.uint32((given & np.uint32(0xFFFFFF00)) | np.uint32(PURPOSE_DRIVE))
            lanes.drive_counters[word, lane] = given


@stage
def _plane(x1, y1, x2, y2, start_x, start_y, normal_x, normal_y, offset):
    """Unit normal towards the start, and offset, of the line through two points."""
    real = x1.dtype.type
    for lane in range(LANES):
        along_x = x2[lane] - x1[lane]
        along_y = y2[lane] - y1[lane]
        scale = real(1.0) / np.sqrt(along_x * along_x + along_y * along_y)
        n_x = -along_y * scale
        n_y = along_x * scale
        inside = n_x * (start_x[lane] - x1[lane]) + n_y * (start_y[lane] - y1[lane])
        n_x = n_x if inside > real(0.0) else -n_x
        n_y = n_y if inside > real(0.0) else -n_y
        normal_x[lane] = n_x
        normal_y[lane] = n_y
        offset[lane] = n_x * x1[lane] + n_y * y1[lane]


@stage
def _direct(direction, cone, part, cosine, sine):
    """Cosine and sine of a ray at so much of the cone to the left of a sensor's direction."""
    real = direction.dtype.type
    for lane in range(LANES):
        s, c = sin_cos_of_turns(direction[lane] + real(part) * cone[lane])
        cosine[lane] = c
        sine[lane] = s


@stage
def _derive(shape, lanes):
    p = lanes.p
    start = shape.row_start
    fill(p[shape.row_reach], lanes.low.dtype.type(0.0))
    bounds = shape.row_bounds
    for k in range(4):
        fill(p[bounds + k], lanes.low.dtype.type(-1e9 if k & 1 else 1e9))
    for part in range(shape.part_corners.size):
        n = shape.part_corners[part]
        first, outline = shape.row_part[part], shape.row_outline[part]
        outline_of(p, first, n, outline, lanes.total)
        for corner in range(n):
            row = outline + 5 * corner
            reach_of(p[row], p[row + 1], p[first + 2 * n], p[shape.row_drive + 2], p[shape.row_reach])
            bounds_of(
                p[row], p[row + 1], p[first + 2 * n], p[bounds], p[bounds + 1], p[bounds + 2], p[bounds + 3]
            )
    if shape.enclosed:
        for w in range(shape.n_walls):
            wall = shape.row_wall + 4 * w
            plane = shape.row_plane + 3 * w
            _plane(
                p[wall], p[wall + 1], p[wall + 2], p[wall + 3], p[start], p[start + 1],
                p[plane], p[plane + 1], p[plane + 2],
            )  # fmt: skip
    for obstacle in range(shape.row_obstacle.size):
        place_obstacle(shape, lanes, obstacle)
    for q in range(shape.row_obstacle.size, shape.row_shape.size):
        wall = shape.row_wall + 4 * (q - shape.row_obstacle.size)
        outline_of(p, wall, 2, shape.row_shape[q], lanes.total)
        fill(p[shape.row_shape[q] + 10], lanes.low.dtype.type(0.0))
    for s in range(shape.row_range.size):
        sensor = shape.row_range[s]
        rays = shape.range_rays[s]
        for k in range(rays):
            ray = shape.row_ray + 2 * (shape.first_ray[s] + k)
            part = 2.0 * k / (rays - 1) - 1.0 if rays > 1 else 0.0
            _direct(p[sensor + 2], p[sensor + 3], part, p[ray], p[ray + 1])


@stage
def _place(grid, x, y, heading, pose, line):
    real = x.dtype.type
    to_x, to_y, to_heading, to_sine, to_cosine = pose.x, pose.y, pose.heading, pose.sine, pose.cosine
    to_u, to_v = line.to_u, line.to_v
    for lane in range(LANES):
        turned = heading[lane] - np.floor(heading[lane] + real(0.5))
        sine, cosine = sin_cos_of_turns(turned)
        to_x[lane] = x[lane]
        to_y[lane] = y[lane]
        to_heading[lane] = turned
        to_sine[lane] = sine
        to_cosine[lane] = cosine
        to_u[lane] = grid[0] + x[lane] * grid[2]
        to_v[lane] = grid[1] + y[lane] * grid[2]


@shared_stage
def start_block(shape, rules, table, counters, first, n_lanes, lanes):
    """Put the robots of trials `first` and on at their starts, standing.

    Args:
        shape, rules: Structure, and how trials are run.
        table: (p, n) or (p, 1) numbers.
        counters: (n, 3) uint32, the fixed words of each trial's random numbers.
        first, n_lanes: Which of the n trials.
        lanes: Written.
    """
    real = lanes.low.dtype.type
    _load(table, counters, first, n_lanes, lanes)
    _derive(shape, lanes)
    start = shape.row_start
    _place(rules.grid, lanes.p[start], lanes.p[start + 1], lanes.p[start + 2], lanes.pose, lanes.line)
    fill(lanes.stalled, real(0.0))
    fill(lanes.low, real(0.0))
    fill(lanes.level, real(0.0))
    fill(lanes.n_stalls, np.int32(0))
    fill(lanes.n_line, np.int32(0))
    for k in range(2):
        fill(lanes.speeds[k], real(0.0))
        fill(lanes.asked[k], real(0.0))
        fill(lanes.wheels[k], real(0.0))
        fill(lanes.commands[k], real(0.0))
    for k in range(lanes.targets.shape[0]):
        fill(lanes.targets[k], real(0.0))
    for node in range(lanes.values.shape[0]):
        fill(lanes.values[node], real(0.0))
    for word in range(lanes.visited.shape[0]):
        fill(lanes.visited[word], np.uint32(0))
        fill(lanes.ends[word], np.uint32(0))
    start_senses(shape, rules, lanes)
