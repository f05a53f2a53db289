"""The topics of a robot, from the table `[driver]` of its robot file, and what their messages mean to a controller."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, Literal, Self

from pydantic import Field, ValidationError, model_validator

from realitygap.errors import RobotError
from realitygap.settings import Settings, mistakes
from realitygap.world import RangeSensor, RobotModel, load_robot

from . import _messages as m
from ._messages import full_topic

BumpKind = Literal[
    "std_msgs/msg/Bool", "irobot_create_msgs/msg/HazardDetectionVector", "turtlebot3_msgs/msg/SensorState"
]
_TOPIC = r"/?[A-Za-z_]\w*(/\w+)*"
BUMP = 1
"""Type of a hazard that is a bump; source: irobot_create_msgs/msg/HazardDetection."""


class Scan(Settings):
    """A laser scanner. Each range sensor of the robot file is a sector of its scans, by its direction and cone."""

    topic: str = Field("scan", description="Topic of its scans, sensor_msgs/LaserScan.")
    x: float = Field(0.0, description="Position of the scanner ahead of the body's origin [m].")
    y: float = Field(0.0, description="Position of the scanner to the left of the body's origin [m].")
    direction: float = Field(
        0.0, description="Direction of the angle 0 of scans, positive to the left [rad]."
    )


class Wiring(Settings):
    """The topics of a robot on ROS 2. Topics without a slash before them are in the robot's namespace."""

    family: Literal["ros2"] = Field(description="Name of the family whose driver reads this table.")
    command: str = Field(
        "cmd_vel", description="Topic of commands, Twist or TwistStamped as the robot announces."
    )
    odometry: str = Field(
        "", description="Topic of nav_msgs/Odometry, which tells the way of the wheels. Empty: none."
    )
    pose: str = Field(
        "",
        description="Topic of geometry_msgs/PoseStamped, as of a motion capture, or of TF, such as /tf. Empty: "
        "odometry tells poses.",
    )
    pose_frames: tuple[str, str] | None = Field(
        None,
        description="Frames of the arena and of the robot, if `pose` is a topic of TF: ['map', 'base_link'].",
    )
    pose_frame: Literal["start", "arena"] = Field(
        "start",
        description="Frame of poses. start: each trial begins at its start, as for odometry. arena: that of the arena.",
    )
    scan: Scan | None = Field(None, description="Laser scanner.")
    ranges: tuple[str, ...] = Field(
        (), max_length=64, description="Topics of sensor_msgs/Range, one for each range sensor in its order."
    )
    intensity: str = Field(
        "",
        description="Topic of irobot_create_msgs/IrIntensityVector, whose values are readings. Empty: none.",
    )
    intensity_frames: tuple[str, ...] = Field(
        (), max_length=64, description="Frames of its values, one for each range sensor in its order."
    )
    intensity_most: float = Field(1.0, gt=0, description="Value that counts as a reading of 1.")
    bump: str = Field("", description="Topic that tells bumps. Empty: none.")
    bump_kind: BumpKind = Field("std_msgs/msg/Bool", description="Type of its messages.")
    battery: str = Field("", description="Topic of sensor_msgs/BatteryState. Empty: none.")
    most_speed: float = Field(math.inf, gt=0, description="Largest speed ahead that is commanded [m/s].")
    most_turn: float = Field(math.inf, gt=0, description="Largest turn rate that is commanded [rad/s].")
    silent_s: float = Field(
        1.0, gt=0, le=60, description="Age of a reading after which its sensor counts as silent [s]."
    )
    timeout_s: float | None = Field(
        None,
        ge=0,
        le=60,
        description="Time after which the robot stops without commands, as documented [s]. 0: never. The driver does "
        "not depend on it.",
    )

    @model_validator(mode="after")
    def _poses_have_frames_if_they_are_transforms(self) -> Self:
        if self.pose_frames and not self.pose:
            raise ValueError("pose_frames is for a topic of TF: set pose, such as '/tf'")
        if self.pose.rpartition("/")[2] == "tf" and not self.pose_frames:
            raise ValueError(
                f"pose is {self.pose!r}, a topic of TF: set pose_frames, such as ['map', 'base_link']"
            )
        return self

    @model_validator(mode="after")
    def _topics_can_be(self) -> Self:
        names = [name for name, _ in self._kinds() if name] + [self.command]
        for name in names:
            if not re.fullmatch(_TOPIC, name):
                raise ValueError(
                    f"{name!r} is no name of a topic, expected letters, digits, '_' and '/', such as 'scan'"
                )
            if names.count(name) > 1:
                raise ValueError(f"topic {name!r} is named twice")
        kinds = [kind for kind in ("ranges", "scan", "intensity") if getattr(self, kind)]
        if len(kinds) > 1:
            raise ValueError(f"{' and '.join(kinds)} both tell the range sensors, expected one of them")
        return self

    def topics(self, namespace: str) -> dict[str, str]:
        """Return the types of all topics that the driver reads, by full name."""
        return {full_topic(namespace, topic): kind for topic, kind in self._kinds() if topic}

    def _kinds(self) -> list[tuple[str, str]]:
        """Return the topics that the driver reads, with empty ones, and their types."""
        return [
            (self.odometry, m.ODOMETRY),
            (self.pose, m.TF if self.pose_frames else m.POSE),
            (self.scan.topic if self.scan else "", m.SCAN),
            *((topic, m.RANGE) for topic in self.ranges),
            (self.intensity, m.INTENSITIES),
            (self.bump, self.bump_kind),
            (self.battery, m.BATTERY),
        ]

    def needed(self, namespace: str) -> tuple[str, ...]:
        """Return the topics without which trials cannot be driven."""
        names = (self.odometry, self.pose, self.scan.topic if self.scan else "", *self.ranges, self.intensity)
        return tuple(full_topic(namespace, name) for name in names if name)


