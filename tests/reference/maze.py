"""A disc in a maze, one robot and one number at a time, in the units and words of Lehman & Stanley (2011)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

Point = tuple[float, float]
Wall = tuple[float, float, float, float]
Controller = Callable[[list[float]], tuple[float, float]]

RAYS = (-90, -45, 0, 45, 90, 180)  # degrees


def distance_to_wall(point: Point, wall: Wall) -> float:
    a, b = wall[:2], wall[2:]
    squared = (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2
    if squared == 0:
        return math.dist(point, a)
    part = ((point[0] - a[0]) * (b[0] - a[0]) + (point[1] - a[1]) * (b[1] - a[1])) / squared
    part = min(max(part, 0.0), 1.0)
    return math.dist(point, (a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])))


def distance_along(point: Point, angle: float, wall: Wall) -> float:
    """From a point along a direction [rad] to a wall; infinite where it is not met."""
    dx, dy = math.cos(angle), math.sin(angle)
    wx, wy = wall[2] - wall[0], wall[3] - wall[1]
    across = dx * wy - dy * wx
    if across == 0:
        return math.inf
    ax, ay = wall[0] - point[0], wall[1] - point[1]
    along_ray = (ax * wy - ay * wx) / across
    along_wall = (ax * dy - ay * dx) / across
    return along_ray if along_ray >= 0 and 0 <= along_wall <= 1 else math.inf


def slice_of(angle: float) -> int:
    """Which quarter holds a direction [rad] from ahead: ahead, left, behind or right."""
    return int((math.degrees(angle) + 45) % 360 // 90)


@dataclass
class Disc:
    """The agent; lengths in units, headings in degrees."""

    walls: Sequence[Wall]
    exit: Point
    place: Point
    heading: float
    radius: float = 8.0
    reach: float = 100.0
    arrival: float = 5.0
    speed: float = 0.0
    spin: float = 0.0

    def sees(self) -> list[float]:
        ranges = []
        for ray in RAYS:
            angle = math.radians(self.heading + ray)
            nearest = min(distance_along(self.place, angle, wall) for wall in self.walls)
            ranges.append(min(nearest / self.reach, 1.0))
        slices = [0.0] * 4
        to_exit = math.atan2(self.exit[1] - self.place[1], self.exit[0] - self.place[0])
        slices[slice_of(to_exit - math.radians(self.heading))] = 1.0
        return [*ranges, *slices, 1.0]

    def step(self, turn: float, push: float) -> None:
        self.spin = min(max(self.spin + turn - 0.5, -3.0), 3.0)
        self.speed = min(max(self.speed + push - 0.5, -3.0), 3.0)
        angle = math.radians(self.heading)
        to = (self.place[0] + self.speed * math.cos(angle), self.place[1] + self.speed * math.sin(angle))
        self.heading += self.spin
        if all(distance_to_wall(to, wall) >= self.radius for wall in self.walls):
            self.place = to

    def is_there(self) -> bool:
        return math.dist(self.place, self.exit) < self.arrival


def drive(
    disc: Disc, controller: Controller, steps: int = 400
) -> tuple[list[list[float]], list[list[float]]]:
    """Poses (units, degrees), the start first, and what was seen, until the exit or the last step."""
    poses, seen = [[*disc.place, disc.heading]], []
    for _ in range(steps):
        inputs = disc.sees()
        seen.append(inputs)
        disc.step(*controller(inputs))
        poses.append([*disc.place, disc.heading])
        if disc.is_there():
            break
    return poses, seen
