"""Trials as bags of ROS 2 and MCAP files, with standard messages, and the mapping that reads them back."""

from __future__ import annotations

import math
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from realitygap.errors import LogError, from_extra
from realitygap.evolution import Genome
from realitygap.records import ObservationsHead, TrialRecord, refuse_results, write_whole
from realitygap.world import Arena, RobotModel, arena_names, load_arena, load_robot

from ._log_map import Commands, LogMap, Poses, Readings, Wheels
from ._open import map_beside
from ._source import Floats

WHEEL_DIAMETER_MM = 65.0
"""Default diameter of the wheels, which converts distances to angles [mm]."""

BEGIN_S = 1.0
"""Time of the first command; 0 is no time in ROS."""

INFRARED = 1
"""Radiation type of infrared sensors in `sensor_msgs/Range`."""

_NS = 1_000_000_000
_STORE = "ROS2_JAZZY"
"""Distribution of ROS 2 whose message definitions are written."""

_VERSION = 9
"""Version of the metadata of a bag; ROS 2 Jazzy writes it."""


@dataclass(frozen=True)
class BagReport:
    """A trial that was written.

    Attributes:
        bag: File or folder of the bag.
        mapping: The mapping that `realitygap import` finds.
        n_messages: Number of messages by topic.
    """

    bag: Path
    mapping: Path
    n_messages: dict[str, int]


def write_bag(
    trial: TrialRecord,
    head: ObservationsHead,
    out: str | Path,
    *,
    times: Floats | None = None,
    wheel_diameter_mm: float = WHEEL_DIAMETER_MM,
) -> BagReport:
    """Write a trial as a bag of ROS 2 (a folder) or as an MCAP file, with a mapping that reads it back.

    | topic | message | content |
    |---|---|---|
    | /cmd_vel | geometry_msgs/TwistStamped | the command at the start of each step, and a stop at the end |
    | /odom | nav_msgs/Odometry | observed poses, and speeds from their differences |
    | /joint_states | sensor_msgs/JointState | angles of left_wheel_joint and right_wheel_joint |
    | /range_0, ... | sensor_msgs/Range | (1 - reading) times the longest reach: nominal, no measured distance |

    A topic without observations is left out. Stalls and crossed cells are in no topic.

    Args:
        trial: The trial.
        head: Robot, arena, and label of the trial.
        out: A file that ends in .mcap, or a new folder without an ending.
        times: (t + 1,) start of each command, and end of the last one [s]. Default: multiples of `step_s`.
        wheel_diameter_mm: Diameter of the wheels, which converts distances to angles [mm].

    Raises:
        LogError: `out` exists already or has another ending, the trial has no command, or the robot has other sensors
            or its front at -x.
        MissingExtraError: The extra `ros` is not installed.
        RecordError: The place belongs to a study's results, or cannot be written.
        ValueError: The diameter is not above 0.
    """
    out = Path(out)
    robot = load_robot(head.robot)
    _check(trial, robot, out, wheel_diameter_mm)
    at = np.arange(len(trial.commands) + 1, dtype=np.float64) * trial.step_s if times is None else times
    mapping = map_beside(out) if out.suffix == ".mcap" else out / "map.toml"
    counts: dict[str, int] = {}
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=out.parent, prefix=".bag-") as folder:
        made = Path(folder) / "bag"
        for topic, stream in _write(made, trial, robot, at, wheel_diameter_mm, is_mcap=out.suffix == ".mcap"):
            counts[topic] = stream
        source = next(made.glob("*.mcap")) if out.suffix == ".mcap" else made
        shutil.move(source, out)
    write_whole(mapping, _mapping(trial, head, robot, mapping, counts, wheel_diameter_mm).encode())
    return BagReport(out, mapping, counts)


def _check(trial: TrialRecord, robot: RobotModel, out: Path, wheel_diameter_mm: float) -> None:
    if not (math.isfinite(wheel_diameter_mm) and wheel_diameter_mm > 0):
        raise ValueError(f"wheel_diameter_mm is {wheel_diameter_mm!r}, expected a length above 0.")
    refuse_results(out)
    if out.suffix not in ("", ".mcap"):
        raise LogError(
            f"{out} ends in {out.suffix}, expected a file that ends in .mcap, or a folder without an ending. "
            "Name such a bag."
        )
    if out.exists() or out.is_symlink():
        raise LogError(f"{out} exists already. Name another bag.")
    if not len(trial.commands):
        raise LogError(f"Trial {trial.number} has no command, expected one that was driven.")
    n = trial.readings.shape[1]
    if n not in (0, len(robot.range)):
        raise LogError(
            f"Trial {trial.number} has {n} range sensors, and the robot {robot.name} has {len(robot.range)}. Expected "
            "the robot that drove."
        )
    if robot.drive.ahead < 0:
        raise LogError(
            f"The front of the robot {robot.name} is at -x, and in ROS it is at +x. Turn its file round: ahead = 1."
        )


