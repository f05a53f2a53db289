"""Panels in a real browser, with the panel's own Python behind the page.

Every test also fails on any message of the console and on any request but for the page itself.
"""

from __future__ import annotations

import time
from typing import Any

import pytest

from realitygap.classroom import DrivePanel, WorldPanel
from realitygap.classroom import _panel as panels
from realitygap.classroom.jyro import Camera, JyroWorld, Pioneer
from realitygap.world import paper_arena
from tests.browsers import LOCAL
from tests.playback.page import PANEL, page_of
from tests.playback.test_player_in_browser import PATIENCE_MS

from .test_panel import Driven

pytestmark = pytest.mark.slow

PAD = {
    "axes": [0, 0], "buttons": [{"pressed": False}], "connected": True, "id": "Test pad", "index": 0, "mapping": "",
}  # fmt: skip


@pytest.fixture
def show(visitors, tmp_path):
    def open_page(panel: Any, *, answers: bool = True, **options: Any) -> Any:
        page = visitors.open_page((900, 800), LOCAL, PATIENCE_MS, **options)

        def kernel(message):
            replies = []
            panel.widget.send = replies.append
            panel._hear(panel.widget, message, [])
            return [{name: getattr(panel.widget, name) for name in PANEL}, replies]

        if answers:
            page.expose_function("kernel", kernel)
        page.add_init_script(
            "window.pads = []; window.looks = 0; Object.defineProperty(navigator, 'getGamepads',"
            " {value: () => { window.looks += 1; return window.pads; }});"
        )
        page.goto(page_of(panel.widget, tmp_path / "page.html", kind="panel").as_uri())
        return page

    yield open_page
    visitors.leave("file://")


@pytest.fixture
def driven(monkeypatch):
    """What a robot is told; by the page alone, because the panel itself would stop it where a busy page is silent."""
    monkeypatch.setattr(panels, "HOLD_S", 600.0)
    return Driven()


def panel_of(driven):
    return DrivePanel(driven.drive, driven.stop, title="Scribby")


def wait_for(page, check):
    until = time.monotonic() + PATIENCE_MS / 1000
    while not check():
        assert time.monotonic() < until, "It did not happen."
        page.wait_for_timeout(30)


def look_at_gamepad(page):
    """Wait until the page has looked at the gamepad as it is now."""
    page.evaluate("() => { window.looks = 0; }")
    page.wait_for_function("() => window.looks >= 2")


def stops_after_driving(page, driven):
    wait_for(page, lambda: "stop" in driven.told)
    assert driven.told[0] != "stop"
    n = len(driven.told)
    page.wait_for_timeout(250)
    assert driven.told[-1] == "stop"
    assert len(driven.told) == n


def test_a_dragged_pad_drives_and_stops_when_let_go(show, driven):
    page = show(panel_of(driven))
    box = page.locator(".rg-pad").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y - box["height"] / 2.8)
    wait_for(page, lambda: (pytest.approx(1.0), 0) in driven.told)
    page.mouse.up()
    stops_after_driving(page, driven)


def test_arrow_keys_drive_and_losing_the_focus_stops(show, driven):
    page = show(panel_of(driven))
    page.locator(".rg-pad").focus()
    page.keyboard.down("ArrowUp")
    page.keyboard.down("ArrowLeft")
    wait_for(page, lambda: (1, 0.5) in driven.told)
    page.evaluate("() => document.activeElement.blur()")
    stops_after_driving(page, driven)


@pytest.mark.parametrize("event", ["blur", "pagehide"])
def test_a_page_that_is_left_stops(show, driven, event):
    page = show(panel_of(driven))
    page.locator(".rg-pad").focus()
    page.keyboard.down("ArrowDown")
    wait_for(page, lambda: (-1, 0) in driven.told)
    page.evaluate("(name) => window.dispatchEvent(new Event(name))", event)
    stops_after_driving(page, driven)


