"""The page in a real browser: Chromium as installed on the machine, driven by Playwright.

Every test also fails on any message of the console and on any request but for the page itself.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from axe_playwright_python.sync_playwright import Axe

from realitygap.report import _replay, write_report
from realitygap.report._tally import read_tally, settings_of
from realitygap.runs import Condition, replay
from realitygap.study import load_study, parse_study, run_study
from realitygap.trials import Trajectory
from tests.browsers import LOCAL

PATIENCE_MS = 60_000
"""Other tests may have the processors."""
DESKTOP, PHONE = (1280, 900), (390, 844)
MARGIN = 0.012 * 42 * 25.4
UNITS = _replay.UNITS
NEAR_MM, NEAR_DEG = 1000 * UNITS["length"] / 2 + 0.11, np.degrees(UNITS["angle"]) / 2 + 0.05
"""Half a unit of the page, and of a digit in its figure."""
"""Of the paper's arena in the player [mm]."""
EVIL = "</script><img src=x onerror=alert(1)>\"'&,/@%"

NUMBERS = "() => [...document.querySelectorAll('#replay-rows tr')].map(" + (
    "row => [...row.querySelectorAll('td')].map(cell => cell.textContent))"
)

SIZES = "all => all.map(it => it.getBoundingClientRect()).map(box => [box.width, box.height])"


