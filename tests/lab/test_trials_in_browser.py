"""A physical study on an emulated robot, through the page: driven, counted, taken up again."""

from __future__ import annotations

import re
import time
from collections.abc import Callable

import pytest

from .conftest import DESKTOP, OUTAGE, PHONE, expect, open_advanced, open_fold
from .page_checks import covered
from .robot_study import (
    FAST,
    SLOW,
    await_trial,
    begin_sitting,
    count,
    ledger_of,
    make_study,
    start_trial,
    tap,
)
from .sheets import drive_sheet

pytestmark = pytest.mark.slow

PAGE = "study/by-robot/trials"


def wait_for(is_so: Callable[[], bool], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < end, "it did not come about"
        time.sleep(0.1)


def states(lab) -> list[str]:
    with ledger_of(lab.root) as ledger:
        return [trial.state for trial in ledger.trials()]


def test_a_whole_study_is_driven_and_counted_by_taps_on_a_phone(lab, visit):
    make_study(lab.root)
    page = visit(PAGE, size=PHONE, has_touch=True)
    begin_sitting(page)
    await_trial(page, 1)
    assert "coverage-robot" not in page.content(), "counting is blind"
    page.evaluate("scrollTo(0, 0)")
    for action in ("Start trial", "Stop robot"):
        assert covered(page.get_by_role("button", name=action)) == []
    for first in (1, 3):
        start_trial(page, first)
        start_trial(page, first + 1)
        page.get_by_text("To score: 2").wait_for()
        count(page, first, 0, 1, 13)
        count(page, first + 1, 0, 12)
        page.get_by_role("button", name="Close generation").click()
    page.get_by_text("All 4 trials scored.").wait_for()
    with ledger_of(lab.root) as ledger:
        assert [(each.cells, each.is_closed) for each in ledger.trials()] == 2 * [
            ((0, 1, 13), True),
            ((0, 12), True),
        ]
        assert {row["who"] for row in ledger.scores()} == {"anna"}
        assert all(len(ledger.record(number).commands) == 12 for number in range(1, 5))
        assert ledger.conditions()["coverage-robot"]["label"] == "EMULATED"


def name_oneself(page, who: str) -> None:
    """Enter a name, and wait until the card of the trial to score is drawn again for it."""
    page.locator('[data-counting="1"]').evaluate("card => { card.dataset.old = 'yes'; }")
    page.get_by_label("Your name").fill(who)
    page.wait_for_function("() => document.cookie.includes('realitygap_who')")
    page.locator('[data-counting="1"]:not([data-old])').wait_for()


def open_folds(page) -> list[str]:
    page.wait_for_timeout(500)  # until nothing slides any more
    return page.locator("[data-fold].q-expansion-item--expanded").evaluate_all(
        "all => all.map((it) => it.dataset.fold)"
    )


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_only_the_current_step_is_open_and_its_action_is_in_view(lab, visit, size):
    make_study(lab.root, steps=20)
    page = visit(PAGE, size=size)

    def check(step: str, action: str, folds: list[str]) -> None:
        page.locator(".lab-steps [aria-current=step]", has_text=step).wait_for()
        button = page.get_by_role("button", name=action)
        button.wait_for()
        assert open_folds(page) == folds
        assert covered(button) == []

    page.get_by_text("No trials yet. Connect a robot to drive 4 trials.").wait_for()
    check("Place", "Connect robot", ["Robot"])
    begin_sitting(page, "emulator://s2?fluke=2&speed=2")
    await_trial(page, 1)
    check("Place", "Start trial", [])
    page.get_by_role("button", name="Start trial").click()
    check("Drive", "Stop robot" if size == PHONE else "Abort trial", [])
    start_trial(page, 2)
    page.get_by_text("Score the trials").wait_for()
    check("Score: 2", "Save score", ["Score"])
    assert re.search("pen:|sheet [0-9]", page.locator("body").inner_text(), re.IGNORECASE) is None, "no paper"
    assert covered(page.get_by_role("button", name="Stop robot")) == []
    for number in (1, 2):
        count(page, number, 0)
    check("Close", "Close generation", [])


def test_section_that_the_visitor_opened_stays_open_when_the_step_turns(lab, visit):
    make_study(lab.root, steps=40)
    page = visit(PAGE)
    begin_sitting(page, "emulator://s2?fluke=2&speed=4")
    start_trial(page, 1)
    start_trial(page, 2)
    open_fold(page, "Robot")
    page.get_by_text("Score the trials").wait_for()
    page.locator('[data-fold="Score"].q-expansion-item--expanded').wait_for()
    assert open_folds(page) == ["Score", "Robot"]
    page.get_by_role("button", name="Disconnect").click()
    page.locator('[data-fold="Robot"]').get_by_text("Connect a robot").wait_for()


def test_cells_are_marked_and_saved_with_the_keyboard(lab, visit):
    drive_sheet(lab.root)
    page = visit(PAGE)
    name_oneself(page, "anna")
    grid = page.get_by_role("grid", name="Cells crossed in trial 1")
    expect(grid.get_by_role("row")).to_have_count(6)
    page.locator('[data-counting="1"] [data-cell="0"]').focus()
    page.keyboard.press("Enter")
    refused = page.get_by_text("Mark each cell that the line crosses, then save.")
    refused.wait_for()
    page.locator('[data-counting="1"] [data-cell="0"]').focus()
    for key in ("ArrowUp", "ArrowRight", "ArrowRight", "Space"):
        page.keyboard.press(key)
    grid.get_by_role("gridcell", name="column 3, row 2, crossed", exact=True).wait_for()
    assert page.evaluate("document.activeElement.dataset.cell") == "14"
    page.get_by_text("1 of 72 cells").wait_for()
    page.keyboard.press("Enter")
    page.get_by_text("Trial 1: 1 cell saved").wait_for()
    refused.wait_for(state="detached")  # the visitor has acted on it
    with ledger_of(lab.root) as ledger:
        assert ledger.trial(1).cells == (14,)


def test_taps_survive_a_reload_and_a_killed_lab(lab, visit):
    make_study(lab.root)
    page = visit(PAGE, forgive=OUTAGE)
    begin_sitting(page)
    start_trial(page, 1)
    start_trial(page, 2)
    page.get_by_text("Score the trials").wait_for()
    tap(page, 0, 1, 2)
    page.get_by_text("3 of 72 cells").wait_for()
    page.reload()
    page.get_by_text("3 of 72 cells").wait_for()
    tap(page, 14)
    page.get_by_text("4 of 72 cells").wait_for()
    lab.kill()
    lab.start()
    lab.slow_counts()
    page = visit(PAGE)
    page.get_by_label("Your name").fill("anna")
    page.get_by_text("4 of 72 cells").wait_for()
    page.get_by_role("button", name="Save score").click()
    page.get_by_text("Trial 1: 4 cells saved").wait_for()
    assert states(lab) == ["scored", "driven"]


def test_a_lab_killed_in_the_middle_of_a_trial_loses_nothing(lab, visit):
    make_study(lab.root, steps=60)
    page = visit(PAGE, forgive=OUTAGE)
    begin_sitting(page, SLOW)
    start_trial(page, 1)
    page.get_by_text(re.compile(r"Step ([3-9]|[1-4]\d) of 60")).wait_for()
    lab.kill()
    with ledger_of(lab.root) as ledger:
        wait_for(lambda: ledger.trial(1).problem is not None)
        assert ledger.trial(1).state == "running"
        assert 2 < len(ledger.record(1).commands) < 60
    lab.start()
    page = visit(PAGE)
    begin_sitting(page, FAST)
    page.get_by_text("The trial was interrupted").wait_for()
    page.get_by_role("button", name="Void and repeat").click()
    start_trial(page, 3)
    wait_for(lambda: states(lab)[:2] == ["void", "driven"])


def test_a_slow_link_is_shown_before_the_first_trial_and_can_be_driven_anyway(lab, visit):
    make_study(lab.root)
    page = visit(PAGE)
    for answer in ("Cancel", "Drive anyway"):
        begin_sitting(page, f"{FAST}&seed=1&faults=delay=0.4")
        page.locator(".lab-question .lab-problem", has_text="the link is too slow").wait_for()
        page.get_by_role("button", name=answer).click()
        if answer == "Cancel":
            page.get_by_text("nothing was driven").wait_for()
            assert states(lab) == ["planned", "planned"]
    start_trial(page, 1)
    wait_for(lambda: states(lab)[:1] == ["driven"])


def test_an_aborted_trial_stops_the_robot_and_is_asked_about(lab, visit):
    make_study(lab.root, steps=200)
    page = visit(PAGE)
    begin_sitting(page, SLOW)
    start_trial(page, 1)
    page.get_by_text(re.compile(r"Step ([3-9]|\d\d) of 200")).wait_for()
    page.get_by_text(re.compile(r"Entered: \d+ of 72 cells")).wait_for()
    assert page.locator(".lab-sketch .lab-marked").count() > 0
    page.get_by_role("button", name="Stop robot").click()
    page.get_by_text("The trial was interrupted: aborted by the operator").wait_for()
    page.get_by_role("button", name="Count as driven").click()
    wait_for(lambda: states(lab)[0] == "driven")
    with ledger_of(lab.root) as ledger:
        assert ledger.trial(1).end == "aborted"


def test_a_trial_goes_on_when_the_page_goes_away(lab, visit):
    make_study(lab.root, steps=20)
    page = visit(PAGE)
    begin_sitting(page, "emulator://s2?fluke=2&speed=1")
    start_trial(page, 1)
    page.get_by_text(re.compile(r"Step \d+ of 20")).wait_for()
    page.context.close()
    wait_for(lambda: states(lab)[0] == "driven")
    with ledger_of(lab.root) as ledger:
        assert ledger.trial(1).end == "step limit"
    again = visit(PAGE)
    await_trial(again, 2)


def test_robot_changes_hands_when_its_operator_agrees_and_everyone_can_stop_it(lab, visit):
    make_study(lab.root)
    page = visit(PAGE)
    begin_sitting(page)
    await_trial(page, 1)
    other = visit(PAGE)
    other.get_by_text("anna is operating the robot. You are watching.").wait_for()
    assert other.get_by_role("button", name="Start trial").count() == 0
    open_fold(page, "All trials")
    page.set_viewport_size({"width": PHONE[0], "height": 400})
    for answer in ("Keep", "Hand over"):
        page.evaluate("scrollTo(0, document.body.scrollHeight)")
        other.get_by_role("button", name="Request control").click()
        other.get_by_text("You requested control.").wait_for()
        page.get_by_text("requests control of the robot.").wait_for()
        assert covered(page.get_by_role("button", name=answer, exact=True)) == []
        page.get_by_role("button", name=answer, exact=True).click()
        if answer == "Keep":
            other.get_by_text("anna keeps the robot.").wait_for()
    page.get_by_text("is operating the robot. You are watching.").wait_for()
    start_trial(other, 1)
    page.get_by_role("button", name="Stop robot").click()
    page.get_by_role("button", name="Robot stopped").wait_for()


def test_two_people_count_and_their_agreement_is_told(lab, visit):
    drive_sheet(lab.root)
    page = visit(PAGE)
    name_oneself(page, "anna")
    count(page, 1, 0, 1)
    other = visit(PAGE)
    other.get_by_label("Your name").fill("ben")
    other.get_by_text("To score a second time: 1").wait_for()
    other.get_by_role("button", name="Trial 1", exact=True).last.click()
    other.get_by_text("You do not see the first one.").wait_for()
    assert other.locator("[data-counting] .lab-marked").count() == 0
    count(other, 1, 0, 1, 2)
    open_fold(other, "All trials")
    other.get_by_text("1 trial counted by two people, 72 cells: 98.6 % judged alike.").wait_for()
    other.locator(".lab-table .lab-label-emulated").first.wait_for()


def test_a_void_trial_needs_a_reason_and_is_driven_again(lab, visit):
    make_study(lab.root)
    page = visit(PAGE)
    begin_sitting(page)
    start_trial(page, 1)
    start_trial(page, 2)
    page.get_by_text("Score the trials").wait_for()
    page.get_by_text("Note or void").click()
    page.get_by_role("button", name="Void trial").click()
    page.get_by_text("Give a reason.").wait_for()
    page.get_by_label("Note or reason").fill("the pen fell out")
    page.get_by_role("button", name="Void trial").click()
    wait_for(lambda: states(lab) == ["void", "planned", "driven"])
    count(page, 2, 0, 1)
    start_trial(page, 3)
    wait_for(lambda: states(lab) == ["void", "driven", "scored"])


def test_the_arena_is_drawn_where_cells_are(lab, visit):
    """A tap on the lower left of the grid is cell 0, and the highest row is the last."""
    drive_sheet(lab.root)
    page = visit(PAGE)
    name_oneself(page, "anna")
    page.wait_for_timeout(800)  # the page brings the grid into view
    page.get_by_role("button", name="Save score").scroll_into_view_if_needed()
    first, last = (page.locator(f'[data-counting] [data-cell="{cell}"]').bounding_box() for cell in (0, 71))
    assert first["x"] < last["x"]
    assert first["y"] > last["y"]
    page.mouse.move(first["x"] + 5, first["y"] + 5)
    page.mouse.down()
    page.mouse.move(first["x"] + 3.5 * first["width"], first["y"] + 5, steps=20)
    page.mouse.up()
    page.get_by_text("4 of 72 cells").wait_for()


def test_the_witness_of_an_emulator_counts_by_itself(lab, visit):
    make_study(lab.root)
    page = visit(PAGE)
    open_advanced(page, page.get_by_role("combobox", name="Scored by"))
    page.get_by_role("combobox", name="Scored by").click()
    page.get_by_role("option", name="The emulator").click()
    begin_sitting(page)
    page.get_by_text("All 4 trials scored.").wait_for()
    with ledger_of(lab.root) as ledger:
        assert {row["who"] for row in ledger.scores()} == {"witness"}
    visit().locator('[data-study="by-robot"] .lab-label-emulated').wait_for()


def test_a_trial_is_chosen_in_the_table_with_a_tap_or_a_key(lab, visit):
    drive_sheet(lab.root)
    page = visit(PAGE)
    name_oneself(page, "anna")
    open_fold(page, "Notes")
    page.get_by_label("Note on the study").fill("half a note")
    open_fold(page, "All trials")
    page.get_by_role("button", name="Score trial 2").click()
    page.locator('[data-counting="2"]').wait_for()
    page.get_by_role("button", name="Score trial 1").focus()
    page.keyboard.press("Enter")
    page.locator('[data-counting="1"]').wait_for()
    count(page, 1, 0)
    page.locator('[data-counting="2"]').wait_for()
    page.get_by_role("button", name="Score trial 1").wait_for(state="detached")  # anna has
    expect(page.get_by_label("Note on the study")).to_have_value("half a note")


def test_open_page_comes_back_with_the_new_token_when_the_lab_was_started_again(lab, visit):
    make_study(lab.root)
    page = visit(PAGE, forgive=[*OUTAGE, "Failed to load resource"])
    page.get_by_label("Your name").fill("anna")
    lab.kill()
    page.get_by_text("Reconnecting…").wait_for()
    lab.start()
    page.get_by_label("Or paste the address or the token here").fill(lab.token)
    page.get_by_role("button", name="Open the lab").click()
    page.wait_for_url(lab.address + PAGE)
    begin_sitting(page)
    await_trial(page, 1)
