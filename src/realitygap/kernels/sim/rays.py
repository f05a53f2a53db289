"""Distances along rays to walls and obstacles, in lanes: the nearest hit is kept as a fraction, divided once.

The denominator is the cosine between the ray and the normal of what it meets.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import stage
from realitygap.kernels.math.bits import unmasked
from realitygap.kernels.math.lanes import LANES, fill

from .outline import PER_CORNER

GRAZING = 1e-3  # the least cosine at which a disc is met


@stage
def see_plane(normal_x, normal_y, offset, pose, gap, along, across):
    """A line as seen from each body: distance of the body's origin and components of the normal ahead and left."""
    x, y, sine, cosine = pose.x, pose.y, pose.sine, pose.cosine
    for lane in range(LANES):
        n_x = normal_x[lane]
        n_y = normal_y[lane]
        gap[lane] = n_x * x[lane] + n_y * y[lane] - offset[lane]
        along[lane] = n_x * cosine[lane] + n_y * sine[lane]
        across[lane] = n_y * cosine[lane] - n_x * sine[lane]


@stage
def _begin(reach, distance, rate):
    real = distance.dtype.type
    for lane in range(LANES):
        distance[lane] = reach[lane]
        rate[lane] = real(1.0)


@stage
def _meet_plane(center, along, across, forward, left, cosine, sine, distance, rate):
    real = distance.dtype.type
    for lane in range(LANES):
        facing = along[lane]
        beside = across[lane]
        gap = center[lane] + facing * forward[lane] + beside * left[lane]
        gap = gap if gap > real(0.0) else real(0.0)
        approach = -(facing * cosine[lane] + beside * sine[lane])
        nearest = unmasked(distance[lane])
        nearest_rate = rate[lane]
        # gap / approach < nearest / nearest_rate; from a wall behind the approach is below zero
        nearer = gap * nearest_rate < nearest * approach
        distance[lane] = gap if nearer else nearest
        rate[lane] = approach if nearer else nearest_rate


@stage
def _corner(x, y, normal_x, normal_y, pose, to_x, to_y, ahead, aside):
    """A corner and the normal of its edge, as seen from each body."""
    from_x, from_y, sine, cosine = pose.x, pose.y, pose.sine, pose.cosine
    for lane in range(LANES):
        d_x = x[lane] - from_x[lane]
        d_y = y[lane] - from_y[lane]
        n_x = normal_x[lane]
        n_y = normal_y[lane]
        s = sine[lane]
        c = cosine[lane]
        to_x[lane] = d_x * c + d_y * s
        to_y[lane] = d_y * c - d_x * s
        ahead[lane] = n_x * c + n_y * s
        aside[lane] = n_y * c - n_x * s


@stage
def _outside(enter, enter_rate, leave, leave_rate):
    real = enter.dtype.type
    for lane in range(LANES):
        enter[lane] = real(0.0)
        enter_rate[lane] = real(1.0)
        leave[lane] = real(1e9)
        leave_rate[lane] = real(1.0)


@stage
def _clip(x, y, ahead, aside, forward, left, cosine, sine, enter, enter_rate, leave, leave_rate):
    """Shorten the part of a ray that is inside a convex polygon, by one of its faces."""
    real = enter.dtype.type
    for lane in range(LANES):
        a = ahead[lane]
        b = aside[lane]
        gap = a * (forward[lane] - x[lane]) + b * (left[lane] - y[lane])
        rate = -(a * cosine[lane] + b * sine[lane])
        n = unmasked(enter[lane])
        n_rate = enter_rate[lane]
        m = leave[lane]
        m_rate = leave_rate[lane]
        enters = (rate > real(0.0)) & (gap * n_rate > n * rate)
        enter[lane] = gap if enters else n
        enter_rate[lane] = rate if enters else n_rate
        leaves = (rate < real(0.0)) & (gap * m_rate > m * rate)
        misses = (rate == real(0.0)) & (gap > real(0.0))
        m = -gap if leaves else m
        leave[lane] = real(-1.0) if misses else m
        leave_rate[lane] = -rate if leaves else m_rate


