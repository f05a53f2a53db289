"""The driver against a robot by Fast DDS: bytes, physics, and stops that nobody of us wrote."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realitygap.emulator import Walls
from realitygap.errors import RobotError
from realitygap.families.ros2 import Ros2Robot
from realitygap.families.ros2._address import read_address
from realitygap.families.ros2._graph import Ends, refuse_graph
from realitygap.families.ros2._link import Link
from realitygap.families.ros2._messages import ODOMETRY, TWIST
from realitygap.robots import Command
from realitygap.world import Pose, paper_arena

from .fast_dds import FastRobot, wait_until

pytest.importorskip("cyclonedds", reason="needs the Python package cyclonedds")

from .cyclone import (
    Header,
    Quaternion,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Twist,
    Vector3,
    valid,
)

pytestmark = pytest.mark.slow

MOUNTS = [(0.05, 0.03, 0.5), (0.05, 0.0, 0.0), (0.05, -0.03, -0.5)]
FILE = """
name = "fast"
step_s = 0.2
[[body]]
corner = [[0, 0]]
radius = 0.05
[drive]
speed = 0.2
track = 0.1
[each.range]
reach = 1.0
response = "linear"
cone = 0.1
rays = 5
{sensors}
[encoder]
[driver]
family = "ros2"
odometry = "odom"
bump = "bumper"
{driver}
"""
RANGES = 'ranges = ["range_0", "range_1", "range_2"]'
SCAN = "[driver.scan]"
MIDDLE = Pose(0.5, 0.4, 0.3)


@pytest.fixture
def connect(start_robot: Any, domain: int, tmp_path: Path) -> Any:
    """A function that starts a robot by Fast DDS, and returns it with our driver's robot."""
    opened: list[Ros2Robot] = []

    def start(driver: str = RANGES, address: str = "/", **options: object) -> tuple[FastRobot, Ros2Robot]:
        fast = start_robot(
            **{"range": MOUNTS, "range_limits": (0.001, 1), "cone": 0.2, "timeout": 0} | options
        )
        opened.append(open_driver(tmp_path, domain, driver, address))
        opened[-1].reset()
        return fast, opened[-1]

    yield start
    for robot in opened:
        robot.close()


def open_driver(folder: Path, domain: int, driver: str = RANGES, address: str = "/") -> Ros2Robot:
    sensors = "\n".join(f"[[range]]\nx = {x}\ny = {y}\ndirection = {direction}" for x, y, direction in MOUNTS)
    (folder / "fast.toml").write_text(FILE.format(sensors=sensors, driver=driver))
    return Ros2Robot(f"{address}?domain={domain}&interface=lo", robot=str(folder / "fast.toml"))


def rests(fast: FastRobot) -> bool:
    return fast.motors() == (0.0, 0.0)


@pytest.mark.parametrize("driver", [RANGES, SCAN])
@pytest.mark.parametrize("byte_order", ["little", "big"])
def test_readings_are_those_of_the_true_pose(connect, driver, byte_order):
    fast, robot = connect(driver, byte_order=byte_order, nothing="nan")
    fast.place(MIDDLE)
    walls = Walls.of(paper_arena())
    wanted = []
    for x, y, direction in MOUNTS:
        at = MIDDLE.point(x, y)
        rays = MIDDLE.heading + direction + np.linspace(-0.1, 0.1, 21)
        wanted.append(walls.ranges(np.full(21, at[0]), np.full(21, at[1]), rays, 1.0).min())

    def is_near() -> bool:
        return bool(np.allclose(robot.observe().raw, wanted, atol=0.02))

    wait_until(is_near)


