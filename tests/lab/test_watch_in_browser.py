"""A study watched, and its trials played, in a real browser."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from realitygap.study import parse_study, run_study

from .conftest import DESKTOP, PHONE, expect
from .page_checks import wrong_bars
from .robot_study import SLOW, begin_sitting, make_study, start_trial

pytestmark = pytest.mark.slow

TEXT = """
[study]
name = "seen"
replicates = 6

[[condition]]
name = "coverage-10"

[[condition]]
name = "novelty-10"
selection = "novelty"
"""

SHOWS_NARROW = """k => {
  const image = document.querySelectorAll(".lab-figure img")[k];
  image?.scrollIntoView();
  return image?.naturalWidth > 0 && image.currentSrc.includes("narrow");
}"""
"""Whether figure k is shown in its narrow form; a page that hears of a change draws its figures anew."""


def carry_out(root: Path) -> None:
    run_study(parse_study(TEXT, "study.toml"), root / "seen")


def test_a_study_is_shown_in_figures_and_its_trials_are_played(lab, visit):
    carry_out(lab.root)
    page = visit("study/seen", size=PHONE)
    page.get_by_text("12 runs", exact=True).wait_for()
    page.locator(".lab-figure img").nth(3).wait_for()
    for k in range(page.locator(".lab-figure img").count()):
        page.wait_for_function(SHOWS_NARROW, arg=k)
    page.get_by_role("tab", name="Replay").click()  # the typical run plays without a wish
    player = page.locator(".lab-replay").locator(".rg-player")
    player.wait_for()
    player.locator(".rg-clock", has_text=re.compile("step [1-9]")).wait_for()
    slider = player.get_by_role("slider", name="Step")
    slider.fill("87")
    assert "step 87 of 87" in player.locator(".rg-clock").text_content()


ARCHIVE = """
[study]
name = "maps"
replicates = 2

[neat]
population = 30
generations = 5

[[condition]]
name = "coverage"

