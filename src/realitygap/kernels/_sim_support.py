"""The corners of outlines that lie lowest along a direction, in lanes."""

from __future__ import annotations

from ._bits import unmasked
from ._compile import stage
from ._lanes import LANES, fill
from ._sim_outline import PER_CORNER

FAR = 1e9  # farther than anything [m]


@stage
def _height(along, across, x, y, low):
    for lane in range(LANES):
        height = along[lane] * x[lane] + across[lane] * y[lane]
        least = unmasked(low[lane])
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
        least = unmasked(low[lane])
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
        least = unmasked(low[lane])
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
        least = unmasked(low[lane])
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


@stage
def _lower_pair(along, across, x, y, other_x, other_y, low, point_x, point_y, next_low, next_x, next_y):
    """Merge two corners into the lowest two, which are in order."""
    for lane in range(LANES):
        a = along[lane]
        b = across[lane]
        c_x = x[lane]
        c_y = y[lane]
        d_x = other_x[lane]
        d_y = other_y[lane]
        one = a * c_x + b * c_y
        two = a * d_x + b * d_y
        swapped = two < one
        c = two if swapped else one
        d = one if swapped else two
        lower_x = d_x if swapped else c_x
        lower_y = d_y if swapped else c_y
        d_x = c_x if swapped else d_x
        d_y = c_y if swapped else d_y
        least = unmasked(low[lane])
        p_x = point_x[lane]
        p_y = point_y[lane]
        then = next_low[lane]
        q_x = next_x[lane]
        q_y = next_y[lane]
        lower = c < least
        low[lane] = c if lower else least
        point_x[lane] = lower_x if lower else p_x
        point_y[lane] = lower_y if lower else p_y
        # The next is the lower one of what was lowest and the other corner, or of the next and the lower corner.
        c = d if lower else c
        lower_x = d_x if lower else lower_x
        lower_y = d_y if lower else lower_y
        then = least if lower else then
        q_x = p_x if lower else q_x
        q_y = p_y if lower else q_y
        lower = c < then
        next_low[lane] = c if lower else then
        next_x[lane] = lower_x if lower else q_x
        next_y[lane] = lower_y if lower else q_y


@stage
def _lower_one(along, across, x, y, low, point_x, point_y, next_low, next_x, next_y):
    for lane in range(LANES):
        c_x = x[lane]
        c_y = y[lane]
        c = along[lane] * c_x + across[lane] * c_y
        least = unmasked(low[lane])
        p_x = point_x[lane]
        p_y = point_y[lane]
        then = next_low[lane]
        q_x = next_x[lane]
        q_y = next_y[lane]
        lower = c < least
        low[lane] = c if lower else least
        point_x[lane] = c_x if lower else p_x
        point_y[lane] = c_y if lower else p_y
        c = least if lower else c
        c_x = p_x if lower else c_x
        c_y = p_y if lower else c_y
        lower = c < then
        next_low[lane] = c if lower else then
        next_x[lane] = c_x if lower else q_x
        next_y[lane] = c_y if lower else q_y


@stage
def lowest_two(p, outline, n, along, across, low, point_x, point_y, next_low, next_x, next_y):
    """The lowest two of n corners along a normal; of one corner there is no second: it is FAR.

    Args:
        p, outline, n, along, across: As in `low_height`.
        low, point_x, point_y, next_low, next_x, next_y: Written: the height and place of each.
    """
    fill(low, low.dtype.type(FAR))
    fill(next_low, low.dtype.type(FAR))
    for pair in range(n >> 1):
        row = outline + 2 * PER_CORNER * pair
        _lower_pair(
            along, across, p[row], p[row + 1], p[row + PER_CORNER], p[row + PER_CORNER + 1],
            low, point_x, point_y, next_low, next_x, next_y,
        )  # fmt: skip
    if n & 1:
        row = outline + PER_CORNER * (n - 1)
        _lower_one(along, across, p[row], p[row + 1], low, point_x, point_y, next_low, next_x, next_y)