@pytest.mark.parametrize("kind", ["twist_topic", "stamped_topic"])
def test_commands_move_it_as_odometry_tells(connect, kind):
    other = {"twist_topic": "stamped_topic", "stamped_topic": "twist_topic"}[kind]
    fast, robot = connect(**{kind: "cmd_vel", other: ""})
    robot.select(robot.channels)
    fast.place(MIDDLE)
    robot.observe()
    before = robot.wheels()
    robot.step_s = 1.0  # a busy machine may take half of it
    robot.drive(Command(0.5, 0.25))
    robot.observe()
    robot.stop()
    wait_until(lambda: rests(fast))
    wait_until(lambda: bool(np.hypot(*np.subtract(fast.pose()[:2], MIDDLE[:2])) > 0.01))
    path = fast.path()
    steps = np.hypot(*np.diff(path[:, 1:3], axis=0).T)
    turns = np.diff(np.unwrap(path[:, 3])) * 0.05

    def ways() -> Any:
        return np.subtract(robot.wheels(), before)

    wait_until(lambda: bool(np.allclose(ways(), [(steps - turns).sum(), (steps + turns).sum()], atol=0.002)))
    counts = fast.ask("commands")
    assert counts["stamped" if kind == "stamped_topic" else "twist"] > 0
    assert counts["refused"] == 0


def test_stamps_are_in_the_robots_time(connect):
    fast, robot = connect(twist_topic="", stamped_topic="cmd_vel", max_age=0.5, clock_shift=1000)
    fast.place(MIDDLE)
    robot.drive(Command(0.5, 0.0))
    wait_until(lambda: fast.ask("commands")["stamped"] > 0)
    assert fast.ask("commands")["refused"] == 0


def test_command_ends_with_its_life(connect):
    fast, robot = connect()
    fast.place(MIDDLE)
    robot.drive(Command(0.2, 0.0))
    wait_until(lambda: not rests(fast) or len(fast.path()) > 1)
    wait_until(lambda: rests(fast))


def test_robot_stops_if_its_program_is_killed(start_robot, domain, tmp_path):
    fast = start_robot(range=MOUNTS, timeout=0)
    open_driver(tmp_path, domain).close()
    program = (
        "import sys; from realitygap.families.ros2 import Ros2Robot; from realitygap.robots import Command\n"
        f"robot = Ros2Robot('/?domain={domain}&interface=lo', robot={str(tmp_path / 'fast.toml')!r}, step_s=30)\n"
        "robot.drive(Command(0.1, 0.0))"
    )
    with subprocess.Popen([sys.executable, "-c", program]) as driver:
        wait_until(lambda: not rests(fast))
        driver.kill()
    wait_until(lambda: rests(fast))


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_robot_stops_if_the_gateway_dies_or_is_frozen(connect, number):
    fast, robot = connect()
    fast.place(MIDDLE)
    robot.motors(0.1, 0.1)
    wait_until(lambda: not rests(fast))
    os.kill(robot.link.port.process_id, number)
    with pytest.raises(RobotError, match="lost"):
        robot.observe()
    wait_until(lambda: rests(fast))


def test_robot_stops_if_the_program_and_its_gateway_are_killed(start_robot, domain, tmp_path):
    fast = start_robot(range=MOUNTS, timeout=0)
    open_driver(tmp_path, domain).close()
    program = (
        "from realitygap.families.ros2 import Ros2Robot; from realitygap.robots import Command\n"
        f"robot = Ros2Robot('/?domain={domain}&interface=lo', robot={str(tmp_path / 'fast.toml')!r}, step_s=30)\n"
        "import os, time; child = os.fork(); child or time.sleep(600)\n"  # it holds all that the program has opened
        "print(robot.link.port.process_id, child, flush=True)\n"
        "robot.drive(Command(0.1, 0.0))"
    )
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as driver:
        gateway, child = map(int, driver.stdout.readline().split())
        try:
            wait_until(lambda: not rests(fast))
            os.kill(gateway, signal.SIGSTOP)
            driver.kill()
            os.kill(gateway, signal.SIGKILL)
            wait_until(lambda: rests(fast))
        finally:
            os.kill(child, signal.SIGKILL)


def test_long_drive_fails_if_the_robot_leaves(connect):
    fast, robot = connect()
    robot.step_s = 60.0
    fast.ask("leave")
    with pytest.raises(RobotError, match="silent"):
        robot.drive(Command(0.0, 0.1))


