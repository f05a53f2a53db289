"""Outlines of bodies, obstacles and walls for contact and rays: corners, normals of edges, and lowest corners."""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import inlined, stage
from realitygap.kernels.math.bits import unmasked
from realitygap.kernels.math.elementary import sin_cos_of_turns
from realitygap.kernels.math.lanes import LANES, fill
from realitygap.kernels.math.vectors import load, pick, spread

# Rows of a corner of an outline, which is counter-clockwise: where it is, and of the edge that begins there
# its outward normal and length.
X, Y, NORMAL_X, NORMAL_Y, LENGTH = 0, 1, 2, 3, 4
PER_CORNER = 5


@stage
def _add_area(x0, y0, x1, y1, area):
    for lane in range(LANES):
        area[lane] = area[lane] + (x0[lane] * y1[lane] - y0[lane] * x1[lane])


@stage
def _choose(area, x, y, other_x, other_y, to_x, to_y):
    """A corner, or the one that comes instead where the outline is given clockwise."""
    real = x.dtype.type
    for lane in range(LANES):
        one_x = x[lane]
        one_y = y[lane]
        two_x = other_x[lane]
        two_y = other_y[lane]
        kept = area[lane] >= real(0.0)
        to_x[lane] = one_x if kept else two_x
        to_y[lane] = one_y if kept else two_y


@stage
def _edge(x0, y0, x1, y1, normal_x, normal_y, length):
    real = x0.dtype.type
    for lane in range(LANES):
        along_x = x1[lane] - x0[lane]
        along_y = y1[lane] - y0[lane]
        size = np.sqrt(along_x * along_x + along_y * along_y)
        scale = real(1.0) / size if size > real(0.0) else real(0.0)
        normal_x[lane] = along_y * scale
        normal_y[lane] = -along_x * scale
        length[lane] = size


@stage
def edges_of(p, n, outline):
    """Normals and lengths of an outline whose n corners are in place."""
    for corner in range(n):
        row = outline + PER_CORNER * corner
        to = outline + PER_CORNER * (corner + 1 if corner + 1 < n else 0)
        _edge(p[row], p[row + 1], p[to], p[to + 1], p[row + 2], p[row + 3], p[row + 4])


@stage
def outline_of(p, first, n, outline, area):
    """The outline of a polygon whose corners are in rows x, y, x, y ... from `first` on.

    Args:
        p: (rows, LANES) read and written.
        first, n: Where its corners are, and how many; in order, either way round.
        outline: Written from this row on.
        area: (LANES,) room.
    """
    fill(area, p.dtype.type(0.0))
    for corner in range(n):
        one = first + 2 * corner
        two = first + 2 * (corner + 1 if corner + 1 < n else 0)
        _add_area(p[one], p[one + 1], p[two], p[two + 1], area)
    for corner in range(n):
        row = outline + PER_CORNER * corner
        one = first + 2 * corner
        two = first + 2 * (n - 1 - corner)
        _choose(area, p[one], p[one + 1], p[two], p[two + 1], p[row], p[row + 1])
    edges_of(p, n, outline)


@stage
def reach_of(x, y, radius, axle, reach):
    """Move a corner's x to be from the axle, and note how far it reaches."""
    for lane in range(LANES):
        shifted = x[lane] - axle[lane]
        x[lane] = shifted
        far = np.sqrt(shifted * shifted + y[lane] * y[lane]) + radius[lane]
        so_far = unmasked(reach[lane])
        reach[lane] = far if far > so_far else so_far


@stage
def bounds_of(x, y, radius, least_x, most_x, least_y, most_y):
    """Widen the bounds of a body, in the frame of its axle, by a corner."""
    for lane in range(LANES):
        c_x = x[lane]
        c_y = y[lane]
        r = radius[lane]
        lowest = least_x[lane]
        highest = most_x[lane]
        rightmost = least_y[lane]
        leftmost = most_y[lane]
        least_x[lane] = c_x - r if c_x - r < lowest else lowest
        most_x[lane] = c_x + r if c_x + r > highest else highest
        least_y[lane] = c_y - r if c_y - r < rightmost else rightmost
        most_y[lane] = c_y + r if c_y + r > leftmost else leftmost


