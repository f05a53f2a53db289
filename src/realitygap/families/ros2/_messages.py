"""Messages of ROS 2: their definitions, as `.msg` files have them, and their names on the wire.

Sources: the packages common_interfaces, geometry2, rcl_interfaces, irobot_create_msgs, and turtlebot3_msgs of ROS 2
Jazzy, without their comments. On the wire, topic `/odom` is `rt/odom`, and type `nav_msgs/msg/Odometry` is
`nav_msgs::msg::dds_::Odometry_` (design.ros2.org, "Topic and Service name mapping to DDS").
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

DEFINITIONS = {
    "builtin_interfaces/msg/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/msg/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "std_msgs/msg/Bool": "bool data",
    "geometry_msgs/msg/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/msg/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/msg/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
    "geometry_msgs/msg/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
    "geometry_msgs/msg/PoseStamped": "std_msgs/Header header\ngeometry_msgs/Pose pose",
    "geometry_msgs/msg/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance",
    "geometry_msgs/msg/Transform": "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation",
    "geometry_msgs/msg/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform"
    ),
    "geometry_msgs/msg/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
    "geometry_msgs/msg/TwistStamped": "std_msgs/Header header\ngeometry_msgs/Twist twist",
    "geometry_msgs/msg/TwistWithCovariance": "geometry_msgs/Twist twist\nfloat64[36] covariance",
    "nav_msgs/msg/Odometry": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
        "geometry_msgs/TwistWithCovariance twist"
    ),
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "sensor_msgs/msg/LaserScan": (
        "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\n"
        "float32 time_increment\nfloat32 scan_time\nfloat32 range_min\nfloat32 range_max\nfloat32[] ranges\n"
        "float32[] intensities"
    ),
    "sensor_msgs/msg/Range": (
        "std_msgs/Header header\nuint8 radiation_type\nfloat32 field_of_view\nfloat32 min_range\nfloat32 max_range\n"
        "float32 range"
    ),
    "sensor_msgs/msg/BatteryState": (
        "std_msgs/Header header\nfloat32 voltage\nfloat32 temperature\nfloat32 current\nfloat32 charge\n"
        "float32 capacity\nfloat32 design_capacity\nfloat32 percentage\nuint8 power_supply_status\n"
        "uint8 power_supply_health\nuint8 power_supply_technology\nbool present\nfloat32[] cell_voltage\n"
        "float32[] cell_temperature\nstring location\nstring serial_number"
    ),
    "irobot_create_msgs/msg/HazardDetection": "std_msgs/Header header\nuint8 type",
    "irobot_create_msgs/msg/HazardDetectionVector": (
        "std_msgs/Header header\nirobot_create_msgs/HazardDetection[] detections"
    ),
    "irobot_create_msgs/msg/IrIntensity": "std_msgs/Header header\nint16 value",
    "irobot_create_msgs/msg/IrIntensityVector": (
        "std_msgs/Header header\nirobot_create_msgs/IrIntensity[] readings"
    ),
    "turtlebot3_msgs/msg/SensorState": (
        "std_msgs/Header header\nuint8 bumper\nfloat32 cliff\nfloat32 sonar\nfloat32 illumination\nuint8 led\n"
        "uint8 button\nbool torque\nint32 left_encoder\nint32 right_encoder\nfloat32 battery"
    ),
}
"""The definition of each message that drivers understand: a type and a name on each line."""

TWIST, TWIST_STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
ODOMETRY, SCAN, RANGE = "nav_msgs/msg/Odometry", "sensor_msgs/msg/LaserScan", "sensor_msgs/msg/Range"
POSE, TF = "geometry_msgs/msg/PoseStamped", "tf2_msgs/msg/TFMessage"
BATTERY, BOOL = "sensor_msgs/msg/BatteryState", "std_msgs/msg/Bool"
HAZARDS, SENSOR_STATE = "irobot_create_msgs/msg/HazardDetectionVector", "turtlebot3_msgs/msg/SensorState"
INTENSITIES = "irobot_create_msgs/msg/IrIntensityVector"


class Field(NamedTuple):
    """A field of a message.

    Attributes:
        name: Its name.
        kind: A primitive type such as `float64`, or a message such as `geometry_msgs/msg/Point`.
        size: Number of values: None for one, 0 for a sequence of any length.
    """

    name: str
    kind: str
    size: int | None


@cache
def fields_of(message: str) -> tuple[Field, ...]:
    """Return the fields of a message in their order."""
    fields = []
    for line in DEFINITIONS[message].splitlines():
        kind, name = line.split()
        base, bracket, size = kind.rstrip("]").partition("[")
        package, slash, short = base.partition("/")
        base = f"{package}/msg/{short}" if slash else base
        fields.append(Field(name, base, int(size or 0) if bracket else None))
    return tuple(fields)


def name_on_wire(message: str) -> str:
    """Return the type's name on the wire: `a/msg/B` is `a::msg::dds_::B_`."""
    package, _, name = message.split("/")
    return f"{package}::msg::dds_::{name}_"


def message_of(wire: str) -> str:
    """Return a type's name as ROS has it, from its name on the wire; another name as it is."""
    parts = wire.split("::")
    if len(parts) == 4 and parts[1:3] == ["msg", "dds_"] and parts[3].endswith("_"):
        return f"{parts[0]}/msg/{parts[3][:-1]}"
    return wire


def topic_on_wire(topic: str) -> str:
    """Return the topic's name on the wire: `/odom` is `rt/odom`."""
    return f"rt{topic}"


def full_topic(namespace: str, topic: str) -> str:
    """Return a topic with its namespace; one that begins with a slash has its own."""
    return topic if topic.startswith("/") else f"{namespace.rstrip('/')}/{topic}"