def test_two_robots_in_two_namespaces_are_told_apart(start_robot, domain, tmp_path):
    one = start_robot(range=MOUNTS, namespace="/one", timeout=0)
    two = start_robot(range=MOUNTS, namespace="/two", timeout=0)
    with pytest.raises(RobotError, match="ros2:/one, ros2:/two"):
        open_driver(tmp_path, domain)
    with open_driver(tmp_path, domain, address="/two") as robot:
        robot.motors(0.1, 0.1)
        wait_until(lambda: not rests(two))
        assert rests(one)


def test_two_robots_in_one_namespace_are_refused_when_the_second_appears(connect, start_robot):
    _, robot = connect()
    start_robot(range=MOUNTS)

    def is_refused() -> bool:
        try:
            robot.observe()
        except RobotError as error:
            return "two robots in one namespace" in str(error)
        return False

    wait_until(is_refused)


def test_two_robots_in_one_namespace_are_refused_at_the_beginning():
    ends = [end | {"reliable": True, "durable": False} for end in (
        {"role": "subscriber", "topic": "/cmd_vel", "kind": TWIST, "who": "a"},
        {"role": "publisher", "topic": "/odom", "kind": ODOMETRY, "who": "a"},
        {"role": "publisher", "topic": "/odom", "kind": ODOMETRY, "who": "b"},
    )]  # fmt: skip
    with pytest.raises(RobotError, match="two robots in one namespace"):
        refuse_graph(
            Ends(tuple(ends)), read_address("/"), "/cmd_vel", {"/odom": ODOMETRY}, [], is_complete=True
        )


@pytest.mark.parametrize(
    ("options", "driver", "message"),
    [
        ({"renamed": "odom"}, RANGES, "/odom has type .*, expected nav_msgs/msg/Odometry"),
        ({"rate_range": 0}, RANGES, "Nobody publishes /range_0"),
        ({}, RANGES + '\ncommand = "wheels"', "Nobody takes commands on /wheels"),
        ({"twist_topic": "odd", "stamped_topic": ""}, RANGES, "Nobody takes commands on /cmd_vel"),
    ],
)
def test_what_is_missing_is_named(start_robot, domain, tmp_path, options, driver, message):
    start_robot(**{"range": MOUNTS} | options)
    with pytest.raises(RobotError, match=message):
        open_driver(tmp_path, domain, driver)


def test_subscriber_with_another_quality_of_service_is_named(domain, peer, tmp_path):
    kept = peer.reader("rt/cmd_vel", Twist, is_reliable=True, is_durable=True)
    with pytest.raises(RobotError, match="subscriber of /cmd_vel asks for durability TRANSIENT_LOCAL"):
        open_driver(tmp_path, domain)
    assert valid(kept) == []


def test_robot_that_appears_while_it_is_looked_for_is_found(start_robot, domain, tmp_path, monkeypatch):
    fast = start_robot(range=MOUNTS)
    fast.ask("leave")
    asked, ask = [], Link.ask

    def ask_and_return(link: Link, what: str, *more: float, **values: float) -> dict[str, Any]:
        answer = ask(link, what, *more, **values)
        asked.append(answer)
        if len(asked) == 2:
            fast.ask("return")
        return answer

    monkeypatch.setattr(Link, "ask", ask_and_return)
    with open_driver(tmp_path, domain) as robot:
        assert robot.observe().readings
    assert asked[0]["graph"] == []


def transforms(*steps: tuple[str, str, float, float, float]) -> Any:
    return TFMessage([
        TransformStamped(
            Header(Time(0, 0), parent),
            child,
            Transform(Vector3(x, y, 0.5), Quaternion(0.0, 0.0, np.sin(turn / 2), np.cos(turn / 2))),
        )
        for parent, child, x, y, turn in steps
    ])  # fmt: skip


TF = RANGES + '\npose = "/tf"\npose_frame = "arena"\npose_frames = ["map", "base_link"]'


