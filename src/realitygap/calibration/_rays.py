"""The obstacles in the rays of a range sensor in an arena, for many poses in one call."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from realitygap.world import Arena, RangeSensor

from ._prior import Floats

GRAZING = 1e-3  # the least cosine at which something is met


def rays_of(sensor: RangeSensor, poses: Floats, arena: Arena) -> tuple[Floats, Floats]:
    """Return the lengths of the rays of a sensor, and the cosines at the obstacles that they meet.

    Args:
        sensor: Sensor of the robot.
        poses: (n, 3) x [m], y [m], heading [rad].
        arena: Round things count as polygons.

    Returns:
        (n, rays) distances [m], at most the sensor's reach, and cosines between ray and normal, 1 if the ray meets
        nothing.
    """
    x, y, heading = poses[:, None].T.transpose(0, 2, 1)
    cosine, sine = np.cos(heading), np.sin(heading)
    spread = np.linspace(-sensor.cone, sensor.cone, sensor.rays) if sensor.rays > 1 else np.zeros(1)
    from_x = x + cosine * sensor.x - sine * sensor.y
    from_y = y + sine * sensor.x + cosine * sensor.y
    along, beside = np.cos(heading + sensor.direction + spread), np.sin(heading + sensor.direction + spread)
    distances, cosines = np.full(along.shape, sensor.reach), np.ones(along.shape)
    for x1, y1, x2, y2 in _segments(arena):
        edge_x, edge_y = x2 - x1, y2 - y1
        length = np.hypot(edge_x, edge_y)
        if length == 0:
            continue
        facing = (along * edge_y - beside * edge_x) / length  # cosine to one of both normals
        safe = np.where(np.abs(facing) < GRAZING, GRAZING, facing)
        far = ((x1 - from_x) * edge_y - (y1 - from_y) * edge_x) / length / safe
        place = ((from_x + far * along - x1) * edge_x + (from_y + far * beside - y1) * edge_y) / length**2
        hit = (np.abs(facing) >= GRAZING) & (far >= 0) & (far < distances) & (place >= 0) & (place <= 1)
        distances, cosines = np.where(hit, far, distances), np.where(hit, np.abs(facing), cosines)
    return distances, cosines


def _segments(arena: Arena) -> list[tuple[float, float, float, float]]:
    """Return all sides of the obstacles in an arena; round ones as short lines."""
    sides = list(arena.walls)
    for obstacle in arena.obstacles:
        points = obstacle.outline()
        sides += [(*first, *second) for first, second in pairwise((*points, points[0]))]
    return sides
