"""The plan of a gap in words."""

from __future__ import annotations

import pytest

from realitygap.lab._gap import NOISE, SPREAD, plan_words
from realitygap.study._gap.plan import pilot_spreads


@pytest.mark.slow
def test_plan_assumes_the_spreads_of_the_pilot():
    pilot = pilot_spreads()
    assert pilot.noise == pytest.approx(NOISE, rel=1e-3)
    assert pilot.controllers / 2 == pytest.approx(SPREAD, rel=1e-3)


@pytest.mark.parametrize(
    ("target", "time"),
    [
        ("jyro", ""),
        ("scribbler:/dev/rfcomm0", " (about 1.9 h)"),  # 50 s to drive a trial, and 20 s to place the robot
        ("scribbler:emulator://s2?fluke=2", " (about 83 min)"),
        ("scribbler:emulator://s2?fluke=2&speed=off", ""),
        ("thymio:emulator://playground?speed=8", " (about 2 min)"),
        ("scribbler:", ""),
    ],
)
def test_plan_states_trials_time_and_detectable_difference(target, time):
    assert plan_words(10, 10, target) == (
        f"Needs 100 trials on the target{time}. With these, mean differences in coverage above 0.078 are detectable."
    )


def test_plan_states_the_controllers_that_equivalence_needs():
    assert plan_words(10, 10, "jyro", 0.05).endswith("Equivalence within 0.05 needs 23 controllers.")
