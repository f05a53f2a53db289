"""The stop for the robot: in sight, uncovered, and at once whatever else goes on."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

from realitygap.emulator import connect_witness
from realitygap.study import parse_study, run_study

from .conftest import PATIENCE_MS, PHONE
from .test_robot_in_browser import hold
from .test_studies_in_browser import TINY, start

pytestmark = pytest.mark.slow

STOP_S = 0.2
"""Within which the motors stand after a press [s]."""
VIEWS = {"desktop": (1280, 800), "phone": PHONE, "phone with its keyboard": (390, 400)}

UNCOVERED = """() => {
  const stop = document.querySelector(".lab-stop"), box = stop.getBoundingClientRect();
  const across = [box.left + 4, box.right - 4], down = [box.top + 4, box.bottom - 4];
  const points = across.flatMap((x) => down.map((y) => [x, y]));
  points.push([(box.left + box.right) / 2, (box.top + box.bottom) / 2]);
  return points.map(([x, y]) => document.elementFromPoint(x, y)).map(
    (found) => stop.contains(found) ? "stop" : found ? found.outerHTML.slice(0, 200) : "out of sight");
}"""


def check_uncovered(page: Any) -> None:
    assert page.evaluate(UNCOVERED) == ["stop"] * 5


@pytest.mark.parametrize("view", VIEWS)
def test_nothing_covers_the_stop(visit, view, tmp_path):
    page = visit("gap", size=VIEWS[view], has_touch=view != "desktop", user_agent=agent(view))
    stop = page.get_by_role("button", name="Stop the robot")
    stop.wait_for()
    check_uncovered(page)

    page.get_by_label("Name", exact=True).fill("no / name")
    page.get_by_role("button", name="Measure the gap").click()
    notice = page.locator(".q-notification", has_text="cannot be named")
    notice.wait_for()
    check_uncovered(page)
    page.screenshot(path=tmp_path / "notice.png")

    page.locator(".q-field", has_text="What is seen of the target").last.click()
    page.get_by_role("option", name="encoders").wait_for()
    page.wait_for_timeout(400)  # it comes in by and by
    check_uncovered(page)
    page.screenshot(path=tmp_path / "choice.png")
    stop.click()
    page.get_by_text("No robot is in use here.").wait_for()

    for popup in ("popup", "too_long_message_popup"):
        page.evaluate(f"document.getElementById('{popup}').ariaHidden = false")
    page.wait_for_timeout(2600)  # after which the first one is shown
    check_uncovered(page)
    page.screenshot(path=tmp_path / "popup.png")


def agent(view: str) -> str | None:
    """On phones a choice is a dialog over the whole page."""
    phone = "Mozilla/5.0 (Linux; Android 14; Pixel 8) AppleWebKit/537.36 Chrome/126.0 Mobile Safari/537.36"
    return None if view == "desktop" else phone


class Motors:
    """The motors of an emulated robot, looked at by its witness all the time."""

    def __init__(self, witness: str) -> None:
        self.moved_s = 0.0
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._look, args=(witness,), daemon=True)
        self._thread.start()

    def _look(self, address: str) -> None:
        with connect_witness(address) as witness:
            while not self._ended.wait(0.002):
                if witness.motors() != (0.0, 0.0):
                    self.moved_s = time.monotonic()

    def end(self) -> None:
        self._ended.set()
        self._thread.join()

    def check_stop(self, driving: Any, press: Any, let_go: Any) -> None:
        """Press while they turn, three times at most: a machine with other work may delay one of them."""
        times = []
        while len(times) < 3 and (not times or times[-1] >= STOP_S):
            hold(driving)
            times.append(self._time_of_stop(press))
            let_go()
            driving.mouse.up()
        print(f"the motors turned for {times} s after the press")
        assert times[-1] < STOP_S

    def _time_of_stop(self, press: Any) -> float:
        """How long they turn after a press [s]."""
        end = time.monotonic() + PATIENCE_MS / 1000
        while time.monotonic() - self.moved_s > 0.05:
            assert time.monotonic() < end, "the motors do not turn"
            time.sleep(0.01)
        pressed = time.monotonic()
        press()
        time.sleep(1.0)
        return self.moved_s - pressed


@pytest.fixture
def emulated() -> Iterator[tuple[str, str]]:
    """The port and the witness of an emulated robot in a process of its own."""
    command = ["-m", "realitygap", "emulate", "scribbler", "--tcp", "0", "--witness", "0", "--quiet"]
    with subprocess.Popen([sys.executable, *command], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        port, witness = (process.stdout.readline().split()[-1] for _ in range(2))
        yield port, witness
        process.terminate()


@pytest.fixture
def motors(emulated: tuple[str, str]) -> Iterator[Motors]:
    motors = Motors(emulated[1])
    yield motors
    motors.end()


def connect(page: Any, port: str) -> None:
    page.get_by_label("Port", exact=True).fill(port)
    page.get_by_role("button", name="Connect").click()
    page.get_by_text(f"at {port}").wait_for()


def point_at_stop(page: Any) -> None:
    button = page.get_by_role("button", name="Stop the robot").bounding_box()
    page.mouse.move(button["x"] + button["width"] / 2, button["y"] + button["height"] / 2)


def make_busy(lab: Any, visit: Any) -> None:
    """Have a check that never ends, a report and a calibration go on."""
    run_study(parse_study(TINY, "study.toml"), lab.root / "tiny")
    lab.make_checks_endless()
    checking, calibrating, reporting = visit("new"), visit("calibrate"), visit("watch/tiny")
    reporting.get_by_text("4 of 4 simulated runs").wait_for()
    start(checking, TINY.replace("tiny", "endless"))
    checking.get_by_role("button", name="Cancel").wait_for()
    calibrating.get_by_role("combobox", name="What", exact=True).click()
    calibrating.get_by_role("option", name="all: everything at once").click()
    calibrating.get_by_role("button", name="Calibrate").click()
    calibrating.get_by_role("button", name="Stop for now").wait_for()
    reporting.get_by_role("button", name="Write the report").click()


def test_stop_is_at_once_while_a_check_a_report_and_a_calibration_run(lab, visit, emulated, motors):
    """Measured from the press of the mouse to the witness's last sight of turning motors: all the way there."""
    driving, pressing = visit("robot"), visit("robot")
    connect(driving, emulated[0])
    pressing.get_by_role("button", name="Ask for the robot").wait_for()
    make_busy(lab, visit)
    point_at_stop(pressing)
    motors.check_stop(driving, pressing.mouse.down, pressing.mouse.up)


