"""A robot driven by hand, at its page."""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
from collections.abc import Callable

import pytest

from realitygap.emulator import serve_pty, serve_tcp
from realitygap.families.scribbler.emulator import Emulator
from realitygap.families.thymio.playground._playground import why_not

from .conftest import NEW_PYTHONS, PHONE, expect, playwright, wait_connected
from .page_checks import covered, wrong_bars

pytestmark = pytest.mark.slow

PORT = "emulator://s2?fluke=2"


def connect(page) -> None:
    page.get_by_role("button", name="Use an emulated robot", exact=True).click()
    wait_connected(page, PORT)


def connect_to(page, port: str) -> None:
    """Connect the lab's robot, which all visitors see."""
    page.get_by_text("Another port").click()
    page.get_by_label("Port", exact=True).fill(port)
    page.get_by_role("button", name="Connect", exact=True).click()
    wait_connected(page, port)


def drive_by(page, shown: playwright.Locator, press: Callable[[], None], let_go: Callable[[], None]) -> None:
    """Press until something is shown: a robot that was silent is stopped, and waits for the next press.

    If the test itself stood still with a key held, the robot may be at a wall.
    """
    blocked, start = page.get_by_text("Standing, blocked"), page.get_by_role("button", name="Put at start")
    for _ in range(24):
        press()
        with contextlib.suppress(playwright.TimeoutError):
            shown.first.wait_for(timeout=5000)
            return
        let_go()
        with contextlib.suppress(playwright.TimeoutError):
            page.get_by_text(re.compile("^Standing")).first.wait_for(timeout=5000)
        if blocked.is_visible() and start.is_visible():
            start.click()
    raise AssertionError("the robot does not drive")


def hold_key(page, until: str = "Driving") -> None:
    """Focus the pad, and hold the key for ahead until the page shows what the robot does."""

    def press() -> None:
        page.locator(".lab-pad").focus()
        page.keyboard.down("ArrowUp")

    drive_by(page, page.get_by_text(until, exact=True), press, lambda: page.keyboard.up("ArrowUp"))


def drive_and_stop(page) -> None:
    """Drive by a key until it is let go."""
    hold_key(page)
    page.keyboard.up("ArrowUp")
    page.get_by_text("Standing", exact=True).wait_for()


def hold(page, until: str | re.Pattern[str] = re.compile(r"^Driving$")) -> None:
    """Pull the handle to its upper end, and hold it until the page shows what the robot does."""

    def press() -> None:
        box = page.locator(".lab-pad").bounding_box()
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] * 0.15, steps=3)

    drive_by(page, page.get_by_text(until), press, page.mouse.up)


def test_it_drives_while_the_handle_is_held_and_stands_when_it_is_let_go(visit):
    page = visit("robot", size=PHONE)
    connect(page)
    page.get_by_text("Standing", exact=True).wait_for()
    hold(page)
    page.mouse.up()
    page.get_by_text("Standing", exact=True).wait_for()


def test_hand_driving_fits_one_screen_of_a_phone_and_counts_cells(visit):
    page = visit("robot", size=(390, 800), has_touch=True)
    connect(page)
    clock = page.locator(".lab-drive-where").get_by_text(
        re.compile(r"Driven for \d+\.\d\ss · \d+ of 72 cells")
    )
    for part in (page.locator(".lab-sketch"), clock, page.locator(".lab-pad"), page.locator(".lab-stop")):
        part.wait_for()
        assert covered(part) == []
    hold(page)
    box = page.locator(".lab-pad").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] - 200, steps=5)
    page.mouse.up()
    hold(page, until=re.compile(r"([2-9]|\d\d) of 72 cells"))
    assert page.evaluate("() => scrollY") == 0
    page.mouse.up()
    # the robot may cross one more cell while the page is read, so both numbers are read at once
    page.wait_for_function(
        """() => {
            const words = document.querySelector(".lab-drive-where").innerText
            return words.includes(` ${document.querySelectorAll(".lab-sketch .lab-marked").length} of 72 cells`)
        }"""
    )


@NEW_PYTHONS
def test_it_stands_when_the_page_goes_away(visit, emulated):
    page = visit("robot")
    connect_to(page, emulated[0])
    hold(page)
    watcher = visit("robot")
    watcher.get_by_text(re.compile("is operating the robot. You are watching")).wait_for()
    page.context.close()
    watcher.get_by_text("Standing", exact=True).wait_for()


