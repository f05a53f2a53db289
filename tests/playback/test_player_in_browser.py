"""The player in a real browser: Chromium as installed on the machine, driven by Playwright.

Every test also fails on any message of the console and on any request but for the page itself.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from realitygap.playback import play
from tests.browsers import LOCAL

from .page import page_of
from .trials import straight, turning

PATIENCE_MS = 60_000
"""Time after which a page that does not get on counts as hung; a machine with other work is slow."""


@pytest.fixture
def show(visitors, tmp_path) -> Iterator[Callable[..., Any]]:
    def open_page(widget: Any, **options: Any) -> Any:
        page = visitors.open_page((900, 800), LOCAL, PATIENCE_MS, **options)
        page.goto(page_of(widget, tmp_path / "page.html").as_uri())
        return page

    yield open_page
    visitors.leave("file://")


def clock(page) -> str:
    return page.text_content(".rg-clock")


def scrub(page, step: int) -> None:
    page.locator("input[type=range]").evaluate(
        "(slider, step) => { slider.value = step; slider.dispatchEvent(new Event('input')); }", step
    )


def visited(page) -> int:
    return page.locator(".rg-tile.rg-visited").count()


@pytest.mark.slow
def test_the_slider_goes_through_the_trial(show):
    trial = straight(10)
    page = show(play(trial))
    assert clock(page) == "step 0 of 10 · 0.0\u00a0s · coverage 0.014"
    assert visited(page) == 1
    scrub(page, 7)
    assert clock(page).startswith("step 7 of 10 · 0.7\u00a0s · coverage ")
    assert visited(page) == trial.at(0.7).n_cells
    x = float(page.locator(".rg-robot").get_attribute("transform").split("(")[1].split(" ")[0])
    left, _, _, _ = page.evaluate("() => window.model.get('scene').extent")
    assert x == pytest.approx(1000 * (trial.poses[7, 0] - left), abs=0.2)
    assert len(page.locator(".rg-trail").get_attribute("points").split()) == 9, "rows 0 to 7, and where it is"
    scrub(page, 2)
    assert visited(page) == trial.at(0.2).n_cells, "cells are given back"
    assert page.locator("input[type=range]").get_attribute("aria-valuetext") == "step 2 of 10, 0.2 seconds"


@pytest.mark.slow
def test_it_plays_as_fast_as_asked_and_stops_at_the_end(show):
    page = show(play(straight(10)))
    page.select_option("select", "8")
    page.click('button[aria-label="Play trials"]')
    page.wait_for_selector('button[aria-label="Play trials"]')
    assert clock(page).startswith("step 10 of 10 · 1.0\u00a0s")
    assert page.evaluate("() => window.model.get('speed')") == 8
    page.select_option("select", "0.25")
    began = time.monotonic()
    page.click('button[aria-label="Play trials"]')
    page.wait_for_function("() => /step [2-9] /.test(document.querySelector('.rg-clock').textContent)")
    page.click('button[aria-label="Pause trials"]')
    shown = float(clock(page).split(" · ")[1].removesuffix("\u00a0s"))
    took = time.monotonic() - began
    assert 0.0 < shown <= 0.25 * took + 0.05, "it begins anew at its end, and a quarter as fast"
    assert page.text_content("[role=status]") == clock(page)


@pytest.mark.slow
def test_keys_do_what_buttons_do(show):
    page = show(play(straight(87)))
    field = page.locator("svg[role=img]")
    field.focus()
    for key, step in (
        ("ArrowRight", 1),
        ("Shift+ArrowRight", 11),
        ("ArrowLeft", 10),
        ("End", 87),
        ("Home", 0),
    ):
        page.keyboard.press(key)
        assert clock(page).startswith(f"step {step} of 87")
    page.keyboard.press(" ")
    page.wait_for_selector('button[aria-label="Pause trials"]')
    page.keyboard.press(" ")
    page.wait_for_selector('button[aria-label="Play trials"]')
    assert field.get_attribute("aria-label").startswith("a: step")


@pytest.mark.slow
def test_a_player_is_as_dark_as_the_page_or_else_as_the_system(show):
    page = show(play([straight(10), straight(5)]), color_scheme="dark")
    colors = """() => [['.rg-player', 'backgroundColor'], ['.rg-clock', 'color'], ['.rg-walls', 'stroke'],
        ['.rg-tile', 'fill'], ['.rg-letter', 'fill'], ['.rg-trail', 'stroke']]
        .map(([name, key]) => getComputedStyle([...document.querySelectorAll(name)].at(-1))[key])"""
    dark = ["28, 32, 38", "163, 171, 181", "230, 232, 235", "20, 23, 27", "230, 232, 235", "90, 169, 230"]
    light = ["255, 255, 255", "90, 98, 109", "28, 31, 36", "246, 247, 249", "28, 31, 36", "0, 114, 178"]
    assert page.evaluate(colors) == [f"rgb({each})" for each in dark]
    page.evaluate("() => { document.body.dataset.jpThemeLight = 'true'; }")
    assert page.evaluate(colors) == [f"rgb({each})" for each in light]
    page.emulate_media(color_scheme="light")
    page.evaluate("() => { document.body.dataset.jpThemeLight = 'false'; }")
    assert page.evaluate(colors) == [f"rgb({each})" for each in dark]


@pytest.mark.slow
def test_rays_are_as_long_as_they_read_and_colored_by_nearness(show):
    page = show(play(straight(10)))
    rays = page.evaluate(
        "() => [...document.querySelectorAll('.rg-ray')].map(ray => [ray.getAttribute('x1'), ray.getAttribute('x2'), "
        "ray.style.stroke])"
    )
    assert [(float(to) - float(start)) for start, to, _ in rays] == pytest.approx([200.0, 100.0, 0.0])
    assert [color for _, _, color in rays] == [
        "var(--rg-far)",
        "color-mix(in srgb, var(--rg-near) 0.0%, var(--rg-middle))",
        "color-mix(in srgb, var(--rg-near) 100.0%, var(--rg-middle))",
    ]
    page.uncheck("label:has-text('rays') input")
    assert not page.locator(".rg-ray").first.is_visible()
    page.uncheck("label:has-text('cells') input")
    assert visited(page) == 0
    page.uncheck("label:has-text('trails') input")
    assert not page.locator(".rg-trail").first.is_visible()


@pytest.mark.slow
def test_several_trials_have_a_pen_each_and_letters_that_do_not_hide_each_other(show):
    trials = [straight(4, title=name) for name in ("one", "two", "<b>three")]
    page = show(play([*trials, turning(2)], title="four"))
    assert page.text_content(".rg-head strong") == "four"
    assert page.locator(".rg-name").all_text_contents()[2] == "C <b>three · 0.014"
    places = {
        (letter.get_attribute("x"), letter.get_attribute("y")) for letter in page.locator(".rg-letter").all()
    }
    assert len(places) == 4
    scrub(page, 10)
    assert "× " in page.locator(".rg-name").all_text_contents()[3], "blocked in its last step"
    assert clock(page) == "step 4 of 4 · 1.0\u00a0s", "it lasts as long as the longest"


@pytest.mark.slow
def test_reduced_motion_shows_steps_instead_of_motion(show):
    page = show(play(turning(2)), reduced_motion="reduce")
    page.click('button[aria-label="Play trials"]')
    page.wait_for_function("() => !document.querySelector('.rg-clock').textContent.startsWith('step 0 ')")
    turns, shown = page.evaluate(
        "() => [document.querySelector('.rg-robot').getAttribute('transform'),"
        " document.querySelector('.rg-clock').textContent]"
    )
    assert turns.endswith(f"rotate({-(360 - 22.918):.2f})") or shown.startswith("step 1")


@pytest.mark.slow
def test_every_control_has_a_name_and_can_be_reached_by_keyboard(show):
    page = show(play(straight(10)))
    names = []
    for _ in range(7):
        page.keyboard.press("Tab")
        names.append(
            page.evaluate(
                "() => { const one = document.activeElement; return one.getAttribute('aria-label') || "
                "(one.labels && one.labels[0] && one.labels[0].textContent); }"
            )
        )
    assert names[0].startswith("a: step 0 of 10")
    assert names[1:] == ["Play trials", "Step", "Speed", "rays", "trails", "cells"]


@pytest.mark.slow
def test_a_robot_that_runs_is_followed_and_can_be_played_afterwards(show):
    trial = straight(10)
    widget = play(trial)
    done = widget.trials
    widget.trials = play(straight(0)).trials
    widget.live = True
    page = show(widget)
    assert page.evaluate("() => window.sent") == [{"kind": "all"}]
    assert page.locator('button[aria-label="Play trials"]').is_disabled()
    now = {"kind": "now", "rays": [0.2, 0.1, None], "stalled": False, "lasts": 0.0, "time": 0.1, "trail": []}
    page.evaluate(
        "message => window.tell(message)", {**now, "pose": [0.2, 0.2, 0.0], "step": 1, "cells": [13]}
    )
    assert clock(page) == "step 1 · 0.1\u00a0s · coverage 0.014"
    page.evaluate(
        "message => window.tell(message)",
        {
            **now,
            "pose": [0.4, 0.2, 0.0],
            "step": 2,
            "time": 0.2,
            "cells": [14, 15],
            "trail": [[0.3, 0.2]],
            "lasts": 0.1,
        },
    )
    left, _, _, _ = page.evaluate("() => window.model.get('scene').extent")
    page.wait_for_function(
        "x => Math.abs(document.querySelector('.rg-robot').getAttribute('transform').split('(')[1].split(' ')[0] - x)"
        " <= 0.2",
        arg=1000 * (0.4 - left),
    )
    assert clock(page) == "step 2 · 0.2\u00a0s · coverage 0.042"
    page.evaluate(
        "trials => { window.model.set('was_live', true); window.model.set('trials', trials); "
        "window.model.set('live', false); }",
        done,
    )
    assert clock(page).startswith("step 10 of 10")
    assert page.locator('button[aria-label="Play trials"]').is_enabled()


@pytest.mark.slow
def test_a_robot_that_runs_arrives_although_the_page_draws_slowly(show):
    widget = play(straight(0))
    widget.live = True
    page = show(widget)
    message = {
        "kind": "now",
        "rays": [0.2, 0.1, None],
        "stalled": False,
        "lasts": 0.1,
        "cells": [13],
        "trail": [],
    }
    x, drawn_in_a_frame = page.evaluate(
        """async ([first, second]) => {
          let now = 0, step = 60, asked = 0; // each look at the clock takes 60 ms
          performance.now = () => (now += step);
          const ask = window.requestAnimationFrame, frame = () => new Promise((done) => ask(done));
          window.requestAnimationFrame = (draw) => (asked += 1, ask(draw));
          window.tell(first);
          window.tell(second);
          for (let k = 0; k < 5; k += 1) await frame();
          const x = Number(document.querySelector(".rg-robot").getAttribute("transform").split("(")[1].split(" ")[0]);
          step = 0; // it is on its way for good
          for (let k = 0; k < 5; k += 1) window.tell(second);
          asked = 0;
          await frame();
          return [x, asked];
        }""",
        [
            {**message, "pose": [0.2, 0.2, 0.0], "step": 1, "time": 0.1},
            {**message, "pose": [0.4, 0.2, 0.0], "step": 2, "time": 0.2},
        ],
    )
    left, _, _, _ = page.evaluate("() => window.model.get('scene').extent")
    assert x == pytest.approx(1000 * (0.4 - left), abs=0.2)
    assert drawn_in_a_frame == 1, "messages that come fast do not make it draw more often"


@pytest.mark.slow
def test_a_view_that_is_closed_listens_no_longer(show):
    page = show(play(straight(10)))
    page.click('button[aria-label="Play trials"]')
    page.evaluate("() => window.cleanup()")
    assert page.evaluate("() => window.heard()") == 0
