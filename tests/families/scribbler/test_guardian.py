"""The guardian: a robot stops if its program is killed or frozen, whatever was on the wire."""

from __future__ import annotations

import contextlib
import gc
import os
import random
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from realitygap.emulator import Server, serve_pty, serve_tcp
from realitygap.errors import RobotError
from realitygap.families.scribbler import Scribbler
from realitygap.families.scribbler._link import STOP_ANSWER
from realitygap.families.scribbler._link import STOP_BYTES as STOP
from realitygap.families.scribbler._ports import LOCKS
from realitygap.families.scribbler.emulator import Emulator
from realitygap.families.scribbler.opcodes import Op
from realitygap.robots import Command
from realitygap.robots._guardian_process import n_answers

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="a process cannot inherit a port there"),
]

SERVE = {"pty": serve_pty, "tcp": serve_tcp}
SETUPS = [("s1", "none"), ("s1", "1"), ("s2", "none"), ("s2", "1"), ("s2", "2")]
STILL = (0.0, 0.0)
KILLED_S = 0.5
"""Median time after which the motors of a killed program stand [s]."""
FROZEN_S = 1.5
"""Median time after which those of a frozen program do [s]."""
BUSY_S = 10.0
"""Longest time that one of them may take on a machine with other work [s]."""

DRIVE = """
import sys, time
from realitygap.robots import Command
from realitygap.families.scribbler import Scribbler
robot = Scribbler(sys.argv[1], step_s=0.05)
robot.drive(Command(1, 0))
print("driving", robot.link.guardian_id, flush=True)
"""
LOOP = """
while True:
    robot.observe()
    robot.drive(Command(0.5, 0.1))
"""


