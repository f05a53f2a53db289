"""The contents of an arena besides its walls: obstacles, lights, a goal, and marks on the floor."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from realitygap.errors import check_finite

from ._part import Points, rounded

TAPE_WIDTH = 0.019  # of a line on the floor [m]: the usual 3/4 in
Segment = tuple[float, float, float, float]


@dataclass(frozen=True)
class Obstacle:
    """A convex outline in the arena: a box, a polygon or, with one corner, a disc.

    Attributes:
        x, y: Position of its own origin [m].
        heading: Rotation [rad, counter-clockwise].
        corners: (c, 2) corners in its own frame [m], counter-clockwise.
        radius: Radius by which it is grown to all sides [m].
    """

    x: float
    y: float
    heading: float = 0.0
    corners: Points = ((0.0, 0.0),)
    radius: float = 0.0

    def __post_init__(self) -> None:
        """Raise a ValueError if a number is infinite or NaN."""
        check_finite(vars(self))

    @property
    def placed(self) -> Points:
        """Its corners in the arena before they are grown, (c, 2) [m]."""
        return tuple(self._at(x, y) for x, y in self.corners)

    def outline(self, *, step: float = math.pi / 16) -> Points:
        """Return points around it in the arena, (p, 2) [m]. Rounded corners become short lines."""
        return tuple(self._at(x, y) for x, y in rounded(self.corners, self.radius, step=step))

    def edges(self) -> Iterator[Segment]:
        """Return its straight sides in the arena [m], moved out by its radius; a disc has none."""
        corners = self.placed
        for (x1, y1), (x2, y2) in zip(corners, (*corners[1:], corners[0]), strict=True):
            length = math.hypot(x2 - x1, y2 - y1)
            if length:
                out_x, out_y = self.radius * (y2 - y1) / length, -self.radius * (x2 - x1) / length
                yield x1 + out_x, y1 + out_y, x2 + out_x, y2 + out_y

    def distance(self, x: float, y: float) -> float:
        """Return the distance from a point to the obstacle [m]; negative inside."""
        corners = self.placed
        ends = list(zip(corners, (*corners[1:], corners[0]), strict=True))
        inside = len(corners) > 2 and all(
            (x2 - x1) * (y - y1) - (y2 - y1) * (x - x1) >= 0 for (x1, y1), (x2, y2) in ends
        )
        nearest = min(distance_to_segment(x, y, (*first, *last)) for first, last in ends)
        return (-nearest if inside else nearest) - self.radius

    def overlaps(self, other: Obstacle) -> bool:
        """Return whether both share an area, or more than a point if one is a line."""
        if not (self._is_beside(other) or other._is_beside(self)):
            return True
        gaps = [other.distance(x, y) - self.radius for x, y in self.placed]
        gaps += [self.distance(x, y) - other.radius for x, y in other.placed]
        return min(gaps) < 0

    def _is_beside(self, other: Obstacle) -> bool:
        """Return whether all corners of another are in front of one side; True for a single corner."""
        corners, others = self.placed, other.placed
        if len(corners) == 1:
            return len(others) == 1
        return any(
            all((y2 - y1) * (x - x1) - (x2 - x1) * (y - y1) >= 0 for x, y in others)
            for (x1, y1), (x2, y2) in zip(corners, (*corners[1:], corners[0]), strict=True)
        )

    def _at(self, x: float, y: float) -> tuple[float, float]:
        sine, cosine = math.sin(self.heading), math.cos(self.heading)
        return self.x + x * cosine - y * sine, self.y + x * sine + y * cosine


@dataclass(frozen=True)
class Light:
    """A light that shines from a point to all sides.

    Attributes:
        x, y: Position [m].
        strength: Reading of a light sensor with gain 1 that faces it from 1 m.
    """

    x: float
    y: float
    strength: float = 1.0

    def __post_init__(self) -> None:
        """Raise a ValueError if a number is infinite or NaN."""
        check_finite(vars(self))


@dataclass(frozen=True)
class Goal:
    """A disc that a robot should reach.

    Attributes:
        x, y: Center [m].
        radius: Distance from the center within which it counts as reached [m].
    """

    x: float
    y: float
    radius: float

    def __post_init__(self) -> None:
        """Raise a ValueError if a number is infinite or NaN."""
        check_finite(vars(self))


def distance_to_segment(x: float, y: float, segment: Segment) -> float:
    """Return the distance from a point to a straight line with two ends [m]."""
    x1, y1, x2, y2 = segment
    along_x, along_y = x2 - x1, y2 - y1
    squared = along_x**2 + along_y**2
    share = 0.0 if not squared else ((x - x1) * along_x + (y - y1) * along_y) / squared
    share = min(1.0, max(0.0, share))
    return math.hypot(x - x1 - share * along_x, y - y1 - share * along_y)
