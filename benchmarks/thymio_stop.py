"""How long a Thymio drives on in Aseba's playground after its program dies, halts, or loses the link.

    python benchmarks/thymio_stop.py --times 100

Each time, a program drives the robot by commands of 0.1 s and is then killed (SIGKILL), halted (SIGSTOP), or cut off
(loopback of the playground's network namespace taken down). The command has 0.3 s to live, and the program on board
ends it 60 ms later. Run it as root on an idle machine; it takes about 4 s each time.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np

from realitygap.families.thymio import Playground
from realitygap.world import Pose

DRIVER = """
import sys
from realitygap.robots import Command
from realitygap.families.thymio import Thymio
with Thymio(sys.argv[1], step_s=0.1) as robot:
    print("driving", flush=True)
    while True:
        robot.drive(Command(0.0, 1.0))
"""
STILL_S = 0.3


def main() -> None:
    """Print a line for each way to end."""
    parser = argparse.ArgumentParser(description="How long a Thymio drives on after its program is gone.")
    parser.add_argument("--times", type=int, default=100, help="times for each way")
    times = parser.parse_args().times
    print("way        times   median s   most s")
    for way in ("SIGKILL", "SIGSTOP", "link down"):
        lasted = np.array([_last(way) for _ in range(times)])
        print(f"{way:9} {times:6} {np.median(lasted):10.3f} {lasted.max():8.3f}", flush=True)


def _last(way: str) -> float:
    """Return how long a robot moves after its program has ended in a way [s]."""
    with Playground() as playground:
        playground.place(Pose(0.5, 0.3, 0.0))
        program = [sys.executable, "-c", DRIVER, playground.port]
        with subprocess.Popen(
            program, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        ) as driver:
            if driver.stdout:
                driver.stdout.readline()
            time.sleep(0.5)
            try:
                return _time_to_rest(playground, lambda: _end(way, driver.pid, playground.process_id))
            finally:
                driver.kill()


def _end(way: str, driver: int, playground: int) -> None:
    if way == "link down":
        inside = ["nsenter", "--target", str(playground), "--net"]
        subprocess.run([*inside, "ip", "link", "set", "lo", "down"], check=True)
    else:
        os.kill(driver, signal.Signals[way])


def _time_to_rest(playground: Playground, end: Callable[[], None]) -> float:
    """Return the time from `end` to the last change of the pose [s]."""
    end()
    began = changed = time.monotonic()
    last = playground.pose()
    while (now := time.monotonic()) < changed + STILL_S:
        pose = playground.pose()
        if pose != last:
            last, changed = pose, now
        time.sleep(0.002)
    return changed - began


if __name__ == "__main__":
    main()
