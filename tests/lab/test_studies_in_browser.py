"""Home and the form, in a real browser."""

from __future__ import annotations

import pytest

from realitygap.records import ResultsFolder

from .conftest import OUTAGE, PHONE

TINY = """
[study]
name = "tiny"
title = "A tiny study"
replicates = 4

[neat]
generations = 2

[[condition]]
name = "one"
"""


def start(page, text: str) -> None:
    page.get_by_role("tab", name="File").click()
    page.get_by_label("The study file").fill(text)
    page.get_by_role("button", name="Start the study").click()


@pytest.mark.slow
def test_a_study_made_with_the_form_is_carried_out_on_a_phone(lab, visit):
    page = visit("", size=PHONE)
    page.get_by_text("No study is here yet.").wait_for()
    page.get_by_role("button", name="Start a new study").click()
    page.get_by_label("name", exact=True).first.fill("from-form")
    page.get_by_label("replicates").fill("5")
    page.get_by_role("button", name="Take this condition out").last.click()
    page.get_by_text("NEAT", exact=True).click()
    page.get_by_label("generations", exact=True).fill("2")
    page.wait_for_timeout(600)  # a field waits a moment for more letters
    page.get_by_role("button", name="Start the study").click()
    card = page.locator('[data-study="from-form"]')
    card.get_by_text("complete", exact=True).wait_for(timeout=120_000)
    folder = ResultsFolder.open(lab.root / "from-form")
    assert folder.description["replicates"] == 5
    assert len(folder.read()) == 5 * 2 * 8


@pytest.mark.slow
def test_a_study_from_a_file_is_carried_out_and_survives_the_lab(lab, visit):
    page = visit("new", forgive=OUTAGE)
    start(page, TINY)
    card = page.locator('[data-study="tiny"]')
    card.get_by_text("complete", exact=True).wait_for(timeout=120_000)
    lab.stop()
    lab.start()
    again = visit("")
    again.locator('[data-study="tiny"]').get_by_text("4 of 4 simulated runs").wait_for()


def test_mistakes_are_told_and_nothing_is_begun(lab, visit):
    page = visit("new")
    start(page, TINY.replace("generations", "generatoins"))
    page.get_by_text("Did you mean 'generations'?").wait_for()
    assert list(lab.root.iterdir()) == []


@pytest.mark.slow
def test_a_study_file_that_is_no_text_is_refused(lab, visit):
    page = visit("new")
    page.locator('input[type="file"]').set_input_files(
        files=[{"name": "a.toml", "mimeType": "text/plain", "buffer": b"\xff\xfe\x00"}]
    )
    page.get_by_text("This is not a text file in UTF-8").wait_for()


@pytest.mark.slow
def test_no_study_reads_files_outside_the_folder(lab, visit):
    page = visit("new")
    start(page, TINY + '\n[arena]\nfile = "/etc/passwd"\n')
    page.get_by_text("would be a file outside").wait_for()
    assert list(lab.root.iterdir()) == []


@pytest.mark.slow
def test_the_stop_is_in_sight_on_every_page(visit):
    for path in ("", "new"):
        page = visit(path, size=PHONE)
        button = page.get_by_role("button", name="Stop the robot")
        button.wait_for()
        box = button.bounding_box()
        assert box["y"] + box["height"] <= PHONE[1]
        assert box["height"] >= 44
