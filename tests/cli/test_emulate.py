"""`realitygap emulate` as a user meets it."""

import os
import pty
import select
import signal
import subprocess
import sys
import time

import pytest
import serial

from realitygap.emulator import connect_witness

from .invoked import refused

pytestmark = pytest.mark.slow

COMMAND = [sys.executable, "-m", "realitygap", "emulate", "scribbler"]
PATIENCE_S = 120.0
"""Time after which a process that does not get on counts as hung [s]; a machine with other work is slow."""
MOTORS = bytes((109, 150, 150)) + bytes(6)


def start(*options):
    process = subprocess.Popen(
        [*COMMAND, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    return process, process.stdout.readline().strip()


def end(process, number=signal.SIGTERM):
    process.send_signal(number)
    assert process.wait(PATIENCE_S) == 0
    assert process.stderr.read() == ""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_the_port_is_printed_first_and_linked_until_it_is_told_to_end(tmp_path, number):
    link = tmp_path / "robot"
    process, name = start("--model", "s1", "--fluke", "none", "--link", str(link), "--quiet")
    assert str(link.readlink()) == name
    with serial.Serial(name, timeout=PATIENCE_S) as port:
        port.write(MOTORS)
        assert port.read(20)[:9] == MOTORS
    end(process, number)
    assert not link.is_symlink()


def test_emulator_on_a_tcp_port_has_a_witness_and_keeps_its_state(tmp_path):
    state = tmp_path / "robot.json"
    for expected in (b"Scribby ", b"Rosie   "):
        options = ("--tcp", "0", "--witness", "0", "--state", str(state), "--timing", "off", "--speed", "5")
        process, name = start(*options)
        address = process.stdout.readline().split()[1]
        with serial.serial_for_url(name, timeout=PATIENCE_S) as port, connect_witness(address) as witness:
            port.write(bytes((78,)) + bytes(8))
            assert port.read(17)[9:] == expected
            port.write(bytes((110, *b"Rosie   ")))
            port.read(20)
            port.write(MOTORS)
            port.read(20)
            assert witness.motors() != (0.0, 0.0)
        end(process)


def test_a_quiet_one_tells_the_address_of_its_witness_too():
    """The port of `--witness 0` is known to nobody else."""
    process, _ = start("--tcp", "0", "--witness", "0", "--quiet")
    word, address = process.stdout.readline().split()
    assert word == "witness"
    with connect_witness(address) as witness:
        assert witness.pose() == witness.arena().start
    end(process)


CLIENT = """
import os, sys, serial
assert sys.argv[1] == os.environ["REALITYGAP_PORT"]
port = serial.Serial(sys.argv[1], timeout=10)
port.setDTR(0)  # a pseudo-terminal refuses this; Myro 2.9.9 does it, and would wait for ever
port.write(bytes((65,)) + bytes(8))
sys.exit(7 if len(port.read(20)) == 20 else 1)
"""


def test_a_client_that_sets_dtr_runs_with_exec_and_its_status_comes_back(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(CLIENT)
    command = f"{sys.executable} {program} {{port}}"
    done = subprocess.run(
        [*COMMAND, "--exec", command], capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )
    assert (done.returncode, done.stderr) == (7, "")


def test_sigterm_removes_the_link_of_a_port_with_exec_too(tmp_path):
    link = tmp_path / "robot"
    process, _ = start("--link", str(link), "--exec", "sleep 20")
    assert link.is_symlink()
    process.send_signal(signal.SIGTERM)
    assert process.wait(PATIENCE_S) == 128 + signal.SIGTERM, process.stderr.read()
    assert not link.is_symlink()


def test_without_exec_a_pseudo_terminal_refuses_dtr():
    process, name = start("--quiet")
    with serial.Serial(name) as port, pytest.raises(OSError, match="Inappropriate ioctl"):
        port.setDTR(0)
    end(process)


def test_another_sitecustomize_is_still_found(tmp_path):
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.found_it = True\n")
    command = f'{sys.executable} -c "import sys; sys.exit(not sys.found_it)"'
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(
        [*COMMAND, "--exec", command], env=environment, capture_output=True, timeout=PATIENCE_S, check=False
    )
    assert done.returncode == 0


def test_in_a_terminal_there_is_a_live_view():
    master, slave = pty.openpty()
    process = subprocess.Popen([*COMMAND, "--tcp", "0"], stdout=slave, stderr=slave, stdin=slave)
    os.close(slave)
    seen, until = b"", time.monotonic() + PATIENCE_S
    while b"last command" not in seen and time.monotonic() < until:
        if select.select([master], [], [], 0.5)[0]:
            seen += os.read(master, 65536)
    process.send_signal(signal.SIGINT)
    while process.poll() is None:
        if select.select([master], [], [], 0.2)[0]:
            try:
                os.read(master, 65536)
            except OSError:
                break
    assert process.wait(PATIENCE_S) == 0
    os.close(master)
    text = seen.decode()
    for part in ("socket://127.0.0.1:", "LEDs", "battery", "heading", "#####"):
        assert part in text


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["scribbler", "--model", "s9"], "s1 or s2"),
        (["scribbler", "--fluke", "3"], "none, 1, 2"),
        (["scribbler", "--arena", "nowhere.toml"], "There is no arena file nowhere.toml."),
        (["scribbler", "--faults", "drip=1"], "Did you mean 'drop'"),
        (["scribbler", "--timing", "fast"], "on or off"),
        (["scribbler", "--tcp", "0", "--link", "x"], "Give one of them"),
    ],
)
def test_a_wrong_option_gets_one_clear_message(options, says):
    assert says in refused("emulate", *options)
