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

from .conftest import PHONE, expect, open_advanced
from .page_checks import covered
from .test_robot_in_browser import hold
from .test_studies_in_browser import TINY, start

pytestmark = pytest.mark.slow

STOP_S = 0.2
"""Within which the motors stand after a press [s]."""
RELEASE_S = 0.5
"""Within which they stand after a key was let go, or may have been [s]."""
VIEWS = {"desktop": (1280, 800), "phone": PHONE, "phone with its keyboard": (390, 400)}

NOTICES = """() => ["negative", "warning", "info"].forEach((type) => Quasar.Notify.create({
  type, message: `What happened, in a sentence that needs two lines on a phone: ${type}.`,
  position: "top", timeout: 0 }))"""


def test_stop_is_shown_while_a_robot_is_connected_and_nothing_covers_it(visit, tmp_path):
    """In one lab, with each kind of thing that lies above a page."""
    robot = visit("robot")
    assert not robot.get_by_role("button", name="Stop robot").is_visible()
    robot.get_by_role("button", name="Use an emulated robot").click()
    robot.locator(".lab-stop").wait_for()
    for view, size in VIEWS.items():
        page = visit("gap", size=size, has_touch=view != "desktop", user_agent=agent(view))
        page.get_by_text("Emulated robot", exact=False).first.wait_for()
        stop = page.get_by_role("button", name="Stop robot")
        stop.wait_for()
        assert stop.bounding_box()["height"] >= 44
        assert covered(page.locator(".lab-stop")) == []

        page.evaluate(NOTICES)
        page.locator(".q-notification").nth(2).wait_for()
        assert covered(page.locator(".lab-stop")) == []
        page.screenshot(path=tmp_path / f"{view}-notices.png")

        open_advanced(page, page.get_by_role("combobox", name="Observation level"))
        page.get_by_role("combobox", name="Observation level").click()
        page.get_by_role("option", name="encoders").wait_for()
        page.wait_for_timeout(400)  # until it has moved in
        assert covered(page.locator(".lab-stop")) == []

        page.evaluate("document.getElementById('too_long_message_popup').ariaHidden = false")
        assert covered(page.locator(".lab-stop")) == []
        page.screenshot(path=tmp_path / f"{view}-choice.png")
        stop.click()
        page.get_by_role("button", name="Robot stopped").wait_for()
        page.get_by_role("button", name="Stop robot").wait_for(timeout=20_000)  # after 5 s
        page.close()
    robot.get_by_role("button", name="Disconnect").click()
    robot.locator(".lab-stop").wait_for(state="hidden")


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
            while not self._ended.wait(0.005):  # exact to a fraction of the limits
                if witness.motors() != (0.0, 0.0):
                    self.moved_s = time.monotonic()

    def end(self) -> None:
        self._ended.set()
        self._thread.join()

    def check_stop(self, driving: Any, press: Any, let_go: Any) -> None:
        """Press while they turn, three times at most: a machine with other work may delay one of them."""

        def end() -> None:
            let_go()
            driving.mouse.up()

        self.check(STOP_S, lambda: hold(driving), press, end)

    def check(self, limit_s: float, begin: Any, act: Any, end: Any) -> None:
        """Let them turn, act, and check how long they turn then; three times at most, for the same reason."""
        times = []
        while len(times) < 3 and (not times or times[-1] >= limit_s):
            self._turn(begin, end)
            times.append(self._time_of_stop(act))
            end()
        print(f"the motors turned for {times} s afterwards")
        assert times[-1] < limit_s

    def _turn(self, begin: Any, end: Any) -> None:
        """Begin until they turn: a page that is drawn at this moment, or a robot that is silent, drops a press."""
        for _ in range(24):
            begin()
            until = time.monotonic() + 5.0
            while time.monotonic() < until:
                if time.monotonic() - self.moved_s < 0.05:
                    return
                time.sleep(0.01)
            end()
        raise AssertionError("the motors do not turn")

    def _time_of_stop(self, press: Any) -> float:
        """How long they turn after a press [s]."""
        pressed = time.monotonic()
        press()
        time.sleep(1.0)
        return self.moved_s - pressed


@pytest.fixture(scope="module")
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
    page.get_by_text("Another port").click()
    page.get_by_label("Port", exact=True).fill(port)
    page.get_by_role("button", name="Connect", exact=True).click()
    page.get_by_text(f"Connected to {port}").wait_for()


def point_at_stop(page: Any) -> None:
    button = page.get_by_role("button", name="Stop robot").bounding_box()
    page.mouse.move(button["x"] + button["width"] / 2, button["y"] + button["height"] / 2)


