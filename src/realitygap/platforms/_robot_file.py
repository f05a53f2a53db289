"""Platforms whose robot is that of a robot file."""

from __future__ import annotations

import math
from functools import cached_property

from realitygap.world import Body, RangeSensors, RobotModel, load_robot

from ._platform import Platform


class RobotFilePlatform(Platform):
    """A platform whose robot's outline and sensors come from a robot file."""

    @property
    def robot_name(self) -> str:
        """Name or file of the robot."""
        return self.base_robot

    @cached_property
    def model(self) -> RobotModel:
        """The robot of the file."""
        return load_robot(self.robot_name)

    @property
    def body(self) -> Body:
        """Outline around all parts of the body, for figures."""
        return Body(hull([point for part in self.model.body for point in part.outline()]))

    @property
    def sensors(self) -> RangeSensors:
        """Mounts and reach of the range sensors, for figures."""
        return RangeSensors(self.model.mounts, self.model.reach)

    @property
    def outline_words(self) -> str:
        """The origin of the outline in figures, for their captions."""
        return f"that of robot {self.model.name}"


def hull(points: list[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Return the corners of the convex outline around points, counter-clockwise."""

    def half(ordered: list[tuple[float, float]]) -> list[tuple[float, float]]:
        kept: list[tuple[float, float]] = []
        for point in ordered:
            while len(kept) > 1 and _turn(kept[-2], kept[-1], point) <= 0:
                kept.pop()
            kept.append(point)
        return kept[:-1]

    ordered = sorted(set(points))
    return tuple(half(ordered) + half(ordered[::-1]))


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Return a number above 0 if a, b, c turn to the left."""
    return math.fsum(((b[0] - a[0]) * (c[1] - a[1]), -(b[1] - a[1]) * (c[0] - a[0])))
