"""Checks that the robot fits at the start of trials, and starts for further robots."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from realitygap._wording import fixed

from ._arena import Arena, Pose
from ._obstacle import distance_to_segment
from ._part import Body
from ._robot_model import RobotModel
from ._walls import SAME_DIGITS, enclosing_walls, is_within

Point = tuple[float, float]

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
            if enclosing and not is_within(enclosing, x, y):
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


START = "arena.start."
PLACES = (START, "arena.obstacle.", "arena.wall.")
"""First parts of the names of numbers that can put a robot's start into a solid object."""

N_DRAWN = 64
"""Number of draws to check in addition to the ends. A fault in one trial of twenty is missed in 1 of 25 arenas."""

TOP = 1.0 - 2.0**-32
"""The largest of the random numbers that draws are made of."""


def check_drawn_starts(arena: Arena, robot: Body | RobotModel) -> None:
    """Refuse an arena in which the robot would not fit at the start for some of what is drawn.

    It checks the ends of the distributions of the start, and some draws of all numbers that move the start, obstacles,
    or walls.

    Raises:
        ValueError: As `check_start`, with what was drawn.
    """
    places = {name: drawn for name, drawn in arena.vary.items() if name.startswith(PLACES)}
    if not places:
        check_start(arena, robot)
        return
    words = {name: drawn.together or name for name, drawn in places.items()}
    for row in _rows(words):
        values = {name: float(drawn.of(np.array(row[words[name]]))) for name, drawn in places.items()}
        try:
            check_start(arena.with_numbers(values), robot)
        except ValueError as error:
            drawn = ", ".join(f"{name} = {value:.4g}" for name, value in values.items())
            raise ValueError(f"{str(error).removeprefix('ArenaFile: ')} Drawn: {drawn}") from None


def _rows(words: dict[str, str]) -> Iterator[dict[str, float]]:
    """Yield uniform random numbers by the word that numbers are drawn by: the ends of the start, then draws of all."""
    every = list(dict.fromkeys(words.values()))
    ends = list(dict.fromkeys(word for name, word in words.items() if name.startswith(START)))
    for corner in itertools.product((0.0, TOP), repeat=len(ends)):
        yield dict.fromkeys(every, 0.5) | dict(zip(ends, corner, strict=True))
    for row in np.random.default_rng(1).random((N_DRAWN, len(every))):
        yield dict(zip(every, row.tolist(), strict=True))
