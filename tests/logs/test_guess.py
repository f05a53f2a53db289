"""Mappings are guessed from names of columns as public programs write them; what is uncertain is refused."""

import numpy as np
import pytest

from realitygap.errors import LogError
from realitygap.logs import guess_log_map, mapping_of, read_logs
from realitygap.world import load_robot
from tests.logs.made import SPEED, STEP_S, TRACK, drive

ROBOT = load_robot("pioneer").with_numbers({"drive.speed": SPEED, "drive.track": TRACK})
BEGAN_S = 1_700_000_000
N = 120


def columns():
    """The columns of a drive, by what they are."""
    commands, poses = drive(N, noise=0)
    told = np.concatenate([commands, commands[-1:]]) * SPEED
    ways = np.concatenate([np.zeros((1, 2)), np.cumsum(told[:-1] * STEP_S, 0)])
    heading = poses[:, 2]
    t = STEP_S * np.arange(N + 1)
    zero = 0 * t
    return {
        "t": t, "s": BEGAN_S + t, "ns": (BEGAN_S * 10**9 + np.round(t * 1e9).astype(np.int64)), "sec": BEGAN_S + t // 1,
        "nsec": np.round(t % 1 * 1e9), "seq": np.arange(N + 1), "0": zero, "l": told[:, 0], "r": told[:, 1],
        "v": told.mean(1), "w": (told[:, 1] - told[:, 0]) / TRACK, "x": poses[:, 0], "y": poses[:, 1], "h": heading,
        "deg": np.degrees(heading), "qz": np.sin(heading / 2), "qw": np.cos(heading / 2), "mm": 1000 * poses[:, 0],
        "mmy": 1000 * poses[:, 1], "el": np.round(ways[:, 0] * 9000) + 4000, "er": np.round(ways[:, 1] * 9000) + 4000,
        "il": np.diff(np.round(ways[:, 0] * 9000), prepend=0), "ir": np.diff(np.round(ways[:, 1] * 9000), prepend=0),
        "lmm": 1000 * told[:, 0], "rmm": 1000 * told[:, 1], "ms": 1000 * t, "n": 0.3 + zero,
    }  # fmt: skip