@pytest.fixture(scope="module")
def page_file(tiny_html, tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("page") / "report.html"
    file.write_text(tiny_html, "utf-8")
    return file


@pytest.fixture
def show(visitors, page_file) -> Iterator[Callable[..., Any]]:
    """Shows the page, in a window of its own."""

    def open_page(fragment: str = "", size=DESKTOP, file: Path | None = None, **options: Any) -> Any:
        page = visitors.open_page(size, LOCAL, PATIENCE_MS, **options)
        page.on("dialog", lambda dialog: (visitors.complaints.append(dialog.message), dialog.dismiss()))
        page.goto((file or page_file).as_uri() + fragment)
        return page

    yield open_page
    visitors.leave("file://")


@pytest.fixture(scope="module")
def trials(tiny_study) -> Callable[[str, int, int], tuple[str, Trajectory]]:
    """The part of a link that names a trial on the page, and the trial recomputed."""
    tally = read_tally(tiny_study)

    def trial(name: str, generation: int, individual: int) -> tuple[str, Trajectory]:
        run = tally.typical_replicate(name)
        row = next(
            row
            for row in tally.folder.read(name, [run]).iter_rows(named=True)
            if (row["generation"], row["individual"]) == (generation, individual)
        )
        condition = Condition.from_settings(name, dict(settings_of(tally.condition(name))))
        return f"{name}/{run}/{generation}/{individual}", replay(condition, row)

    return trial


def step_of(page) -> int:
    return int(re.search(r"step (\d+) of", page.locator("#replay-clock").text_content())[1])


def robot_at(page, letter: str = "A") -> str:
    return page.locator(f'#replay-figure .rg-robot[data-pen="{letter}"]').get_attribute("transform")


def numbers(page) -> list[list[float | str]]:
    def value(text: str) -> float | str:
        text = text.replace("−", "-")
        return float(text) if re.fullmatch(r"-?\d+\.\d+", text) else text

    return [[value(text) for text in row] for row in page.evaluate(NUMBERS)]


def check_numbers(shown: list[float | str], trajectory: Trajectory, step: int) -> None:
    """The numbers of a row of the table are those of the trial, within half a unit of the page."""
    lengths = [*shown[:2], *shown[3:6]]
    exact = [*trajectory.poses[step, :2], *trajectory.readings[step]]
    assert np.abs(np.subtract(lengths, exact)).max() <= UNITS["length"] / 2 + 1e-9
    assert abs(shown[2] - trajectory.poses[step, 2]) <= UNITS["angle"] / 2 + 1e-9
    if step < len(trajectory.commands):
        answers = [trajectory.inputs[step, 0], *trajectory.commands[step]]
        assert np.abs(np.subtract(shown[6:9], answers)).max() <= UNITS["output"] / 2 + 1e-9
    else:
        assert shown[6:9] == ["–"] * 3
        assert shown[10:] == [round(trajectory.coverage_line, 3), round(trajectory.coverage_ends, 3)]
    assert shown[9] == ("yes" if trajectory.stalled[step] else "no")


# time


@pytest.mark.slow
def test_replay_waits_at_step_0_and_plays_once_when_in_view(show):
    page = show(size=PHONE)
    assert page.locator("#replay-scrub").evaluate("scrub => scrub.value") == "0"
    assert page.locator("#replay-figure .rg-robot").count() == 1
    page.wait_for_timeout(300)
    assert step_of(page) == 0
    page.locator("#replay-speed").evaluate("speed => { speed.value = '8'; }")
    page.locator("#replay-stage").scroll_into_view_if_needed()
    page.wait_for_function("() => document.querySelector('#replay-scrub').value == 30")
    page.evaluate("scrollTo(0, 0)")
    page.locator("#replay-first").evaluate("button => button.click()")
    page.locator("#replay-stage").scroll_into_view_if_needed()
    page.wait_for_timeout(300)
    assert step_of(page) == 0
    assert page.locator("#replay-play").text_content().strip() == "Play"


@pytest.mark.slow
def test_first_screen_has_findings_a_figure_and_a_moving_path(show):
    page = show(size=(1440, 900))
    boxes = [
        page.locator(name).bounding_box()
        for name in (".findings", "#figure-bests .wide svg", "#figure-bests figcaption", "#replay-arena")
    ]
    assert all(box["y"] >= 0 and box["y"] + box["height"] <= 900 for box in boxes)
    assert boxes[1]["x"] + boxes[1]["width"] <= boxes[3]["x"], "side by side"
    page.wait_for_function("() => document.querySelector('#replay-scrub').value > 1")
    moving = page.locator("#replay-figure .rg-robot")
    page.locator("#replay-play").click()
    paused = moving.get_attribute("transform")
    page.wait_for_timeout(300)
    assert moving.get_attribute("transform") == paused


@pytest.mark.slow
def test_first_screen_is_still_with_reduced_motion(show):
    page = show(size=(1440, 900), reduced_motion="reduce")
    page.wait_for_timeout(300)
    assert step_of(page) == 0
    assert page.locator("#replay-play").text_content().strip() == "Play"


@pytest.mark.slow
def test_conclusions_and_differences_are_in_view_on_a_phone(show):
    page = show(size=PHONE)
    rows = page.locator("table.comparisons tr:has(td)").evaluate_all(
        "rows => rows.filter(row => row.checkVisibility()).map("
        "row => [row.children[2].getBoundingClientRect().right, row.offsetHeight])"
    )
    assert rows
    assert max(right for right, _ in rows) <= PHONE[0]
    assert max(height for _, height in rows) < 60, "rows and no cards"


@pytest.mark.slow
def test_navigation_marks_the_section_in_view(show):
    page = show(size=(1400, 900), reduced_motion="reduce")
    marked = page.locator(".contents a[aria-current]")
    assert marked.text_content() == "Findings and replay"
    for link in page.locator(".contents a").all():
        page.evaluate("anchor => document.querySelector(anchor).scrollIntoView()", link.get_attribute("href"))
    # The page learns of a scroll in a later frame, so until then another link is marked.
    marked.and_(page.get_by_text("Data", exact=True)).wait_for()
    assert marked.count() == 1


PAPER_HEIGHTS = {(1400, 900): 8_500, PHONE: 12_000}
"""Largest height of the report of the paper's study by size of the window [px]."""


@pytest.mark.slow
def test_report_of_the_paper_is_short(visitors, tmp_path):
    folder = run_study(load_study("paper", replicates=100), tmp_path / "paper").folder
    file = write_report(folder, tmp_path / "page.html")
    for size, most in PAPER_HEIGHTS.items():
        page = visitors.open_page(size, LOCAL, PATIENCE_MS, reduced_motion="reduce")
        page.goto(file.as_uri())
        assert page.evaluate("document.documentElement.scrollHeight") <= most
        assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
        used = page.locator("main section > *").evaluate_all(
            "all => Math.max(...all.map(it => it.getBoundingClientRect().right))"
        )
        assert used >= 0.97 * size[0] - 32, "the page uses its width"
        if size != PHONE:
            pages = re.findall(rb"/Type\s*/Page\b", page.pdf(format="A4"))
            assert 1 < len(pages) <= 8
    visitors.leave("file://")


@pytest.mark.slow
@pytest.mark.parametrize(("size", "scheme"), [(DESKTOP, "light"), (PHONE, "dark")])
def test_axe_finds_no_fault(show, size, scheme):
    page = show(size=size, color_scheme=scheme, reduced_motion="reduce", bypass_csp=True)
    violations = Axe().run(page).response["violations"]
    assert [(each["id"], [node["target"] for node in each["nodes"]][:3]) for each in violations] == []


@pytest.mark.slow
def test_letters_do_not_overlap(show):
    page = show(reduced_motion="reduce")
    page.get_by_role("button", name="All of generation 2").click()
    for step in (0, 10, 30):
        page.locator("#replay-scrub").fill(str(step))
        boxes = [text.bounding_box() for text in page.locator("#replay-arena text").all()]
        assert len(boxes) == 4
        for k, one in enumerate(boxes):
            for other in boxes[k + 1 :]:
                apart = [
                    abs(one[a] + one[b] / 2 - other[a] - other[b] / 2) - (one[b] + other[b]) / 2
                    for a, b in (("x", "width"), ("y", "height"))
                ]
                assert max(apart) > -2, (step, one, other)


@pytest.mark.slow
def test_play_moves_the_robot_and_pause_stops_it(show, trials):
    name, _ = trials("coverage", 2, 0)
    page = show(f"#replay={name}@0")
    page.locator("#replay-play").click()
    page.wait_for_function("() => document.querySelector('#replay-scrub').value > 2")
    page.locator("#replay-play").click()
    step, pose = step_of(page), robot_at(page)
    assert step > 2
    page.wait_for_timeout(300)
    assert (step_of(page), robot_at(page)) == (step, pose)


@pytest.mark.slow
def test_play_ends_at_the_end_and_restarts(show):
    page = show(reduced_motion="reduce")
    page.locator("#replay-speed").select_option("8")
    page.locator("#replay-play").click()
    page.wait_for_function("() => document.querySelector('#replay-play span').textContent == 'Play'")
    assert step_of(page) == 30
    assert page.locator("#replay-play").text_content().strip() == "Play"


@pytest.mark.slow
def test_scrub_jumps_and_buttons_step(show):
    page = show(reduced_motion="reduce")
    page.locator("#replay-scrub").fill("12")
    assert step_of(page) == 12
    page.locator("#replay-next").click()
    assert step_of(page) == 13
    page.locator("#replay-back").click()
    page.locator("#replay-back").click()
    assert step_of(page) == 11
    page.locator("#replay-last").click()
    assert step_of(page) == 30
    page.locator("#replay-next").click()
    assert step_of(page) == 30
    page.locator("#replay-first").click()
    page.locator("#replay-back").click()
    assert step_of(page) == 0
    assert page.locator("#replay-scrub").get_attribute("aria-valuetext") == "0.0 seconds, step 0 of 30"


@pytest.mark.slow
def test_dragging_over_the_curve_goes_through_time(show):
    page = show(reduced_motion="reduce")
    page.locator("#replay-chart").scroll_into_view_if_needed()
    box = page.locator("#replay-chart").bounding_box()
    page.mouse.move(box["x"] + 8, box["y"] + 30)
    page.mouse.down()
    assert step_of(page) == 0
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 30)
    assert step_of(page) == 15
    page.mouse.up()


