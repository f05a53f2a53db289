"""Every page of the lab in its states: readable at each size and in both themes, and usable by keyboard."""

from __future__ import annotations

import re

import pytest

from realitygap.emulator import serve_tcp
from realitygap.families.scribbler.emulator import Emulator
from realitygap.study import parse_study, run_study

from .conftest import enter, open_advanced, open_fold
from .page_checks import SIZES, faults, keyboard, states, watch_states
from .robot_study import await_trial, begin_sitting, make_study
from .sheets import drive_sheet, photo_of

pytestmark = pytest.mark.slow

TEXT = """
[study]
name = "seen"
replicates = 3

[[condition]]
name = "novelty-10"
selection = "novelty"
"""


@pytest.fixture
def look(visit):
    """Opens a page: look("robot"). Nothing in it moves, because a browser needs much time to draw motion."""
    return lambda path, **options: visit(path, bypass_csp=True, reduced_motion="reduce", **options)


def test_pages_without_a_study_are_accessible(lab, look):
    for path, text in (
        ("", "No studies yet."),
        ("new", "Start study"),
        ("calibrate", "No calibrations yet."),
        ("gap", "Measure"),
        ("robot", "No robot connected."),
        ("nonsense", "There is no page here."),
        ("broken", "This page cannot be shown: "),
    ):
        page = look(path, forgive=["404", "500"])
        page.get_by_text(text).first.wait_for()
        assert faults(page, lab.root) == [], path
        assert keyboard(page) == [], path
        if path == "new":  # the page with a bar at its lower edge
            assert keyboard(page, SIZES["zoom of 200 %"]) == []


def test_a_gap_with_a_mistake_while_it_is_measured_and_its_result(lab, look):
    page = look("gap")
    enter(page, "Simulator", "sim:/etc/passwd")
    page.get_by_role("button", name="Measure the gap").click()
    page.locator(".lab-field .lab-problem", has_text="outside").wait_for()
    assert faults(page, lab.root) == []
    enter(page, "Simulator", "sim")
    page.get_by_label("Trials per controller").fill("3")
    page.get_by_role("button", name="Measure the gap").click()
    page.get_by_role("button", name="Stop", exact=True).wait_for()
    assert faults(page, lab.root) == []
    page.get_by_text("Complete.", exact=True).wait_for()
    assert faults(page, lab.root) == []


def test_a_study_that_runs_and_is_watched_played_and_extended(lab, look):
    home = look("")
    watch_states(home)
    run_study(parse_study(TEXT, "study.toml"), lab.root / "seen")
    page = look("study/seen")
    watch_states(page)
    page.locator(".lab-figure img").nth(4).wait_for()
    assert faults(page, lab.root) == []
    assert keyboard(page) == []
    page.get_by_role("button", name="Add runs").click()
    page.get_by_label("Runs per condition").fill("5")
    # axe-core takes the backdrop for the background of buttons in the dialog, depending on the panel behind it
    assert [fault for fault in faults(page, lab.root) if "color-contrast" not in fault] == []
    page.get_by_role("button", name="Run", exact=True).click()
    page.get_by_text("5 runs", exact=True).wait_for()
    page.get_by_role("tab", name="Replay").click()
    page.locator(".lab-replay").locator(".rg-player").wait_for()
    assert faults(page, lab.root) == []
    home.locator('[data-study="seen"]').get_by_text("5 runs", exact=True).wait_for()
    assert faults(home, lab.root) == []
    assert states(home) + states(page) == []


def test_trials_that_are_counted_from_a_photo(lab, look):
    lines = drive_sheet(lab.root)
    page = look("study/by-robot/trials")
    page.get_by_label("Your name").fill("anna")
    photo = {"name": "sheet.jpg", "mimeType": "image/jpeg", "buffer": photo_of(lines)}
    page.get_by_label("Choose a photo").set_input_files(photo)
    page.locator("[data-counting] image").wait_for()
    page.get_by_text("Score from a video").click()
    page.get_by_label("Tags").wait_for()
    assert faults(page, lab.root) == []


def test_pages_of_a_connected_robot_are_accessible(lab, look):
    make_study(lab.root)
    page = look("study/by-robot/trials")
    begin_sitting(page)
    await_trial(page, 1)
    assert faults(page, lab.root) == []
    assert keyboard(page) == []
    open_fold(page, "Robot")
    page.get_by_role("button", name="Disconnect").click()
    page.get_by_role("button", name="Connect robot").wait_for()
    robot = look("robot")
    with serve_tcp(Emulator("s2"), speed=20) as server:
        robot.get_by_text("Another port").click()
        robot.get_by_label("Port", exact=True).fill(server.name)
        robot.get_by_role("button", name="Connect", exact=True).click()
        robot.get_by_text("Battery").wait_for()
        assert faults(robot, lab.root) == []
        assert keyboard(robot) == []
        watcher = look("robot")
        watcher.get_by_role("button", name="Request control").wait_for()
        assert faults(watcher, lab.root) == []
    robot.get_by_text(re.compile(r"Last reading \d+\ss ago")).wait_for()
    assert faults(robot, lab.root) == []


def test_pages_of_a_running_and_of_a_finished_calibration_are_accessible(lab, look):
    page = look("calibrate")
    page.get_by_role("button", name="Next").click()
    assert keyboard(page) == []
    open_advanced(page, page.get_by_label("Number of trials"))
    page.get_by_label("Number of trials").fill("4")
    page.get_by_role("button", name="Calibrate", exact=True).click()
    page.locator(".lab-plot text").first.wait_for()
    assert faults(page, lab.root) == []
    inks = []
    for theme in ("light", "dark"):
        page.emulate_media(color_scheme=theme)
        inks.append(page.locator(".lab-plot text").first.evaluate("text => getComputedStyle(text).fill"))
    assert inks == ["rgb(28, 31, 36)", "rgb(230, 232, 235)"]
    page.emulate_media(color_scheme="light")
    page.get_by_role("button", name="Use in a study").wait_for()
    assert faults(page, lab.root) == []
