"""The emulated robot in this program, the addresses, and what messages mean; no DDS is needed."""

from __future__ import annotations

import math
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from realitygap.errors import RealityGapError, RobotError
from realitygap.families import ros2
from realitygap.families.ros2 import Ros2Robot, _ports
from realitygap.families.ros2._address import read_address
from realitygap.families.ros2._messages import DEFINITIONS, fields_of, message_of, name_on_wire
from realitygap.families.ros2._wiring import Scan, load_wired, respond, sectors_of
from realitygap.platforms import base_robot_of, open_target, platform_of
from realitygap.robots import Command
from realitygap.study import OwnPosesObserver
from realitygap.testing import check_platform, check_robot
from realitygap.trials import TrialPlan, WitnessObserver
from realitygap.world import Pose, RangeSensor, load_robot, paper_arena, robot_names

PORT = "emulator://ros2?speed=off"
ROBOTS = [name for name in robot_names() if load_robot(name).driver.get("family") == "ros2"]


@pytest.mark.parametrize("name", ROBOTS)
def test_each_shipped_robot_can_be_emulated_and_keeps_the_contract(name):
    check_robot(Ros2Robot(f"{PORT}&robot={name}"))
    platform = platform_of(f"ros2:{PORT}&robot={name}")
    check_platform(platform)
    assert len(platform.body.corners) > 2


def test_robot_drives_as_its_body_and_odometry_tells_it(tmp_path):
    model = load_robot("turtlebot3-burger")
    file = tmp_path / "slow.toml"
    file.write_text('base = "turtlebot3-burger"\n[drive]\ngain_left = 0.5\ngain_right = 0.5\n')
    ways = []
    for body in ("turtlebot3-burger", file):
        with Ros2Robot(f"{PORT}&arena=paper&body={body}", step_s=1.0) as robot:
            robot.reset()
            robot.drive(Command(0.5, 0.0))
            robot.stop()
            left, right = robot.wheels()
            moved = robot.port.witness.pose().x - robot.port.witness.path()[0, 1]
            assert (left + right) / 2 == pytest.approx(moved, rel=0.05)
            ways.append(moved)
    assert ways[0] == pytest.approx(model.drive.speed / 2 * (1 - model.drive.lag), rel=0.15)
    assert ways[1] == pytest.approx(ways[0] / 2, rel=0.1)


def test_address_decides_the_robot_that_calibrations_build_on(tmp_path):
    assert base_robot_of(f"ros2:{PORT}") == "turtlebot3-burger"
    assert base_robot_of("ros2:/one?robot=mine.toml&domain=3") == "mine.toml"


def wired(folder, driver):
    file = folder / "mine.toml"
    file.write_text(f'base = "turtlebot3-burger"\n[driver]\n{driver}\n')
    return str(file)


@pytest.mark.parametrize(
    ("driver", "message"),
    [
        ('odometri = "odom"', "driver.odometri: unknown setting. Did you mean 'odometry'"),
        ('odometry = "odom 1"', "'odom 1' is no name of a topic"),
        ('odometry = "scan"', "topic 'scan' is named twice"),
        ('pose_frames = ["map", "base_link"]', "set pose, such as '/tf'"),
        ('pose = "/tf"', "set pose_frames"),
        ('ranges = ["a", "b", "c", "d", "e"]', "ranges and scan both tell the range sensors"),
    ],
)
def test_wrong_topics_get_one_message(tmp_path, driver, message):
    with pytest.raises(RobotError, match=message):
        Ros2Robot(f"{PORT}&robot={wired(tmp_path, driver)}")


@pytest.mark.parametrize("driver", ['pose = "/mocap"', 'pose = "/tf"\npose_frames = ["map", "base_link"]'])
def test_emulated_motion_capture_tells_true_poses(tmp_path, driver):
    driver += '\npose_frame = "arena"'
    with Ros2Robot(f"{PORT}&robot={wired(tmp_path, driver)}", step_s=1.0) as robot:
        robot.reset()
        robot.begin_path(Pose(0.0, 0.0, 0.0))
        robot.drive(Command(0.5, 0.3))
        assert robot.path()[-1, 1:] == pytest.approx(tuple(robot.port.witness.pose()))


def test_drive_that_stood_still_fails(monkeypatch):
    with Ros2Robot(PORT, step_s=10.0) as robot:
        sleep = robot.clock.sleep
        monkeypatch.setattr(robot.clock, "sleep", lambda seconds: sleep(seconds + 5))
        with pytest.raises(RobotError, match=r"stood still for 5\.0 s"):
            robot.drive(Command(0.1, 0.0))


def test_battery_that_is_not_told_is_an_error(tmp_path):
    file = wired(tmp_path, 'battery = ""')
    with (
        Ros2Robot(f"{PORT}&robot={file}") as robot,
        pytest.raises(RobotError, match="does not tell the voltage"),
    ):
        robot.volts()


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("ROS_DOMAIN_ID", "300", "from 0 to 232"),
        ("ROS_AUTOMATIC_DISCOVERY_RANGE", "everywhere", "expected SUBNET, LOCALHOST"),
    ],
)
def test_wrong_variable_of_ros_gets_one_message(monkeypatch, name, value, message):
    monkeypatch.setenv(name, value)
    with pytest.raises(RobotError, match=message):
        read_address("/")
    if find_spec("cyclonedds"):
        assert any(message in guess.seems for guess in _ports._look())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("robot1", "names no robot"),
        ("//x", "names no robot"),
        ("/x?domian=1", "Did you mean 'domain'"),
        ("/x?domain=300", "from 0 to 232"),
        ("/x?label=SIM", "expected REAL or EMULATED"),
    ],
)
def test_wrong_address_gets_one_message(text, message):
    with pytest.raises(RobotError, match=message):
        read_address(text)


