"""The keyboard's focus stays where it was when a part of a page is drawn again."""

from __future__ import annotations

import pytest

from realitygap.study import parse_study, run_study

pytestmark = pytest.mark.slow

TEXT = """
[study]
name = "seen"
replicates = 2

[neat]
generations = 2

[[condition]]
name = "one"

[[condition]]
name = "two"
"""


def press(page, name: str) -> None:
    """Press a button by its key."""
    button = page.get_by_role("button", name=name, exact=True).first
    button.wait_for()
    button.focus()
    page.keyboard.press("Enter")


def has_focus(page, selector: str) -> None:
    page.wait_for_function("selector => document.activeElement.matches(selector)", arg=selector)


def test_focus_returns_to_a_button_that_was_drawn_again_or_to_the_part_around_it(visit):
    page = visit("new")
    press(page, "Add condition")
    page.get_by_role("button", name="Remove condition 3").wait_for()
    page.wait_for_function("() => document.activeElement.textContent === 'Add condition'")
    press(page, "Remove condition 3")
    page.get_by_role("button", name="Remove condition 3").wait_for(state="detached")
    has_focus(page, ".lab-main .lab-place")
    page.keyboard.press("Tab")
    assert page.evaluate("() => document.activeElement.closest('.lab-main') !== null")


def test_focus_stays_near_when_a_robot_is_connected_and_never_returns_to_the_drive_pad(visit, emulated):
    page = visit("robot")
    page.get_by_text("Another port").click()
    page.get_by_label("Port", exact=True).fill(emulated[0])
    press(page, "Connect")
    page.get_by_text("Battery").wait_for()
    has_focus(page, ".lab-main .lab-place")
    page.locator(".lab-pad").focus()
    other = visit("robot")  # its request draws the page of the robot again
    press(other, "Request control")
    press(page, "Keep")
    page.locator(".lab-pad").focus()
    page.locator(".lab-pad").evaluate(
        "pad => { window.pad = pad.cloneNode(true); pad.replaceWith(window.pad); }"
    )
    has_focus(page, ".lab-main .lab-place")
    press(page, "Disconnect")
    page.get_by_role("button", name="Use an emulated robot", exact=True).wait_for()
    has_focus(page, ".lab-main .lab-place")


def test_kind_of_calibration_is_chosen_by_arrow_keys_and_the_hidden_form_gives_the_focus_on(visit):
    page = visit("calibrate")
    press(page, "Next")
    card = page.locator(".lab-kind[aria-checked=true]")
    card.wait_for()
    card.focus()
    assert card.get_attribute("data-kind") == "sensors"
    for key, kind in (
        ("ArrowDown", "motion"),
        ("ArrowLeft", "sensors"),
        ("ArrowUp", "path"),
        ("ArrowUp", "all"),
    ):
        page.keyboard.press(key)
        has_focus(page, f".lab-kind[data-kind={kind}][aria-checked=true]")
    press(page, "Back")
    page.get_by_role("button", name="Next").wait_for()
    has_focus(page, ".lab-main .lab-place")


def test_focus_returns_from_a_closed_notification(lab, visit):
    lab.list_port("/tmp/no-device")
    page = visit("robot")
    press(page, "Identify the robot on /tmp/no-device")
    page.locator(".q-notification").get_by_text("is no port that the lab opens").wait_for()
    press(page, "Close")
    page.locator(".q-notification").wait_for(state="detached")
    has_focus(page, "[aria-label='Identify the robot on /tmp/no-device']")


def test_condition_of_a_study_is_chosen_by_keyboard(lab, visit):
    run_study(parse_study(TEXT, "study.toml"), lab.root / "seen")
    page = visit("study/seen")
    row = page.get_by_role("button", name="two", exact=True)
    page.locator(".lab-figure img").nth(3).wait_for()  # all is drawn
    # A busy page may draw its last parts late; what is drawn again without a change is so each second.
    for _ in range(5):
        drawn = row.element_handle()
        page.wait_for_timeout(1500)
        if drawn.evaluate("row => row.isConnected"):
            break
    else:
        raise AssertionError("drawn again without a change")
    press(page, "two")
    page.locator(".lab-choose-row[aria-pressed=true]", has_text="two").wait_for()
    page.wait_for_function("() => document.activeElement.textContent.trim() === 'two'")
