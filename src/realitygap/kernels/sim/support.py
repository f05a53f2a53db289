"""The corners of outlines that lie lowest along a direction, in vectors."""

from __future__ import annotations

from realitygap.kernels.compile.decorators import inlined
from realitygap.kernels.math.vectors import load, pick, spread

from .outline import PER_CORNER

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
