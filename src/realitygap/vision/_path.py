"""A trace as a line: points in an order in which it may have been drawn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ._links import STEP
from ._pixels import to_meters
from ._trace import Trace

Floats = NDArray[np.float64]

SPACING = 0.003  # between the points of a line [m]
REACH = 0.0065  # from a point to the next, at most [m]


def trace_path(trace: Trace, start: tuple[float, float]) -> Floats:
    """Return a line through all of a trace, from the start, (k, 2) [m]; at a crossing it goes straight.

    Paper does not tell in which order a line was drawn, nor how often.
    """
    points = _beads(trace)
    if not len(points):
        return points
    from scipy.spatial import cKDTree

    around = [np.array(near) for near in cKDTree(points).query_ball_point(points, REACH)]
    left = np.ones(len(points), np.bool_)
    here = int(np.argmin(np.sum((points - np.array(start)) ** 2, axis=1)))
    order, heading = [here], np.zeros(2)
    left[here] = False
    while left.any():
        near = around[here][left[around[here]]]
        if len(near):
            ways = points[near] - points[here]
            length = np.hypot(*ways.T)
            turned = ways @ heading / np.maximum(length, 1e-9)
            following = int(near[np.argmax(turned - 0.3 * length / SPACING)])
            heading = points[following] - points[here]
            heading = heading / max(float(np.hypot(*heading)), 1e-9)
            order.append(following)
        else:
            way = _way_to_what_is_left(here, around, left)
            following = way[-1]
            order.extend(way)
            heading = np.zeros(2)
        here = following
        left[here] = False
    return points[order]


def _beads(trace: Trace) -> Floats:
    """Return points along the middle of a trace, about `SPACING` apart, (k, 2) [m]."""
    from scipy.spatial import cKDTree

    rows, columns = np.nonzero(trace.own | trace.links)
    places = to_meters(np.column_stack([columns, rows]).astype(np.float64), trace.box, 1 / STEP)
    if not len(places):
        return places
    tree = cKDTree(places)
    free = np.ones(len(places), np.bool_)
    beads = []
    for k in range(len(places)):
        if free[k]:
            free[tree.query_ball_point(places[k], SPACING)] = False
            beads.append(places[tree.query_ball_point(places[k], 0.6 * SPACING)].mean(axis=0))
    return np.array(beads)


def _way_to_what_is_left(here: int, around: list[NDArray[np.int64]], left: NDArray[np.bool_]) -> list[int]:
    """Return the path back along the line to the next remaining point; a jump if there is no path."""
    before = {here: here}
    queue = [here]
    for point in queue:
        if left[point]:
            way = [point]
            while before[way[-1]] != here:
                way.append(before[way[-1]])
            return way[::-1]
        for other in around[point].tolist():
            if other not in before:
                before[other] = point
                queue.append(other)
    return [int(np.flatnonzero(left)[0])]
