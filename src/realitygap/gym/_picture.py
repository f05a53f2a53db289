"""A picture of one robot in its arena: walls, cells, path, body, and rays."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from realitygap.drawing import Ink, Line, Picture, Shape, to_image
from realitygap.platforms import Array, Outline, Points
from realitygap.world import Arena, Pose, floor_shapes, things_in

WIDTH = 480
"""Width of a picture [pixels]."""


def draw_robot(
    arena: Arena, outline: Outline, path: Array, readings: Array, cells: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """Return a picture (h, w, 3) of one robot from above.

    Args:
        arena: Arena to draw.
        outline: The robot's.
        path: (t, 3) poses up to now: x [m], y [m], heading [rad].
        readings: (s,) distances that its range sensors measure [m].
        cells: The visited ones.
    """
    grid = arena.grid
    shapes: list[Shape] = [*floor_shapes(arena.floor)]
    for cell in cells.tolist():
        shapes.append(Line(grid.corners(cell), None, closed=True, fill=Ink.VISITED))
    shapes += things_in(arena)
    shapes += [Line(((x1, y1), (x2, y2)), Ink.TEXT, 2.4) for x1, y1, x2, y2 in arena.walls]
    shapes.append(Line(tuple(map(tuple, path[:, :2].tolist())), Ink.OURS, 1.4))
    pose = Pose(*path[-1].tolist())
    for (ahead, left, direction), length in zip(outline.mounts, readings.tolist(), strict=True):
        far = (ahead + length * math.cos(direction), left + length * math.sin(direction))
        shapes.append(Line(_placed(((ahead, left), far), pose), Ink.PUBLISHED, 0.9))
    for part in outline.parts:
        shapes.append(Line(_placed(part, pose), Ink.BODY, 1.4, closed=True, fill=Ink.RULE))
    nose = max(x for part in outline.parts for x, _ in part)
    shapes.append(Line(_placed(((0.0, 0.0), (nose, 0.0)), pose), Ink.TEXT, 1.4))
    left_end, bottom, right, top = _extent(arena)
    picture = Picture(f"Arena {arena.name}", "", left_end, bottom, right, top, tuple(shapes))
    return np.asarray(to_image(picture, WIDTH), np.uint8).copy()


def _placed(points: Points, pose: Pose) -> Points:
    """Return points of a robot in the arena."""
    return tuple(pose.point(*point) for point in points)


def _extent(arena: Arena) -> tuple[float, float, float, float]:
    """Return left, bottom, right and top of what a picture shows [m]."""
    grid = arena.grid
    points = [(grid.x, grid.y), (grid.right_end, grid.upper_end)]
    points += [(x, y) for x1, y1, x2, y2 in arena.walls for x, y in ((x1, y1), (x2, y2))]
    points += [(light.x, light.y) for light in arena.lights]
    xs, ys = np.array(points).T
    margin = 0.02 * float(np.ptp(xs))
    return (
        float(xs.min()) - margin,
        float(ys.min()) - margin,
        float(xs.max()) + margin,
        float(ys.max()) + margin,
    )
