"""An emulated robot on ROS 2: `sim` moves it, and it answers the lines of a gateway."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from realitygap._limits import parse_json
from realitygap.emulator import SECOND, EmulatedPort, EmulatedRobot, Walls, open_arena
from realitygap.errors import DescriptionError, RobotError
from realitygap.platforms import SimPlatform, SimRobot
from realitygap.robots import Command
from realitygap.trials import NoiseKey
from realitygap.world import Arena, Pose, RangeSensor, load_robot

from . import _messages as m
from ._lines import LIFE_S, MOST_TRAIL, ONCE_S
from ._messages import full_topic
from ._robot import DEFAULT_ROBOT
from ._wiring import load_wired

TICK_S = 0.02
"""Time between two steps of the simulation [s]."""
TICK = round(TICK_S * SECOND)
SCAN_TICKS = 10
"""Ticks between two scans: five a second, as an LDS-01."""
SCAN_POINTS = 360
SPEED_TICKS = 5
"""Ticks over which odometry averages speeds."""
USUAL_TIMEOUT_S = 0.5
"""Timeout of a robot whose file has none [s]: that of `diff_drive_controller`."""
KEY = 2**40
"""Key of the noise; that of a trial is its seed."""


class EmulatedRos2(EmulatedRobot):
    """A robot whose body is a robot file on `sim`, with the topics of the same or another file.

    Commands are converted to wheels by the numbers of the file with the topics, as a robot's firmware does, and
    published odometry starts at 0 and does not notice that somebody carries the robot.

    Args:
        arena: Arena.
        robot: Robot whose file has the topics.
        body: Robot that moves; empty for the same.
        namespace: Namespace of its topics.

    Raises:
        RobotError: A file has no topics, or the robots have other sensors.
    """

    def __init__(
        self, arena: Arena, robot: str = DEFAULT_ROBOT, body: str = "", namespace: str = "/"
    ) -> None:
        self.arena = arena
        self.model, self.wiring = load_wired(robot)
        self.namespace = namespace
        try:
            moving = load_robot(body or robot)
        except DescriptionError as error:
            raise RobotError(str(error)) from None
        if len(moving.range) != len(self.model.range):
            raise RobotError(
                f"{body} has {len(moving.range)} range sensors, and {robot} has {len(self.model.range)}."
            )
        self.identity = f"ros2 {robot} {moving.to_dict()}"
        self._body = moving
        self._platform = SimPlatform(robot=moving, step_s=TICK_S, precision="double")
        self._walls = Walls.of(arena)
        self._now, self._held, self._answers = 0, b"", b""
        self._odometry = Pose(0.0, 0.0, 0.0)
        self.place(arena.start, 0)

    @property
    def timeout_s(self) -> float:
        """Time after which it stops without commands [s]; 0: never."""
        return USUAL_TIMEOUT_S if self.wiring.timeout_s is None else self.wiring.timeout_s

    @property
    def now_ns(self) -> int:
        """The time since it was switched on [ns]."""
        return self._now

    def place(self, pose: Pose, seed: int) -> None:
        """Put it at a pose with its motors off; odometry continues from its last pose."""
        super().place(pose, seed)
        self._from = self._odometry
        self._start = pose
        self._sim = SimRobot(self._platform, self.arena, noise_key=NoiseKey(KEY + seed))
        channels = self._sim.channels
        self._sim.select(tuple(name for name in ("bump.0", "encoder.0", "encoder.1") if name in channels))
        self._sim.reset(pose)
        self._rng = np.random.default_rng(seed)
        self._twist, self._until = (0.0, 0.0), 0
        self._steps = 0
        self._trail: list[list[float]] = []
        self._true: list[list[float]] = []
        self._passed = [self._odometry] * (SPEED_TICKS + 1)
        self._seen = self._sim.observe()
        self._scan = self._new_scan()

    def advance_to(self, when: int) -> None:
        """Let time pass up to a time [ns]."""
        while self._now + TICK <= when:
            self._now += TICK
            if self._now > self._until:
                self._twist = (0.0, 0.0)
            drive = self.model.drive
            ahead, turn = self._twist[0] * drive.ahead, self._twist[1]
            if drive.mixing == "independent":
                command = Command(_part(ahead / drive.speed), _part(turn / drive.turn_rate))
            else:
                left, right = (
                    _part((ahead + side * turn * drive.track / 2) / drive.speed) for side in (-1, 1)
                )
                command = Command((left + right) / 2, (right - left) / 2)
            self._sim.drive(command)
            self.move_to(self._sim.pose)
            self._steps += 1
            self._reckon()
            if self._steps % SCAN_TICKS == 0:
                self._seen = self._sim.observe()
                self._scan = self._new_scan()

    def _reckon(self) -> None:
        """Follow the odometry."""
        there = self._sim.odometry if self._body.encoder is not None else self._sim.pose
        ahead, aside = there.x - self._start.x, there.y - self._start.y
        cos, sin = math.cos(self._start.heading), math.sin(self._start.heading)
        point = self._from.point(ahead * cos + aside * sin, aside * cos - ahead * sin)
        heading = self._from.heading + there.heading - self._start.heading
        self._odometry = Pose(*point, math.remainder(heading, math.tau))
        self._passed = [*self._passed[1:], self._odometry]
        for trail, pose in ((self._trail, self._odometry), (self._true, self.pose)):
            trail.append([self.now, *pose])
            del trail[:-MOST_TRAIL]

    # the lines of a gateway

    def next_event(self, wanted: int = 1) -> int | None:
        """Return the present if an answer waits; it never says anything else."""
        return self._now if self._answers else None

    def receive(self, data: bytes) -> None:
        """Take bytes of requests."""
        *lines, self._held = (self._held + data).split(b"\n")
        for line in lines:
            number = None
            try:
                request = parse_json(line)
                number = request.get("id")
                answer = self._answer(request)
            except (ValueError, KeyError, TypeError, AttributeError) as error:
                answer = {"error": f"{type(error).__name__}: {error}"}
            self._answers += json.dumps(answer | {"id": number}).encode() + b"\n"

    def transmit(self) -> bytes:
        """Return the answers that have not been sent."""
        answers, self._answers = self._answers, b""
        return answers

    def _answer(self, request: Mapping[str, Any]) -> dict[str, Any]:
        what = request["do"]
        if what == "drive":
            most = (self.timeout_s or ONCE_S) if request.get("once") else LIFE_S
            self.command(float(request["ahead"]), float(request["turn"]), min(float(request["life"]), most))
            return {}
        if what == "stop":
            self.command(0.0, 0.0, 0.0)
            return {}
        if what == "read":
            trails = {self.wiring.odometry: self._trail, self.wiring.pose: self._true}
            self._trail, self._true = [], []
            topics = {
                topic: {"n": self._steps, "age": 0.0, "message": message}
                for topic, (_, message) in self.messages().items()
            }
            return {
                "now": self.now,
                "topics": topics,
                "trails": {self._full(topic): trail for topic, trail in trails.items() if topic},
            }
        if what == "graph":
            ends = [{"role": "subscriber", "topic": self._full(self.wiring.command), "kind": m.TWIST}]
            ends += [
                {"role": "publisher", "topic": topic, "kind": kind}
                for topic, (kind, _) in self.messages().items()
            ]
            more = {"who": "emulator", "reliable": True, "durable": False}
            return {"graph": [end | more for end in ends], "kinds": [m.TWIST]}
        raise ValueError(f"unknown request {what!r}")

    def command(self, ahead: float, turn: float, life_s: float) -> None:
        """Drive at a speed [m/s] and a turn rate [rad/s] for so much time [s]."""
        if not (math.isfinite(ahead) and math.isfinite(turn) and math.isfinite(life_s)):
            raise ValueError(f"ahead is {ahead}, turn {turn}, and life {life_s}, expected finite numbers")
        self._twist, self._until = (ahead, turn), self._now + round(life_s * SECOND)

    def messages(self) -> dict[str, tuple[str, dict[str, Any]]]:
        """Return the type and the present message of each topic that it publishes."""
        wiring = self.wiring
        found: dict[str, tuple[str, dict[str, Any]]] = {}
        if wiring.odometry:
            found[self._full(wiring.odometry)] = m.ODOMETRY, self._odometry_message()
        if wiring.pose:
            found[self._full(wiring.pose)] = self._pose_message()
        if wiring.scan is not None:
            found[self._full(wiring.scan.topic)] = m.SCAN, self._scan
        sensors = zip(wiring.ranges, self._body.range, self._seen.readings, strict=False)
        for topic, sensor, reading in sensors:
            found[self._full(topic)] = m.RANGE, range_message(sensor, reading)
        if wiring.intensity:
            values = zip(wiring.intensity_frames, self._seen.readings, strict=True)
            found[self._full(wiring.intensity)] = (
                m.INTENSITIES,
                {
                    "header": self.stamp(),
                    "readings": [
                        {"header": {"frame_id": frame}, "value": round(wiring.intensity_most * reading)}
                        for frame, reading in values
                    ],
                },
            )
        if wiring.bump:
            found[self._full(wiring.bump)] = wiring.bump_kind, self._bump_message()
        if wiring.battery:
            found[self._full(wiring.battery)] = m.BATTERY, {"voltage": 12.0, "percentage": 1.0}
        return found

    def _full(self, topic: str) -> str:
        return full_topic(self.namespace, topic)

    def stamp(self) -> dict[str, Any]:
        """Return the header of a message of now."""
        return {"stamp": {"sec": int(self.now), "nanosec": int(self.now % 1 * 1e9)}, "frame_id": "base_link"}

    def _odometry_message(self) -> dict[str, Any]:
        x, y, heading = self._odometry
        before, passed_s = self._passed[0], SPEED_TICKS * TICK_S
        turned = math.remainder(heading - before.heading, math.tau)
        middle = heading - turned / 2
        ahead = (x - before.x) * math.cos(middle) + (y - before.y) * math.sin(middle)
        way = {"x": 0.0, "y": 0.0, "z": math.sin(heading / 2), "w": math.cos(heading / 2)}
        return {
            "header": self.stamp() | {"frame_id": "odom"},
            "child_frame_id": "base_footprint",
            "pose": {"pose": {"position": {"x": x, "y": y, "z": 0.0}, "orientation": way}},
            "twist": {
                "twist": {
                    "linear": {"x": ahead / passed_s, "y": 0.0, "z": 0.0},
                    "angular": {"x": 0.0, "y": 0.0, "z": turned / passed_s},
                }
            },
        }

    def _pose_message(self) -> tuple[str, dict[str, Any]]:
        """Return the type and the message of a motion capture, which sees the robot in the frame of the arena."""
        x, y, heading = self.pose
        way = {"x": 0.0, "y": 0.0, "z": math.sin(heading / 2), "w": math.cos(heading / 2)}
        at = {"x": x, "y": y, "z": 0.0}
        if not self.wiring.pose_frames:
            return m.POSE, {"header": self.stamp(), "pose": {"position": at, "orientation": way}}
        parent, child = self.wiring.pose_frames
        step = {
            "header": self.stamp() | {"frame_id": parent},
            "child_frame_id": child,
            "transform": {"translation": at, "rotation": way},
        }
        return m.TF, {"transforms": [step]}

    def _new_scan(self) -> dict[str, Any]:
        """Return a scan of now; empty without a scanner."""
        scan = self.wiring.scan
        if scan is None:
            return {}
        reach = self.model.reach or 3.5
        angles = np.arange(SCAN_POINTS) * (math.tau / SCAN_POINTS)
        x, y = self.pose.point(scan.x, scan.y)
        rays = np.asarray(self.pose.heading + scan.direction + angles, np.float64)
        far = self._walls.ranges(np.full(SCAN_POINTS, x), np.full(SCAN_POINTS, y), rays, reach)
        noise = max((sensor.noise_uniform for sensor in self._body.range), default=0.0)
        seen = np.maximum(far + reach * noise * self._rng.uniform(-1, 1, SCAN_POINTS), 0.001)
        return {
            "header": self.stamp() | {"frame_id": "base_scan"},
            "angle_min": 0.0,
            "angle_max": float(angles[-1]),
            "angle_increment": math.tau / SCAN_POINTS,
            "time_increment": 0.0,
            "scan_time": SCAN_TICKS * TICK_S,
            "range_min": 0.0,
            "range_max": reach,
            "ranges": [
                None if free else round(d, 4) for d, free in zip(seen.tolist(), far >= reach, strict=True)
            ],
            "intensities": [],
        }

    def _bump_message(self) -> dict[str, Any]:
        is_bump = bool(self._seen.channels.get("bump.0", float(self._seen.stalled)))
        if self.wiring.bump_kind == m.HAZARDS:
            return {
                "header": self.stamp(),
                "detections": [{"header": self.stamp(), "type": 1}] if is_bump else [],
            }
        if self.wiring.bump_kind == m.SENSOR_STATE:
            return {"header": self.stamp(), "bumper": int(is_bump)}
        return {"data": is_bump}

    def wheel_speeds(self) -> tuple[float, float]:
        """Return the commanded speeds of the left and the right wheel [m/s]."""
        ahead, turn = self._twist if self._now < self._until else (0.0, 0.0)
        half = self.model.drive.track / 2
        return ahead - turn * half, ahead + turn * half


def range_message(sensor: RangeSensor, reading: float) -> dict[str, Any]:
    """Return the sensor_msgs/Range of a sensor for a reading."""
    return {
        "radiation_type": 1,
        "field_of_view": 2 * sensor.cone,
        "min_range": 0.0,
        "max_range": sensor.reach,
        "range": distance_of(sensor, reading),
    }


def distance_of(sensor: RangeSensor, reading: float) -> float | None:
    """Return the distance for a reading [m], the inverse of `respond`; None: nothing is in range."""
    if reading <= 0:
        return None
    if sensor.response == "table":
        rows = sorted(sensor.table, key=lambda row: row.reading)
        return float(np.interp(reading, [row.reading for row in rows], [row.distance for row in rows]))
    return max(sensor.reach * (1.0 - reading), 0.0)


def _part(value: float) -> float:
    return min(max(value, -1.0), 1.0)


class Ros2Port(EmulatedPort):
    """The port of an emulated robot on ROS 2: emulator://ros2?robot=turtlebot4&arena=paper&body=slow.toml."""

    options: ClassVar[tuple[str, ...]] = ("arena", "robot", "body")

    def make_robot(self, host: str, options: Mapping[str, str]) -> EmulatedRos2:
        """Return the robot that an address describes.

        Raises:
            RobotError: A file cannot be used.
        """
        return EmulatedRos2(
            open_arena(options.get("arena", "paper")),
            options.get("robot", DEFAULT_ROBOT),
            options.get("body", ""),
        )