# numbers


@pytest.mark.slow
def test_numbers_shown_are_those_recomputed(show, trials):
    page = show(reduced_motion="reduce")
    for name in ("coverage", "novelty", "turn", "ends"):
        chosen = [trials(name, 2, individual) for individual in range(4)]
        links = [link for link, _ in chosen]
        page.evaluate(f"location.hash = '#replay={','.join(links)}@0'")
        page.locator("#replay-rows .trial", has_text=links[-1]).wait_for()
        assert page.locator("#replay-rows .trial").all_text_contents() == links
        for step in (0, 1, 2, 7, 15, 29, 30):
            page.locator("#replay-scrub").fill(str(step))
            for row, (_, trajectory) in zip(numbers(page), chosen, strict=True):
                check_numbers(row, trajectory, step)


@pytest.mark.slow
def test_robot_stands_where_its_numbers_say(show, trials):
    name, trajectory = trials("turn", 1, 3)
    page = show(f"#replay={name}@9")
    x, y, heading = trajectory.poses[9]
    arena = "document.querySelector('#replay-arena')"
    width, height = page.evaluate(f"() => [{arena}.viewBox.baseVal.width, {arena}.viewBox.baseVal.height]")
    assert (width, height) == pytest.approx((42 * 25.4 + 2 * MARGIN, 24 * 25.4 + 2 * MARGIN), abs=0.2)
    found = [float(number) for number in re.findall(r"-?\d+\.\d+", robot_at(page))]
    assert found[:2] == pytest.approx([1000 * x + MARGIN, height - MARGIN - 1000 * y], abs=NEAR_MM)
    assert found[2] == pytest.approx(-np.degrees(heading), abs=NEAR_DEG)
    corners = page.locator("#replay-figure .rg-robot .rg-body").get_attribute("points")
    assert corners == "90.0,-80.0 90.0,80.0 -90.0,80.0 -90.0,-80.0", "0.18 x 0.16 m, in mm"
    ends = [float(ray.get_attribute("x2")) for ray in page.locator("#replay-figure .rg-robot .rg-ray").all()]
    assert ends == pytest.approx(90 + 1000 * trajectory.readings[9], abs=NEAR_MM)


