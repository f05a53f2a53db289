"""A trial on the platform `jyro`, one ray and one edge at a time.

Written from Jyro's rules (touching counts, parallel lines never meet, a blocked step changes nothing) and
Rosenzweig & Remy, sections 2.1 to 2.4. Headings are counter-clockwise from +x.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from realitygap.platforms import JyroPlatform
from realitygap.world import Arena

from .coverage import Cell, cell_of, cells_on_line, first_visits
from .philox import Stream

Point = tuple[float, float]
Controller = Callable[[Sequence[float]], Sequence[float]]

# Nearer than this to a border, in cells, is on it.
SNAP = 1e-9


@dataclass
class Trial:
    """What happened; the first pose and the first readings are those of the start."""

    poses: list[tuple[float, float, float]]
    readings: list[list[float]]
    inputs: list[list[float]] = field(default_factory=list)
    commands: list[tuple[float, float]] = field(default_factory=list)
    stalled: list[bool] = field(default_factory=lambda: [False])
    line: list[Cell] = field(default_factory=list)
    ends: list[Cell] = field(default_factory=list)


def side(a: Point, b: Point, c: Point) -> float:
    """Positive where c lies left of the line from a to b, 0 on it."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def touch(a: Point, b: Point, c: Point, d: Point) -> bool:
    """Whether AB and CD meet: neither has both ends on one side of the other, and they are not parallel."""
    if side((0, 0), (b[0] - a[0], b[1] - a[1]), (d[0] - c[0], d[1] - c[1])) == 0:
        return False
    return side(a, b, c) * side(a, b, d) <= 0 and side(c, d, a) * side(c, d, b) <= 0


def in_frame(pose: tuple[float, float, float], point: Point) -> Point:
    """A point of the world as seen from a pose: forward, left."""
    x, y, heading = pose
    dx, dy = point[0] - x, point[1] - y
    return dx * math.cos(heading) + dy * math.sin(heading), dy * math.cos(heading) - dx * math.sin(heading)


def in_world(pose: tuple[float, float, float], point: Point) -> Point:
    x, y, heading = pose
    forward, left = point
    return (
        x + forward * math.cos(heading) - left * math.sin(heading),
        y + forward * math.sin(heading) + left * math.cos(heading),
    )


class Robot:
    """The Scribbler of the platform in an arena."""

    def __init__(self, platform: JyroPlatform, arena: Arena) -> None:
        self.platform = platform
        self.walls = [((x1, y1), (x2, y2)) for x1, y1, x2, y2 in arena.walls]
        self.grid = arena.grid
        x, y, heading = arena.start
        self.pose = (x, y, heading)

    def reading(self, mount: tuple[float, float, float]) -> float:
        """Distance to the nearest wall ahead: where walls cross the forward axis of the sensor's frame."""
        forward, left, angle = mount
        x, y = in_world(self.pose, (forward, left))
        sensor = (x, y, self.pose[2] + angle)
        distance = self.platform.sensor_range
        for a, b in self.walls:
            (af, al), (bf, bl) = in_frame(sensor, a), in_frame(sensor, b)
            if al != bl and min(al, bl) <= 0.0 <= max(al, bl):
                crossing = af + (bf - af) * al / (al - bl)
                if crossing >= 0.0:
                    distance = min(distance, crossing)
        return distance

    def readings(self) -> list[float]:
        return [self.reading(mount) for mount in self.platform.sensors.mounts]

    def move(self, move: float, turn: float) -> bool:
        """One step, translation along the old heading; False, and nothing changes, when it is blocked."""
        x, y, heading = self.pose
        x += move * 0.1 * math.cos(heading)
        y += move * 0.1 * math.sin(heading)
        heading = (heading + turn * self.platform.turn_per_step) % (2 * math.pi)
        corners = [in_world((x, y, heading), corner) for corner in self.platform.body.corners]
        edges = zip(corners, corners[1:] + corners[:1], strict=True)
        if any(touch(*edge, *wall) for edge in edges for wall in self.walls):
            return False
        self.pose = (x, y, heading)
        return True

    def place(self) -> Point:
        """Where it is in grid units."""
        u = (self.pose[0] - self.grid.x) / self.grid.cell
        v = (self.pose[1] - self.grid.y) / self.grid.cell
        return snapped(u), snapped(v)


def snapped(value: float) -> float:
    return float(round(value)) if abs(value - round(value)) < SNAP else value


def obstacle_input(readings: Sequence[float], platform: JyroPlatform, noise: Sequence[float]) -> float:
    """The largest of the inverted readings, each 0..1 before its noise is added."""
    reach = platform.sensor_range
    values = [min((reach - d) / reach, 1.0) + n for d, n in zip(readings, noise, strict=True)]
    if platform.noisy_reading == "clip":
        values = [min(max(value, 0.0), 1.0) for value in values]
    return max(values)


def run(
    platform: JyroPlatform,
    arena: Arena,
    controller: Controller,
    *,
    noise: float = 0.0,
    stream: Stream | None = None,
    bias_value: float | None = None,
) -> Trial:
    """Drive a controller for all steps; sensor s takes 24 bits of word s of the step's blocks of four."""
    robot = Robot(platform, arena)
    trial = Trial([robot.pose], [robot.readings()])
    here = robot.place()
    trial.line = [cell_of(*here)]
    trial.ends = [cell_of(*here)]
    n_sensors = len(platform.sensors.mounts)
    blocks = math.ceil(n_sensors / 4)
    for step in range(platform.steps):
        moved = [0.0] * n_sensors
        if stream is not None:
            words = [stream.words(blocks * step + s // 4)[s % 4] for s in range(n_sensors)]
            moved = [noise * ((word >> 8) * 2 + 1 - 2**24) / 2**24 for word in words]
        inputs = [
            obstacle_input(trial.readings[-1], platform, moved),
            float(trial.stalled[-1]),
            step / platform.steps,
        ]
        if bias_value is not None:
            inputs.append(bias_value)
        move, turn = controller(inputs)
        free = robot.move(move, turn)
        if free:
            there = robot.place()
            trial.line += cells_on_line(*here, *there)
            trial.ends.append(cell_of(*there))
            here = there
        trial.inputs.append(inputs)
        trial.commands.append((move, turn))
        trial.stalled.append(not free)
        trial.poses.append(robot.pose)
        trial.readings.append(robot.readings())
    return trial


def visited(trial: Trial, arena: Arena) -> tuple[list[int], list[int]]:
    """Cells along the line and cells at the ends of steps, in order of first visit."""
    columns, rows = arena.grid.columns, arena.grid.rows
    return first_visits(trial.line, columns, rows), first_visits(trial.ends, columns, rows)
