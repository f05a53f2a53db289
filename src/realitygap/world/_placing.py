"""A check that a robot fits at its start."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from realitygap._numbers import fixed

from ._arena import Arena, Pose
from ._obstacle import Segment, distance_to_segment
from ._robot import Body

if TYPE_CHECKING:
    from ._robot_model import RobotModel

Point = tuple[float, float]

SAME_DIGITS = (
    7  # digits to which ends of walls must be equal to be one corner, because coordinates are rounded [m]
)
TOUCHING = 1e-9  # outlines that overlap by less [m] touch, which is allowed at the start


def check_start(arena: Arena, robot: Body | RobotModel) -> None:
    """Refuse a start at which the body would not lie within the walls and clear of all obstacles.

    Raises:
        ValueError: a corner of it lies beyond a wall, or it overlaps a wall or an obstacle.
    """
    pose = arena.start
    start = f"the robot does not fit at the start ({pose.x:g}, {pose.y:g}, {pose.heading:g})"
    enclosing = enclosing_walls(arena.walls)
    for outline in _outlines(robot, pose):
        for x, y in outline:
            if enclosing and not _is_within(enclosing, x, y):
                raise ValueError(
                    f"{start}: a corner of its body would be at ({fixed(x, 3)}, {fixed(y, 3)}), beyond a wall. Move "
                    "the start away from the wall."
                )
        for what, other in _solids(arena):
            if _overlap(outline, other):
                raise ValueError(f"{start}: its body would overlap {what}. Move the start away from it.")


def roomiest_starts(arena: Arena, n: int) -> tuple[Pose, ...]:
    """Return n starts for further robots, each at the place with the most room, with the heading of the arena's start.

    Each is the center of the reachable cell whose distance to walls and obstacles, or half of whose distance to the
    starts before it, whichever is less, is largest. If several are equal, it is the first.
    """
    grid, starts = arena.grid, [arena.start]
    centers = [
        (grid.x + (column + 0.5) * grid.cell, grid.y + (row + 0.5) * grid.cell)
        for row in range(grid.rows)
        for column in range(grid.columns)
    ]
    room = [
        min(
            [distance_to_segment(x, y, wall) for wall in arena.walls]
            + [obstacle.distance(x, y) for obstacle in arena.obstacles],
            default=math.inf,
        )
        for x, y in centers
    ]
    for _ in range(n):
        before = starts[-1]
        room = [
            min(free, math.hypot(x - before.x, y - before.y) / 2)
            for free, (x, y) in zip(room, centers, strict=True)
        ]
        # Rounding must not decide between cells that have as much room.
        most = max(round(free, SAME_DIGITS) for free in room)
        where = next(k for k, free in enumerate(room) if round(free, SAME_DIGITS) == most)
        starts.append(Pose(*centers[where], arena.start.heading))
    return tuple(starts[1:])


def is_inside(arena: Arena, x: float, y: float) -> bool:
    """Return whether a point is inside the walls that enclose the arena; False if no walls enclose it."""
    return _is_within(enclosing_walls(arena.walls), x, y)


def enclosing_walls(walls: Sequence[Segment]) -> list[Segment]:
    """Return the walls that make closed rounds: those with a loose end are taken away, again and again."""
    left = list(walls)
    while True:
        counts = Counter(end for wall in left for end in _ends(wall))
        tied = [wall for wall in left if all(counts[end] > 1 for end in _ends(wall))]
        if len(tied) == len(left):
            return tied
        left = tied


def _ends(wall: Segment) -> tuple[Point, Point]:
    x1, y1, x2, y2 = (round(value, SAME_DIGITS) for value in wall)
    return (x1, y1), (x2, y2)


def _is_within(walls: Sequence[Segment], x: float, y: float) -> bool:
    """Return whether an odd number of walls is to the right of a point."""
    crossings = 0
    for x1, y1, x2, y2 in walls:
        if (y1 > y) != (y2 > y) and x < x1 + (y - y1) / (y2 - y1) * (x2 - x1):
            crossings += 1
    return crossings % 2 == 1


def _outlines(robot: Body | RobotModel, pose: Pose) -> Iterator[tuple[Point, ...]]:
    """Yield the outlines of a robot at a pose, each convex [m]."""
    parts = [robot.corners] if isinstance(robot, Body) else [part.outline() for part in robot.body]
    for part in parts:
        yield tuple(pose.point(*corner) for corner in part)


def _solids(arena: Arena) -> Iterator[tuple[str, tuple[Point, ...]]]:
    """Yield each wall and obstacle that a body cannot overlap: its name and its convex outline."""
    for k, (x1, y1, x2, y2) in enumerate(arena.walls):
        yield f"wall {k}", ((x1, y1), (x2, y2))
    for k, obstacle in enumerate(arena.obstacles):
        yield f"obstacle {k}", obstacle.outline()


def _overlap(a: Sequence[Point], b: Sequence[Point]) -> bool:
    """Return whether two convex outlines overlap, so that no direction separates them. Two corners are a line."""
    for corners in (a, b):
        for (x1, y1), (x2, y2) in zip(corners, (*corners[1:], corners[0]), strict=True):
            length = math.hypot(x2 - x1, y2 - y1)
            if not length:
                continue
            across_x, across_y = (y2 - y1) / length, (x1 - x2) / length
            along_a = [x * across_x + y * across_y for x, y in a]
            along_b = [x * across_x + y * across_y for x, y in b]
            if min(max(along_a) - min(along_b), max(along_b) - min(along_a)) <= TOUCHING:
                return False
    return True