def test_arrow_keys_drive_and_escape_stops(visit):
    page = visit("robot")
    connect(page)
    hold_key(page)
    page.keyboard.press("Escape")
    page.get_by_role("button", name="Robot stopped").wait_for()
    page.get_by_text("Standing", exact=True).wait_for()  # though the key is still down
    page.keyboard.up("ArrowUp")
    page.locator('.lab-pad[data-stops="2"]').wait_for()
    hold_key(page)
    page.keyboard.up("ArrowUp")
    page.get_by_text("Standing", exact=True).wait_for()


def test_a_gamepad_drives_while_the_handle_has_the_focus(visit):
    page = visit("robot")
    connect(page)
    page.evaluate(
        "() => { window.pad = {axes: [0, -1], buttons: [{pressed: false}], connected: true};"
        "Object.defineProperty(navigator, 'getGamepads', {value: () => [null, window.pad]}); }"
    )
    page.wait_for_timeout(300)
    page.get_by_text("Standing", exact=True).wait_for()
    page.bring_to_front()
    page.locator(".lab-pad").focus()
    page.get_by_text("Driving", exact=True).wait_for()
    page.evaluate("() => { window.pad.buttons[0].pressed = true; }")
    page.get_by_text("Standing", exact=True).wait_for()
    page.evaluate("() => { window.pad.axes = [0, 0]; window.pad.buttons[0].pressed = false; }")
    page.wait_for_timeout(200)
    page.evaluate("() => { window.pad.axes = [1, 0]; }")
    page.get_by_text("Driving", exact=True).wait_for()
    page.locator(".lab-pad").blur()
    page.get_by_text("Standing", exact=True).wait_for()


def test_a_person_who_watches_can_stop_the_robot_and_cannot_drive_it(visit, emulated):
    page = visit("robot")
    connect_to(page, emulated[0])
    watcher = visit("robot")
    watcher.locator('.lab-pad[aria-disabled="true"]').wait_for()
    watcher.get_by_role("button", name="Stop robot").click()
    watcher.get_by_role("button", name="Robot stopped").wait_for()


def test_each_visitor_drives_an_emulated_robot_of_their_own(visit):
    first, second = visit("robot"), visit("robot")
    connect(first)
    connect(second)
    hold_key(first)
    assert second.get_by_text("Standing", exact=True).is_visible()
    second.get_by_role("button", name="Stop robot").click()
    hold_key(first)
    assert second.get_by_text("Standing", exact=True).is_visible()
    first.keyboard.up("ArrowUp")
    second.get_by_role("button", name="Disconnect").click()
    second.get_by_role("button", name="Use an emulated robot", exact=True).wait_for()
    drive_and_stop(first)


def pass_preflight(page):
    """Run the pre-flight check until it passes: on a busy machine, it may find the link too slow."""
    passed = page.get_by_text("Pre-flight check passed.")
    for _ in range(20):
        page.get_by_role("button", name="Run pre-flight").click()
        passed.or_(page.locator(".lab-problem", has_text="the link is too slow")).first.wait_for()
        if passed.is_visible():
            return
    passed.wait_for()


def test_its_preflight_and_its_picture_are_shown(visit):
    page = visit("robot")
    connect(page)
    pass_preflight(page)
    page.get_by_role("button", name="Take picture").click()
    page.locator(".lab-senses").get_by_alt_text("Picture of the robot's camera").wait_for()
    assert (
        page.get_by_text("Scribby", exact=True).count() == 1
    )  # the pre-flight does not repeat the facts above
    page.get_by_text(re.compile(r"^\d\.\d\d\sV$")).first.wait_for()


def test_robot_stops_when_a_key_is_released_and_sensors_have_names(visit):
    page = visit("robot")
    connect(page)
    drive_and_stop(page)
    for name in ("Left obstacle", "Center light", "Right line"):
        page.get_by_role("progressbar", name=name).wait_for()
    page.get_by_text("Left obstacle (0 to 6,400)").wait_for()


def test_bars_of_sensors_are_as_wide_as_the_readings_while_the_robot_drives_into_a_wall(visit):
    page = visit("robot")
    connect(page)
    hold_key(page)
    assert wrong_bars(page, 12) == []
    page.keyboard.up("ArrowUp")