def test_address_stays_on_this_machine_unless_ros_says_otherwise(monkeypatch):
    for name in ("CYCLONEDDS_URI", "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_DOMAIN_ID"):
        monkeypatch.delenv(name, raising=False)
    assert read_address("/a/")[:1] + read_address("/a/")[2:] == ("/a", 0, "lo", "", "EMULATED")
    assert read_address("ros2:/?interface=wlan0").label == "REAL"
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    assert read_address("/")[2:4] == (7, "auto")


@pytest.mark.parametrize(
    ("driver", "message"),
    [
        ("", "has no table"),
        ('[driver]\nfamily = "ros2"\nodometri = "odom"', "odometri"),
        ('[driver]\nfamily = "ros2"', "neither ranges nor scan"),
        ('[driver]\nfamily = "ros2"\nranges = ["a"]', "has 5 range sensors, and .* names 1 of them"),
    ],
)
def test_robot_file_without_its_topics_gets_one_message(tmp_path, driver, message):
    shipped = Path(ros2.__file__).parent / "robots" / "turtlebot3-burger.toml"
    file = tmp_path / "mine.toml"
    file.write_text(shipped.read_text().partition("[driver]")[0] + driver)
    with pytest.raises(RealityGapError, match=message):
        load_wired(str(file))


def test_sector_is_the_nearest_point_in_the_cone_of_its_sensor():
    sensors = [RangeSensor(x=0.0, y=0.0, direction=d, cone=0.2, reach=2.0) for d in (0.0, math.pi / 2)]
    ranges = [1.0, 0.5, None, 0.0, 9.0, 0.7]
    scan = {"angle_min": -0.1, "angle_increment": 0.1, "range_min": 0.1, "range_max": 5.0, "ranges": ranges}
    assert sectors_of(scan, Scan(), sensors) == [0.5, None]
    turned = sectors_of(scan, Scan(direction=math.pi / 2), sensors)
    assert turned == [None, pytest.approx(0.5)]
    shifted = sectors_of(scan, Scan(x=-0.3), sensors)
    assert shifted[0] == pytest.approx(0.2)


def test_reading_follows_the_response_of_the_robot_file():
    linear = RangeSensor(x=0, y=0, reach=2.0)
    assert [respond(linear, far) for far in (None, 2.5, 0.5, 0.0)] == [0.0, 0.0, 0.75, 1.0]
    table = RangeSensor(
        x=0, y=0, reach=1.0, response="table",
        table=({"distance": 0.1, "reading": 1.0}, {"distance": 0.5, "reading": 0.2}),
    )  # fmt: skip
    assert [respond(table, far) for far in (0.05, 0.3, 0.7)] == pytest.approx([1.0, 0.6, 0.2])
    with pytest.raises(RobotError, match="expected linear or table"):
        respond(RangeSensor(x=0, y=0, reach=1.0, response="ir"), 0.5)


def test_names_on_the_wire_lead_back():
    for name in DEFINITIONS:
        assert message_of(name_on_wire(name)) == name
        assert fields_of(name)
    assert name_on_wire("nav_msgs/msg/Odometry") == "nav_msgs::msg::dds_::Odometry_"
    assert message_of("something::else") == "something::else"


def test_own_poses_are_those_of_odometry_from_the_start():
    arena = paper_arena()
    plan = TrialPlan(commands=np.array([[0.8, 0.0], [0.0, 0.5], [0.8, 0.2]] * 3), number=3, sees_end=True)
    seen = []
    for observer in (WitnessObserver(), OwnPosesObserver(arena, WitnessObserver())):
        with open_target(f"ros2:{PORT}", arena, observer=observer) as target:
            assert target.observes == "track"
            (trial,) = target.carry_out([plan], "track")
            seen.append(trial)
    true, told = (trial.poses for trial in seen)
    assert np.allclose(told[0], arena.start, atol=0.001)
    assert np.abs(told[:, :2] - true[:, :2]).max() < 0.01
    assert np.abs(np.angle(np.exp(1j * (told[:, 2] - true[:, 2])))).max() < 0.05
    assert np.hypot(*(told[-1, :2] - told[0, :2])) > 0.05
    assert set(seen[1].cells) <= set(range(arena.grid.n_cells))


def test_robot_without_odometry_tells_no_poses(tmp_path):
    file = tmp_path / "blind.toml"
    file.write_text('base = "turtlebot3-burger"\n[driver]\nodometry = ""\n')
    observer = OwnPosesObserver(paper_arena(), WitnessObserver())
    with pytest.raises(RobotError, match="tells no poses"):
        open_target(f"ros2:{PORT}&robot={file}", paper_arena(), observer=observer).carry_out(
            [TrialPlan(commands=np.zeros((1, 2)))], "track"
        )
