"""A calibration at its page: by itself, and led through beside a robot."""

from __future__ import annotations

import re

import pytest

from realitygap.emulator import serve_tcp
from realitygap.families.scribbler.emulator import Emulator
from realitygap.lab.pages._calibrate import _KINDS, PLACING_S
from realitygap.platforms import class_of
from realitygap.records import read_observations
from realitygap.study._calibrate.kinds import KINDS
from realitygap.world import load_arena, load_robot, read_calibration

from .conftest import FOR_CHILDREN, PHONE, enter

pytestmark = pytest.mark.slow


STEP_S = 0.5
"""Time of a command [s]."""
REJECTED = """
import sys
if "realitygap.lab._work" in sys.orig_argv:
    from realitygap.lab import _calibration
    make_calibration = _calibration.make_calibration
    def rejected(*given, **options):
        made = make_calibration(*given, **options)
        return made.model_copy(update={"misspecified": True, "misspecification_p": 0.01})
    _calibration.make_calibration = rejected
"""


def begin(page, kind: str = "sensors", **fields: str) -> None:
    for label, value in fields.items():
        enter(page, label, value)
    page.get_by_role("button", name="Next", exact=True).click()
    page.locator(f'[data-kind="{kind}"]').click()
    page.get_by_role("button", name="Calibrate", exact=True).click()


def measure(page, ahead: str, left: str, turned: str) -> None:
    """Enter what a ruler says; of a turn on the spot it is asked how far alone."""
    for label, value in (
        ("Distance ahead", ahead),
        ("Distance to the left", left),
        ("Turn to the left", turned),
    ):
        if page.get_by_label(label).count():
            page.get_by_label(label).fill(value)
    page.get_by_role("button", name="Save", exact=True).click()


def n_plotted(page) -> int:
    """Of how many trials there are readings in the plot, as it says of itself."""
    said = page.locator(".lab-plot").get_attribute("aria-label")
    return int(re.search(r"of (\d+) trial", said)[1])


def test_cards_state_the_trials_and_minutes_of_each_kind():
    robot = load_robot(class_of("scribbler:port").base_robot)
    for kind, (_, _, n_trials, minutes) in _KINDS.items():
        plans = KINDS[kind].plans(load_arena("paper"), robot)
        seconds = sum(len(plan.commands) * STEP_S + PLACING_S for plan in plans)
        assert (n_trials, minutes) == (len(plans), round(seconds / 60)), kind


def test_wizard_leads_from_the_robot_to_a_result_and_shows_a_rejection(lab, visit):
    (lab.root.parent / FOR_CHILDREN).mkdir()
    (lab.root.parent / FOR_CHILDREN / "sitecustomize.py").write_text(REJECTED)
    page = visit("calibrate")
    step = page.locator(".lab-steps [aria-current=step]")
    page.get_by_text("No calibrations yet.").wait_for()
    page.get_by_label("Name", exact=True).fill("not a name!")
    page.get_by_role("button", name="Next").click()
    page.get_by_role("alert").filter(has_text="You entered 'not a name!'.").wait_for()
    step.filter(has_text="Robot").wait_for()
    page.get_by_label("Name", exact=True).fill("refused")
    page.get_by_role("button", name="Next").click()
    step.filter(has_text="Part").wait_for()
    page.locator('[data-kind="path"]').press("Space")
    page.locator('[data-kind="path"][aria-checked="true"]').wait_for()
    page.get_by_role("button", name="Calibrate", exact=True).click()
    step.filter(has_text="Result").wait_for()
    page.get_by_text("Rejected: the simulator can't reproduce this robot (p = 0.01).").wait_for()
    assert page.locator(".lab-fitted .lab-bar-interval").count() > 0
    assert page.locator(".lab-fitted tbody").get_by_text("dentified").count() > 0
    page.get_by_role("button", name="Measure the gap").click()
    page.wait_for_url("**/gap?sim=sim:refused.toml")
    assert page.get_by_label("Simulator", exact=True).input_value() == "sim:refused.toml"


