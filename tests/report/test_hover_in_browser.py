"""Values on hover, tables on a phone, and print, in a real browser."""

from __future__ import annotations

import re

import polars as pl
import pytest

from realitygap.report import compare_choices, write_report
from realitygap.report._tally import read_tally
from tests.report.results import describe, random_runs, write_results
from tests.report.test_in_browser import DESKTOP, PHONE, page_file, show  # noqa: F401

pytestmark = pytest.mark.slow

WHERE = """([anchor, wide, name, label]) => {
  const { frames, panels } = JSON.parse(document.getElementById('marks').textContent)[anchor];
  const plot = document.querySelector(`#${anchor} .${wide ? 'wide' : 'narrow'}`), svg = plot.querySelector('svg');
  svg.scrollIntoView({ block: 'center' });
  const box = svg.getBoundingClientRect(), scale = box.width / svg.viewBox.baseVal.width;
  const [a, b, c, d] = frames[wide ? 0 : 1][0];
  const [, , ys, xs, labels] = panels[0].series.find((each) => each[1] === name && each[4] && each[4].includes(label));
  const k = labels.indexOf(label);
  return [box.left + (a + b * xs[k]) * scale, box.top + (c + d * ys[k]) * scale];
}"""
"""Where on the screen the mark of a run in the figure of the best coverages is."""


@pytest.fixture(scope="module")
def runs(tiny_study, tmp_path_factory) -> pl.DataFrame:
    """The data of a figure, as it is exported with the page."""
    folder = tmp_path_factory.mktemp("exported")
    write_report(tiny_study, folder / "page.html", figures=folder / "figures")
    return pl.read_csv(folder / "figures" / "data-coverage-by-run.csv")


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_hover_on_a_run_shows_its_number_and_the_value_of_the_csv(show, runs, size):  # noqa: F811
    touch = size == PHONE
    page = show(size=size, reduced_motion="reduce", has_touch=touch)
    for condition, run, value in runs.select("condition", "replicate", "line").iter_rows():
        if condition == "turn":
            x, y = page.evaluate(WHERE, ["figure-bests", not touch, condition, str(run)])
            page.touchscreen.tap(x, y) if touch else page.mouse.move(x, y)
            text = page.locator("#figure-bests .tip").text_content()
            median = runs.filter(pl.col("condition") == condition)["line"].median()
            if value != median:  # a dot under the mark of the median is reached by the keyboard
                assert text.removesuffix(" (click to replay)") == (
                    f"turn, run {run}: best coverage {value:.3f}"
                )
    page.mouse.move(1, 1)


def test_all_marks_of_a_series_are_highlighted_and_leave_with_the_pointer(show):  # noqa: F811
    page = show(reduced_motion="reduce")
    x, y = page.evaluate(WHERE, ["figure-bests", True, "coverage", "0"])
    page.mouse.move(x, y)
    circles = page.locator("#figure-bests .wide .hover").get_attribute("d").count("a2 2")
    assert circles == 2 * 7
    page.mouse.move(x, 5)
    assert page.locator(".tip, .hover").count() == 0


def test_arrow_keys_step_through_all_marks_and_are_read_aloud(show, tiny_study):  # noqa: F811
    page = show(reduced_motion="reduce")
    plot = page.locator("#figure-coverage .wide")
    plot.focus()
    texts = []
    for key in ("ArrowRight", "ArrowRight", "ArrowDown", "ArrowRight", "ArrowLeft", "ArrowUp"):
        page.keyboard.press(key)
        texts.append(page.locator("#figure-coverage .tip").text_content())
        assert page.locator("#marks-live").text_content() == texts[-1]
    best = read_tally(tiny_study).generation_bests("coverage", "line")
    assert texts[2] == f"coverage, run 0, generation 1: {best[0, 1]:.3f}"
    assert texts[3] == f"coverage, run 0, generation 2: {best[0, 2]:.3f}"
    assert texts[4] == texts[2]
    assert texts[5] == texts[1]
    assert re.fullmatch(r"coverage, generation 0: median 0\.\d{3} \[0\.\d{3}, 0\.\d{3}\], n = 7", texts[0])
    page.keyboard.press("Escape")
    assert page.locator(".tip").count() == 0


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_a_click_on_a_run_replays_its_best_trial_in_view(show, runs, tiny_study, size):  # noqa: F811
    touch = size == PHONE
    page = show(size=size, reduced_motion="reduce", has_touch=touch)
    median = runs.filter(pl.col("condition") == "novelty")["line"].median()
    for run, value in runs.filter(pl.col("condition") == "novelty").select("replicate", "line").iter_rows():
        if value == median:  # a dot under the mark of the median is reached by the keyboard
            continue
        x, y = page.evaluate(WHERE, ["figure-bests", not touch, "novelty", str(run)])
        for _ in range(2):
            page.touchscreen.tap(x, y) if touch else (page.mouse.move(x, y), page.mouse.click(x, y))
        trial = page.locator("#replay-rows .trial", has_text=f"novelty/{run}/")
        trial.wait_for()
        rows = tiny_study.read("novelty", [run])
        best = rows.row(int(rows["coverage_line"].arg_max()), named=True)
        assert trial.text_content() == f"novelty/{run}/{best['generation']}/{best['individual']}"
        box = page.locator("#replay-arena").bounding_box()
        assert box["y"] >= 0
        assert box["y"] + box["height"] <= size[1]
        page.mouse.move(1, 1)


