"""Bags of ROS 2 and MCAP files are read by topic; damaged ones have one message."""

import json

import numpy as np
import pytest

from realitygap.errors import LogError
from realitygap.logs import LogMap, guess_log_map, open_source, read_logs
from realitygap.world import load_robot
from tests.logs.made import SPEED, STEP_S, TRACK, drive

ROBOT = load_robot("pioneer").with_numbers({"drive.speed": SPEED, "drive.track": TRACK})
BEGAN_NS = 1_700_000_000_000_000_000
NS = 1_000_000_000


def ros_bag(path, commands, poses, storage, *, late_s=0.0, clock_s=0):
    """A bag with /cmd_vel (Twist) and /mocap (PoseStamped), recorded late, with stamps of a clock that is off."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS2_HUMBLE)
    twist, vector = types.types["geometry_msgs/msg/Twist"], types.types["geometry_msgs/msg/Vector3"]
    stamped, pose = types.types["geometry_msgs/msg/PoseStamped"], types.types["geometry_msgs/msg/Pose"]
    point, quaternion = types.types["geometry_msgs/msg/Point"], types.types["geometry_msgs/msg/Quaternion"]
    header, stamp = types.types["std_msgs/msg/Header"], types.types["builtin_interfaces/msg/Time"]
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        told = writer.add_connection("/cmd_vel", twist.__msgtype__, typestore=types)
        seen = writer.add_connection("/mocap", stamped.__msgtype__, typestore=types)
        for k, (x, y, heading) in enumerate(poses):
            at = BEGAN_NS + round(k * STEP_S * NS)
            left, right = commands[min(k, len(commands) - 1)] * SPEED
            ahead, turn = vector((left + right) / 2, 0.0, 0.0), vector(0.0, 0.0, (right - left) / TRACK)
            writer.write(told, at, types.serialize_cdr(twist(ahead, turn), twist.__msgtype__))
            where = pose(point(x, y, 0.0), quaternion(0.0, 0.0, np.sin(heading / 2), np.cos(heading / 2)))
            message = stamped(header(stamp(at // NS + clock_s, at % NS), "world"), where)
            writer.write(seen, at + round(late_s * NS), types.serialize_cdr(message, stamped.__msgtype__))
    return path


def json_mcap(path, commands, poses):
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channels = {
            topic: writer.register_channel(topic=topic, message_encoding="json", schema_id=0)
            for topic in ("/drive", "/camera")
        }
        for k, (x, y, heading) in enumerate(poses):
            left, right = commands[min(k, len(commands) - 1)] * SPEED
            at = BEGAN_NS + round(k * STEP_S * NS)
            for topic, message in (
                ("/drive", {"left": left, "right": right}),
                ("/camera", {"pose": [x, y, heading]}),
            ):
                writer.add_message(channels[topic], at, json.dumps(message).encode(), at)
        writer.finish()
    return path


JSON_MAP = LogMap(
    commands={"left": "/drive/left", "right": "/drive/right"},
    poses={"x": "/camera/pose[0]", "y": "/camera/pose[1]", "heading": "/camera/pose[2]"},
)


@pytest.mark.slow
def test_bags_of_ros_give_what_was_driven(tmp_path):
    commands, poses = drive(50)
    for storage in ("sqlite3", "mcap"):
        path = ros_bag(tmp_path / storage, commands, poses, storage)
        mapped = guess_log_map(path)
        assert mapped.commands.columns() == ["/cmd_vel/linear/x", "/cmd_vel/angular/z"]
        assert mapped.poses.x == "/mocap/pose/position/x"
        stamped = mapped.poses.model_copy(update={"time": "/mocap/header/stamp"})
        for each in (mapped, mapped.model_copy(update={"poses": stamped})):
            (log,) = read_logs(path, each, ROBOT)
            assert np.abs(log.commands - commands).max() < 1e-5
            off = log.poses - poses
            off[:, 2] -= 2 * np.pi * np.round(off[0, 2] / (2 * np.pi))
            assert np.abs(off).max() < 1e-5
        single = next(file for file in path.iterdir() if file.suffix in (".db3", ".mcap"))
        (log,) = read_logs(single, mapped, ROBOT)
        assert np.abs(log.commands - commands).max() < 1e-5
        single.write_bytes(single.read_bytes()[: single.stat().st_size // 2])
        with pytest.raises(LogError, match="is damaged, cut off, or no such file") as error:
            list(read_logs(single, mapped, ROBOT))
        assert "\n" not in str(error.value)


@pytest.mark.slow
def test_times_are_those_of_headers_unless_their_clock_is_another_one(tmp_path):
    commands, poses = drive(50)
    bag = ros_bag(tmp_path / "late", commands, poses, "mcap", late_s=0.4)
    mapped = guess_log_map(bag)
    (log,) = read_logs(bag, mapped, ROBOT)
    assert np.abs(log.poses[:, :2] - poses[:, :2]).max() < 1e-5
    assert any("times of /mocap/header/stamp" in note for note in log.notes)
    recorded = mapped.poses.model_copy(update={"time": "@time"})
    (log,) = read_logs(bag, mapped.model_copy(update={"poses": recorded}), ROBOT)
    assert log.start_s == pytest.approx(BEGAN_NS / NS + 0.4)
    simulated = ros_bag(tmp_path / "simulated", commands, poses, "mcap", clock_s=-1_700_000_000)
    (log,) = read_logs(simulated, mapped, ROBOT)
    assert np.abs(log.poses[:, :2] - poses[:, :2]).max() < 1e-5


def test_mcap_with_json_gives_what_was_driven(tmp_path):
    commands, poses = drive(50)
    path = json_mcap(tmp_path / "log.mcap", commands, poses)
    (log,) = read_logs(path, JSON_MAP, ROBOT)
    assert np.abs(log.commands - commands).max() < 1e-5
    assert np.abs(log.poses - poses).max() < 1e-5


def test_mcap_that_is_cut_off_has_one_message(tmp_path):
    path = json_mcap(tmp_path / "log.mcap", *drive(50))
    whole = path.read_bytes()
    for size in (4, 100, len(whole) // 2, len(whole) - 1):
        path.write_bytes(whole[:size])
        with pytest.raises(LogError, match=r"log.mcap is damaged, cut off.*mcap recover") as error:
            list(read_logs(path, JSON_MAP, ROBOT))
        assert "\n" not in str(error.value)


def test_columns_of_a_part_are_of_one_topic(tmp_path):
    path = json_mcap(tmp_path / "log.mcap", *drive(10))
    mapped = LogMap(commands={"left": "/drive/left", "right": "/camera/pose[0]"})
    with pytest.raises(LogError, match="are of 2 topics, expected one"):
        list(read_logs(path, mapped, ROBOT))
    with pytest.raises(LogError, match=r"has no column /drive/lef\. .*Did you mean '/drive/left'"):
        list(open_source(path).batches(["/drive/lef"]))


def test_empty_mcap_has_a_message_without_names_of_exceptions(tmp_path):
    """It named `EndOfFile: EndOfFile`, and advised to recover what was never there."""
    (tmp_path / "log.mcap").touch()
    with pytest.raises(LogError, match=r"log.mcap is empty. Record it again.$"):
        list(read_logs(tmp_path / "log.mcap", JSON_MAP, ROBOT))
