"""A peer by Cyclone DDS, with types of its own: what the robot sends and hears is checked without the driver."""

from __future__ import annotations

from dataclasses import dataclass
from types import new_class
from typing import Any

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float32, float64, int32, sequence, uint8, uint32
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from realitygap._closed_on_exit import ClosedOnExit

from .fast_dds import LOOPBACK, wait_until


def message(package: str, name: str, **members: Any) -> Any:
    """Return the class of a ROS 2 message."""
    words = {"typename": f"{package}::msg::dds_::{name}_"}
    annotations = {"__annotations__": members, "__module__": __name__}
    return dataclass(new_class(name, (IdlStruct,), words, lambda names: names.update(annotations)))


Time = message("builtin_interfaces", "Time", sec=int32, nanosec=uint32)
Header = message("std_msgs", "Header", stamp=Time, frame_id=str)
Bool = message("std_msgs", "Bool", data=bool)
Vector3 = message("geometry_msgs", "Vector3", x=float64, y=float64, z=float64)
Point = message("geometry_msgs", "Point", x=float64, y=float64, z=float64)
Quaternion = message("geometry_msgs", "Quaternion", x=float64, y=float64, z=float64, w=float64)
Twist = message("geometry_msgs", "Twist", linear=Vector3, angular=Vector3)
TwistStamped = message("geometry_msgs", "TwistStamped", header=Header, twist=Twist)
Pose = message("geometry_msgs", "Pose", position=Point, orientation=Quaternion)
PoseStamped = message("geometry_msgs", "PoseStamped", header=Header, pose=Pose)
Transform = message("geometry_msgs", "Transform", translation=Vector3, rotation=Quaternion)
TransformStamped = message(
    "geometry_msgs", "TransformStamped", header=Header, child_frame_id=str, transform=Transform
)
TFMessage = message("tf2_msgs", "TFMessage", transforms=sequence[TransformStamped])
Covariance = array[float64, 36]
PoseWithCovariance = message("geometry_msgs", "PoseWithCovariance", pose=Pose, covariance=Covariance)
TwistWithCovariance = message("geometry_msgs", "TwistWithCovariance", twist=Twist, covariance=Covariance)
Odometry = message(
    "nav_msgs",
    "Odometry",
    header=Header,
    child_frame_id=str,
    pose=PoseWithCovariance,
    twist=TwistWithCovariance,
)
ANGLES = dict.fromkeys(("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time"), float32)
LIMITS = {"range_min": float32, "range_max": float32}
VALUES = {"ranges": sequence[float32], "intensities": sequence[float32]}
LaserScan = message("sensor_msgs", "LaserScan", header=Header, **ANGLES, **LIMITS, **VALUES)
RANGE = dict.fromkeys(("field_of_view", "min_range", "max_range", "range"), float32)
Range = message("sensor_msgs", "Range", header=Header, radiation_type=uint8, **RANGE)
RangeWithVariance = message(
    "sensor_msgs", "Range", header=Header, radiation_type=uint8, **RANGE, variance=float32
)


def twist(ahead: float, turn: float) -> Any:
    """Return a command [m/s], [rad/s]."""
    return Twist(Vector3(ahead, 0.0, 0.0), Vector3(0.0, 0.0, turn))


def seconds(header: Any) -> float:
    """Return the time of a header [s]."""
    return header.stamp.sec + header.stamp.nanosec * 1e-9


class Peer(ClosedOnExit):
    """A participant of a domain on loopback."""

    def __init__(self, domain: int) -> None:
        self._domain = Domain(domain, LOOPBACK)
        self.participant = DomainParticipant(domain)

    def writer(self, topic: str, kind: Any, *, is_matched: bool = True) -> DataWriter:
        """Return a reliable writer that has found its reader."""
        reliable = Policy.Reliability.Reliable(duration(seconds=10))
        made = DataWriter(
            self.participant, Topic(self.participant, topic, kind), Qos(reliable, Policy.History.KeepLast(1))
        )
        if is_matched:
            wait_until(lambda: bool(made.get_matched_subscriptions()))
        return made

    def reader(
        self, topic: str, kind: Any, *, is_reliable: bool = False, is_durable: bool = False, depth: int = 1
    ) -> DataReader:
        """Return a reader; a durable one asks for messages of before."""
        reliability = (
            Policy.Reliability.Reliable(duration(seconds=10))
            if is_reliable
            else Policy.Reliability.BestEffort
        )
        durability = Policy.Durability.TransientLocal if is_durable else Policy.Durability.Volatile
        return DataReader(
            self.participant,
            Topic(self.participant, topic, kind),
            Qos(reliability, durability, Policy.History.KeepLast(depth)),
        )

    def close(self) -> None:
        """Leave the domain, with all readers and writers."""
        self._domain.__del__()


def valid(reader: DataReader) -> list[Any]:
    """Take all messages. A sample that says that its writer has gone is none."""
    return [sample for sample in reader.take(10_000) if not isinstance(sample, InvalidSample)]


def next_message(reader: DataReader, after: float = 0.0) -> Any:
    """Return the next message whose stamp is after a time [s]."""
    found: list[Any] = []

    def is_there() -> bool:
        found.extend(sample for sample in valid(reader) if seconds(sample.header) > after)
        return bool(found)

    wait_until(is_there)
    return found[0]