def _write(
    path: Path,
    trial: TrialRecord,
    robot: RobotModel,
    at: Floats,
    wheel_diameter_mm: float,
    *,
    is_mcap: bool,
) -> Iterator[tuple[str, int]]:
    """Write all messages in the order of their times; yield each topic and the number of its messages."""
    rosbag2, typesys = from_extra("rosbags.rosbag2", "ros"), from_extra("rosbags.typesys", "ros")
    store = typesys.get_typestore(typesys.Stores[_STORE])
    messages = _Messages(store.types)
    streams = {
        "/cmd_vel": messages.commands(trial, robot),
        "/odom": messages.poses(trial, at),
        "/joint_states": messages.wheels(trial, wheel_diameter_mm),
        **messages.ranges(trial, robot),
    }
    plugin = rosbag2.StoragePlugin.MCAP if is_mcap else rosbag2.StoragePlugin.SQLITE3
    with rosbag2.Writer(path, version=_VERSION, storage_plugin=plugin) as writer:
        rows = []
        for topic, stream in streams.items():
            if not stream:
                continue
            kind = stream[0].__msgtype__
            connection = writer.add_connection(topic, kind, typestore=store)
            rows += [(k, connection, message, kind) for k, message in enumerate(stream)]
            yield topic, len(stream)
        for k, connection, message, kind in sorted(rows, key=lambda row: row[0]):
            nanoseconds = round((BEGIN_S + float(at[k])) * _NS)
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(nanoseconds, _NS)
            writer.write(connection, nanoseconds, store.serialize_cdr(message, kind))


class _Messages:
    """Messages of a trial, whose stamps are filled in when they are written; message k is of the begin of step k."""

    def __init__(self, types: Any) -> None:
        self._types = types

    def _make(self, kind: str, *values: Any) -> Any:
        return self._types[kind](*values)

    def _header(self, frame: str) -> Any:
        return self._make("std_msgs/msg/Header", self._make("builtin_interfaces/msg/Time", 0, 0), frame)

    def _twist(self, forward: float, turn: float) -> Any:
        vector = "geometry_msgs/msg/Vector3"
        return self._make(
            "geometry_msgs/msg/Twist",
            self._make(vector, forward, 0.0, 0.0),
            self._make(vector, 0.0, 0.0, turn),
        )

    def commands(self, trial: TrialRecord, robot: RobotModel) -> list[Any]:
        """Return the command of each step, and a stop."""
        twists = [*twists_of(trial.commands, robot), (0.0, 0.0)]
        kind = "geometry_msgs/msg/TwistStamped"
        return [self._make(kind, self._header("base_link"), self._twist(*twist)) for twist in twists]

    def poses(self, trial: TrialRecord, at: Floats) -> list[Any]:
        """Return the pose at the begin of each step and at the end; speeds are those of the step before."""
        if not len(trial.poses):
            return []
        steps, lasted = np.diff(trial.poses, axis=0), np.diff(at)
        half = trial.poses[:-1, 2] + steps[:, 2] / 2
        forward = (steps[:, 0] * np.cos(half) + steps[:, 1] * np.sin(half)) / lasted
        speeds = [(0.0, 0.0), *zip(forward.tolist(), (steps[:, 2] / lasted).tolist(), strict=True)]
        unknown = np.zeros(36)
        return [
            self._make(
                "nav_msgs/msg/Odometry",
                self._header("map"),
                "base_link",
                self._make("geometry_msgs/msg/PoseWithCovariance", self._pose(*pose), unknown),
                self._make("geometry_msgs/msg/TwistWithCovariance", self._twist(*speed), unknown),
            )
            for pose, speed in zip(trial.poses.tolist(), speeds, strict=True)
        ]

    def _pose(self, x: float, y: float, heading: float) -> Any:
        return self._make(
            "geometry_msgs/msg/Pose",
            self._make("geometry_msgs/msg/Point", x, y, 0.0),
            self._make(
                "geometry_msgs/msg/Quaternion", 0.0, 0.0, math.sin(heading / 2), math.cos(heading / 2)
            ),
        )

    def wheels(self, trial: TrialRecord, wheel_diameter_mm: float) -> list[Any]:
        """Return the angles of the wheels at the begin of each step and at the end."""
        angles = trial.wheels / (wheel_diameter_mm / 2000)
        names, none = ["left_wheel_joint", "right_wheel_joint"], np.empty(0)
        kind = "sensor_msgs/msg/JointState"
        return [
            self._make(kind, self._header(""), names, row.astype(np.float64), none, none) for row in angles
        ]

    def ranges(self, trial: TrialRecord, robot: RobotModel) -> dict[str, list[Any]]:
        """Return the reading of each range sensor before each command and, if the robot looked, after the last."""
        readings = trial.readings
        if len(trial.last_readings):
            readings = np.vstack([readings, trial.last_readings])
        reach = longest_reach(robot)
        kind = "sensor_msgs/msg/Range"
        return {
            f"/range_{k}": [
                self._make(
                    *(kind, self._header(f"range_{k}"), INFRARED, 2 * robot.range[k].cone, 0.0, reach),
                    *(reach * (1.0 - reading), 0.0),
                )
                for reading in column
            ]
            for k, column in enumerate(readings.T.tolist())
        }


