"""What a loop of senses and motors sends, and the benchmark that measures how many a second there are."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from realitygap.families.scribbler import Scribbler

from .peers import BLOCK

pytestmark = pytest.mark.slow

ANSWERS = {85: bytes(2), 86: bytes(2), 87: bytes(2)}


class InstantPort:
    """Answers at once what an S2 behind a Fluke 1 would, and does nothing else."""

    timeout = 1.0
    buffer = b""
    n_writes = 0

    @property
    def in_waiting(self) -> int:
        return len(self.buffer)

    def read(self, size: int = 1) -> bytes:
        got, self.buffer = self.buffer[:size], self.buffer[size:]
        return got

    def write(self, data: bytes) -> int:
        self.n_writes += 1
        info = b"fluke:2.9.1,Robot-Version:1.1.5,Robot:Scribbler2,Mode:Serial\n"
        answers = {80: info, 79: data + b"\0", **ANSWERS}
        self.buffer = answers.get(data[0], data + BLOCK)
        return len(data)

    def open(self) -> None: ...

    def close(self) -> None: ...


def test_a_loop_of_senses_and_motors_is_one_write_a_command():
    port = InstantPort()
    with Scribbler(port) as robot:
        before = port.n_writes
        robot.observe()
        robot.motors(0.5, 0.4)
        assert port.n_writes - before == 5  # three obstacle sensors, stall and motors, a write each


def test_the_benchmark_measures_every_set_up_with_every_peer(monkeypatch):
    path = Path(__file__).parents[3] / "benchmarks" / "robot_loops.py"
    spec = importlib.util.spec_from_file_location("robot_loops", path)
    robot_loops = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(robot_loops)
    monkeypatch.setattr(robot_loops, "LOOPS", 5)
    monkeypatch.setattr(robot_loops, "REPEATS", 1)
    monkeypatch.setattr(robot_loops, "SETUPS", robot_loops.SETUPS[:1] + robot_loops.SETUPS[-1:])
    rates = robot_loops.measure()
    assert set(rates) == set(robot_loops.PEERS)
    assert all(rate > 0 for row in rates.values() for rate in row.values())
