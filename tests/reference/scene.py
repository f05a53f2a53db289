"""What Jyro 0.3.2 does with a scene, written for the eye: one line, one ray, one robot at a time.

The reference of `realitygap.kernels.jyro.scene`. It takes a `Case` and gives one `Row` per step and robot.
Python's own `round` does the rounding. Headings are Jyro's: 0 faces +y, counter-clockwise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

from realitygap.world._case import Case, CaseController, CaseDevice, CaseRobot

DECIMALS = 7
Point = tuple[float, float]


class Row(NamedTuple):
    """One line of the CSV file."""

    step: int
    robot: int
    time: float
    x: float
    y: float
    heading: float
    stall: int
    speed: float
    turn_rate: float
    energy: float
    readings: list[float]


def rounded(point: Point) -> Point:
    return round(point[0], DECIMALS), round(point[1], DECIMALS)


def between(value: float, one: float, other: float) -> bool:
    return min(one, other) <= value <= max(one, other)


def distance(one: Point, other: Point) -> float:
    (ax, ay), (bx, by) = rounded(one), rounded(other)
    return math.sqrt((ax - bx) * (ax - bx) + (ay - by) * (ay - by))


class Line:
    """A piece of a straight line, all of its numbers rounded to seven decimals."""

    def __init__(self, start: Point, end: Point) -> None:
        self.start = rounded(start)
        self.end = rounded(end)
        (ax, ay), (bx, by) = self.start, self.end
        self.is_vertical = ax == bx
        if not self.is_vertical:
            self.slope = round((by - ay) / (bx - ax), DECIMALS)
            self.height = round(ay - ax * self.slope, DECIMALS)  # y at x = 0

    def at(self, x: float) -> Point:
        return x, self.height + x * self.slope

    def is_parallel_to(self, other: Line) -> bool:
        if self.is_vertical or other.is_vertical:
            return self.is_vertical and other.is_vertical
        return self.slope == other.slope

    def holds(self, point: Point) -> bool:
        x, y = rounded(point)
        return between(x, self.start[0], self.end[0]) and between(y, self.start[1], self.end[1])

    def meets(self, other: Line) -> Point | None:
        if self.is_parallel_to(other):
            return None
        if self.is_vertical:
            point = other.at(self.start[0])
        elif other.is_vertical:
            point = self.at(other.start[0])
        else:
            point = self.at((other.height - self.height) / (self.slope - other.slope))
        return point if self.holds(point) and other.holds(point) else None


@dataclass
class Body:
    """A robot that moves."""

    case: CaseRobot
    x: float
    y: float
    heading: float
    stall: int = 0
    energy: float = 10000.0
    readings: list[float] = field(default_factory=list)

    def outline(self, x: float, y: float, heading: float) -> list[Line]:
        """The edges of the body, were it at this pose."""
        cos, sin = math.cos(heading + math.pi / 2), math.sin(heading + math.pi / 2)
        box = self.case.bounding_box
        corners = [
            (x + forward * cos - left * sin, y + forward * sin + left * cos)
            for forward, left in zip(box.x, box.y, strict=True)
        ]
        return [Line(corner, corners[i - 1]) for i, corner in enumerate(corners)]

    def edges(self) -> list[Line]:
        return self.outline(self.x, self.y, self.heading)


@dataclass
class Scene:
    """Walls, lights and robots."""

    walls: list[Line]
    lights: list[list[float]]
    robots: list[Body]

    def others(self, robot: Body) -> list[Body]:
        return [other for other in self.robots if other.case.name != robot.case.name]

    def move(self, robot: Body, speed: float, turn_rate: float, dt: float) -> None:
        x = robot.x + speed * math.sin(-robot.heading) * dt
        y = robot.y + speed * math.cos(-robot.heading) * dt
        heading = robot.heading + turn_rate * dt
        if speed != 0.0 or turn_rate != 0.0:
            robot.energy -= 1.0
        obstacles = self.walls + [edge for other in self.others(robot) for edge in other.edges()]
        body = robot.outline(x, y, heading)
        robot.stall = int(any(edge.meets(obstacle) is not None for edge in body for obstacle in obstacles))
        if not robot.stall:
            robot.x, robot.y, robot.heading = x, y, heading % (2.0 * math.pi)

    def nearest(self, robot: Body, start: Point, angle: float, reach: float) -> float | None:
        """How far a ray gets that starts at a point and goes `angle` clockwise from +y."""
        end = (math.sin(angle) * reach + start[0], math.cos(angle) * reach + start[1])
        ray = Line(start, end)
        obstacles = self.walls + [edge for other in self.others(robot) for edge in other.edges()]
        points = [obstacle.meets(ray) for obstacle in obstacles]
        hits = [distance(point, start) for point in points if point is not None]
        return min((hit for hit in hits if hit <= reach), default=None)

    def read_range(self, robot: Body, device: CaseDevice, mount: list[float]) -> float:
        forward, left, angle = mount
        cos, sin = math.cos(robot.heading + math.pi / 2), math.sin(robot.heading + math.pi / 2)
        start = (robot.x + (forward * cos - left * sin), robot.y + (forward * sin + left * cos))
        hit = self.nearest(robot, start, -(robot.heading + angle), device.max_range)
        reading = device.max_range if hit is None else hit
        if device.type == "bumper":
            return 1.0 if reading < device.max_range else 0.0
        return reading

    def read_light(self, robot: Body, device: CaseDevice, mount: list[float]) -> float:
        forward, left, _ = mount
        cos, sin = math.cos(robot.heading + math.pi / 2), math.sin(robot.heading + math.pi / 2)
        sensor = (robot.x + forward * cos - left * sin, robot.y + forward * sin + left * cos)
        total = 0.0
        for x, y, brightness in self.lights:
            way = Line((x, y), sensor)
            away = distance((x, y), sensor)
            angle = -math.atan2(way.end[1] - way.start[1], way.end[0] - way.start[0]) + math.pi / 2
            intensity = falloff(device.mode, away, device.max_range)
            if self.nearest(robot, (x, y), angle, away - 0.1) is not None:
                intensity /= 2.0
            total += intensity * brightness
        return total

    def sense(self, robot: Body) -> None:
        robot.readings = [
            self.read_light(robot, device, mount)
            if device.reads_light
            else self.read_range(robot, device, mount)
            for device in robot.case.devices
            for mount in device.geometry
        ]


def falloff(mode: str, away: float, reach: float) -> float:
    """Jyro's way of writing 1 - d/R, 0.2/d and (0.2/d)^2, d being limited to R and 0.2 m."""
    if mode == "linear":
        return 1.0 - min(away, reach) / reach
    part, least = min(max(away, 0.2), reach) / reach, 0.2 / reach
    if mode == "ambient":
        return (1.0 / part) / (1.0 / least)
    return (1.0 / (part * part)) / (1.0 / (least * least))


