"""Whole programs on a pseudo-terminal: however one ends, the wheels stand still afterwards."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest
import serial

from realitygap.emulator import Server, serve_pty, serve_tcp
from realitygap.errors import RobotError
from realitygap.families.scribbler import Scribbler, label_of
from realitygap.families.scribbler.emulator import Emulator

pytestmark = pytest.mark.slow

DRIVE = """
import sys, time
from realitygap.families.scribbler import Scribbler
robot = Scribbler(sys.argv[1])
robot.motors(1, 1)
print("driving", flush=True)
"""
IN_A_BLOCK = """
import sys, time
from realitygap.families.scribbler import Scribbler
with Scribbler(sys.argv[1]) as robot:
    robot.motors(1, 1)
    print("driving", flush=True)
    while True:
        robot.observe()
"""
WAYS_OUT = {
    "the program ends without closing": (DRIVE, None, 0),
    "an exception that nobody catches": (DRIVE + "1 / 0", None, 1),
    "sys.exit": (DRIVE + "sys.exit(3)", None, 3),
    "Ctrl-C": (DRIVE + "time.sleep(60)", signal.SIGINT, -signal.SIGINT),
    "Ctrl-C in a block": (IN_A_BLOCK, signal.SIGINT, -signal.SIGINT),
    "SIGTERM": (DRIVE + "time.sleep(60)", signal.SIGTERM, 128 + signal.SIGTERM),
    "SIGTERM in a block": (IN_A_BLOCK, signal.SIGTERM, 128 + signal.SIGTERM),
    "a closed terminal": (DRIVE + "time.sleep(60)", signal.SIGHUP, 128 + signal.SIGHUP),
    "the robot is thrown away": (DRIVE + "del robot; print('gone'); time.sleep(60)", signal.SIGKILL, -9),
}


@pytest.fixture
def server() -> Iterator[Server]:
    with serve_pty(Emulator("s2", "1"), speed=20.0) as server:
        yield server


def _hear_hang_ups() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # tests that run under nohup hand down that it is ignored


@pytest.mark.parametrize("way", WAYS_OUT)
def test_the_wheels_stand_still_after(way, server):
    program, number, status = WAYS_OUT[way]
    with subprocess.Popen(
        [sys.executable, "-c", program, server.name],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        preexec_fn=_hear_hang_ups,
    ) as process:
        assert process.stdout.readline() == "driving\n"
        if number == signal.SIGKILL:
            assert process.stdout.readline() == "gone\n"
            time.sleep(0.3)
        elif number is not None:
            assert server.witness.motors() != (0.0, 0.0)
        if number is not None:
            process.send_signal(number)
        assert process.wait(30) == status
    assert server.witness.motors() == (0.0, 0.0)


def test_a_pseudo_terminal_and_a_loopback_are_emulated_and_a_device_is_real(tmp_path, server):
    assert label_of(server.name) == "EMULATED"
    (tmp_path / "robot").symlink_to(server.name)
    assert label_of(str(tmp_path / "robot")) == "EMULATED"
    assert label_of("socket://127.0.0.1:7000") == "EMULATED"
    assert label_of("socket://localhost:7000") == "EMULATED"
    assert label_of("rfc2217://[::1]:7000") == "EMULATED"
    assert label_of("emulator://s2?fluke=2") == "EMULATED"
    assert label_of("scribbler:socket://127.0.0.1:7000") == "EMULATED"
    assert label_of("scribbler:emulator://s2") == "EMULATED"
    assert label_of(f"alt://{server.name}?class=Serial") == "EMULATED"
    assert label_of("spy:///dev/ttyS0?file=log.txt") == "REAL"
    assert label_of("/dev/ttyS0") == "REAL"
    assert label_of("/dev/rfcomm0") == "REAL"
    assert label_of("COM3") == "REAL"
    assert label_of("socket://192.0.2.1:7000") == "REAL"


def test_an_open_port_of_pyserial_is_called_what_its_name_says(server, monkeypatch):
    with serial.Serial(server.name) as port, Scribbler(port) as robot:
        assert robot.label == "EMULATED"
    with serial.Serial(server.name) as port:
        monkeypatch.setattr(port, "name", "/dev/rfcomm0")
        with Scribbler(port) as robot:
            assert robot.label == "REAL"


def test_the_driver_works_through_a_link_to_a_pseudo_terminal_with_the_platform_s_name(tmp_path, server):
    (tmp_path / "robot").symlink_to(server.name)
    with Scribbler(f"scribbler:{tmp_path / 'robot'}") as robot:
        assert robot.label == "EMULATED"
        assert robot.info.fluke == "1"
        assert len(robot.observe().readings) == 3


def test_port_that_is_open_in_this_program_is_refused_with_what_to_do(server):
    with Scribbler(server.name), pytest.raises(RobotError, match="This program has it open already"):
        Scribbler(server.name)


@pytest.mark.parametrize(
    ("port", "message"),
    [
        (
            "/dev/no-such-port",
            r"^/dev/no-such-port cannot be opened: No such file or directory\. .*`realitygap robot list` lists",
        ),
        ("/dev/null", r"^/dev/null cannot be opened: Inappropriate ioctl for device\. Is the robot on"),
        (
            "socket://127.0.0.1:1",
            r"^socket://127.0.0.1:1 cannot be opened: Connection refused\. Is the address right",
        ),
        ("nonsense://x", r"nonsense://x cannot be opened: .*nonsense"),
        ("", r" cannot be opened"),
    ],
)
def test_a_port_that_cannot_be_opened_is_one_message_with_advice(port, message):
    with pytest.raises(RobotError, match=message):
        Scribbler(port)


OPENINGS = {
    "a driver": "from realitygap.families.scribbler import Scribbler; robot = Scribbler(sys.argv[1])",
    "a port": "from realitygap.robots import open_on; robot = open_on(sys.argv[1])[1]",
    "a platform": "from realitygap.platforms import platform_of; from realitygap.world import paper_arena; "
    "robot = platform_of(sys.argv[1]).open_robot(paper_arena())",
    "Myro": "from realitygap.classroom.myro import *; initialize(sys.argv[1]); robot = None",
}


def test_fresh_process_opens_each_kind_of_port(server):
    """A new process has imported nothing else, so no import by another part of the program can help."""
    with serve_tcp(Emulator("s2", "2")) as tcp:
        host = tcp.name.removeprefix("socket://")
        ports = [
            ("a driver", server.name),
            ("a driver", "emulator://s2?fluke=2&speed=off"),
            ("a driver", f"socket://{host}"),
            ("a port", f"scribbler:socket://{host}"),
            ("a port", "scribbler:emulator://s1?fluke=1&speed=off"),
            ("a port", "thymio:emulator://playground?speed=8"),
            ("a platform", "scribbler:emulator://s2?speed=off"),
            ("Myro", "emulator://s2?fluke=2&speed=off"),
            ("Myro", "sim"),
        ]
        for kind, port in ports:
            code = f"import sys; {OPENINGS[kind]}; getattr(robot, 'close', print)()"
            done = subprocess.run(
                [sys.executable, "-c", code, port], capture_output=True, text=True, check=False
            )
            assert done.returncode == 0, f"{kind} {port}: {done.stderr}"