@contextlib.contextmanager
def program(text: str, *arguments: str) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """Start a program that drives; yield it and the number of its guardian."""
    with subprocess.Popen(
        [sys.executable, "-c", text, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            line = process.stdout.readline().split()
            assert line[:1] == ["driving"], process.stderr.read()
            yield process, int(line[1])
        finally:
            process.kill()


@contextlib.contextmanager
def fork(drive: Callable[[Scribbler], None], port: str) -> Iterator[int]:
    """Drive a robot in a child of this process, which has imported everything already; yield its number."""
    ready, tell = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            robot = Scribbler(port, step_s=0.05)
            robot.drive(Command(1, 0))
            os.write(tell, b"!")
            drive(robot)
        except BaseException as error:
            os.write(tell, repr(error).encode())
        finally:
            os._exit(1)
    os.close(tell)  # otherwise a child that fails would never end the wait
    try:
        said = os.read(ready, 2000)
        assert said[:1] == b"!", said.decode()
        yield child
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        os.close(ready)


def loop(robot: Scribbler) -> None:
    """Drive until the end."""
    while True:
        robot.observe()
        robot.drive(Command(0.5, 0.1))


def time_to_stand(server: Server, frozen: int | None = None) -> float:
    """Wait until the motors are off, and return how long that took [s].

    Args:
        server: Server of the robot.
        frozen: Process that stays frozen. It is stopped again and again, because another program that stops processes
            for a moment, such as `tests.faults.stops`, may resume it.
    """
    since = time.monotonic()
    while server.witness.motors() != STILL:
        assert time.monotonic() - since < BUSY_S, "The motors are still running."
        if frozen is not None and is_alive(frozen):
            with contextlib.suppress(ProcessLookupError):  # a frozen guardian is replaced
                os.kill(frozen, signal.SIGSTOP)
        time.sleep(0.005)
    return time.monotonic() - since


def is_alive(process: int) -> bool:
    """Return whether a process exists and is no zombie."""
    try:
        os.kill(process, 0)
        return ") Z " not in Path(f"/proc/{process}/stat").read_text()
    except ProcessLookupError:
        return False
    except FileNotFoundError:  # it has ended meanwhile, or this system has no such file
        return not Path("/proc/self/stat").exists()


def kill_at_random(server: Server, n_kills: int, number: int, seconds: float) -> None:
    """Kill, or freeze, programs that drive, at random moments; each time the motors stand soon."""
    rng = random.Random(n_kills)
    times = []
    for _ in range(n_kills):
        with fork(loop, server.name) as child:
            time.sleep(rng.uniform(0, 0.3))
            os.kill(child, number)
            times.append(time_to_stand(server, child if number == signal.SIGSTOP else None))
            time.sleep(0.1)
            assert server.witness.motors() == STILL
    assert statistics.median(times) < seconds


@pytest.mark.parametrize("channel", SERVE)
def test_motors_stop_after_kill(channel):
    with SERVE[channel](Emulator("s2", "1")) as server:
        kill_at_random(server, 5, signal.SIGKILL, KILLED_S)


@pytest.mark.long
@pytest.mark.parametrize("channel", SERVE)
@pytest.mark.parametrize(("model", "fluke"), SETUPS)
def test_motors_stop_after_each_of_many_kills(channel, model, fluke):
    with SERVE[channel](Emulator(model, fluke)) as server:
        kill_at_random(server, 20, signal.SIGKILL, KILLED_S)
        kill_at_random(server, 4, signal.SIGSTOP, FROZEN_S)


@pytest.mark.parametrize(("model", "fluke"), SETUPS)
def test_motors_stop_after_kill_in_the_middle_of_a_packet(model, fluke):
    """The robot has some bytes of a packet when its program dies; the next program finds a robot that answers."""

    def tear(robot: Scribbler) -> None:
        robot.link._guardian.expect_motion()
        os.write(robot.port.fileno(), bytes([109, 200, 200, 0, 0, 0, 0, 0, 0])[:n_bytes])
        os.kill(os.getpid(), signal.SIGKILL)

    times = []
    for n_bytes in range(1, 9):
        with serve_pty(Emulator(model, fluke)) as server:
            with fork(tear, server.name):
                times.append(time_to_stand(server))
            if fluke == "1" and n_bytes == 4:  # a Fluke 1 never forgets the rest of a packet
                with Scribbler(server.name) as robot:
                    assert robot.info.model == model
                assert server.witness.motors() == STILL
    assert statistics.median(times) < KILLED_S


def test_motors_stop_after_kill_while_a_forked_child_holds_the_pipe():
    """A worker that was forked inherits the pipe, so that its end never comes."""
    fork = "import os\nif os.fork() == 0:\n    time.sleep(60)\n    os._exit(0)\n"
    with serve_pty(Emulator("s2", "1")) as server, program(DRIVE + fork + LOOP, server.name) as (process, _):
        time.sleep(0.2)
        process.kill()
        try:
            time_to_stand(server)
        finally:
            os.killpg(process.pid, signal.SIGKILL)  # the child


def test_next_program_waits_for_the_guardian_of_a_killed_one():
    """The robot is busy with a tone for seconds, so that the guardian has to wait for its answer."""
    tone, emulator, heard = "robot.beep(3.0, 440)\n", Emulator("s2", "1"), []
    receive = emulator.receive
    emulator.receive = lambda data: (heard.append(data), receive(data))
    with (
        serve_pty(emulator) as server,
        program(DRIVE + tone, server.name) as (process, guardian),
    ):
        until = time.monotonic() + BUSY_S
        while not any(data[0] == Op.SET_SPEAKER for data in heard):
            assert time.monotonic() < until, "The tone did not begin."
            time.sleep(0.01)
        process.kill()
        process.wait(10)
        assert is_alive(guardian)
        with Scribbler(server.name) as robot:
            assert not is_alive(guardian)
            assert robot.info.model == "s2"
            robot.drive(Command(0, 0))


def test_next_program_finds_a_robot_whose_connection_the_guardian_still_has():
    with serve_tcp(Emulator("s2", "1")) as server, program(DRIVE + LOOP, server.name) as (process, _):
        process.kill()
        with Scribbler(server.name) as robot:
            assert server.witness.motors() == STILL
            assert robot.info.model == "s2"


def test_port_in_use_names_the_process_that_has_it():
    with serve_pty(Emulator("s2", "1")) as server, program(DRIVE + LOOP, server.name) as (process, _):
        named = f": process {process.pid} .*python" if LOCKS.exists() else ""
        with pytest.raises(RobotError, match=f"Another program holds it; close that one{named}"):
            Scribbler(server.name)
        assert server.witness.motors() != STILL


@pytest.mark.parametrize("channel", SERVE)
def test_motors_of_a_frozen_program_stop_and_its_next_command_is_an_error(channel):
    report = """
from realitygap.errors import RobotError
try:
    while True:
        robot.observe()
        robot.drive(Command(0.5, 0.1))
except RobotError as error:
    print(error, flush=True)
robot.drive(Command(0.5, 0))
print("again", flush=True)
robot.close()
"""
    with SERVE[channel](Emulator("s2", "1")) as server:
        with program(DRIVE + report, server.name) as (process, _):
            process.send_signal(signal.SIGSTOP)
            time_to_stand(server, process.pid)
            process.send_signal(signal.SIGCONT)
            said = process.stdout.readline()
            assert "This program was silent for 1 s, so the motors were stopped: '" in said
            assert "motors stopped" in said
            assert process.stdout.readline() == "again\n", "it can drive on if it wants to"
            assert process.wait(10) == 0
        assert server.witness.motors() == STILL


def test_motors_stop_while_native_code_keeps_all_threads_from_running():
    busy = (
        "import ctypes\nctypes.PyDLL(None).sleep(60)\n"  # PyDLL does not release the lock of the interpreter
    )
    with serve_pty(Emulator("s2", "1")) as server, program(DRIVE + busy, server.name):
        time_to_stand(server)


def test_watchdog_that_speaks_first_does_not_hide_that_the_program_was_frozen():
    report = """
robot.clock.sleep(2.0)
try:
    robot.observe()
except Exception as error:
    print(error, flush=True)
"""
    text = (DRIVE + report).replace("step_s=0.05", "step_s=0.05, watchdog_s=1.0")
    with serve_pty(Emulator("s2", "1")) as server, program(text, server.name) as (process, _):
        process.send_signal(signal.SIGSTOP)
        time_to_stand(server, process.pid)
        process.send_signal(signal.SIGCONT)
        assert "This program was silent for 1 s" in process.stdout.readline()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_guardian_that_is_killed_or_frozen_is_replaced_and_the_motors_stop(number):
    with serve_pty(Emulator("s2", "1")) as server, Scribbler(server.name, step_s=0.0) as robot:
        robot.drive(Command(1, 0))
        first = robot.link.guardian_id
        os.kill(first, number)
        time_to_stand(server, first if number == signal.SIGSTOP else None)
        with pytest.raises(
            RobotError, match="The process that guards the robot ended, so the motors were stopped"
        ):
            robot.observe()
        robot.drive(Command(1, 0))
        assert robot.link.guardian_id != first
        assert is_alive(robot.link.guardian_id)
        assert not is_alive(first)


def test_guardian_that_is_killed_while_the_robot_stands_is_replaced_without_a_word():
    with serve_pty(Emulator("s2", "1")) as server, Scribbler(server.name, step_s=0.0) as robot:
        first = robot.link.guardian_id
        os.kill(first, signal.SIGKILL)
        until = time.monotonic() + 10
        while robot.link.guardian_id in (first, None):
            assert time.monotonic() < until
            time.sleep(0.01)
        robot.observe()


def test_ctrl_c_for_the_whole_group_lets_the_program_stop_its_robot():
    with serve_pty(Emulator("s2", "1")) as server:
        with program(DRIVE + LOOP, server.name) as (process, guardian):
            os.killpg(process.pid, signal.SIGINT)
            assert process.wait(10) != 0
            time_to_stand(server)
            assert not is_alive(guardian)
        with program(DRIVE + LOOP, server.name) as (process, guardian):
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                os.kill(guardian, number)
            time.sleep(0.1)
            assert is_alive(guardian)
            process.kill()
            time_to_stand(server)


UNWRITABLE = {
    "pipe": "while True:\n    robot.observe()\n    print('x' * 100, flush=True)\n",
    "file": """
import resource
resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, 10_000))
with open(sys.argv[2], "wb", buffering=0) as file:
    while True:
        robot.observe()
        file.write(bytes(1000))
""",
}
"""What a program does until a pipe is closed, or a file has its largest size."""


@pytest.mark.parametrize("kind", UNWRITABLE)
def test_motors_stop_when_a_driving_program_can_write_no_more(kind, tmp_path):
    """SIGPIPE and SIGXFSZ are ignored, so that the write fails and the robot is closed; they end nobody at once."""
    with (
        serve_pty(Emulator("s2", "1")) as server,
        program(DRIVE + UNWRITABLE[kind], server.name, str(tmp_path / "file")) as (process, guardian),
    ):
        process.send_signal(signal.SIGPIPE)
        process.send_signal(signal.SIGXFSZ)
        process.stdout.close()
        assert process.wait(60) == 1
        assert server.witness.motors() == STILL
        assert not is_alive(guardian)
        assert ("Broken pipe" if kind == "pipe" else "File too large") in process.stderr.read()


def test_closed_robots_leave_no_process_and_no_descriptor():
    def descriptors() -> set[str]:
        return {each.name for each in Path("/dev/fd").iterdir()}

    with serve_pty(Emulator("s2", "1")) as first, serve_pty(Emulator("s2", "2")) as second:
        gc.collect()
        before = descriptors()
        for _ in range(3):
            with Scribbler(first.name, step_s=0.0) as one, Scribbler(second.name, step_s=0.0) as other:
                one.drive(Command(1, 0))
                other.drive(Command(1, 0))
                guardians = (one.link.guardian_id, other.link.guardian_id)
                assert all(map(is_alive, guardians))
            assert not any(map(is_alive, guardians))
        assert not descriptors() - before  # threads of earlier tests may close some
        with pytest.raises(RobotError):
            Scribbler("/dev/null")
        assert not descriptors() - before


def test_emulator_in_the_same_program_needs_no_guardian():
    with Scribbler("emulator://s2?fluke=1&speed=off") as robot:
        assert robot.link.guardian_id is None


def test_guardian_that_cannot_be_started_is_one_error_and_nothing_moves(monkeypatch):
    with serve_pty(Emulator("s2", "1")) as server:
        monkeypatch.setattr(sys, "executable", "/nowhere/python")
        with pytest.raises(RobotError, match=r"cannot be started: .*/nowhere/python.* Nothing was driven"):
            Scribbler(server.name)
        monkeypatch.setattr(sys, "executable", "/bin/true")
        with Scribbler(server.name) as robot, pytest.raises(RobotError, match=r"cannot be started|ended"):
            robot.motors(1, 1)
        assert server.witness.motors() == STILL


def test_rfc_2217_is_refused_with_what_to_do():
    with pytest.raises(RobotError, match=r"RFC 2217 is not supported.*socket://HOST:PORT"):
        Scribbler("rfc2217://127.0.0.1:1")


def test_answers_to_motors_off_are_counted():
    block = bytes([1, 0, 0, 108, 108, 108, 0, 102, 0, 1, 0])
    assert n_answers(STOP + block, STOP_ANSWER) == 1
    assert n_answers(b"\x6d\xc8" + STOP + block + STOP + block, STOP_ANSWER) == 2
    assert n_answers(STOP + STOP + STOP, STOP_ANSWER) == 0, "an S1 echoes while it is deaf"
    assert n_answers(STOP + block[:10], STOP_ANSWER) == 0
