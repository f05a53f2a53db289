"""Whatever way a program ends, the robot stops: a program in a process of its own, an emulator on a pseudo-terminal."""

import os
import signal
import subprocess
import sys
import time

import pytest

from realitygap.classroom import myro
from realitygap.emulator import serve_pty, serve_tcp
from realitygap.families.scribbler.emulator import Emulator

pytestmark = pytest.mark.slow

WAYS = {
    "the end": "",
    "an exception": "1 / 0",
    "a mistake": "forward('x')",
    "an exit": "import sys; sys.exit(3)",
    "a thread": "doTogether(lambda: wait(0.1), lambda: 1 / 0)",
}


@pytest.fixture
def served():
    server = serve_pty(Emulator("s2", "2"), speed=5.0)
    yield server
    server.close()


def start(tmp_path, port, rest):
    program = tmp_path / "program.py"
    program.write_text(
        f"from realitygap.classroom.myro import *\ninitialize({port!r})\nforward(0.2)\n"
        f"print('driving', flush=True)\n{rest}\n"
    )
    return subprocess.Popen(
        [sys.executable, program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def stands_within(served, seconds):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        if served.witness.motors() == (0, 0):
            return True
        time.sleep(0.02)
    return False


@pytest.mark.parametrize("way", WAYS)
def test_the_robot_stops_when_a_program_ends(served, tmp_path, way):
    process = start(tmp_path, served.name, WAYS[way])
    out, _ = process.communicate(timeout=60)
    assert "driving" in out
    assert len(served.witness.path()) > 1
    assert stands_within(served, 2)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_robot_stops_when_a_program_is_interrupted(served, tmp_path, number):
    process = start(tmp_path, served.name, "wait(60)")
    while "driving" not in process.stdout.readline():
        assert process.poll() is None
    os.kill(process.pid, number)
    process.communicate(timeout=60)
    assert stands_within(served, 2)


def test_functions_that_run_together_end_with_ctrl_c(served, tmp_path):
    together = "def on():\n    while True: forward(0.2, 0.1)\ndoTogether(on, lambda: wait(60))"
    process = start(tmp_path, served.name, together)
    while "driving" not in process.stdout.readline():
        assert process.poll() is None
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert stands_within(served, 2)


def test_a_robot_on_a_tcp_port_drives():
    server = serve_tcp(Emulator("s1", "none"), speed=20.0)
    try:
        myro.initialize(server.name)
        myro.forward(1, 0.5)
        assert len(server.witness.path()) > 1
    finally:
        myro.closeConnection()
        server.close()


def test_a_robot_that_is_gone_does_not_keep_the_next_one_away():
    server = serve_tcp(Emulator("s1", "none"), speed=20.0)
    myro.initialize(server.name)
    server.close()
    myro.initialize("emulator://s2?speed=off")
    assert myro.getStall() == 0


def test_a_number_is_that_of_a_com_port():
    with pytest.raises(myro.MyroError, match="COM77"):
        myro.initialize(77)
