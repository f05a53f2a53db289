"""A gap measured and planned at its page."""

from __future__ import annotations

import re

import pytest

from realitygap.lab._gap_work import rounds
from realitygap.records import read_observations

pytestmark = pytest.mark.slow


def measure(page, **fields: str) -> None:
    if "Name" in fields and not page.get_by_label("Name", exact=True).is_visible():
        page.get_by_text("Advanced", exact=True).click()
    for label, value in fields.items():
        page.get_by_label(re.compile(f"^{label.replace('_', ' ')}")).first.fill(value)
    page.get_by_role("button", name="Measure the gap").click()


def test_the_report_of_a_gap_grows_until_all_trials_are_done(lab, visit):
    page = visit("gap")
    measure(page, Name="first", Simulator="sim", Target="jyro", Trials_per_controller="3")
    page.get_by_text("Complete.", exact=True).wait_for(timeout=180_000)
    report = page.frame_locator("iframe")
    report.get_by_text("jyro").first.wait_for()
    assert len(read_observations(lab.root / "gaps" / "first.jsonl").trials) == 30
    assert (lab.root / "gaps" / "first.html").is_file()


def test_a_platform_that_cannot_be_is_told_in_words(lab, visit):
    page = visit("gap")
    measure(page, Name="second", Target="nowhere")
    page.locator(".lab-problem", has_text="nowhere").wait_for()


def test_no_platform_is_read_from_outside_the_folder(lab, visit):
    page = visit("gap")
    measure(page, Name="third", Simulator="sim:/etc/passwd")
    page.locator(".lab-problem", has_text="would be a file outside").wait_for()
    measure(page, Name="../third", Simulator="sim")
    page.locator(".lab-problem", has_text="You entered '../third'.").wait_for()
    assert list(lab.root.iterdir()) == []


def test_the_number_of_trials_is_planned(lab, visit):
    page = visit("gap")
    page.get_by_text("How many trials do I need?").click()
    page.get_by_role("button", name="Plan", exact=True).click()
    page.get_by_role("cell", name="50", exact=True).wait_for(timeout=180_000)
    assert page.locator(".lab-plan tr").count() == 7


def test_reports_come_after_2_4_8_trials_and_at_the_end():
    assert rounds(1) == [1]
    assert rounds(2) == [2]
    assert rounds(10) == [2, 4, 8, 10]