def test_transforms_tell_poses_through_all_frames_between(connect, peer):
    writer = peer.writer("rt/tf", TFMessage, is_matched=False)
    turned = np.pi / 2
    sent = transforms(
        ("map", "/odom", 0.3, 0.2, turned), ("odom", "base_link", 0.1, 0.0, -turned), ("map", "cup", 9, 9, 9)
    )
    with published(writer, sent):
        _, robot = connect(TF)
        robot.begin_path(Pose(0.0, 0.0, 0.0))
        assert robot.path()[-1, 1:] == pytest.approx([0.3, 0.3, 0.0])
    writer.write(transforms(("odom", "base_link", 0.2, 0.1, 0.0)))
    wait_until(lambda: robot.path()[-1, 1:] == pytest.approx([0.2, 0.4, turned]))


def test_transforms_without_the_frames_are_named(start_robot, domain, peer, tmp_path):
    start_robot(range=MOUNTS)
    writer = peer.writer("rt/tf", TFMessage, is_matched=False)
    with (
        published(writer, transforms(("map", "odom", 0, 0, 0), ("world", "base_link", 0, 0, 0))),
        pytest.raises(RobotError, match=r"tells no pose .* there: world > base_link, map > odom"),
    ):
        open_driver(tmp_path, domain, TF)


@contextlib.contextmanager
def published(writer: Any, message: Any) -> Iterator[None]:
    """Publish a message again and again."""
    is_over = threading.Event()

    def publish() -> None:
        while not is_over.wait(0.05):
            writer.write(message)

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        yield
    finally:
        is_over.set()
        thread.join()


@pytest.mark.parametrize(("timeout", "least", "most"), [(0.5, 0.5, 1.5), (0, np.inf, np.inf)])
def test_probe_measures_the_robots_own_timeout(connect, timeout, least, most):
    # A busy computer may need longer to hear of the stop, but never hears of it too early.
    fast, robot = connect(timeout=timeout)
    fast.place(MIDDLE)
    assert least - 0.06 <= robot.timeout() <= most
    wait_until(lambda: rests(fast))


def test_sensor_that_falls_silent_ends_the_trial_with_its_name(connect):
    fast, robot = connect(RANGES + "\nsilent_s = 0.5")
    fast.ask("mute range_1")

    def is_named() -> bool:
        try:
            robot.observe()
        except RobotError as error:
            return "/range_1 is silent" in str(error)
        return False

    wait_until(is_named)


def test_robot_that_leaves_the_network_is_silent_and_one_that_returns_is_read(connect):
    fast, robot = connect(RANGES + "\nsilent_s = 0.5")
    fast.ask("leave")

    def fails() -> bool:
        try:
            robot.observe()
        except RobotError as error:
            return "silent" in str(error)
        return False

    wait_until(fails)
    fast.ask("return")
    wait_until(lambda: not fails())


def test_odd_messages_are_read_or_refused(connect):
    fast, robot = connect(SCAN, rate_odom=1000, variance=0.25)
    fast.place(MIDDLE)
    fast.ask("scan_rays 90")
    robot.observe()
    fast.ask("scan_rays 2621440")
    check = re.compile(r"2,621,440 values|is silent")

    def is_refused() -> bool:
        try:
            robot.observe()
        except RobotError as error:
            return bool(check.search(str(error)))
        return False

    wait_until(is_refused)
    fast.ask("scan_rays 360")
    wait_until(lambda: not is_refused())


@pytest.mark.parametrize("value", ["nan", "inf"])
def test_range_that_is_no_number_is_nothing_in_range(connect, value):
    fast, robot = connect(variance=0.25)
    fast.ask(f"readings {value}")
    wait_until(lambda: robot.observe().readings == (0.0, 0.0, 0.0))


@pytest.mark.parametrize("is_frozen", [False, True])
def test_no_program_is_left_when_it_is_closed(connect: Callable[..., Any], is_frozen: bool) -> None:
    _, robot = connect()
    numbers = [process.pid for process in robot.link.port.processes]
    assert len(numbers) == 2
    if is_frozen:
        os.kill(numbers[0], signal.SIGSTOP)
    with pytest.raises(RobotError) if is_frozen else contextlib.nullcontext():
        robot.close()
    for number in numbers:
        with pytest.raises(ProcessLookupError):
            os.kill(number, 0)