def make_busy(lab: Any, visit: Any) -> None:
    """Have a check that never ends, a report and a calibration go on."""
    run_study(parse_study(TINY, "study.toml"), lab.root / "tiny")
    lab.make_checks_endless()
    checking, calibrating, reporting = visit("new"), visit("calibrate"), visit("study/tiny")
    reporting.get_by_text("4 runs", exact=True).wait_for()
    start(checking, TINY.replace("tiny", "endless"))
    checking.get_by_role("button", name="Cancel").wait_for()
    calibrating.get_by_role("button", name="Next").click()
    calibrating.locator('[data-kind="all"]').click()
    calibrating.get_by_role("button", name="Calibrate", exact=True).click()
    calibrating.get_by_role("button", name="Stop calibration").wait_for()
    reporting.get_by_role("tab", name="Report").click()
    reporting.get_by_role("button", name="Write report").click()


def test_stop_is_at_once_while_a_check_a_report_and_a_calibration_run(lab, visit, emulated, motors):
    """Measured from the press of the mouse to the witness's last sight of turning motors: all the way there."""
    driving, pressing = visit("robot"), visit("robot")
    connect(driving, emulated[0])
    pressing.get_by_role("button", name="Request control").wait_for()
    make_busy(lab, visit)
    point_at_stop(pressing)
    motors.check_stop(driving, pressing.mouse.down, pressing.mouse.up)


def test_motors_stop_within_half_a_second_once_keys_are_let_go_or_are_another_windows(
    visit, emulated, motors
):
    page = visit("robot")
    connect(page, emulated[0])
    keyboard, window = page.keyboard, page.context.new_cdp_session(page)
    window.send("Emulation.setFocusEmulationEnabled", {"enabled": False})  # otherwise each page has the focus

    def press() -> None:
        page.bring_to_front()
        page.locator(".lab-pad").focus()
        keyboard.down("ArrowLeft")

    def let_go() -> None:
        for key in ("ArrowLeft", "Meta", "Alt"):
            keyboard.up(key)
        for other in page.context.pages[page.context.pages.index(page) + 1 :]:
            other.close()

    def open_tab() -> None:
        page.context.new_page().bring_to_front()

    lost_keys = {
        "key": lambda: keyboard.up("ArrowLeft"),
        "Command": lambda: keyboard.down("Meta"),
        "Alt": lambda: keyboard.down("Alt"),
        "menu": lambda: page.locator(".lab-pad").dispatch_event("contextmenu"),
        "dialog": lambda: page.evaluate("() => { window.dispatchEvent(new Event('blur')); }"),
        "tab": open_tab,
    }
    for name, act in lost_keys.items():
        print(name)
        motors.check(RELEASE_S, press, act, let_go)


@pytest.mark.parametrize("is_asked", [True, False])
def test_motors_stop_within_half_a_second_when_the_tab_is_closed_with_a_key_down(
    visit, emulated, motors, is_asked
):
    page = visit("robot")
    connect(page, emulated[0])
    pages = [page]

    def press() -> None:
        pages[-1].bring_to_front()
        pages[-1].locator(".lab-pad").focus()
        pages[-1].keyboard.down("ArrowLeft")

    def open_again() -> None:
        pages[-1].close()  # unless that is what was measured
        again = page.context.new_page()
        again.goto(page.url)
        again.get_by_text(f"Connected to {emulated[0]}").wait_for()
        pages.append(again)

    motors.check(RELEASE_S, press, lambda: pages[-1].close(run_before_unload=is_asked), open_again)


def test_stop_needs_no_websocket(visit, emulated, motors):
    driving, pressing = visit("robot"), visit("robot")
    connect(driving, emulated[0])
    pressing.evaluate("window.socket.disconnect()")
    point_at_stop(pressing)
    motors.check_stop(driving, pressing.mouse.down, pressing.mouse.up)


def test_escape_stops_from_any_page_whatever_has_the_focus(visit, emulated, motors):
    driving, pressing = visit("robot"), visit("new")
    connect(driving, emulated[0])
    pressing.get_by_label("Name", exact=True).first.focus()
    motors.check_stop(
        driving, lambda: pressing.keyboard.down("Escape"), lambda: pressing.keyboard.up("Escape")
    )


def test_page_without_the_lab_shows_the_stop_and_disables_everything_else(visit):
    page = visit("gap", forgive=["net::ERR", "WebSocket", "reloading", "Failed to load"])
    page.get_by_label("Target").fill("twin:mine.toml")
    assert not page.locator(".lab-stop").is_visible()
    page.context.set_offline(True)
    page.evaluate("window.socket.io.engine.close()")
    page.get_by_text("Reconnecting…").wait_for()
    lost = page.get_by_role("button", name="Connection lost. Use the robot's power switch.")
    lost.wait_for()  # whether a robot is connected is unknown
    assert covered(page.locator(".lab-stop")) == []
    page.get_by_role("button", name="Measure the gap").click()
    page.context.set_offline(False)
    page.get_by_text("Reconnecting…").wait_for(state="hidden")
    page.locator(".lab-stop").wait_for(state="hidden")
    expect(page.get_by_label("Target")).to_have_value("twin:mine.toml")
    expect(page.get_by_text("No gaps measured yet.")).to_be_visible()