def load_wired(robot: str) -> tuple[RobotModel, Wiring]:
    """Return a robot of a file, and its topics.

    Raises:
        DescriptionError: There is no such robot.
        RobotError: Its file has no topics, or wrong ones.
    """
    model = load_robot(robot)
    if not model.driver:
        raise RobotError(
            f"Robot {robot} has no table [driver] with its topics on ROS 2. Add one as in docs/how-to/ros2.md, or name "
            "another robot: ros2:/?robot=turtlebot3-burger."
        )
    try:
        wiring = Wiring.model_validate(model.driver)
    except ValidationError as error:
        found = [f"driver.{place}: {text}" for place, text in mistakes(error, Wiring, model.driver)]
        raise RobotError(f"Robot {robot}: {' '.join(found)}") from error
    n, named = len(model.range), wiring.intensity_frames if wiring.intensity else wiring.ranges
    if named and len(named) != n:
        raise RobotError(f"Robot {robot} has {n} range sensors, and [driver] names {len(named)} of them.")
    if n and not named and wiring.scan is None:
        raise RobotError(f"Robot {robot} has {n} range sensors, and [driver] has neither ranges nor scan.")
    return model, wiring


def respond(sensor: RangeSensor, distance: float | None) -> float:
    """Return the reading of a sensor for a distance [m], as the robot file describes it; None: nothing is in range."""
    if distance is None or distance >= sensor.reach:
        return 0.0
    if sensor.response == "table":
        rows = sensor.table
        if distance <= rows[0].distance:
            return rows[0].reading
        for low, high in pairwise(rows):
            if distance <= high.distance:
                share = (distance - low.distance) / (high.distance - low.distance)
                return low.reading + share * (high.reading - low.reading)
        return rows[-1].reading
    if sensor.response == "linear":
        return min(max(1.0 - distance / sensor.reach, 0.0), 1.0)
    raise RobotError(
        f"A range sensor has response {sensor.response!r}, and a robot on ROS 2 tells distances: expected linear or "
        "table in its robot file."
    )


def range_of(message: Mapping[str, Any]) -> float | None:
    """Return the distance of a sensor_msgs/Range [m]; None if nothing is in range."""
    value, least, most = message["range"], message["min_range"] or 0.0, message["max_range"] or 0.0
    if value is None or (most > least and value >= most):  # an e-puck2's limits are the wrong way round
        return None
    return max(float(value), 0.0)


def intensities_of(message: Mapping[str, Any], wiring: Wiring) -> tuple[float, ...]:
    """Return the reading of each range sensor from an IrIntensityVector; 0 for a frame that is not in it."""
    values = {each["header"]["frame_id"]: each["value"] for each in message["readings"]}
    return tuple(
        min(max(values.get(frame, 0) / wiring.intensity_most, 0.0), 1.0) for frame in wiring.intensity_frames
    )


def sectors_of(message: Mapping[str, Any], scan: Scan, sensors: Sequence[RangeSensor]) -> list[float | None]:
    """Return the distance that each range sensor sees in a scan [m]: that of the nearest point in its cone.

    A point of the scan counts by where it is, not by its angle at the scanner. A distance of 0, below `range_min`,
    above `range_max`, infinite, or NaN is nothing: drivers differ in how they write it.
    """
    least, most = message["range_min"] or 0.0, message["range_max"] or math.inf
    start, step = message["angle_min"] or 0.0, message["angle_increment"] or 0.0
    points = []
    for k, value in enumerate(message["ranges"]):
        if value is None or not max(least, 1e-9) <= value <= most:
            continue
        angle = scan.direction + start + k * step
        points.append((scan.x + value * math.cos(angle), scan.y + value * math.sin(angle)))
    found: list[float | None] = []
    for sensor in sensors:
        near = [
            math.hypot(x - sensor.x, y - sensor.y)
            for x, y in points
            if _is_in_cone(math.atan2(y - sensor.y, x - sensor.x) - sensor.direction, sensor.cone, step)
        ]
        found.append(min(near, default=None))
    return found


def _is_in_cone(angle: float, cone: float, step: float) -> bool:
    """Return whether an angle is within a cone, or within half a step of the scan if that is wider."""
    turned = (angle + math.pi) % math.tau - math.pi
    return abs(turned) <= max(cone, abs(step) / 2) + 1e-9


def is_bumped(kind: str, message: Mapping[str, Any]) -> bool:
    """Return whether a message tells a bump."""
    if kind == m.HAZARDS:
        return any(each["type"] == BUMP for each in message["detections"])
    if kind == m.SENSOR_STATE:
        return bool(message["bumper"])
    return bool(message["data"])