[[condition]]
name = "elites"
platform = "sim"
selection = "map-elites"
archive = { descriptor = ["end", "stall_share"], cells = [5, 4, 2] }
"""


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_a_cell_of_an_archive_is_tapped_and_its_trial_plays(lab, visit, size):
    run_study(parse_study(ARCHIVE, "study.toml"), lab.root / "maps")
    page = visit("study/maps", size=size)
    page.get_by_role("tab", name="Replay").click()
    replay = page.locator(".lab-replay")
    replay.locator(".rg-player").wait_for()
    assert replay.locator(".lab-elites").count() == 0  # the first condition has no archive
    page.get_by_label("Condition", exact=True).click()
    page.get_by_role("option", name="elites").click()
    maps = replay.locator(".lab-elites svg")
    maps.nth(1).wait_for()
    assert maps.count() == 2
    elite = maps.first.get_by_role("button").last
    words = elite.get_attribute("aria-label")
    generation, individual = re.search(r"generation (\d+), individual (\d+)", words).groups()
    elite.click()
    title = f"generation {generation}, individual {individual}"
    replay.locator(".rg-player").get_by_text(title).first.wait_for()
    expect(page.get_by_label("Generation", exact=True)).to_have_value(generation)
    expect(page.get_by_label("Individual", exact=True)).to_have_value(individual)
    maps.first.locator("[tabindex='0']").press("ArrowDown")
    page.keyboard.press("Enter")
    focused = page.evaluate("document.activeElement.getAttribute('aria-label')")
    title = re.search(r"generation \d+, individual \d+", focused).group()
    replay.locator(".rg-player").get_by_text(title).first.wait_for()


def test_compare_adds_up_to_three_trials_to_the_one_that_plays(lab, visit):
    carry_out(lab.root)
    page = visit("study/seen")
    page.get_by_role("tab", name="Replay").click()
    replay = page.locator(".lab-replay")
    replay.locator(".rg-player").wait_for()
    assert replay.locator(".rg-names > *").count() == 0  # one trial at first
    run, compare = page.get_by_label("Run", exact=True), page.get_by_role("button", name="Compare")

    def choose(number: int) -> None:
        run.fill(str(number))
        run.press("Tab")
        compare.click()

    for number in (1, 2, 3):
        choose(number)
        replay.locator(".rg-names > *").nth(number).wait_for()
    choose(4)
    page.get_by_role("alert").filter(has_text="4 trials are shown.").wait_for()
    expect(replay.locator(".rg-names > *")).to_have_count(4)
    run.fill("99")
    run.press("Tab")
    page.get_by_role("button", name="Show trial").click()
    page.locator(".lab-problem", has_text="99").wait_for()


def test_condition_of_the_table_filters_both_panels(lab, visit):
    carry_out(lab.root)
    page = visit("study/seen")
    for width, height in (DESKTOP, PHONE):
        page.set_viewport_size({"width": width, "height": height})
        filter_by_the_table(page)


def filter_by_the_table(page) -> None:
    page.locator(".lab-curves polyline").nth(1).wait_for()
    page.locator(".lab-panel .rg-player").wait_for()
    row = page.locator(".lab-choosable tbody tr").nth(1)
    name = row.get_by_role("button").inner_text()
    row.get_by_role("button").click()
    page.get_by_role("button", name="Compare all").wait_for()
    expect(page.get_by_role("combobox", name="Condition").first).to_have_value(name)
    page.locator(".lab-panel .rg-head", has_text=name).wait_for()
    expect(page.locator(".lab-curves g.lab-curve-off")).to_have_count(2)  # a line and its label
    page.locator(".lab-curves > svg").focus()
    page.keyboard.press("ArrowRight")
    assert page.locator(".lab-curves-words").inner_text().startswith(f"{name}, generation 0: 0.")
    row.locator("td").last.click()  # the whole row works; a second press shows all
    page.get_by_role("button", name="Compare all").wait_for(state="hidden")


def test_report_is_written_and_works_in_its_sandbox(lab, visit):
    carry_out(lab.root)
    page = visit("study/seen")
    page.get_by_role("tab", name="Report").click()
    page.get_by_role("button", name="Write report").click()
    link = page.get_by_role("link", name="Open report")
    link.wait_for()
    with page.context.expect_page() as opened:
        link.click()
    report, faults = opened.value, []
    report.wait_for_load_state()
    report.on("console", lambda message: faults.append(message.text))
    report.on("pageerror", lambda error: faults.append(str(error)))
    report.emulate_media(
        reduced_motion="reduce"
    )  # otherwise the replay may start, and the press below pauses it
    report.reload()
    report.get_by_role("heading", name="seen").first.wait_for()
    assert report.evaluate("origin") == "null"
    began = report.locator("#replay-clock").inner_text()
    report.get_by_role("button", name="To the start").click()
    report.locator("#replay-play").click()
    report.wait_for_function(
        "began => document.getElementById('replay-clock').innerText !== began", arg=began
    )
    report.get_by_role("link", name="Link to this view").click()
    assert "#replay=" in report.url
    assert faults == []


def test_whoever_watches_sees_a_trial_while_it_is_driven(lab, visit):
    make_study(lab.root, steps=60)
    page = visit("study/by-robot/trials")
    begin_sitting(page, SLOW)
    start_trial(page, 1)
    watcher = visit("study/by-robot", size=PHONE)
    watcher.get_by_text("Trial 1 is being driven").wait_for()
    line = watcher.locator(".lab-line")
    line.wait_for()
    before = line.get_attribute("points")
    watcher.wait_for_function(
        "before => document.querySelector('.lab-line').getAttribute('points') !== before", arg=before
    )
    assert wrong_bars(watcher, 6) == []


def test_no_file_but_the_report_of_a_study_can_be_read(lab, visit):
    (lab.root / "secret.txt").write_text("secret")
    carry_out(lab.root)
    page = visit("")
    for path in (
        "reports/%2e%2e%2fsecret.txt",
        "reports/secret.txt",
        "reports/seen",
        "gaps/%2e%2e%2fsecret.txt",
    ):
        assert page.request.get(lab.address + path).status == 404