def table(path, layout, separator=","):
    """Write a table with these names of columns, and what is in each."""
    values = columns()
    rows = zip(*(values[kind].tolist() for kind in layout.values()), strict=True)
    lines = [separator.join(layout), *(separator.join(map(repr, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


ODOMETRY = {
    "pose.pose.position.x": "x", "pose.pose.position.y": "y", "pose.pose.position.z": "0",
    "pose.pose.orientation.x": "0", "pose.pose.orientation.y": "0",
    "pose.pose.orientation.z": "qz", "pose.pose.orientation.w": "qw",
    "pose.covariance_0": "n", "pose.covariance_1": "0", "twist.twist.linear.x": "v", "twist.twist.linear.y": "0",
    "twist.twist.linear.z": "0", "twist.twist.angular.x": "0", "twist.twist.angular.y": "0",
    "twist.twist.angular.z": "w", "twist.covariance_0": "n",
}  # fmt: skip
TWIST = {
    "linear.x": "v",
    "linear.y": "0",
    "linear.z": "0",
    "angular.x": "0",
    "angular.y": "0",
    "angular.z": "w",
}


def under(start, layout, separator="."):
    return {start + name.replace(".", separator): kind for name, kind in layout.items()}


GUESSED = {
    "rostopic echo -p of both, joined": {"%time": "ns", **under("field.", TWIST), **under("field.", ODOMETRY)},
    "bagpy, with the topics' names": {
        "Time": "s", **under("cmd_vel.", TWIST), "odom.header.seq": "seq", "odom.header.stamp.secs": "sec",
        "odom.header.stamp.nsecs": "nsec", **under("odom.", ODOMETRY),
    },
    "PlotJuggler": {
        "__time": "s", **under("/cmd_vel/", TWIST, "/"), "/odom/header/stamp": "s", **under("/odom/", ODOMETRY, "/"),
        "/imu/angular_velocity/z": "w", "/imu/linear_acceleration/x": "n", "/imu/orientation/z": "qz",
    },
    "header stamps alone": {
        "cmd_vel.header.stamp.sec": "sec", "cmd_vel.header.stamp.nanosec": "nsec", **under("cmd_vel.twist.", TWIST),
        "mocap.pose.position.x": "x", "mocap.pose.position.y": "y", "mocap.pose.orientation.x": "0",
        "mocap.pose.orientation.y": "0", "mocap.pose.orientation.z": "qz", "mocap.pose.orientation.w": "qw",
    },
    "underscores": {"timestamp": "s", **under("cmd_vel_", TWIST, "_"), **under("vicon_", ODOMETRY, "_"),
                    **under("odom_", ODOMETRY, "_")},
    "a student's table": {"t": "t", "v": "v", "w": "w", "x": "x", "y": "y", "theta": "h", "qx": "0", "acc_x": "n"},
    "units in names": {"time_ms": "ms", "left_mm_s": "lmm", "right_mm_s": "rmm", "x_mm": "mm", "y_mm": "mmy",
                       "yaw_deg": "deg"},
    "camera before odometry": {"time": "t", "leftSpeed": "l", "rightSpeed": "r", "odom_x": "n", "odom_y": "n",
                               "cam_x": "x", "cam_y": "y", "cam_theta": "h", "goal_x": "n", "goal_y": "n"},
    "current and battery": {"time": "t", "left_cmd": "l", "right_cmd": "r", "left_current": "n", "right_current": "n",
                            "left_actual_speed": "n", "right_actual_speed": "n", "battery_v": "n", "x": "x", "y": "y",
                            "heading": "h"},
}  # fmt: skip


def test_names_of_public_programs_give_what_was_driven(tmp_path):
    commands, poses = drive(N, noise=0)
    for style, layout in GUESSED.items():
        path = table(tmp_path / "log.csv", layout)
        (log,) = read_logs(path, guess_log_map(path), ROBOT)
        assert log.step_s == pytest.approx(STEP_S, rel=1e-3), style
        assert np.abs(log.commands - commands).max() < 0.02, style
        assert np.abs(log.poses[:, :2] - poses[:, :2]).max() < 1e-3, style
        off = log.poses[:, 2] - poses[:, 2]
        assert np.abs(off - 2 * np.pi * np.round(off[0] / (2 * np.pi))).max() < 1e-3, style


REFUSED = {
    "speeds of odometry, and no commands": ({"Time": "s", **ODOMETRY}, "speeds that the robot measured"),
    "two commands": (
        {"t": "t", "left": "l", "right": "r", "v": "v", "w": "w"},
        "several columns could be the commands",
    ),
    "two poses": (
        {"t": "t", "v": "v", "w": "w", "a_x": "x", "a_y": "y", "b_x": "n", "b_y": "n"},
        "several columns could be the poses: a_x and a_y; b_x and b_y",
    ),
    "millimeters without a unit": (
        {"t": "t", "left": "l", "right": "r", "x": "mm", "y": "mmy"},
        "too much for meters",
    ),
    "speeds in millimeters": (
        {"t": "t", "left": "lmm", "right": "rmm", "x": "x", "y": "y"},
        "left reaches .* for m/s",
    ),
    "degrees without a unit": (
        {"t": "t", "v": "v", "w": "w", "x": "x", "y": "y", "yaw": "deg"},
        "yaw are no radians",
    ),
    "milliseconds": (
        {"t": "ms", "v": "v", "w": "w", "x": "x", "y": "y"},
        "rows are 100 apart in t, and its unit is",
    ),
    "no time": ({"dt": "n", "v": "v", "w": "w", "x": "x", "y": "y"}, "no column looks like the time"),
    "a time that goes back": ({"time": "v", "left": "l", "right": "r"}, "no column looks like the time"),
    "parts of a quaternion": (
        {"t": "t", "orientation.w": "qw", "linear.x": "v"},
        "do not say which are the wheels",
    ),
}


def test_uncertain_columns_are_refused(tmp_path):
    for case, (layout, message) in REFUSED.items():
        with pytest.raises(LogError, match=message):
            print(case, guess_log_map(table(tmp_path / "log.csv", layout)))
    layout, _ = REFUSED["millimeters without a unit"]
    log_map, _ = mapping_of(table(tmp_path / "log.csv", layout), draft=True)
    assert log_map.poses.unit == "m"


def test_increments_of_encoders_are_recognized_by_names_or_values(tmp_path):
    poses = {"x": "x", "y": "y", "theta": "h"}
    cases = {
        "names": ({"t": "t", "delta_left_ticks": "il", "delta_right_ticks": "ir", **poses}, "row"),
        "short names": ({"t": "t", "dl": "il", "dr": "ir", **poses}, "row"),
        "values, with poses": ({"t": "t", "left_ticks": "il", "right_ticks": "ir", **poses}, "row"),
        "values": ({"t": "t", "left_ticks": "il", "right_ticks": "ir"}, "row"),
        "counters, with poses": ({"t": "t", "left_ticks": "el", "right_ticks": "er", **poses}, ""),
        "counters": ({"t": "t", "left_ticks": "el", "right_ticks": "er"}, ""),
    }
    for case, (layout, per) in cases.items():
        log_map, origin = mapping_of(table(tmp_path / "log.csv", layout))
        assert log_map.wheels.per == per, case
        assert ("increments" in origin) == bool(per), case


def test_encoders_of_unknown_scale_are_left_out_if_there_are_commands(tmp_path):
    path = table(
        tmp_path / "log.csv", {"t": "t", "v": "v", "w": "w", "encoder_left": "el", "encoder_right": "er"}
    )
    log_map, origin = mapping_of(path)
    assert log_map.wheels is None
    assert "because ticks_per_m is unknown" in origin
    assert mapping_of(path, draft=True)[0].wheels.unit == "ticks"
    (log,) = read_logs(path, log_map, ROBOT)
    assert log.has_commands


def test_poses_have_the_stamp_of_their_header_if_its_clock_is_that_of_the_log(tmp_path):
    for stamp, expected in (("s", "odom.header.stamp"), ("t", "Time")):
        layout = {
            "Time": "s",
            "odom.header.stamp": stamp,
            **under("cmd_vel.", TWIST),
            **under("odom.", ODOMETRY),
        }
        log_map = guess_log_map(table(tmp_path / "log.csv", layout))
        assert (log_map.commands.time, log_map.poses.time) == ("Time", expected)


def test_readings_of_unknown_scale_are_left_out(tmp_path):
    layout = {"t": "t", "v": "v", "w": "w", "ir0": "mm", "ir1": "mm", "status1": "n", "status2": "n"}
    log_map, origin = mapping_of(table(tmp_path / "log.csv", layout))
    assert log_map.readings is None
    assert "ir0 to ir1 are left out" in origin