def test_stop_needs_no_websocket(visit, emulated, motors):
    driving, pressing = visit("robot"), visit("robot")
    connect(driving, emulated[0])
    pressing.evaluate("window.socket.disconnect()")
    point_at_stop(pressing)
    motors.check_stop(driving, pressing.mouse.down, pressing.mouse.up)


def test_escape_stops_from_any_page_whatever_has_the_focus(visit, emulated, motors):
    driving, pressing = visit("robot"), visit("new")
    connect(driving, emulated[0])
    pressing.get_by_label("name", exact=True).first.focus()
    motors.check_stop(
        driving, lambda: pressing.keyboard.down("Escape"), lambda: pressing.keyboard.up("Escape")
    )


def test_stop_tells_when_the_lab_cannot_be_reached(lab, visit):
    page = visit("gap", forgive=["net::ERR", "WebSocket", "reloading", "Failed to load"])
    warning = page.get_by_text("Connection lost. Use the robot's power switch.")
    page.get_by_role("button", name="Stop the robot").wait_for()
    assert not warning.is_visible()
    page.context.set_offline(True)
    page.get_by_role("button", name="Stop the robot").click()
    warning.wait_for()
    check_uncovered(page)
    page.context.set_offline(False)
    page.get_by_role("button", name="Stop the robot").click()
    warning.wait_for(state="hidden")