@pytest.mark.skipif(bool(why_not()), reason=why_not() or "-")
def test_blocked_robot_is_drawn_at_the_wall_that_blocks_it(visit):
    page = visit("robot")
    connect(page)
    hold_key(page, until="Driving, blocked")
    page.keyboard.up("ArrowUp")
    robot, grid = page.locator(".lab-robot polygon").bounding_box(), page.locator(".lab-wall").all()
    right = max(wall.bounding_box()["x"] for wall in grid)
    cell = page.locator("[data-cell='0']").bounding_box()["width"]
    assert abs(robot["x"] + robot["width"] - right) < 0.4 * cell  # half a cell with a circle in its place


def test_thymio_in_playground_is_driven_with_its_own_sensors(visit):
    page = visit("robot")
    page.get_by_role("button", name="Use an emulated Thymio").click()
    wait_connected(page, "thymio:emulator://playground")
    page.get_by_role("progressbar", name="Rear right infrared").wait_for()
    expect(page.get_by_role("progressbar")).to_have_count(9)  # and two ground sensors
    drive_and_stop(page)
    pass_preflight(page)
    assert not page.get_by_role("button", name="Take picture").is_visible()


def test_lost_link_disables_the_pad_and_keeps_the_last_readings_with_their_age(visit):
    page = visit("robot")
    with serve_tcp(Emulator("s2"), speed=20) as server:
        connect_to(page, server.name)
        page.get_by_text("Standing", exact=True).wait_for()
        assert page.locator(".lab-chip").inner_text() == f"Robot on {server.name}"
    page.locator(".lab-robot-silent .lab-chip", has_text="no readings").wait_for()
    assert page.get_by_role("button", name="Stop robot").is_visible()
    page.get_by_role("button", name="Retry").wait_for()
    page.locator(".lab-robot-lost .lab-chip", has_text="link lost").wait_for()
    assert not page.get_by_role("button", name="Stop robot").is_visible()  # it would reach no robot
    page.get_by_text(re.compile(r"Last reading \d+\ss ago")).wait_for()
    page.locator('.lab-pad[aria-disabled="true"]').wait_for()
    page.locator(".lab-stale").wait_for()


def test_robot_on_a_listed_port_is_identified_on_request_only(lab, visit, monkeypatch):
    emulator, received = Emulator("s2", "2"), []
    receive = emulator.receive
    monkeypatch.setattr(emulator, "receive", lambda data: (received.append(data), receive(data)))
    with serve_pty(emulator, speed=20) as server:
        lab.list_port(server.name)
        page = visit("robot")
        identify = page.get_by_role("button", name=f"Identify the robot on {server.name}")
        identify.wait_for()
        page.wait_for_timeout(1000)
        assert received == []
        identify.click()
        page.get_by_text(re.compile(r"answered \(EMULATED\): model s2, .*fluke 2")).wait_for()
        page.get_by_role("button", name=f"Connect {server.name}").click()  # the port is free again
        wait_connected(page, server.name)


def test_port_that_does_not_answer_is_identified_as_no_robot(lab, visit):
    mine, other = os.openpty()  # a device that is silent
    try:
        lab.list_port(os.ttyname(other))
        page = visit("robot", size=PHONE)
        page.get_by_role("button", name="Identify the robot on").click()
        page.get_by_text("Looking for a robot…").wait_for()
        found = re.compile("No robot found. No Scribbler answers on .* Is the robot on, paired")
        page.get_by_text(found).wait_for()
        page.get_by_text("No robot connected.").wait_for()
    finally:
        os.close(mine)
        os.close(other)


def test_busy_port_is_identified_with_one_message_however_often_it_is_asked(lab, visit):
    mine, other = os.openpty()
    fcntl.flock(other, fcntl.LOCK_EX)
    try:
        lab.list_port(os.ttyname(other))
        page = visit("robot")
        identify = page.get_by_role("button", name="Identify the robot on")
        identify.focus()
        for _ in range(2):
            page.keyboard.press("Enter")
        reply = page.get_by_role("status").filter(has_text="cannot be opened: it is in use")
        reply.wait_for()
        expect(reply).to_have_count(1)
        assert identify.evaluate("button => button === document.activeElement")
        assert page.locator(".q-notification").count() == 0
        connect(page)
    finally:
        os.close(mine)
        os.close(other)


def test_a_port_without_a_robot_is_told_in_words(visit):
    page = visit("robot")
    page.get_by_text("Another port").click()
    page.get_by_label("Port", exact=True).fill("/dev/nothing")
    page.get_by_role("button", name="Connect", exact=True).click()
    page.locator(".lab-problem", has_text="/dev/nothing").wait_for()
    page.get_by_role("button", name="Retry").wait_for()
