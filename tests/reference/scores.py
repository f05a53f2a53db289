"""What one trial is worth, written for the eye: poses in the arena, one number at a time."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from .maze import Point, Wall, distance_to_wall

Pose = Sequence[float]


def avoid(commands: Sequence[Sequence[float]], ranges: Sequence[Sequence[float]], *, backward: bool) -> float:
    """The mean of V (1 - sqrt(dv)) (1 - i); ranges are those after each command."""
    values = []
    for (move, turn), seen in zip(commands, ranges, strict=True):
        left = min(max(move - turn, -1.0), 1.0)
        right = min(max(move + turn, -1.0), 1.0)
        speed, apart = (abs(left) + abs(right)) / 2, abs(left - right) / 2
        if not backward:
            speed = max((left + right) / 2, 0.0)
        values.append(speed * (1 - math.sqrt(apart)) * (1 - max(seen, default=0.0)))
    return sum(values) / len(values)


def light(poses: Sequence[Pose], stalled: Sequence[bool], lights: Sequence[Point]) -> float:
    def away(pose: Pose) -> float:
        return min(math.dist(pose[:2], place) for place in lights)

    nearness = [max(0.0, 1 - away(pose) / away(poses[0])) for pose in poses[1:]]
    free = [not blocked for blocked in stalled[1:]]
    return sum(nearness) / len(nearness) * (sum(free) / len(free))


def goal(poses: Sequence[Pose], place: Point, radius: float) -> float:
    away = [math.dist(pose[:2], place) for pose in poses]
    return 1.0 if min(away) < radius else 1 - away[-1] / away[0]


def nearest_point(point: Point, wall: Wall) -> Point:
    """Of a wall, found by leaving out the farther third again and again."""
    low, high = 0.0, 1.0

    def at(part: float) -> Point:
        return wall[0] + part * (wall[2] - wall[0]), wall[1] + part * (wall[3] - wall[1])

    for _ in range(100):
        one, other = low + (high - low) / 3, high - (high - low) / 3
        if math.dist(point, at(one)) < math.dist(point, at(other)):
            high = other
        else:
            low = one
    return at((low + high) / 2)


def wall(poses: Sequence[Pose], walls: Sequence[Wall], side: str, within: float) -> float:
    total = 0.0
    for (x0, y0, _), (x1, y1, _) in itertools.pairwise(poses):
        middle = ((x0 + x1) / 2, (y0 + y1) / 2)
        nearest = min(walls, key=lambda one: distance_to_wall(middle, one))
        if (x0, y0) == (x1, y1) or distance_to_wall(middle, nearest) >= within:
            continue
        place = nearest_point(middle, nearest)
        to_wall = math.atan2(place[1] - middle[1], place[0] - middle[0])
        along = to_wall - math.pi / 2 if side == "left" else to_wall + math.pi / 2
        total += (x1 - x0) * math.cos(along) + (y1 - y0) * math.sin(along)
    return total