def test_a_gamepad_drives_once_it_is_ticked_and_its_buttons_stop(show, driven):
    page = show(panel_of(driven))
    page.bring_to_front()
    page.evaluate("(pad) => { window.pads = [pad]; pad.axes[1] = -0.8; }", PAD)
    page.wait_for_timeout(300)
    assert driven.told == []
    page.get_by_label("Gamepad").check()
    wait_for(page, lambda: (pytest.approx(0.8), 0) in driven.told)
    page.evaluate("() => { window.pads[0].buttons[0].pressed = true; }")
    stops_after_driving(page, driven)
    page.evaluate("() => { window.pads[0].buttons[0].pressed = false; }")
    look_at_gamepad(page)
    page.wait_for_timeout(250)
    assert driven.told[-1] == "stop", "until the stick was in its middle"
    page.evaluate("() => { window.pads[0].axes[1] = 0; }")
    look_at_gamepad(page)
    page.evaluate("() => { window.pads[0].axes[0] = 1; }")
    wait_for(page, lambda: driven.told[-1] == (0, -1))
    assert page.text_content(".rg-panel-status") == "Gamepad: Test pad"
    page.evaluate("() => { window.pads = []; }")
    wait_for(page, lambda: "No gamepad yet" in page.text_content(".rg-panel-status"))


def test_a_kernel_that_does_not_answer_gets_one_command_and_a_release(show, driven):
    page = show(panel_of(driven), answers=False)
    page.locator(".rg-pad").focus()
    page.keyboard.down("ArrowUp")
    wait_for(page, lambda: "busy or gone" in page.text_content(".rg-panel-status"))
    assert [message["kind"] for message in page.evaluate("window.sent")] == ["drive", "release"]
    page.evaluate("() => window.tell({kind: 'heard', n: 2})")
    assert page.text_content(".rg-panel-status") == ""


def test_sliders_drive_the_robot_while_the_world_runs(show):
    world = JyroWorld()
    world.add_box(0.0, 0.0, 4.0, 2.0)
    robot = world.add(Pioneer(1.0, 1.0))
    robot.add(Camera())
    world.add(Pioneer(3.5, 1.0, name="second"))
    page = show(WorldPanel(world))
    start = robot.pose.x
    page.locator("input[aria-label=Speed]").evaluate(
        "(slider) => { slider.focus(); slider.value = 0.5; slider.dispatchEvent(new Event('input')); }"
    )
    page.get_by_role("button", name="Run").click()
    wait_for(page, lambda: world.n_steps > 3)
    assert robot.pose.x > start + 0.04
    page.get_by_role("button", name="Pause").click()
    page.wait_for_timeout(200)
    n = world.n_steps
    page.wait_for_timeout(300)
    assert world.n_steps == n
    page.get_by_role("button", name="Step", exact=True).click()
    wait_for(page, lambda: world.n_steps == n + 1)
    assert page.locator(".rg-panel-camera").is_visible()
    page.get_by_label("Robot", exact=True).select_option("second")
    wait_for(page, lambda: not page.locator(".rg-panel-camera").is_visible())
    assert robot.speed == 0.0
    page.get_by_role("button", name="Reset").click()
    wait_for(page, lambda: world.n_steps == 0)
    assert page.text_content(".rg-panel-clock") == "0.0 s, step 0"


def test_a_panel_that_is_taken_away_stops_and_listens_no_more(show, driven):
    page = show(panel_of(driven))
    page.locator(".rg-pad").focus()
    page.keyboard.down("ArrowUp")
    wait_for(page, lambda: driven.told)
    page.evaluate("() => window.cleanup()")
    stops_after_driving(page, driven)
    assert page.evaluate("() => window.heard()") == 0


def test_a_panel_is_as_dark_as_the_page_or_else_as_the_system(show):
    world = JyroWorld(paper_arena())
    world.add(Pioneer(0.5, 0.3))
    page = show(WorldPanel(world), color_scheme="dark")
    colors = """() => [['.rg-panel', 'backgroundColor'], ['.rg-panel', 'color'], ['.rg-panel-view svg rect', 'fill'],
        ['.rg-panel-view svg path', 'stroke']]
        .map(([name, key]) => getComputedStyle(document.querySelector(name))[key])"""
    dark = ["rgb(28, 32, 38)", "rgb(230, 232, 235)", "rgb(28, 32, 38)", "rgb(230, 232, 235)"]
    light = ["rgb(255, 255, 255)", "rgb(28, 31, 36)", "rgb(255, 255, 255)", "rgb(28, 31, 36)"]
    assert page.evaluate(colors) == dark
    page.evaluate("() => { document.body.dataset.jpThemeLight = 'true'; }")
    assert page.evaluate(colors) == light
    page.emulate_media(color_scheme="light")
    page.evaluate("() => { document.body.dataset.jpThemeLight = 'false'; }")
    assert page.evaluate(colors) == dark