@stage
def _take_clipped(enter, enter_rate, leave, leave_rate, distance, rate):
    for lane in range(LANES):
        n = enter[lane]
        n_rate = enter_rate[lane]
        nearest = unmasked(distance[lane])
        nearest_rate = rate[lane]
        hit = (n * leave_rate[lane] <= leave[lane] * n_rate) & (n * nearest_rate < nearest * n_rate)
        distance[lane] = n if hit else nearest
        rate[lane] = n_rate if hit else nearest_rate


@stage
def _meet_edge(x, y, ahead, aside, length, radius, forward, left, cosine, sine, distance, rate):
    """A ray meets an edge moved out by a radius, from outside, between the edge's ends."""
    real = distance.dtype.type
    for lane in range(LANES):
        a = ahead[lane]
        b = aside[lane]
        off_x = forward[lane] - x[lane]
        off_y = left[lane] - y[lane]
        gap = a * off_x + b * off_y - radius[lane]
        approach = -(a * cosine[lane] + b * sine[lane])
        along = (a * off_y - b * off_x) * approach + (a * sine[lane] - b * cosine[lane]) * gap
        nearest = unmasked(distance[lane])
        nearest_rate = rate[lane]
        hit = (
            (approach > real(0.0))
            & (gap >= real(0.0))
            & (along >= real(0.0))
            & (along <= length[lane] * approach)
            & (gap * nearest_rate < nearest * approach)
        )
        distance[lane] = gap if hit else nearest
        rate[lane] = approach if hit else nearest_rate


@stage
def _meet_disc(x, y, radius, forward, left, cosine, sine, distance, rate):
    real = distance.dtype.type
    for lane in range(LANES):
        off_x = x[lane] - forward[lane]
        off_y = y[lane] - left[lane]
        along = off_x * cosine[lane] + off_y * sine[lane]
        aside = off_y * cosine[lane] - off_x * sine[lane]
        under = radius[lane] * radius[lane] - aside * aside
        half = np.sqrt(under if under > real(0.0) else real(0.0))
        gap = along - half
        r = radius[lane]
        cosine_there = half / (r if r > real(0.0) else real(1.0))
        cosine_there = cosine_there if cosine_there > real(GRAZING) else real(GRAZING)
        nearest = unmasked(distance[lane])
        nearest_rate = rate[lane]
        hit = (under >= real(0.0)) & (gap >= real(0.0)) & (gap * nearest_rate < nearest)
        distance[lane] = gap * cosine_there if hit else nearest
        rate[lane] = cosine_there if hit else nearest_rate


@stage
def _meet_round(shape, lanes, q):
    """Rays meet a polygon with rounded corners, or a disc."""
    p, distances, rates, spare = lanes.p, lanes.distances, lanes.rates, lanes.spare
    n, first = shape.shape_corners[q], shape.row_shape[q]
    radius = first + PER_CORNER * n
    for corner in range(n):
        row = first + PER_CORNER * corner
        _corner(
            p[row], p[row + 1], p[row + 2], p[row + 3], lanes.pose, spare[0], spare[1], spare[2], spare[3]
        )
        for s in range(shape.row_range.size):
            sensor = shape.row_range[s]
            for ray in range(shape.first_ray[s], shape.first_ray[s + 1]):
                way = shape.row_ray + 2 * ray
                if n > 1:
                    _meet_edge(
                        spare[0], spare[1], spare[2], spare[3], p[row + 4], p[radius], p[sensor], p[sensor + 1],
                        p[way], p[way + 1], distances[ray], rates[ray],
                    )  # fmt: skip
                _meet_disc(
                    spare[0], spare[1], p[radius], p[sensor], p[sensor + 1], p[way], p[way + 1],
                    distances[ray], rates[ray],
                )  # fmt: skip