def test_sensors_of_an_emulated_robot_are_calibrated_with_a_plot(lab, visit):
    page = visit("calibrate", size=PHONE)
    begin(page, Robot="scribbler:emulator://s2?fluke=2&speed=off", Name="mine")
    page.get_by_text("Saved as mine.toml").wait_for(timeout=180_000)
    page.locator(".lab-plot canvas, .lab-plot svg").first.wait_for()
    assert page.locator(".lab-fitted tr").count() > 0
    made = read_calibration(lab.root / "mine.toml")
    assert made.kind == "sensors"
    assert n_plotted(page) == len(read_observations(lab.root / "mine.trials.sqlite").trials)


def test_a_simulation_is_calibrated_too_and_others_see_it(lab, visit):
    page = visit("calibrate")
    begin(page, Robot="sim", Name="of-sim")
    other = visit("calibrate")
    other.get_by_text("of-sim: sensors").wait_for()
    for each in (page, other):
        each.get_by_text("Saved as of-sim.toml").wait_for(timeout=180_000)


def test_somebody_is_led_through_while_the_plot_grows_and_others_watch(lab, visit):
    """The emulator is at a socket, of which nobody says that it is one with a witness: somebody has to place it."""
    with serve_tcp(Emulator("s2"), speed=20) as server:
        page = visit("calibrate")
        begin(page, "path", Robot=f"scribbler:{server.name}", Name="led")
        for number in (1, 2):
            page.locator(".lab-question").get_by_text(f"Trial {number} of").wait_for()
            page.get_by_role("button", name="Robot is in place").click()
            page.get_by_label("Turn to the left").wait_for()
            if number == 1:
                measure(page, "far", "0", "0")
                page.get_by_text("Expected numbers such as 13.75").wait_for()
            measure(page, "13 3/4", "-1/8", "2")
            page.wait_for_function(
                "n => document.querySelector('.lab-plot')?.getAttribute('aria-label').includes(`of ${n} trial`)",
                arg=number,
            )
        other = visit("calibrate")
        other.get_by_text("is operating the robot. You are watching").wait_for()
        assert n_plotted(other) == 2
        assert other.get_by_role("button", name="Robot is in place").count() == 0
        assert other.get_by_role("button", name="Stop calibration").is_disabled()
        page.reload()
        page.locator(".lab-question").get_by_text("Trial 3 of").wait_for()
        page.get_by_role("button", name="Robot is in place").click()
        page.get_by_label("Turn to the left").wait_for()
        page.get_by_role("button", name="Stop calibration").click()
        page.get_by_text("Recorded trials are saved").wait_for()
        assert len(read_observations(lab.root / "led.trials.sqlite").trials) == 2
        begin(page, "path", Robot=f"scribbler:{server.name}", Name="led")
        page.get_by_text("before you said what you saw").wait_for()
        page.get_by_role("button", name="Use this trial").click()
        page.get_by_label("Turn to the left").wait_for()
        measure(page, "13 3/4", "0", "1")
        page.locator(".lab-question").get_by_text("Trial 1 of").wait_for()
        page.get_by_role("button", name="Stop calibration").click()
        page.get_by_text("Recorded trials are saved").wait_for()
    assert len(read_observations(lab.root / "led.trials.sqlite").trials) == 3


def test_no_calibration_is_written_or_read_outside_the_folder(lab, visit):
    page = visit("calibrate")
    for fields, message in (
        ({"Name": "../mine"}, "You entered '../mine'."),
        ({"Name": "mine", "Robot": "twin:/etc/passwd"}, "would be a file outside"),
    ):
        for label, value in fields.items():
            enter(page, label, value)
        page.get_by_role("button", name="Next", exact=True).click()
        page.get_by_text(message).last.wait_for()
    assert list(lab.root.iterdir()) == []
