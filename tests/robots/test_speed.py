"""A loop of senses and motors costs the processor little, so that the wire decides how fast a robot is.

Processor time, the least of several measurements: what else runs on the machine does not matter.
"""

from __future__ import annotations

import time

import pytest

import realitygap.emulator  # noqa: F401  # its ports are known from then on
from realitygap.robots.scribbler import Scribbler

from .peers import BLOCK

WANTED = 2_000  # loops a second, through driver, wire and emulator
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


def loops_a_second(robot: Scribbler, n: int = 100) -> float:
    best = float("inf")
    for _ in range(10):
        since = time.process_time()
        for _ in range(n):
            robot.observe()
            robot.motors(0.5, 0.4)
        best = min(best, time.process_time() - since)
    return n / best


def test_the_driver_alone_takes_a_tenth_of_the_time_at_most():
    port = InstantPort()
    with Scribbler(port) as robot:
        before = port.n_writes
        robot.observe()
        robot.motors(0.5, 0.4)
        assert port.n_writes - before == 5  # three obstacle sensors, stall and motors, a write each
        assert loops_a_second(robot) > 10 * WANTED


@pytest.mark.parametrize(
    "setup", ["s1?fluke=none", "s2?fluke=none", "s1?fluke=1", "s2?fluke=1", "s2?fluke=2"]
)
def test_driver_wire_and_emulator_do_two_thousand_loops_a_second(setup):
    with Scribbler(f"emulator://{setup}&seed=1&speed=off&timing=off") as robot:
        assert loops_a_second(robot) > WANTED
        assert robot.faults.recoveries == 0
