"""How long a robot drives on after the stop of the lab's page is pressed, or a key is released.

    python benchmarks/lab_stop.py --times 20

A page in Chromium drives an emulated robot that is a process of its own. The time runs from the event in the browser to
the last time at which the robot's witness has its motors turn. Run it on an idle machine; it takes about 3 s each time.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from playwright.sync_api import sync_playwright

from realitygap.emulator import connect_witness

LOOK_S = 0.005


def main() -> None:
    """Print a line for each way to stop."""
    parser = argparse.ArgumentParser(
        description="Measure how long a robot drives on after a stop in the lab."
    )
    parser.add_argument("--times", type=int, default=20, help="times for each way")
    times = parser.parse_args().times
    with _program("emulate", "scribbler", "--tcp", "0", "--witness", "0", "--quiet") as emulator:
        port, witness = (_line(emulator).split()[-1] for _ in range(2))
        with (
            tempfile.TemporaryDirectory() as folder,
            _program("lab", folder, "--no-open", "--port", "0") as lab,
        ):
            _line(lab)
            with _pages(_line(lab).split()[1]) as (page, other), _Motors(witness) as motors:
                _connect(page, port)
                print("way        times   median s   most s")
                for way, act in _ways(page, other).items():
                    lasted = np.array([_time_to_rest(page, motors, act) for _ in range(times)])
                    print(f"{way:10} {times:5} {np.median(lasted):10.3f} {lasted.max():8.3f}", flush=True)


def _ways(page: Any, other: Any) -> dict[str, Callable[[], None]]:
    """Return what stops the robot, by its name: two on a page that does not drive, and the key that drives."""
    button = other.get_by_role("button", name="Stop robot").bounding_box()
    other.mouse.move(button["x"] + button["width"] / 2, button["y"] + button["height"] / 2)

    def press() -> None:
        other.mouse.down()
        other.mouse.up()

    return {
        "button": press,
        "Escape": lambda: other.keyboard.press("Escape"),
        "key": lambda: page.keyboard.up("ArrowUp"),
    }


def _time_to_rest(page: Any, motors: _Motors, act: Callable[[], None]) -> float:
    """Return how long the motors turn after a stop [s]."""
    turned = motors.turned_s
    page.locator(".lab-pad").focus()
    page.keyboard.down("ArrowUp")
    while motors.turned_s == turned:
        time.sleep(LOOK_S)
    began = time.monotonic()
    act()
    time.sleep(1.0)
    page.keyboard.up("ArrowUp")
    lasted = motors.turned_s - began
    time.sleep(1.0)
    return max(lasted, 0.0)


class _Motors:
    """When the motors of an emulated robot turned last, by its witness."""

    def __init__(self, witness: str) -> None:
        self.turned_s = 0.0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._look, args=(witness,), daemon=True)

    def __enter__(self) -> _Motors:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _look(self, address: str) -> None:
        with connect_witness(address) as witness:
            while not self._ended.wait(LOOK_S):
                if witness.motors() != (0.0, 0.0):
                    self.turned_s = time.monotonic()


@contextmanager
def _program(*words: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "realitygap", *words]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        yield program
        program.terminate()


def _line(program: subprocess.Popen[str]) -> str:
    return program.stdout.readline() if program.stdout else ""


@contextmanager
def _pages(address: str) -> Iterator[tuple[Any, Any]]:
    """Two pages of the lab in a browser."""
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        context = browser.new_context()
        pages = context.new_page(), context.new_page()
        for page in pages:
            page.goto(address)
            page.goto(address.partition("?")[0] + "robot")
        yield pages
        browser.close()


def _connect(page: Any, port: str) -> None:
    page.get_by_text("Another port").click()
    page.get_by_label("Port", exact=True).fill(port)
    page.get_by_role("button", name="Connect", exact=True).click()
    page.get_by_text(f"Connected to {port}").wait_for()


if __name__ == "__main__":
    main()