@pytest.mark.slow
def test_a_blocked_step_is_marked_and_not_by_color_alone(show, trials):
    for individual in range(8):
        name, trajectory = trials("turn", 0, individual)
        if trajectory.stalled.any():
            break
    page = show(f"#replay={name}@{trajectory.stalled.argmax()}")
    assert page.locator("#replay-figure .rg-robot.rg-stalled").count() == 1
    assert page.locator("#replay-arena text").first.text_content() == "A ×"
    assert numbers(page)[0][9] == "yes"
    assert "blocked" in page.locator("#replay-arena").get_attribute("aria-label")
    assert page.locator("#replay-figure .rg-blocked").get_attribute("d").startswith("M")


@pytest.mark.slow
def test_visited_cells_fill_up_to_those_of_the_trial(show, trials):
    name, trajectory = trials("coverage", 2, 1)
    page = show(f"#replay={name}@30")
    assert page.locator("#replay-figure .rg-visited").count() == len(trajectory.cells)
    page.locator("#replay-first").click()
    assert page.locator("#replay-figure .rg-visited").count() == 1


# several trials


@pytest.mark.slow
def test_several_at_once_differ_without_color(show):
    page = show(reduced_motion="reduce")
    page.get_by_role("button", name="All of generation 1").click()
    assert [row.get_attribute("data-pen") for row in page.locator("#replay-figure .rg-robot").all()] == list(
        "ABCD"
    )
    dashes = [
        trail.get_attribute("stroke-dasharray")
        for trail in page.locator("#replay-figure polyline.rg-trail").all()
    ]
    assert len(set(dashes)) == 4
    colors = page.evaluate(
        "() => [...document.querySelectorAll('#replay-figure polyline.rg-trail')]"
        ".map(trail => getComputedStyle(trail).stroke)"
    )
    assert len(set(colors)) == 4
    pressed = page.locator("#replay-matrix [aria-pressed=true]")
    assert [button.text_content()[0] for button in pressed.all()] == list("ABCD")