@stage
def _set_down(middle_x, middle_y, heading, x, y, normal_x, normal_y):
    for lane in range(LANES):
        sine, cosine = sin_cos_of_turns(heading[lane])
        own_x = x[lane]
        own_y = y[lane]
        x[lane] = middle_x[lane] + (own_x * cosine - own_y * sine)
        y[lane] = middle_y[lane] + (own_x * sine + own_y * cosine)
        own_x = normal_x[lane]
        own_y = normal_y[lane]
        normal_x[lane] = own_x * cosine - own_y * sine
        normal_y[lane] = own_x * sine + own_y * cosine


@stage
def _copy(source, target):
    for lane in range(LANES):
        target[lane] = source[lane]


@stage
def place_obstacle(shape, lanes, obstacle):
    """The outline of an obstacle from its own numbers, wherever they say that it is."""
    p = lanes.p
    first, outline, n = (
        shape.row_obstacle[obstacle],
        shape.row_shape[obstacle],
        shape.obstacle_corners[obstacle],
    )
    if n == 0:
        fill(p[outline + 2], p.dtype.type(0.0))
        fill(p[outline + 3], p.dtype.type(0.0))
        fill(p[outline + 4], p.dtype.type(0.0))
        _copy(p[first], p[outline])
        _copy(p[first + 1], p[outline + 1])
        _copy(p[first + 3], p[outline + 5])
        return
    outline_of(p, first + 4, n, outline, lanes.total)
    for corner in range(n):
        row = outline + PER_CORNER * corner
        _set_down(p[first], p[first + 1], p[first + 2], p[row], p[row + 1], p[row + 2], p[row + 3])
    _copy(p[first + 3], p[outline + PER_CORNER * n])


FAR = 1e9  # farther than anything [m]
SURELY = 1e-5  # [m] by which boxes must be apart for what is in them to be so: more than rounding does


@inlined
def low_height(p, outline, n, along, across, lane):
    """Return the height of the lowest of n corners along a normal.

    Args:
        p: (rows, LANES) the corners are in rows `outline` and on, PER_CORNER for each.
        outline, n: Where, and how many.
        along, across: Vectors: the normal, in the frame of the corners.
        lane: The first of the lanes.
    """
    low = spread(p.dtype.type(FAR))
    for corner in range(n):
        row = outline + PER_CORNER * corner
        height = along * load(p, row, lane) + across * load(p, row + 1, lane)
        low = pick(height < low, height, low)
    return low


@inlined
def lowest(p, outline, n, along, across, lane):
    """Return the position of the lowest of n corners along a normal: the first of several.

    Args:
        p, outline, n, along, across, lane: As in `low_height`.
    """
    low, x, y = spread(p.dtype.type(FAR)), along, across
    for corner in range(n):
        row = outline + PER_CORNER * corner
        c_x, c_y = load(p, row, lane), load(p, row + 1, lane)
        height = along * c_x + across * c_y
        lower = height < low
        low, x, y = pick(lower, height, low), pick(lower, c_x, x), pick(lower, c_y, y)
    return x, y


@inlined
def lowest_two(p, outline, n, along, across, lane):
    """The lowest two of n corners along a normal: height, x and y of each. The second of one corner is FAR.

    Args:
        p, outline, n, along, across, lane: As in `low_height`.
    """
    low = spread(p.dtype.type(FAR))
    next_low, x, y, next_x, next_y = low, along, across, along, across
    for corner in range(n):
        row = outline + PER_CORNER * corner
        c_x, c_y = load(p, row, lane), load(p, row + 1, lane)
        height = along * c_x + across * c_y
        lower, second = height < low, height < next_low
        # The next is what was lowest, or the corner, or what it was.
        next_low = pick(lower, low, pick(second, height, next_low))
        next_x = pick(lower, x, pick(second, c_x, next_x))
        next_y = pick(lower, y, pick(second, c_y, next_y))
        low, x, y = pick(lower, height, low), pick(lower, c_x, x), pick(lower, c_y, y)
    return low, x, y, next_low, next_x, next_y
