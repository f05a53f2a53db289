"""A gap measured at its page."""

from __future__ import annotations

import re

import pytest

from realitygap.lab._gap import rounds
from realitygap.records import read_observations
from realitygap.world import Calibration

from .conftest import enter, expect

pytestmark = pytest.mark.slow


TEXTS_ARE_WITHIN = """() => [...document.querySelectorAll('.lab-scatter svg')].every((svg) => {
  const box = svg.getBoundingClientRect();
  const texts = [...svg.querySelectorAll('text')].map((it) => it.getBoundingClientRect());
  const isIn = (low, [a, b], high) => low - 1 <= a && b <= high + 1;
  return texts.length > 6 && texts.every((it) => isIn(box.left, [it.left, it.right], box.right)
    && isIn(box.top, [it.top, it.bottom], box.bottom));
})"""
"""Whether all names and numbers of axes are within their figure."""


def measure(page, **fields: str) -> None:
    for label, value in fields.items():
        enter(page, label.replace("_", " "), value)
    page.get_by_role("button", name="Measure the gap").click()


def test_gap_is_measured_with_its_progress_and_mistakes_are_shown_at_their_fields(lab, visit):
    page = visit("gap")
    for fields, problem in (
        ({"Name": "../first"}, "You entered '../first'."),
        ({"Name": "first", "Simulator": "sim:/etc/passwd"}, "would be a file outside"),
        ({"Simulator": "sim", "Target": "nowhere"}, "'nowhere' is no platform"),
        ({"Target": "scribbler:/dev/rfcomm0"}, "a gap needs a target without an operator"),
        ({"Target": "jyro", "Trials_per_controller": "0"}, "Enter a whole number from 1 to 4096."),
    ):
        measure(page, **fields)
        page.locator(".lab-field .lab-problem", has_text=problem).wait_for()
        page.wait_for_function("() => document.activeElement.ariaInvalid === 'true'")
    assert list(lab.root.iterdir()) == []
    page.get_by_label("Controllers", exact=True).fill("10")
    page.get_by_label("Trials per controller").fill("3")
    page.get_by_text(
        "Needs 30 trials on the target. With these, mean differences in coverage above"
    ).wait_for()
    page.get_by_role("button", name="Measure the gap").click()
    page.get_by_text("sim → jyro · 10 controllers · 3 trials each").wait_for()
    expect(page.get_by_role("button", name="Measure the gap")).to_have_count(0)
    assert not page.get_by_label("Simulator").is_visible()
    page.get_by_text(re.compile(r"\d+ of 30 trials")).wait_for()
    page.get_by_text("Complete.", exact=True).wait_for(timeout=180_000)
    page.reload()
    page.get_by_text("Rank correlation", exact=True).wait_for()
    for trials in (2, 3):  # one interval for each report
        page.get_by_text(f"{trials} trials", exact=True).wait_for()
    terms = page.locator(".lab-facts dt", has_text=re.compile("^Rank correlation$"))
    assert re.fullmatch(r"−?\d\.\d{3} \[−?\d\.\d{3}, −?\d\.\d{3}\]", terms.locator("+ dd").inner_text())
    scatter = page.locator(".lab-scatter svg")
    words = page.locator(".lab-scatter .lab-curves-words")
    expect(scatter.locator("rect")).to_have_count(10)
    for width in (390, 1440):
        page.set_viewport_size({"width": width, "height": 900})
        expect(page.locator(".lab-scatter svg text").first).to_be_visible()
        page.wait_for_function(TEXTS_ARE_WITHIN)
    scatter.locator("rect").nth(4).hover()
    words.get_by_text(
        re.compile(r".+: \d\.\d{3} \[\d\.\d{3}, \d\.\d{3}\] on sim \(SIM\), .* on jyro \(SIM\)")
    ).wait_for()
    scatter.focus()
    read = set()
    for _ in range(10):
        page.keyboard.press("ArrowRight")
        read.add(words.inner_text().partition(":")[0])
    assert len(read) >= 6  # from the one at which the pointer was
    page.frame_locator("iframe").get_by_text("jyro").first.wait_for()
    assert len(read_observations(lab.root / "gaps" / "first.sqlite").trials) == 30
    assert (lab.root / "gaps" / "first.html").is_file()
    for fields, problem in (
        ({"Name": "first", "Target": "sim"}, "The gap first has other settings (Target)."),
        ({"Target": "jyro", "Trials_per_controller": "2"}, "has 10 controllers with 3 trials each"),
    ):
        measure(page, **fields)  # nothing overwrites a report
        page.locator(".lab-field .lab-problem", has_text=problem).wait_for()


@pytest.mark.long
def test_gap_is_closed_by_a_button_and_its_report_shows_both_gaps(lab, visit):
    page = visit("gap")
    page.get_by_label("Controllers", exact=True).fill("5")
    page.get_by_label("Trials per controller").fill("2")
    measure(page, Target="sim", Name="first")
    page.get_by_role("button", name="Close the gap").click(timeout=120_000)
    page.get_by_text("Gap first-closed", exact=True).wait_for()
    page.get_by_text("Complete.", exact=True).wait_for(timeout=300_000)
    report = page.frame_locator("iframe")
    report.get_by_text("before and after a calibration with 20 trials").first.wait_for()
    expect(report.locator(".motion .rg-player")).to_have_count(2)
    assert page.get_by_role("button", name="Close the gap").count() == 0
    expect(page.locator(".lab-scatter svg")).to_have_count(2)  # before and after, on the same axes
    page.wait_for_function(TEXTS_ARE_WITHIN)
    page.get_by_text("coverage on sim with fit (SIM)").wait_for()
    ticks = page.locator(".lab-scatter").evaluate_all(
        "all => all.map((it) => [...it.querySelectorAll('[text-anchor=end]')].map((tick) => tick.textContent).join())"
    )
    assert ticks[0] == ticks[1]
    page.get_by_role("link", name="first-closed", exact=True).wait_for()  # without a reload
    assert (lab.root / "gaps" / "first-closed" / "fit.toml").is_file()


def test_gap_of_a_calibrated_simulator_is_explained_by_a_button(lab, visit):
    calibration = Calibration(
        kind="path", robot="scribbler-s2-fluke2", target="twin", label="TWIN", observe="cells", trials=10,
        date="2026-01-01", method="known", numbers={"drive.track": 0.16},
    )  # fmt: skip
    (lab.root / "fit.toml").write_text(calibration.to_toml())
    page = visit("gap")
    page.get_by_label("Controllers", exact=True).fill("3")
    page.get_by_label("Trials per controller").fill("2")
    measure(page, Simulator="sim:fit.toml", Target="sim", Name="first")
    page.get_by_role("button", name="Explain the gap").click()
    expect(page.get_by_role("button", name="Explain the gap")).to_have_count(0)
    page.get_by_text("Complete.", exact=True).wait_for()
    page.frame_locator("iframe").locator("#why").wait_for(state="attached")  # in a fold of the report


def test_reports_come_after_2_4_8_trials_and_at_the_end():
    assert rounds(1) == [1]
    assert rounds(2) == [2]
    assert rounds(10) == [2, 4, 8, 10]