@pytest.mark.slow
def test_trials_come_and_go_one_by_one(show):
    page = show(reduced_motion="reduce")
    page.locator("#replay-clear").click()
    assert page.locator("#replay-figure .rg-robot").count() == 0
    page.locator("#replay-play").click()
    assert page.locator("#replay-status").text_content() == "Choose a trial first."
    page.get_by_role("button", name="Generation 0, individual 4:").click()
    page.get_by_role("button", name="Generation 2, individual 5:").click()
    assert page.locator("#replay-rows tr").count() == 2
    page.get_by_role("button", name="Remove A:").click()
    assert page.locator("#replay-rows tr").count() == 1
    assert page.locator("#replay-figure .rg-robot").get_attribute("data-pen") == "B"
    assert "A removed" in page.locator("#replay-status").text_content()


@pytest.mark.slow
def test_a_fifth_trial_is_refused_with_a_message(show):
    page = show(reduced_motion="reduce")
    page.get_by_role("button", name="All of generation 0").click()
    page.get_by_role("button", name="Generation 1, individual 0:").click()
    assert page.locator("#replay-status").text_content() == "All 4 pens are in use. Remove a trial first."
    assert page.locator("#replay-rows tr").count() == 4


@pytest.mark.slow
def test_conditions_can_be_compared(show):
    page = show(reduced_motion="reduce")
    page.locator("#replay-across").click()
    names = [name.split("/")[0] for name in page.locator("#replay-rows .trial").all_text_contents()]
    assert names == ["coverage", "novelty", "turn", "ends"]
    page.locator("#replay-condition").select_option(
        label=page.locator("option", has_text="turn").text_content()
    )
    page.locator("#replay-bests").click()
    names = page.locator("#replay-rows .trial").all_text_contents()
    assert [re.sub(r"/\d+/(\d+)/\d+", r" \1", name) for name in names] == ["turn 0", "turn 1", "turn 2"]


# links


@pytest.mark.slow
def test_a_link_leads_to_what_was_seen(show, trials):
    links = [trials("novelty", 1, 2)[0], trials("ends", 2, 7)[0]]
    page = show(f"#replay={','.join(links)}@17")
    assert page.locator("#replay-rows .trial").all_text_contents() == links
    assert step_of(page) == 17
    assert page.locator("#replay-link").get_attribute("href") == f"#replay={','.join(links)}@17"
    assert page.locator("#replay-arena").bounding_box()["y"] < DESKTOP[1], "the replay is in view"
    page.evaluate(f"location.hash = '#replay={links[1]}'")
    page.wait_for_function("() => document.querySelectorAll('#replay-figure .rg-robot').length == 1")
    assert step_of(page) == 30


@pytest.mark.slow
@pytest.mark.parametrize(
    "fragment", ["#replay=nothing/0/0/0", "#replay=%", "#replay=", "#replay=a@b@c,,", "#x"]
)
def test_a_link_that_leads_nowhere_leaves_the_page_as_it_is(show, fragment):
    page = show(fragment, reduced_motion="reduce")
    assert page.locator("#replay-figure .rg-robot").count() == 1
    assert step_of(page) == 0
    if "nothing" in fragment:
        assert "Not on this page: nothing/0/0/0" in page.locator("#replay-status").text_content()


