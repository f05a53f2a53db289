"""A gap measured and planned at its page."""

from __future__ import annotations

import re

import pytest

from realitygap.lab._gap_work import rounds
from realitygap.records import read_observations

from .conftest import open_advanced

pytestmark = pytest.mark.slow


def measure(page, **fields: str) -> None:
    if "Name" in fields:
        open_advanced(page, page.get_by_label("Name", exact=True))
    for label, value in fields.items():
        page.get_by_label(re.compile(f"^{label.replace('_', ' ')}")).first.fill(value)
    page.get_by_role("button", name="Measure the gap").click()


def test_gap_is_measured_with_its_progress_and_mistakes_are_shown_at_their_fields(lab, visit):
    page = visit("gap")
    for fields, problem in (
        ({"Name": "../first"}, "You entered '../first'."),
        ({"Name": "first", "Simulator": "sim:/etc/passwd"}, "would be a file outside"),
        ({"Simulator": "sim", "Target": "nowhere"}, "'nowhere' is no platform"),
        ({"Target": "jyro", "Trials_per_controller": "0"}, "Enter a whole number from 1 to 4096."),
    ):
        measure(page, **fields)
        page.locator(".lab-field .lab-problem", has_text=problem).wait_for()
        page.wait_for_function("() => document.activeElement.classList.contains('lab-summary')")
    assert list(lab.root.iterdir()) == []
    measure(page, Trials_per_controller="3")
    page.get_by_text(re.compile(r"\d+ of 30 trials")).wait_for()
    assert not page.get_by_role("button", name="Measure the gap").is_visible()
    page.get_by_text("Complete.", exact=True).wait_for(timeout=180_000)
    page.reload()
    page.get_by_text("Rank correlation", exact=True).wait_for()
    page.frame_locator("iframe").get_by_text("jyro").first.wait_for()
    assert len(read_observations(lab.root / "gaps" / "first.jsonl").trials) == 30
    assert (lab.root / "gaps" / "first.html").is_file()


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