def test_enter_on_a_run_in_focus_replays_it_and_again(show):  # noqa: F811
    page = show(reduced_motion="no-preference")
    page.locator("#figure-bests .wide").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowDown")
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    text = page.locator("#figure-bests .tip").text_content()
    run = re.match(r"coverage, run (\d+): .* \(click to replay\)", text)[1]
    for _ in range(2):
        page.keyboard.press("Enter")
        page.wait_for_function("() => document.querySelectorAll('#replay-rows tr').length == 1")
        assert page.locator("#replay-rows .trial").text_content().startswith(f"coverage/{run}/")
        page.wait_for_function("() => document.querySelector('#replay-play').textContent.trim() == 'Pause'")
        page.locator("#replay-across").evaluate("button => button.click()")
        assert page.locator("#replay-rows tr").count() == 4


def test_wide_tables_scroll_on_a_phone_and_say_so(show):  # noqa: F811
    page = show(size=PHONE)
    hinted = page.evaluate(
        """() => [...document.querySelectorAll('.scroll')].filter((box) => box.checkVisibility()).map((box) =>
            [box.scrollWidth > box.clientWidth + 1, getComputedStyle(box, '::before').content.includes('sideways')])"""
    )
    assert [wide for wide, _ in hinted] == [says for _, says in hinted]
    assert any(wide for wide, _ in hinted)
    assert page.evaluate("() => document.documentElement.scrollWidth") <= PHONE[0]


def test_print_has_the_first_screen_on_one_page_and_the_last_frame(show):  # noqa: F811
    page = show(color_scheme="dark", size=(720, 1000))
    page.emulate_media(media="print")
    page.wait_for_function("() => document.querySelector('#replay-scrub').value == '30'")
    # A4 within its margins, 178 x 261 mm at 96 dots per inch
    page.set_viewport_size({"width": 672, "height": 986})
    for name in ("#figure-bests", "#replay-arena"):
        box = page.locator(name).bounding_box()
        assert box["y"] + box["height"] <= 986
    assert not page.locator("#replay-play").is_visible()
    page.emulate_media(media="screen")
    page.wait_for_function("() => document.querySelector('#replay-scrub').value != '30'")


EVERY = """(narrow) => {
  const marks = JSON.parse(document.getElementById('marks').textContent);
  return Object.entries(marks).flatMap(([anchor, entry]) => {
  const plot = document.querySelectorAll(`#${anchor} .plot`)[narrow ? 1 : 0], svg = plot.querySelector('svg');
  return (narrow && entry.narrow || entry.panels).flatMap((panel, k) => panel.series.map(([, name, ys, xs]) => {
    svg.scrollIntoView({ block: 'center' });
    const box = svg.getBoundingClientRect(), scale = box.width / svg.viewBox.baseVal.width;
    const [a, b, c, d] = entry.frames[narrow ? 1 : 0][k], x = box.left + (a + b * (xs ? xs[0] : 0)) * scale;
    const y = box.top + (c + d * ys[0]) * scale, at = { clientX: x, clientY: y, pointerType: 'mouse', bubbles: true };
    svg.dispatchEvent(new PointerEvent('pointermove', at));
    return [name, plot.querySelector('.tip')?.textContent, plot.querySelector('.hover')?.getAttribute('d')];
  }));
}); }"""
"""The first mark of each series, with what the pointer shows there."""


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_choices_show_the_median_of_their_row_in_either_form(show, out, size):  # noqa: F811
    words = {"base": "base", "one": "one", "long": "a choice that takes several lines of words " * 3}
    conditions = [
        describe(name, **({} if name == "base" else {"baseline": "base"}), change=words[name])
        for name in words
    ]
    folder = write_results(out, conditions, {name: random_runs(6, seed=k) for k, name in enumerate(words)})
    write_report(folder, out / "page.html")
    found = show(size=size, file=out / "page.html").evaluate(EVERY, size == PHONE)
    medians = {each.change: each.median for (group,) in [compare_choices(folder)] for each in group}
    shown = {name: text for name, text, _ in found if name in medians and text and ": median " in text}
    assert set(shown) == set(medians)
    for name, text in shown.items():
        assert text.startswith(f"{name}: median {medians[name]:.3f} [")