# keyboard and accessibility


@pytest.mark.slow
def test_everything_works_by_keyboard(show):
    page = show(reduced_motion="reduce")
    page.locator("#replay-stage").focus()
    for key, step in [
        ("Home", 0),
        ("ArrowRight", 1),
        ("Shift+ArrowRight", 11),
        ("ArrowLeft", 10),
        ("Shift+ArrowLeft", 0),
        ("End", 30),
    ]:
        page.keyboard.press(key)
        assert step_of(page) == step
    page.keyboard.press("Home")
    page.keyboard.press("Space")
    assert page.locator("#replay-play").text_content().strip() == "Pause"
    page.keyboard.press("Space")
    assert page.locator("#replay-play").text_content().strip() == "Play"
    page.keyboard.press("+")
    assert page.locator("#replay-speed").input_value() == "2"
    page.keyboard.press("-")
    page.keyboard.press("-")
    assert page.locator("#replay-speed").input_value() == "0.5"
    page.locator("#replay-scrub").focus()
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    assert step_of(page) == 1


@pytest.mark.slow
def test_tab_passes_through_and_focus_shows(show):
    page = show(reduced_motion="reduce")
    page.locator("#replay-stage").focus()
    visited = []
    for _ in range(40):
        page.keyboard.press("Tab")
        visited.append(
            page.evaluate(
                "() => { const at = document.activeElement; return ["
                "at.id || at.closest('[id]').id, getComputedStyle(at).outlineStyle,"
                "Boolean(at.closest('#replay-figure'))]; }"
            )
        )
        if not visited[-1][2]:
            break
    assert not visited[-1][2], "focus leaves the replay"
    inside = [each for each in visited if each[2]]
    assert [name for name, _, _ in inside].count("replay-matrix") == 1, "one stop for all trials"
    assert {"replay-scrub", "replay-play", "replay-speed", "replay-condition", "replay-link"} <= {
        name for name, _, _ in inside
    }
    assert all(outline != "none" for _, outline, _ in inside)


@pytest.mark.slow
def test_arrows_lead_through_the_trials(show):
    page = show(reduced_motion="reduce")
    page.locator("#replay-clear").click()
    page.get_by_role("button", name="All of generation 0").focus()
    for key in ("ArrowRight", "ArrowRight", "ArrowDown", "Enter"):
        page.keyboard.press(key)
    assert page.locator("#replay-rows .trial").text_content().endswith("/1/1")
    assert page.evaluate("() => document.activeElement.getAttribute('aria-pressed')") == "true"
    page.keyboard.press("End")
    page.keyboard.press("Space")
    assert page.locator("#replay-rows tr").count() == 2
    assert page.locator("#replay-play").text_content().strip() == "Play"


@pytest.mark.slow
def test_every_control_and_picture_has_a_name(show):
    page = show(reduced_motion="reduce")
    page.locator("#replay-across").click()
    nameless = page.evaluate(
        """() => [...document.querySelectorAll(
            'button, input, select, svg:not([aria-hidden]), [role=group], [role=region]')]
        .filter(each => !(each.getAttribute('aria-label') || each.textContent.trim() || each.labels?.length
            || document.getElementById(each.getAttribute('aria-labelledby'))?.textContent.trim()))
        .map(each => each.outerHTML.slice(0, 80))"""
    )
    assert nameless == []
    ids = page.evaluate("() => [...document.querySelectorAll('[id]')].map(each => each.id)")
    assert len(set(ids)) == len(ids)
    assert "coverage" in page.locator("#replay-arena").get_attribute("aria-label")


