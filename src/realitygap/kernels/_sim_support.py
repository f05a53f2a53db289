"""The corners of outlines that lie lowest along a direction, in lanes."""

from __future__ import annotations

from ._compile import stage
from ._lanes import LANES, fill
from ._sim_outline import PER_CORNER

FAR = 1e9  # farther than anything [m]


@stage
def _height(along, across, x, y, low):
    for lane in range(LANES):
        height = along[lane] * x[lane] + across[lane] * y[lane]
        least = low[lane]
        low[lane] = height if height < least else least


@stage
def _height_of_four(along, across, x, y, x_1, y_1, x_2, y_2, x_3, y_3, low):
    for lane in range(LANES):
        a = along[lane]
        b = across[lane]
        one = a * x[lane] + b * y[lane]
        two = a * x_1[lane] + b * y_1[lane]
        three = a * x_2[lane] + b * y_2[lane]
        four = a * x_3[lane] + b * y_3[lane]
        least = low[lane]
        height = two if two < one else one
        other = four if four < three else three
        height = other if other < height else height
        low[lane] = height if height < least else least


@stage
def low_height(p, outline, n, along, across, low):
    """How low the lowest of n corners lies along a normal.

    Args:
        p: (rows, LANES) the corners are in rows `outline` and on, PER_CORNER for each.
        outline, n: Where, and how many.
        along, across: The normal, in the frame of the corners.
        low: Written.
    """
    fill(low, low.dtype.type(FAR))
    for four in range(n >> 2):
        row = outline + 4 * PER_CORNER * four
        _height_of_four(
            along, across, p[row], p[row + 1], p[row + PER_CORNER], p[row + PER_CORNER + 1],
            p[row + 2 * PER_CORNER], p[row + 2 * PER_CORNER + 1],
            p[row + 3 * PER_CORNER], p[row + 3 * PER_CORNER + 1], low,
        )  # fmt: skip
    for corner in range(n & ~3, n):
        row = outline + PER_CORNER * corner
        _height(along, across, p[row], p[row + 1], low)


@stage
def _lower(along, across, x, y, low, point_x, point_y):
    for lane in range(LANES):
        c_x = x[lane]
        c_y = y[lane]
        height = along[lane] * c_x + across[lane] * c_y
        least = low[lane]
        p_x = point_x[lane]
        p_y = point_y[lane]
        lower = height < least
        low[lane] = height if lower else least
        point_x[lane] = c_x if lower else p_x
        point_y[lane] = c_y if lower else p_y


@stage
def _lower_of_two(along, across, x, y, other_x, other_y, low, point_x, point_y):
    for lane in range(LANES):
        c_x = x[lane]
        c_y = y[lane]
        d_x = other_x[lane]
        d_y = other_y[lane]
        one = along[lane] * c_x + across[lane] * c_y
        two = along[lane] * d_x + across[lane] * d_y
        least = low[lane]
        p_x = point_x[lane]
        p_y = point_y[lane]
        second = two < one
        height = two if second else one
        c_x = d_x if second else c_x
        c_y = d_y if second else c_y
        lower = height < least
        low[lane] = height if lower else least
        point_x[lane] = c_x if lower else p_x
        point_y[lane] = c_y if lower else p_y


@stage
def lowest(p, outline, n, along, across, low, point_x, point_y):
    """How low the lowest of n corners lies along a normal, and which it is: the first of several.

    Args:
        p, outline, n, along, across: As in `low_height`.
        low, point_x, point_y: Written: its height, and where it is.
    """
    fill(low, low.dtype.type(FAR))
    for pair in range(n >> 1):
        row = outline + 2 * PER_CORNER * pair
        _lower_of_two(
            along, across, p[row], p[row + 1], p[row + PER_CORNER], p[row + PER_CORNER + 1], low, point_x, point_y
        )  # fmt: skip
    if n & 1:
        row = outline + PER_CORNER * (n - 1)
        _lower(along, across, p[row], p[row + 1], low, point_x, point_y)
