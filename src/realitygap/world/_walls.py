"""The walls that enclose an arena, and the rectangle around all of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

from ._arena import Arena
from ._obstacle import Segment

Point = tuple[float, float]

Room = tuple[float, float, float, float]
"""Left, low, right, high [m]."""

SAME_DIGITS = (
    7  # digits to which ends of walls must be equal to be one corner, because coordinates are rounded [m]
)


def is_inside(arena: Arena, x: float, y: float) -> bool:
    """Return whether a point is inside the walls that enclose the arena; False if no walls enclose it."""
    return is_within(enclosing_walls(arena.walls), x, y)


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


def is_within(walls: Sequence[Segment], x: float, y: float) -> bool:
    """Return whether an odd number of walls is to the right of a point."""
    crossings = 0
    for x1, y1, x2, y2 in walls:
        if (y1 > y) != (y2 > y) and x < x1 + (y - y1) / (y2 - y1) * (x2 - x1):
            crossings += 1
    return crossings % 2 == 1


def bounds_of(arena: Arena) -> Room | None:
    """Return the smallest rectangle around all walls; None if it has no area."""
    xs, ys = ([value for wall in arena.walls for value in wall[k::2]] for k in (0, 1))
    if not xs or not (max(xs) > min(xs) and max(ys) > min(ys)):
        return None
    return min(xs), min(ys), max(xs), max(ys)


def room_of(arena: Arena) -> Room | None:
    """Return the rectangle of walls around everything; None if one of its walls is missing."""
    room = bounds_of(arena)
    is_closed = room and set(_edges(room)) <= {_undirected(wall) for wall in arena.walls}
    return room if is_closed else None


def walls_within(arena: Arena, room: Room | None) -> Iterator[tuple[float, float, float, float]]:
    """Yield the walls with a length that are not one of the room's."""
    outer = set() if room is None else set(_edges(room))
    for wall in arena.walls:
        if _undirected(wall) not in outer and wall[:2] != wall[2:]:
            yield wall


def _edges(room: Room) -> Iterator[tuple[tuple[float, float], ...]]:
    left, low, right, high = room
    corners = [(left, low), (right, low), (right, high), (left, high)]
    for k, corner in enumerate(corners):
        yield _undirected((*corner, *corners[(k + 1) % 4]))


def _undirected(wall: Sequence[float]) -> tuple[tuple[float, float], ...]:
    return tuple(sorted(((wall[0], wall[1]), (wall[2], wall[3]))))
