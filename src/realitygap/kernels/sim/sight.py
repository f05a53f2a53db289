"""The obstacles between two points, and the distance of a point to the nearest thing to touch, in lanes.

Obstacles and open walls are convex outlines grown by a radius (`row_shape` of the structure): their corners x, y, each
with the outward normal and the length of the edge that begins there, then the radius. The walls of an enclosed room
are half-planes.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import stage
from realitygap.kernels.math.bits import unmasked
from realitygap.kernels.math.lanes import LANES, fill

PER_CORNER = 5  # rows
FAR = 1e9  # farther than anything [m]


@stage
def _behind(normal_x, normal_y, offset, x, y, shade, lit):
    real = lit.dtype.type
    for lane in range(LANES):
        outside = normal_x[lane] * x[lane] + normal_y[lane] * y[lane] < offset[lane]
        before = unmasked(lit[lane])
        lit[lane] = real(shade) if outside else before


@stage
def _pass_corner(from_x, from_y, to_x, to_y, x, y, radius, shade, lit):
    """Whether the way comes nearer to a corner than its radius."""
    real = lit.dtype.type
    for lane in range(LANES):
        along_x = to_x[lane] - from_x[lane]
        along_y = to_y[lane] - from_y[lane]
        off_x = x[lane] - from_x[lane]
        off_y = y[lane] - from_y[lane]
        square = along_x * along_x + along_y * along_y
        part = (off_x * along_x + off_y * along_y) / (square if square > real(0.0) else real(1.0))
        part = part if part < real(1.0) else real(1.0)
        part = part if part > real(0.0) else real(0.0)
        off_x = off_x - part * along_x
        off_y = off_y - part * along_y
        r = radius[lane]
        before = unmasked(lit[lane])
        lit[lane] = real(shade) if off_x * off_x + off_y * off_y < r * r else before


@stage
def _cross_edge(from_x, from_y, to_x, to_y, x1, y1, x2, y2, shade, lit):
    real = lit.dtype.type
    for lane in range(LANES):
        along_x = to_x[lane] - from_x[lane]
        along_y = to_y[lane] - from_y[lane]
        edge_x = x2[lane] - x1[lane]
        edge_y = y2[lane] - y1[lane]
        off_x = x1[lane] - from_x[lane]
        off_y = y1[lane] - from_y[lane]
        turn = along_x * edge_y - along_y * edge_x
        way = off_x * edge_y - off_y * edge_x
        edge = off_x * along_y - off_y * along_x
        side = real(-1.0) if turn < real(0.0) else real(1.0)
        turn = turn * side
        way = way * side
        edge = edge * side
        hit = (turn > real(0.0)) & (way >= real(0.0)) & (way <= turn) & (edge >= real(0.0)) & (edge <= turn)
        before = unmasked(lit[lane])
        lit[lane] = real(shade) if hit else before


@stage
def shade_light(shape, p, from_x, from_y, to_x, to_y, shade, lit):
    """`shade` where something stands between two points, else 1.

    A straight way meets a grown outline where it crosses an edge or comes within the radius of a corner.

    Args:
        shape: Structure.
        p: (rows, LANES) numbers and what follows from them.
        from_x, from_y, to_x, to_y: (LANES,) the eye and the light [m].
        shade: What of the light arrives in a shadow.
        lit: Written.
    """
    fill(lit, lit.dtype.type(1.0))
    if shape.enclosed:
        for w in range(shape.n_walls):
            plane = shape.row_plane + 3 * w
            _behind(p[plane], p[plane + 1], p[plane + 2], to_x, to_y, shade, lit)
    for q in range(shape.row_shape.size):
        first, n = shape.row_shape[q], shape.shape_corners[q]
        for corner in range(n):
            one = first + PER_CORNER * corner
            two = first + PER_CORNER * (corner + 1 if corner + 1 < n else 0)
            _pass_corner(
                from_x, from_y, to_x, to_y, p[one], p[one + 1], p[first + PER_CORNER * n], shade, lit
            )
            if n > 1:
                _cross_edge(
                    from_x, from_y, to_x, to_y, p[one], p[one + 1], p[two], p[two + 1], shade, lit
                )  # fmt: skip


@stage
def _from_plane(normal_x, normal_y, offset, x, y, gap):
    for lane in range(LANES):
        one = normal_x[lane] * x[lane] + normal_y[lane] * y[lane] - offset[lane]
        least = unmasked(gap[lane])
        gap[lane] = one if one < least else least


@stage
def _from_edge(x1, y1, normal_x, normal_y, length, x, y, outside, distance):
    """The least distance to an edge, and the largest to the line of one, above 0 outside."""
    real = distance.dtype.type
    for lane in range(LANES):
        off_x = x[lane] - x1[lane]
        off_y = y[lane] - y1[lane]
        across = off_x * normal_x[lane] + off_y * normal_y[lane]
        part = (
            off_y * normal_x[lane] - off_x * normal_y[lane]
        )  # along the edge, which has its outside on the right
        long = length[lane]
        part = part if part < long else long
        part = part if part > real(0.0) else real(0.0)
        off_x = off_x + part * normal_y[lane]
        off_y = off_y - part * normal_x[lane]
        one = np.sqrt(off_x * off_x + off_y * off_y)
        least = unmasked(distance[lane])
        distance[lane] = one if one < least else least
        most = outside[lane]
        outside[lane] = across if across > most else most


@stage
def _grow(outside, distance, radius, solid, gap):
    real = gap.dtype.type
    for lane in range(LANES):
        inside = outside[lane] <= real(0.0)
        one = distance[lane]
        one = -one if inside & solid else one
        one = one - radius[lane]
        least = unmasked(gap[lane])
        gap[lane] = one if one < least else least


@stage
def gap_of_point(shape, p, x, y, outside, distance, gap):
    """Compute the distance of points from the nearest wall or obstacle [m], below zero inside one.

    Args:
        shape: Structure.
        p: (rows, LANES) numbers and what follows from them.
        x, y: (LANES,) [m].
        outside, distance: Room.
        gap: Written.
    """
    real = gap.dtype.type
    fill(gap, real(FAR))
    if shape.enclosed:
        for w in range(shape.n_walls):
            plane = shape.row_plane + 3 * w
            _from_plane(p[plane], p[plane + 1], p[plane + 2], x, y, gap)
    for q in range(shape.row_shape.size):
        first, n = shape.row_shape[q], shape.shape_corners[q]
        fill(outside, real(-FAR))
        fill(distance, real(FAR))
        for corner in range(n):
            row = first + PER_CORNER * corner
            _from_edge(p[row], p[row + 1], p[row + 2], p[row + 3], p[row + 4], x, y, outside, distance)
        _grow(outside, distance, p[first + PER_CORNER * n], n > 2, gap)


@stage
def answer_bump(gap, reach, reading):
    """1 where something is within a bump sensor's reach, else 0."""
    real = reading.dtype.type
    for lane in range(LANES):
        reading[lane] = real(1.0) if gap[lane] <= reach[lane] else real(0.0)
