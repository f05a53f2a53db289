"""Lanes: many trials side by side in one loop, so that one instruction serves several of them.

Every number of a trial is an entry of an array of `LANES`; single or double precision is the arrays'.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import inlined, kernel, stage

from .bits import unmasked

# Wide enough to pay for the start of each loop, small enough for all arrays to stay in the nearest cache.
LANES = 64

Row = NDArray[np.floating]  # (LANES,)
Rows = NDArray[np.floating]  # (several, LANES)
Words = NDArray[np.uint32]  # (several, LANES)


# Of a cache line [bytes]: what begins elsewhere lies in two of them, and takes twice as long to load.
ALIGNED = 64


def zeros(shape, dtype):
    """An array of zeros that begins at a cache line, so each of its rows of lanes does."""
    n_bytes = int(np.prod(shape)) * np.dtype(dtype).itemsize
    room = np.zeros(n_bytes + ALIGNED, np.uint8)
    first = -room.ctypes.data % ALIGNED
    return room[first : first + n_bytes].view(dtype).reshape(shape)


@inlined
def words_of(columns):
    """32-bit words that hold a bit for each column."""
    return (columns + 31) >> 5


class Poses(NamedTuple):
    """The poses of robots: [m] from the start, whole turns counter-clockwise from +x."""

    x: Row
    y: Row
    heading: Row
    sine: Row
    cosine: Row


class Seen(NamedTuple):
    """One wall as seen from each body: distance [m] and components of its normal, or both its ends [m]."""

    gap: Row
    along: Row
    across: Row
    from_x: Row
    from_y: Row
    to_x: Row
    to_y: Row


class Line(NamedTuple):
    """The line of one step over a grid, in grid units, lower end first where rows are concerned."""

    from_u: Row
    from_v: Row
    to_u: Row
    to_v: Row
    slope: Row  # columns passed per row
    shift: Row  # 1 where a line through a corner visits, below it, the column left of the corner; else 0
    leftmost: Row
    rightmost: Row
    bottom: Row
    top: Row
    at_bottom: Row  # the column of the lower end
    at_top: Row
    below: Row  # the column in which it meets a border between rows, in the row below it
    above: Row
    entry: Row  # the column in which it meets the lower border of a row


class Lanes(NamedTuple):
    """The state of a block of trials."""

    pose: Poses
    proposed: Poses  # after the step, if nothing is in the way
    low: Row  # how far the body's nearest point would be from a wall; 0 and less: in touch
    stalled: Row  # 1 where the last step was blocked, else 0
    n_stalls: NDArray[np.int32]
    step_length: Row  # at full output [m]
    step_turn: Row  # at full output, in whole turns
    noise: Row
    sensor_range: Row  # [m]
    fractions: Rows  # (s,) distance as a part of the range, per sensor
    rates: Rows  # (s,) room
    seen: Seen
    counters: Words  # (3,) the fixed words of each trial's random numbers
    words: Words  # (4,) random, and room
    values: Rows  # (m,) activations: inputs, outputs, hidden nodes
    before: Rows  # (m,) those of the step before, in recurrent networks
    total: Row  # room
    line: Line
    visited: Words  # (rows * words,) a bit a column, along the line
    fresh: Words  # ((rows + 1) * words,) those visited first in this step, from the first row of its line on
    any_fresh: NDArray[np.uint32]
    ends: Words  # (rows * words,) at the ends of steps
    n_line: NDArray[np.int32]


def _row(like):
    return np.zeros(LANES, like.dtype)


def _poses(like):
    return Poses(*(_row(like) for _ in Poses._fields))


def make_lanes(like, n_sensors, n_nodes, columns, rows):
    """Room for a block of trials in the precision of the array `like`."""
    real = like.dtype
    words = -(-columns // 32)
    return Lanes(
        pose=_poses(like),
        proposed=_poses(like),
        low=_row(like),
        stalled=_row(like),
        n_stalls=np.zeros(LANES, np.int32),
        step_length=_row(like),
        step_turn=_row(like),
        noise=_row(like),
        sensor_range=_row(like),
        fractions=np.zeros((n_sensors, LANES), real),
        rates=np.zeros((n_sensors, LANES), real),
        seen=Seen(*(_row(like) for _ in Seen._fields)),
        counters=np.zeros((3, LANES), np.uint32),
        words=np.zeros((4, LANES), np.uint32),
        values=np.zeros((n_nodes, LANES), real),
        before=np.zeros((n_nodes, LANES), real),
        total=_row(like),
        line=Line(*(_row(like) for _ in Line._fields)),
        visited=np.zeros((rows * words, LANES), np.uint32),
        fresh=np.zeros(((rows + 1) * words, LANES), np.uint32),
        any_fresh=np.zeros(LANES, np.uint32),
        ends=np.zeros((rows * words, LANES), np.uint32),
        n_line=np.zeros(LANES, np.int32),
    )


@stage
def fill(row, value):
    """The same number in every lane."""
    for lane in range(LANES):
        row[lane] = value


@stage
def copy_row(source, target):
    """The same numbers in another row."""
    for lane in range(LANES):
        target[lane] = source[lane]


@stage
def keep_where_low(low, old, new):
    """The new numbers, but the old ones where `low` is not above zero."""
    real = low.dtype.type
    for lane in range(LANES):
        before = unmasked(old[lane])
        after = new[lane]
        bar = low[lane]
        old[lane] = before if bar <= real(0.0) else after


@kernel
def any_above_zero(row):
    """Whether any lane is above 0."""
    n = 0
    for lane in range(LANES):
        n += 1 if row[lane] > 0 else 0
    return n > 0
