"""The stop for the robot: in sight, uncovered, and heard whatever else goes on."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import pytest

from realitygap.emulator import connect_witness
from realitygap.study import parse_study, run_study

from .conftest import PHONE, enter, expect, open_advanced, wait_connected
from .page_checks import covered
from .test_robot_in_browser import hold
from .test_studies_in_browser import TINY, start

pytestmark = pytest.mark.slow

VIEWS = {"desktop": (1280, 800), "phone": PHONE, "phone with its keyboard": (390, 400)}

NOTICES = """() => ["negative", "warning", "info"].forEach((type) => Quasar.Notify.create({
  type, message: `What happened, in a sentence that needs two lines on a phone: ${type}.`,
  position: "top", timeout: 0 }))"""


def test_stop_is_shown_while_a_robot_is_connected_and_nothing_covers_it(visit, emulated, tmp_path):
    """In one lab, with each kind of thing that lies above a page."""
    robot = visit("robot")
    assert not robot.get_by_role("button", name="Stop robot").is_visible()
    connect(robot, emulated[0])
    robot.locator(".lab-stop").wait_for()
    for view, size in VIEWS.items():
        page = visit("gap", size=size, has_touch=view != "desktop", user_agent=agent(view))
        page.get_by_text(f"Robot on {emulated[0]}", exact=False).first.wait_for()
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
    """The motors of an emulated robot, seen by its witness. `benchmarks/lab_stop.py` measures their speed."""

    def __init__(self, witness: Any) -> None:
        self._witness = witness

    def check_stop(self, driving: Any, press: Any, let_go: Any) -> None:
        """Press while the handle is held: only the stop can have the motors stand for long."""

        def end() -> None:
            let_go()
            driving.mouse.up()

        self.check(lambda: hold(driving), press, end)

    def check(self, begin: Any, act: Any, end: Any) -> None:
        """Let them turn, act, and wait until they stand."""
        self._turn(begin, end)
        act()
        still = 0
        for _ in range(6000):
            still = still + 1 if self._stand() else 0
            if still == 100:  # a page that is frozen for a moment lets a robot stand for a moment
                end()
                return
            time.sleep(0.01)
        raise AssertionError("the motors do not stop")

    def _stand(self) -> bool:
        return bool(self._witness.motors() == (0.0, 0.0))

    def _turn(self, begin: Any, end: Any) -> None:
        """Begin until they turn: while a robot is silent, its pad is off."""
        for _ in range(24):
            begin()
            for _ in range(500):
                if not self._stand():
                    return
                time.sleep(0.01)
            end()
        raise AssertionError("the motors do not turn")


@pytest.fixture
def motors(emulated: tuple[str, str]) -> Iterator[Motors]:
    with connect_witness(emulated[1]) as witness:
        yield Motors(witness)


def connect(page: Any, port: str) -> None:
    page.get_by_text("Another port").click()
    page.get_by_label("Port", exact=True).fill(port)
    page.get_by_role("button", name="Connect", exact=True).click()
    wait_connected(page, port)


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


def test_stop_works_while_a_check_a_report_and_a_calibration_run(lab, visit, emulated, motors):
    """The lab answers the press before all of this has ended."""
    driving, pressing = visit("robot"), visit("robot")
    connect(driving, emulated[0])
    pressing.get_by_role("button", name="Request control").wait_for()
    make_busy(lab, visit)
    point_at_stop(pressing)
    motors.check_stop(driving, pressing.mouse.down, pressing.mouse.up)


def test_motors_stop_once_keys_are_let_go_or_are_another_windows(visit, emulated, motors):
    page = visit("robot")
    connect(page, emulated[0])
    keyboard = page.keyboard

    def press() -> None:
        window.send("Browser.setWindowBounds", {"windowId": number, "bounds": {"windowState": "normal"}})
        page.bring_to_front()
        page.locator(".lab-pad").focus()
        keyboard.down("ArrowLeft")

    def let_go() -> None:
        for key in ("ArrowLeft", "Meta", "Alt"):
            keyboard.up(key)

    window = page.context.new_cdp_session(page)
    window.send("Emulation.setFocusEmulationEnabled", {"enabled": False})
    number = window.send("Browser.getWindowForTarget")["windowId"]
    other = page.context.new_page()

    def turn_to_another_window() -> None:
        other.bring_to_front()
        window.send("Browser.setWindowBounds", {"windowId": number, "bounds": {"windowState": "minimized"}})

    def hide() -> None:
        """In a browser without a screen no page is ever hidden, whatever is in front of it: only the event is sent."""
        page.evaluate("() => { document.dispatchEvent(new Event('visibilitychange')); }")

    lost_keys = {
        "key": lambda: keyboard.up("ArrowLeft"),
        "Command": lambda: keyboard.down("Meta"),
        "Alt": lambda: keyboard.down("Alt"),
        "menu": lambda: page.locator(".lab-pad").dispatch_event("contextmenu"),
        "window": turn_to_another_window,
        "tab": hide,
    }
    for name, act in lost_keys.items():
        print(name)
        motors.check(press, act, let_go)


@pytest.mark.parametrize("is_asked", [True, False])
def test_motors_stop_when_the_tab_is_closed_with_a_key_down(visit, emulated, motors, is_asked):
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
        wait_connected(again, emulated[0])
        pages.append(again)

    motors.check(press, lambda: pages[-1].close(run_before_unload=is_asked), open_again)


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
    enter(page, "Target", "twin:mine.toml")
    assert not page.locator(".lab-stop").is_visible()
    page.context.set_offline(True)
    page.evaluate("window.socket.io.engine.close()")
    page.get_by_text("Reconnecting…").wait_for()
    lost = page.get_by_role("button", name="Connection lost. If a robot moves, use its power switch.")
    lost.wait_for()  # whether a robot is connected is unknown
    assert covered(page.locator(".lab-stop")) == []
    page.get_by_role("button", name="Measure the gap").click()
    page.context.set_offline(False)
    page.get_by_text("Reconnecting…").wait_for(state="hidden")
    page.locator(".lab-stop").wait_for(state="hidden")
    expect(page.get_by_label("Target", exact=True)).to_have_value("twin:mine.toml")
    expect(page.get_by_text("No gaps measured yet.")).to_be_visible()