def luminance(color: str) -> float:
    shares = [int(color[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    linear = [share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares]
    return float(np.dot(linear, [0.2126, 0.7152, 0.0722]))


@pytest.mark.slow
def test_colors_of_both_themes_differ_and_have_enough_contrast(show):
    page = show()
    colors = []
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        check_contrast(page)
        colors.append(
            page.evaluate(
                "() => ['.rg-walls', '.rg-trail'].map(name => getComputedStyle(document.querySelector(name)).stroke)"
                ".concat(getComputedStyle(document.body).backgroundColor)"
            )
        )
    assert all(light != dark for light, dark in zip(*colors, strict=True))


def check_contrast(page) -> None:
    def contrast(first: str, second: str) -> float:
        style = "getComputedStyle(document.documentElement)"
        colors = [
            page.evaluate(f"() => {style}.getPropertyValue('--{name}').trim()") for name in (first, second)
        ]
        colors = [re.sub(r"^#(.)(.)(.)$", r"#\1\1\2\2\3\3", color) for color in colors]
        low, high = sorted(map(luminance, colors))
        return (high + 0.05) / (low + 0.05)

    for ink in ("text", "muted", "accent"):
        for ground in ("ink-ground", "ground", "card"):
            assert contrast(ink, ground) >= 4.5, (ink, ground)
    assert contrast("ink-text", "ink-band") >= 4.5, "numbers on the darkest trial"
    assert contrast("ink-ground", "accent") >= 4.5, "the play button"
    assert contrast("ink-reach", "ink-ground") >= 4.5, "blocked"
    for pen in range(8):
        assert contrast(f"ink-pen{pen}", "ink-ground") >= 3.0, pen


# sizes, schemes, print, motion, names


@pytest.mark.slow
def test_the_page_is_not_wider_than_the_window(show):
    page = show(reduced_motion="reduce")
    page.get_by_role("button", name="All of generation 0").click()
    for width, height in (DESKTOP, PHONE, (320, 640)):
        page.set_viewport_size({"width": width, "height": height})
        assert page.evaluate("() => document.documentElement.scrollWidth") <= width
        if width < DESKTOP[0]:
            boxes = page.locator("#replay-figure button:visible").evaluate_all(SIZES)
            assert boxes
            assert all(width >= 24 and height >= 24 for width, height in boxes), "large enough for a finger"


@pytest.mark.slow
def test_touch_plays(show):
    page = show(size=PHONE, has_touch=True, is_mobile=True)
    page.locator("#replay-first").tap()
    page.locator("#replay-play").tap()
    page.wait_for_function("() => document.querySelector('#replay-scrub').value > 0")
    page.locator("#replay-play").tap()
    assert page.evaluate("() => document.documentElement.scrollWidth") <= PHONE[0]


@pytest.mark.slow
def test_a_replay_in_use_does_not_start_by_itself(show):
    page = show(size=(PHONE[0], 80))
    page.locator("#replay-first").dispatch_event("pointerdown")
    page.set_viewport_size({"width": DESKTOP[0], "height": DESKTOP[1]})
    page.locator("#replay-stage").scroll_into_view_if_needed()
    page.wait_for_timeout(300)
    assert page.locator("#replay-play").text_content().strip() == "Play"


@pytest.mark.slow
def test_print_is_a_still(show):
    page = show(color_scheme="dark")
    page.emulate_media(media="print")
    assert page.locator("#replay-arena").is_visible()
    assert page.locator("#replay-rows").is_visible()
    assert not page.locator("#replay-play").is_visible()
    assert not page.locator("#replay-matrix").is_visible()
    assert page.evaluate("() => getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert page.pdf()[:5] == b"%PDF-"


@pytest.mark.slow
def test_reduced_motion_goes_from_step_to_step(show, trials):
    name, trajectory = trials("coverage", 2, 0)
    page = show(f"#replay={name}@0", reduced_motion="reduce")
    poses = []
    page.evaluate(
        """() => {
            window.seen = new Set();
            const robot = () => document.querySelector('#replay-figure .rg-robot');
            new MutationObserver(() => window.seen.add(robot().getAttribute('transform')))
                .observe(document.querySelector('#replay-arena'), {subtree: true, attributes: true});
        }"""
    )
    page.locator("#replay-play").click()
    page.wait_for_function("() => document.querySelector('#replay-scrub').value > 8")
    page.locator("#replay-play").click()
    poses = page.evaluate("() => [...window.seen]")
    assert poses
    steps = [(1000 * x + MARGIN, -np.degrees(heading)) for x, _, heading in trajectory.poses]
    for pose in poses:
        x, _, turn = (float(number) for number in re.findall(r"-?\d+\.\d+", pose))
        assert any(abs(x - at) <= NEAR_MM and abs(turn - angle) <= NEAR_DEG for at, angle in steps)


@pytest.mark.slow
def test_the_page_without_a_script_says_so(show):
    page = show(java_script_enabled=False)
    assert page.get_by_text("needs JavaScript, which does not run here").is_visible()
    assert page.locator("#replay-without .rg-trail").is_visible()
    assert not page.locator("#replay-stage").is_visible()


@pytest.mark.slow
def test_page_in_a_browser_that_cannot_unpack_trials_says_so(show, page_file):
    page = show()
    page.add_init_script("delete globalThis.DecompressionStream")
    page.goto(page_file.as_uri())
    assert page.get_by_text("This browser cannot unpack the trials.").is_visible()
    assert page.locator("#replay-without .rg-trail").is_visible()
    assert not page.locator("#replay-stage").is_visible()


@pytest.mark.slow
def test_hostile_names_stay_text(show, tiny_study, monkeypatch, tmp_path):
    pack = _replay._pack_run

    def rename(*arguments: Any) -> Any:
        run = pack(*arguments)
        run.data["name"] = run.data["label"] = EVIL + run.data["name"]
        return run

    monkeypatch.setattr(_replay, "_pack_run", rename)
    page = show(file=write_report(tiny_study, tmp_path / "evil.html"))
    page.locator("#replay-across").click()
    assert page.locator("#replay-rows .trial").first.text_content().startswith(EVIL)
    assert page.locator("img").count() == 0
    link = page.locator("#replay-link").get_attribute("href")
    before = page.locator("#replay-rows .trial").all_text_contents()
    page.locator("#replay-clear").click()
    page.evaluate("link => { location.hash = link; }", link)
    page.wait_for_function("() => document.querySelectorAll('#replay-figure .rg-robot').length == 4")
    assert page.locator("#replay-rows .trial").all_text_contents() == before


SEVERAL = """
[study]
name = "several"
replicates = 1

[arena]
robots = 3

[neat]
population = 4
generations = 2

[platform.sim]
steps = 12

[[condition]]
name = "one"
platform = "sim"
"""


@pytest.mark.slow
def test_all_robots_of_a_trial_are_replayed(show, tmp_path) -> None:
    folder = run_study(parse_study(SEVERAL, "several.toml"), tmp_path / "r").folder
    condition = Condition.from_settings("one", dict(folder.description["conditions"][0]["settings"]))
    row = next(folder.read("one").filter(pl.col("generation") == 1).iter_rows(named=True))
    trial = replay(condition, row)
    page = show("#replay=one/0/1/0@12", file=write_report(folder))
    robots = page.locator("#replay-figure .rg-robot")
    assert robots.count() == 3
    assert page.locator(".rg-robot text, #replay-rows tr").count() == 1
    places = [
        tuple(map(float, re.findall(r"-?[\d.]+", robots.nth(k).get_attribute("transform"))[:2]))
        for k in range(3)
    ]
    for k, robot in enumerate(trial.robots):
        moved = np.subtract(robot.poses[-1, :2], trial.poses[-1, :2]) * [1000, -1000]
        assert np.subtract(places[k], places[0]) == pytest.approx(moved, abs=2 * NEAR_MM)
    assert numbers(page)[0][10:] == [round(trial.coverage_line, 3), round(trial.coverage_ends, 3)]