def longest_reach(robot: RobotModel) -> float:
    """Return the longest reach of a robot's range sensors [m]."""
    return max(float(sensor.reach) for sensor in robot.range)


def twists_of(commands: Floats, robot: RobotModel) -> list[tuple[float, float]]:
    """Return the speed [m/s] and the rate of turn [rad/s] of each command (t, 2), move and turn, -1 to 1."""
    drive = robot.drive
    move, turn = np.asarray(commands, np.float64).T
    if drive.mixing == "independent":
        return list(zip((drive.speed * move).tolist(), (drive.turn_rate * turn).tolist(), strict=True))
    left, right = np.clip(move - turn, -1, 1), np.clip(move + turn, -1, 1)
    forward, rate = drive.speed * (left + right) / 2, drive.speed * (right - left) / drive.track
    return list(zip(forward.tolist(), rate.tolist(), strict=True))


def _mapping(
    trial: TrialRecord,
    head: ObservationsHead,
    robot: RobotModel,
    file: Path,
    counts: dict[str, int],
    wheel_diameter_mm: float,
) -> str:
    """Return the mapping of a bag, after the files of the arena and the controller that it names were written."""
    stem = file.name.removesuffix(".map.toml") if file.name != "map.toml" else "trial"
    arena, controller = Arena.from_dict(dict(head.arena)), ""
    name = arena.name
    if name not in arena_names() or load_arena(name) != arena:
        name = f"{stem}.arena.toml"
        write_whole(file.parent / name, arena.to_toml().encode())
    if trial.genome:
        controller = f"{stem}.controller.json"
        write_whole(file.parent / controller, Genome.from_json(trial.genome).to_json().encode())
    n = sum(topic.startswith("/range_") for topic in counts)
    pose = "/odom/pose/pose"
    parts: dict[str, Any] = {
        "commands": Commands(forward="/cmd_vel/twist/linear/x", turn="/cmd_vel/twist/angular/z"),
        "poses": Poses(
            x=f"{pose}/position/x",
            y=f"{pose}/position/y",
            quaternion=tuple(f"{pose}/orientation/{axis}" for axis in "xyzw"),
        ),
        "wheels": Wheels(
            left="/joint_states/left_wheel_joint/position",
            right="/joint_states/right_wheel_joint/position",
            unit="rad",
            wheel_diameter_mm=wheel_diameter_mm,
        ),
        "readings": None
        if not n
        else Readings(
            sensors=tuple(f"/range_{k}/range" for k in range(n)), full=longest_reach(robot), inverted=True
        ),
    }
    has = {"commands": "/cmd_vel", "poses": "/odom", "wheels": "/joint_states", "readings": "/range_0"}
    return LogMap(
        robot=head.robot,
        step_s=trial.step_s,
        arena=name,
        controller=controller,
        label=head.label,
        **{part: value for part, value in parts.items() if has[part] in counts},
    ).to_toml()
