"""Overlaps between robots and an arena at the start."""

from __future__ import annotations

from realitygap.world import Arena, Obstacle


def overlaps(part: Obstacle, other: Obstacle) -> bool:
    """Return whether two rounded convex outlines share an area, or more than a point if one is a line."""
    if not (_is_beside(part, other) or _is_beside(other, part)):
        return True
    gaps = [other.distance(x, y) - part.radius for x, y in part.placed]
    gaps += [part.distance(x, y) - other.radius for x, y in other.placed]
    return min(gaps) < 0


def as_obstacles(arena: Arena) -> list[Obstacle]:
    """Return all obstacles of an arena: its obstacles, and its walls without a width."""
    walls = [Obstacle(0.0, 0.0, 0.0, ((x1, y1), (x2, y2))) for x1, y1, x2, y2 in arena.walls]
    return [*arena.obstacles, *walls]


def _is_beside(part: Obstacle, other: Obstacle) -> bool:
    """Return whether all corners of another body are in front of one side; True for a single corner."""
    corners, others = part.placed, other.placed
    if len(corners) == 1:
        return len(others) == 1
    return any(
        all((y2 - y1) * (x - x1) - (x2 - x1) * (y - y1) >= 0 for x, y in others)
        for (x1, y1), (x2, y2) in zip(corners, (*corners[1:], corners[0]), strict=True)
    )
