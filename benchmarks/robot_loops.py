"""How many sensor-and-motor loops a second go through driver, wire and peer: read all that looks ahead, set the motors.

    python benchmarks/robot_loops.py [--json]

Peers: `instant` is a process on a pseudo-terminal that answers each command at once and does nothing else, so it shows
what driver and wire take; `emulator` is ours with its timing off, in the same process, on TCP and on a pseudo-terminal.
The best of several short measurements counts, as other work on the machine only ever adds time.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import platform
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import realitygap.emulator  # noqa: F401  # its ports are known from then on
from realitygap.families.scribbler import Scribbler
from realitygap.families.scribbler.opcodes import FLUKE_2_COMMANDS, ROBOT_ANSWERS, S2_ANSWERS, Op

SETUPS = (("s1", "none"), ("s2", "none"), ("s1", "1"), ("s2", "1"), ("s2", "2"))
LOOPS = 200
REPEATS = 15
BLOCK = bytes([1, 1, 0, 100, 0, 100, 0, 100, 0, 0, 0])


def loops_a_second(port: str) -> float:
    """The best rate of `REPEATS` times `LOOPS` loops with the robot on a port."""
    best = float("inf")
    with Scribbler(port) as robot:
        for _ in range(REPEATS):
            since = time.perf_counter()
            for _ in range(LOOPS):
                robot.observe()
                robot.motors(0.5, 0.4)
            best = min(best, time.perf_counter() - since)
        if robot.faults.recoveries:
            raise RuntimeError(f"The link was disturbed: {robot.faults}")
    return LOOPS / best


def _info(model: str, fluke: str) -> bytes:
    board = {"none": "", "1": "fluke:2.9.1,", "2": "fluke:3.0.5,"}[fluke]
    robot = {"s1": "Robot-Version:2.6.2,Robot:Scribbler", "s2": "Robot-Version:1.1.5,Robot:Scribbler2"}[model]
    echo = "P        " if model == "s1" else ""
    return f"{echo}{board}{robot},Mode:Serial\n".encode()


def _answers(model: str, fluke: str) -> dict[int, bytes]:
    """What follows the echo of a robot's command, or answers a Fluke's."""
    robot = {
        int(op): BLOCK if n == len(BLOCK) else bytes(n)
        for op, n in (ROBOT_ANSWERS | S2_ANSWERS).items()
        if n > 0
    }
    board = {int(op): bytes(each.answer) for op, each in FLUKE_2_COMMANDS.items() if each.answer >= 0}
    return robot | (board if fluke != "none" else {}) | {int(Op.GET_INFO): _info(model, fluke)}


def _answer_at_once(master: int, model: str, fluke: str) -> None:
    answers = _answers(model, fluke)
    boards = FLUKE_2_COMMANDS if fluke != "none" else {}
    while True:
        command = os.read(master, 64)
        if command[0] in boards or command[0] == Op.GET_INFO:
            os.write(master, answers[command[0]])
        else:
            os.write(master, command + answers.get(command[0], b""))


@contextmanager
def instant(model: str, fluke: str) -> Iterator[str]:
    """The port of a process that answers at once."""
    master, slave = os.openpty()
    tty.setraw(slave)
    peer = multiprocessing.get_context("fork").Process(
        target=_answer_at_once, args=(master, model, fluke), daemon=True
    )
    peer.start()
    try:
        yield os.ttyname(slave)
    finally:
        peer.terminate()
        peer.join()
        os.close(master)
        os.close(slave)


@contextmanager
def in_process(model: str, fluke: str) -> Iterator[str]:
    """The port of an emulator without a wire."""
    yield f"emulator://{model}?fluke={fluke}&seed=1&speed=off&timing=off"


def served(where: list[str]) -> Callable[[str, str], Any]:
    """The port of an emulator in a process of its own."""

    @contextmanager
    def open_port(model: str, fluke: str) -> Iterator[str]:
        import subprocess
        import sys

        command = [
            sys.executable,
            "-m",
            "realitygap",
            "emulate",
            "scribbler",
            "--model",
            model,
            "--fluke",
            fluke,
        ]
        with subprocess.Popen(
            [*command, *where, "--timing", "off", "--quiet"], stdout=subprocess.PIPE, text=True
        ) as process:
            try:
                yield process.stdout.readline().split()[-1]  # type: ignore[union-attr]
            finally:
                process.terminate()

    return open_port


PEERS: dict[str, Callable[[str, str], Any]] = {
    "instant, pseudo-terminal": instant,
    "emulator, in process": in_process,
    "emulator, TCP": served(["--tcp", "0"]),
    "emulator, pseudo-terminal": served([]),
}


def measure() -> dict[str, dict[str, float]]:
    """Loops a second of each peer with each set-up."""
    rates: dict[str, dict[str, float]] = {}
    for name, peer in PEERS.items():
        rates[name] = {}
        for model, fluke in SETUPS:
            with peer(model, fluke) as port:
                rates[name][f"{model}, fluke {fluke}"] = round(loops_a_second(port), 1)
    return rates


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--json", action="store_true", help="print data")
    rates: dict[str, Any] = {
        "loops_per_second": measure(),
        "machine": f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}",
        "load": round(os.getloadavg()[0], 2),
    }
    if parser.parse_args().json:
        print(json.dumps(rates, indent=2))
        return
    print(f"Sensor-and-motor loops a second ({rates['machine']}, load {rates['load']})")
    for name, row in rates["loops_per_second"].items():
        print(f"\n{name}")
        for setup, rate in row.items():
            print(f"  {setup:16} {rate:10,.0f}")


if __name__ == "__main__":
    main()