def decide(controller: CaseController, robot: Body, part_of_time: float) -> tuple[float, float]:
    """Speed and turn rate from what the robot read last."""
    reach = controller.sensor_max_range
    inverted = [(reach - reading) / reach for reading in robot.readings]
    values: list[float] = []
    for name in controller.inputs:
        if name == "max_inverted":
            values.append(max(inverted))
        elif name == "all_inverted":
            values += inverted
        else:
            values.append(float(robot.stall) if name == "stall" else part_of_time)
    for layer in controller.layers:
        sums = [sum(w * v for w, v in zip(row, values, strict=True)) for row in layer.weights]
        values = [math.tanh(total + bias) for total, bias in zip(sums, layer.bias, strict=True)]
    return values[0] * controller.output_scale[0], values[1] * controller.output_scale[1]


def run(case: Case) -> list[Row]:
    """All that happens in a case, step by step, robot by robot."""
    walls = [Line((x1, y1), (x2, y2)) for x1, y1, x2, y2 in case.world.lines()]
    robots = [Body(robot, robot.start.x, robot.start.y, robot.start.heading) for robot in case.robots]
    scene = Scene(walls, case.world.lights, robots)
    for robot in robots:
        scene.sense(robot)
    rows = []
    time = 0.0
    commands = [(0.0, 0.0)] * len(robots)
    for step in range(case.steps + 1):
        if step > 0:
            time += case.dt
            commands = [
                decide(robot.case.controller, robot, (step - 1) / case.steps)
                if robot.case.controller
                else (robot.case.commands[step - 1][0], robot.case.commands[step - 1][1])
                for robot in robots
            ]
            for robot, (speed, turn_rate) in zip(robots, commands, strict=True):
                scene.move(robot, speed, turn_rate, case.dt)
            for robot in robots:
                scene.sense(robot)
        rows += [
            Row(step, i, time, r.x, r.y, r.heading, r.stall, *commands[i], r.energy, list(r.readings))
            for i, r in enumerate(robots)
        ]
    return rows
