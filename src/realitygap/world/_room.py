"""The rectangle of walls around an arena, for simulators whose world is such a room."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ._arena import Arena

Room = tuple[float, float, float, float]
"""Left, low, right, high [m]."""


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
