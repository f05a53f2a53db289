"""Home and the form, in a real browser."""

from __future__ import annotations

import re

import pytest

from realitygap.records import ResultsFolder
from realitygap.study import parse_study, run_study

from .conftest import DESKTOP, NEW_PYTHONS, OUTAGE, PHONE, expect, open_advanced
from .robot_study import make_study

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
    page.get_by_label("Study file", exact=True).fill(text)
    page.get_by_role("button", name="Start study").click()


@pytest.mark.slow
@NEW_PYTHONS
def test_a_study_made_with_the_form_is_carried_out_on_a_phone(lab, visit):
    page = visit("", size=PHONE)
    page.get_by_text("No studies yet.").wait_for()
    page.get_by_role("button", name="Create a study").click()
    page.get_by_label("Name", exact=True).first.fill("from-form")
    page.get_by_label("Runs per condition").fill("5")
    page.get_by_role("button", name="Remove condition").last.click()
    open_advanced(page, page.get_by_label("Filter settings"))
    page.get_by_label("Filter settings").fill("generations")
    page.get_by_label("Generations", exact=True).fill("2")
    page.get_by_role("button", name="Start study").click()
    page.wait_for_url("**/study/from-form")
    page.locator(".lab-state", has_text="Complete").wait_for(timeout=120_000)
    folder = ResultsFolder.open(lab.root / "from-form")
    assert folder.description["replicates"] == 5
    assert len(folder.read()) == 5 * 2 * 8


@pytest.mark.slow
def test_name_of_a_condition_follows_its_noise_until_it_is_changed(lab, visit):
    """Noise 7 began a condition called coverage-10."""
    page = visit("new")
    names, noises = page.get_by_label("Name", exact=True), page.get_by_label("Noise", exact=True)
    noises.first.fill("7")
    page.wait_for_function("[...document.querySelectorAll('input')].some(box => box.value == 'coverage-700')")
    names.nth(1).fill("loud")
    noises.first.fill("0.5")
    assert names.nth(1).input_value() == "loud"


@pytest.mark.slow
def test_a_study_from_a_file_is_carried_out_and_extended_and_survives_the_lab(lab, visit):
    page = visit("new", forgive=OUTAGE)
    start(page, TINY)
    page.wait_for_url("**/study/tiny")
    page.locator(".lab-state", has_text="Complete").wait_for(timeout=120_000)
    page.get_by_role("button", name="Add runs").click()
    page.get_by_label("Runs per condition").fill("4")
    page.get_by_role("button", name="Run", exact=True).click()
    page.locator(".lab-field .lab-problem", has_text="Enter a whole number from 5 to 1000000000.").wait_for()
    page.get_by_label("Runs per condition").fill("6")
    page.get_by_role("button", name="Run", exact=True).click()
    page.get_by_text("6 runs", exact=True).wait_for(timeout=120_000)
    assert ResultsFolder.open(lab.root / "tiny").description["replicates"] == 6
    lab.stop()
    lab.start()
    again = visit("")
    again.locator('[data-study="tiny"]').get_by_text("6 runs", exact=True).wait_for()


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
def test_studies_have_a_picture_and_one_primary_action_and_can_be_found(lab, visit):
    page = visit()
    page.get_by_text("No studies yet. Run the paper's study (takes seconds) or create your own.").wait_for()
    assert (
        page.get_by_label("Filter studies").count() == 0
        or not page.get_by_label("Filter studies").is_visible()
    )
    run_study(parse_study(TINY, "study.toml"), lab.root / "tiny")
    make_study(lab.root)
    tiny, robot = (page.locator(f'[data-study="{name}"]') for name in ("tiny", "by-robot"))
    picture = tiny.locator(".lab-thumbnail img")
    picture.wait_for()
    page.wait_for_function("image => image.naturalWidth > 0", arg=picture.element_handle())
    tiny.get_by_text("Median best coverage").wait_for()
    for width, height in (DESKTOP, PHONE):
        page.set_viewport_size({"width": width, "height": height})
        for row, action in ((tiny, "Open"), (robot, "Open trials")):
            primary = row.locator(".q-btn--unelevated")
            expect(primary).to_have_text([re.compile(rf"^\s*{action}\s*$")])
            box = primary.bounding_box()
            assert box["x"] >= 0
            assert box["x"] + box["width"] <= width
    names = page.locator("[data-study]")
    page.get_by_role("combobox", name="Order of studies").click()
    page.get_by_role("option", name="Name").click()
    names.first.and_(robot).wait_for()
    page.get_by_label("Filter studies").fill("TIN")
    robot.wait_for(state="detached")
    expect(names).to_have_count(1)
    page.get_by_label("Filter studies").fill("nonsense")
    page.get_by_text("No study has this text in its name or title.").wait_for()
    other = visit("gap")
    other.get_by_role("button", name="Measure the gap").click()
    page.get_by_role("link", name="Gap sim-jyro").wait_for()
