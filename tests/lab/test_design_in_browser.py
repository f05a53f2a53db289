"""The locked design of a study and of saved trials, at their pages: locked, amended, and unblinded."""

from __future__ import annotations

import pytest

from realitygap.errors import StudyError
from realitygap.study import design_report, gap_between

from .conftest import PHONE, enter, expect, open_fold
from .robot_study import FAST, await_trial, make_study, start_trial

pytestmark = pytest.mark.slow


def header(page):
    return page.locator('[data-fold="Design"] .lab-fold')


def disconnect(page):
    """Disconnect the robot, and open the form that connects one."""
    open_fold(page, "Robot")
    page.get_by_role("button", name="Disconnect").click()
    expect(page.locator('[data-fold="Robot"] .lab-fold')).to_contain_text("Connect a robot")
    open_fold(page, "Robot")


def test_sitting_locks_its_design_which_is_amended_and_lists_deviations(lab, visit):
    folder = make_study(lab.root)
    page = visit("study/by-robot/trials", size=PHONE)
    enter(page, "Port", FAST)
    page.get_by_role("switch", name="Lock design").click()
    page.get_by_role("button", name="Connect robot").click()
    page.locator(".lab-field .lab-problem", has_text="Enter your name first").wait_for()
    expect(page.get_by_label("Your name")).to_be_focused()
    page.get_by_label("Your name").fill("anna")
    page.wait_for_function("() => document.cookie.includes('anna')")
    page.get_by_role("button", name="Connect robot").click()
    await_trial(page, 1)
    start_trial(page, 1)
    await_trial(page, 2)
    expect(header(page)).to_contain_text("no deviations")
    locked = design_report(folder)
    assert locked.design.sha256[:8] in header(page).inner_text()
    assert locked.design.lock["who"] == "anna"
    assert locked.design.events[0].n_trials == 0

    other = visit("study/by-robot/trials")
    open_fold(other, "Design")
    other.get_by_text("Only the operator of the robot can change the design.").wait_for()
    expect(other.get_by_role("button", name="Amend design")).to_be_hidden()

    open_fold(page, "Design")
    page.get_by_label("Setting").click()
    page.get_by_role("option", name="replicates").click()
    value = page.get_by_label("New value")
    expect(value).to_have_value("1")
    value.fill("none")
    page.get_by_role("button", name="Amend design").click()
    page.locator(".lab-field .lab-problem", has_text="This field is empty").wait_for()
    page.get_by_label("Reason", exact=True).fill("scores vary more than planned")
    page.get_by_role("button", name="Amend design").click()
    page.locator(".lab-field .lab-problem", has_text="replicates: expected").wait_for()
    assert len(design_report(folder).deviations) == 0
    value.fill("2")
    page.get_by_role("button", name="Amend design").click()
    expect(header(page)).to_contain_text("1 deviation")
    page.get_by_text("scores vary more than planned. replicates: 1 → 2.").wait_for()
    (amended,) = design_report(folder).deviations
    assert amended.startswith("Amended by anna after 1 trial ")
    disconnect(page)
    expect(page.get_by_role("button", name="Connect robot")).to_be_visible()
    expect(page.get_by_role("switch", name="Lock design")).to_be_hidden()


def test_study_with_trials_cannot_be_locked_on_its_page_and_it_says_why(lab, visit):
    make_study(lab.root)
    page = visit("study/by-robot/trials")
    page.get_by_label("Your name").fill("anna")
    enter(page, "Port", FAST)
    page.get_by_role("button", name="Connect robot").click()
    start_trial(page, 1)
    await_trial(page, 2)
    expect(header(page)).to_be_hidden()
    disconnect(page)
    page.get_by_text("The study has trials. A design is locked before the first trial.").wait_for()
    expect(page.get_by_role("switch", name="Lock design")).to_be_disabled()


def test_blind_gap_is_unblinded_with_a_reason_on_the_page_of_its_trials(lab, visit):
    file = lab.root / "gaps" / "blind.sqlite"
    file.parent.mkdir(parents=True)
    with pytest.raises(StudyError, match="blind"):
        gap_between(
            "sim", "sim:scribbler-s1", n_controllers=2, trials=1, observe="cells", results=file, blind=True
        )
    page = visit("saved/gaps/blind.sqlite")
    page.get_by_label("Your name").fill("anna")
    page.wait_for_function("() => document.cookie.includes('anna')")
    open_fold(page, "Design")
    page.get_by_text("Codes of the arms").wait_for()
    page.get_by_role("button", name="Unblind").click()
    dialog = page.get_by_role("dialog")
    dialog.get_by_text("1 of 1 round complete.").wait_for()
    dialog.get_by_role("button", name="Unblind results").click()
    dialog.locator(".lab-field .lab-problem", has_text="This field is empty").wait_for()
    assert design_report(file).design.is_blind
    dialog.get_by_label("Reason").fill("all trials are driven")
    dialog.get_by_role("button", name="Unblind results").click()
    expect(dialog).to_be_hidden()
    expect(page.get_by_role("button", name="Unblind")).to_be_hidden()
    assert not design_report(file).design.is_blind
    assert design_report(file).design.events[-1].details["who"] == "anna"
