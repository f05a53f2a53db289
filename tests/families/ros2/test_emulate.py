"""`realitygap emulate ros2` in a process of its own, for our driver and for the programs of others."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from realitygap.emulator import connect_witness
from realitygap.errors import RobotError
from realitygap.families.ros2 import Ros2Robot
from realitygap.robots import Command, read_recording
from realitygap.world import Pose

from .fast_dds import wait_until

pytest.importorskip("cyclonedds", reason="needs the Python package cyclonedds")
pytestmark = pytest.mark.slow


class Emulated(NamedTuple):
    """An emulated robot, its address, and its witness."""

    process: Any
    port: str
    witness: Any


@pytest.fixture
def emulated(domain: int) -> Iterator[Emulated]:
    command = [sys.executable, "-m", "realitygap", "emulate", "ros2", "--namespace", "/one", "--stamped"]
    command += ["--domain", str(domain), "--witness", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        port, witness = (process.stdout.readline().split()[-1] for _ in range(2))
        with connect_witness(witness) as connected:
            yield Emulated(process, port, connected)
        process.terminate()


def test_scan_of_walls_out_of_reach_is_published(emulated):
    with Ros2Robot(emulated.port) as robot:
        emulated.witness.place(Pose(0.1, 0.1, 0.5), 0)  # the corner is farther than 1 m
        wait_until(lambda: None in robot.link.ask("read")["topics"]["/one/scan"]["message"]["ranges"])
        assert emulated.process.poll() is None


def test_driver_finds_it_and_its_robot_is_recorded(emulated, tmp_path):
    file = tmp_path / "drive.jsonl"
    with Ros2Robot(emulated.port, step_s=0.5, record=file) as robot:
        assert robot.info.command == "geometry_msgs/msg/TwistStamped"
        robot.reset()
        robot.drive(Command(1.0, 0.0))
        robot.stop()
    wait_until(lambda: emulated.witness.motors() == (0.0, 0.0))
    path = emulated.witness.path()
    assert np.hypot(*(path[-1, 1:3] - path[0, 1:3])) > 0.02
    recording = read_recording(file)
    names = [line["name"] for line in recording.lines]
    assert {"drive", "stop", "read"} <= set(names)


def test_command_that_is_no_number_does_not_end_it(emulated, domain):
    from .cyclone import Header, Peer, Time, TwistStamped, twist

    with Peer(domain) as peer:
        writer = peer.writer("rt/one/cmd_vel", TwistStamped)
        header = Header(Time(0, 0), "")
        writer.write(TwistStamped(header, twist(math.nan, 0.0)))
        writer.write(TwistStamped(header, twist(0.1, math.inf)))
        writer.write(TwistStamped(header, twist(0.1, 0.0)))
        wait_until(lambda: emulated.witness.motors() == (0.1, 0.1))
        writer.write(TwistStamped(header, twist(0.0, 0.0)))
        wait_until(lambda: emulated.witness.motors() == (0.0, 0.0))


def test_list_of_robots_has_its_namespace(emulated, domain):
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    done = subprocess.run(
        [sys.executable, "-m", "realitygap", "robot", "list", "--json"],
        capture_output=True, text=True, check=True, env=environment,
    )  # fmt: skip
    ports = {each["port"]: each["seems"] for each in json.loads(done.stdout)}
    assert "TwistStamped" in ports[f"ros2:/one?domain={domain}"]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_signal_ends_it_like_a_normal_end(emulated, number):
    emulated.process.send_signal(number)
    assert emulated.process.wait() == 0


def test_unknown_interface_is_named(domain):
    with pytest.raises(RobotError, match="interface nosuch0"):
        Ros2Robot(f"/one?domain={domain}&interface=nosuch0")


def test_file_without_topics_is_refused_before_the_network(tmp_path):
    Path(tmp_path, "mine.toml").write_text('base = "e-puck"\n')
    done = subprocess.run(
        [sys.executable, "-m", "realitygap", "emulate", "ros2", "--robot", str(tmp_path / "mine.toml")],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    assert "has no table [driver]" in done.stderr.replace("\n", " ")
    assert "Traceback" not in done.stderr