@stage
def _meet_polygon(shape, lanes, q):
    """Rays meet a convex polygon with sharp corners."""
    p, clips, spare = lanes.p, lanes.clips, lanes.spare
    n, first = shape.shape_corners[q], shape.row_shape[q]
    for ray in range(lanes.distances.shape[0]):
        _outside(clips[4 * ray], clips[4 * ray + 1], clips[4 * ray + 2], clips[4 * ray + 3])
    for corner in range(n):
        row = first + PER_CORNER * corner
        _corner(
            p[row], p[row + 1], p[row + 2], p[row + 3], lanes.pose, spare[0], spare[1], spare[2], spare[3]
        )
        for s in range(shape.row_range.size):
            sensor = shape.row_range[s]
            for ray in range(shape.first_ray[s], shape.first_ray[s + 1]):
                way = shape.row_ray + 2 * ray
                _clip(
                    spare[0], spare[1], spare[2], spare[3], p[sensor], p[sensor + 1], p[way], p[way + 1],
                    clips[4 * ray], clips[4 * ray + 1], clips[4 * ray + 2], clips[4 * ray + 3],
                )  # fmt: skip
    for ray in range(lanes.distances.shape[0]):
        _take_clipped(
            clips[4 * ray], clips[4 * ray + 1], clips[4 * ray + 2], clips[4 * ray + 3],
            lanes.distances[ray], lanes.rates[ray],
        )  # fmt: skip


@stage
def _meet_wall(shape, lanes, q):
    """Rays meet a straight wall of no thickness, from either side."""
    p, distances, rates, spare = lanes.p, lanes.distances, lanes.rates, lanes.spare
    first = shape.row_shape[q]
    fill(spare[4], lanes.low.dtype.type(0.0))
    for side in range(2):
        row = first + PER_CORNER * side
        _corner(
            p[row], p[row + 1], p[row + 2], p[row + 3], lanes.pose, spare[0], spare[1], spare[2], spare[3]
        )
        for s in range(shape.row_range.size):
            sensor = shape.row_range[s]
            for ray in range(shape.first_ray[s], shape.first_ray[s + 1]):
                way = shape.row_ray + 2 * ray
                _meet_edge(
                    spare[0], spare[1], spare[2], spare[3], p[row + 4], spare[4], p[sensor], p[sensor + 1],
                    p[way], p[way + 1], distances[ray], rates[ray],
                )  # fmt: skip


@stage
def _meet_shape(shape, lanes, q):
    n = shape.shape_corners[q]
    if (q < shape.obstacle_round.size and shape.obstacle_round[q]) or n == 1:
        _meet_round(shape, lanes, q)
    elif n == 2:
        _meet_wall(shape, lanes, q)
    else:
        _meet_polygon(shape, lanes, q)


@stage
def _divide(distance, rate):
    for lane in range(LANES):
        distance[lane] = distance[lane] / rate[lane]


@stage
def cast_rays(shape, lanes):
    """Distance along each ray of the range sensors to what is nearest [m], at most the sensor's reach.

    Args:
        shape: Structure.
        lanes: Numbers and poses are read; `distances` (rays, LANES) written, and `rates`: the cosine between each ray
            and the normal of what it meets, 1 where there is nothing.
    """
    p, distances, rates, spare = lanes.p, lanes.distances, lanes.rates, lanes.spare
    for s in range(shape.row_range.size):
        for ray in range(shape.first_ray[s], shape.first_ray[s + 1]):
            _begin(p[shape.row_range[s] + 4], distances[ray], rates[ray])
    if shape.enclosed:
        for w in range(shape.n_walls):
            plane = shape.row_plane + 3 * w
            see_plane(p[plane], p[plane + 1], p[plane + 2], lanes.pose, spare[0], spare[1], spare[2])
            for s in range(shape.row_range.size):
                sensor = shape.row_range[s]
                for ray in range(shape.first_ray[s], shape.first_ray[s + 1]):
                    direction = shape.row_ray + 2 * ray
                    _meet_plane(
                        spare[0], spare[1], spare[2], p[sensor], p[sensor + 1], p[direction], p[direction + 1],
                        distances[ray], rates[ray],
                    )  # fmt: skip
    for q in range(shape.row_shape.size):
        _meet_shape(shape, lanes, q)
    for ray in range(distances.shape[0]):
        _divide(distances[ray], rates[ray])
