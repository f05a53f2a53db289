"""Distances along rays to walls and obstacles, in lanes: the nearest hit is kept as a fraction, divided once."""

from __future__ import annotations

from ._compile import stage
from ._lanes import LANES


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
        nearest = distance[lane]
        nearest_rate = rate[lane]
        # gap / approach < nearest / nearest_rate; from a wall behind the approach is below zero
        nearer = gap * nearest_rate < nearest * approach
        distance[lane] = gap if nearer else nearest
        rate[lane] = approach if nearer else nearest_rate


@stage
def _divide(distance, rate):
    for lane in range(LANES):
        distance[lane] = distance[lane] / rate[lane]


@stage
def cast_rays(shape, lanes):
    """Distance along each ray of the range sensors to what is nearest [m], at most the sensor's reach.

    Args:
        shape: Structure.
        lanes: Numbers and poses are read, `distances` (rays, LANES) written.
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
    for ray in range(distances.shape[0]):
        _divide(distances[ray], rates[ray])
