"""Novelty of behaviors that are points of a plane."""

from __future__ import annotations

import math

from realitygap.kernels.compile.decorators import inlined, kernel

from .novelty import mean_of_nearest


@inlined
def _distances(x, y, xs, ys, n, distance):
    for k in range(n):
        dx = xs[k] - x
        dy = ys[k] - y
        distance[k] = math.sqrt(dx * dx + dy * dy)


@kernel
def point_novelty(points, archive, n_archive, distance, nearest, novelty):
    """Mean distance of each point to its nearest ones among the others and the archived.

    Args:
        points: (2, n) float64, x and y.
        archive: (2, >= n_archive) float64.
        n_archive: How many points are in it.
        distance: (>= n + n_archive,) room.
        nearest: (k,) room: as many neighbors count.
        novelty: (n,) written.

    Source: Lehman & Stanley (2011), sparseness.
    """
    n = novelty.size
    for row in range(n):
        x = points[0, row]
        y = points[1, row]
        _distances(x, y, points[0], points[1], n, distance)
        _distances(x, y, archive[0], archive[1], n_archive, distance[n:])
        distance[row] = -1.0
        novelty[row] = mean_of_nearest(distance, n + n_archive, nearest)
