"""Saved trials of a gap, listed, corrected, voided, and annotated at their page."""

from __future__ import annotations

from dataclasses import replace
from datetime import date

import pytest

from realitygap.lab._saved import saved_files
from realitygap.records import (
    LEDGER_NAME,
    Ledger,
    open_ledger,
    open_saved_trials,
    read_observations,
    write_observations,
)
from tests.records.test_observations_file import HEAD, trial

from .conftest import expect

pytestmark = pytest.mark.slow


def test_saved_trials_are_listed_corrected_voided_and_annotated(lab, visit):
    file = lab.root / "gaps" / "first one.sqlite"
    file.parent.mkdir(parents=True)
    with open_saved_trials(file, HEAD) as ledger:
        for number in range(3):
            ledger.append(replace(trial(number), purpose="controller", cells=(13, 14)))
    page = visit("gap")
    page.get_by_role("link", name="Saved trials").click()
    page.get_by_text(f"the twin worn, 3 trials, {date.today()}", exact=True).wait_for()
    page.get_by_role("link", name="gaps/first one.sqlite").click()
    page.get_by_text("the twin worn, 3 trials").wait_for()
    page.get_by_text("TWIN", exact=True).wait_for()
    row = page.get_by_role("row").nth(2)
    row.get_by_role("checkbox").click()
    page.get_by_role("button", name="Save cells").click()
    named = page.locator(".lab-field", has=page.get_by_label("Your name"))
    named.locator(".lab-problem", has_text="Enter your name first").wait_for()
    expect(named.locator("input")).to_be_focused()
    page.get_by_label("Your name").fill("anna")
    page.wait_for_function("() => document.cookie.includes('anna')")
    page.get_by_role("button", name="Save cells").click()
    page.get_by_text("Trial 2: 2 cells saved.").wait_for()
    page.get_by_label("Note or reason").fill("it was pushed")
    page.get_by_role("button", name="Save note").click()
    page.get_by_text("anna: it was pushed").first.wait_for()
    page.get_by_label("Note or reason").fill("it was pushed")
    page.get_by_role("button", name="Void trial").click()
    page.get_by_text("void: it was pushed").wait_for()
    expect(page.get_by_role("button", name="Void trial")).to_be_disabled()
    with open_ledger(file) as ledger:  # a command that drives
        ledger.append(replace(trial(3), purpose="controller", cells=(13, 14)))
    page.get_by_text("the twin worn, 4 trials").wait_for()
    expect(row.get_by_role("checkbox")).to_be_checked()
    with open_ledger(file, writable=False) as log:
        assert [each.state for each in log.trials()] == ["scored", "void", "scored", "scored"]
    assert {note["who"] for note in read_observations(file).notes} == {"anna"}


def test_only_plain_files_of_trials_in_the_folder_have_a_page(tmp_path):
    root, elsewhere = tmp_path / "lab", tmp_path / "elsewhere.jsonl"
    (root / "gaps").mkdir(parents=True)
    (root / "moved" / "sim").mkdir(parents=True)
    write_observations(elsewhere, HEAD, [])
    write_observations(root / "moved" / "sim" / "select.jsonl", HEAD, [])
    for name in ("own.jsonl", "converted.jsonl", "converted.sqlite"):
        write_observations(root / "gaps" / name, HEAD, [])
    Ledger.create(root / "moved" / LEDGER_NAME).close()
    (root / "gaps" / "link.jsonl").symlink_to(elsewhere)
    (root / "log.jsonl").write_text("{}\n")
    assert sorted(saved_files(root)) == ["gaps/converted.sqlite", "gaps/own.jsonl", "moved/sim/select.jsonl"]
