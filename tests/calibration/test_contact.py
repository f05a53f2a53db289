"""Contact is fitted to what was seen of encounters with walls."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from realitygap.calibration import contact_plans, fit_contact
from realitygap.calibration._contact import encounters_of
from realitygap.calibration._prior import CONTACT

from .drawn_robots import ARENA, ENSEMBLE, PRIOR, ROBOT, carried_out, drawn

pytestmark = pytest.mark.slow

PLANS = contact_plans(ARENA, ROBOT)


def _covered(seeds: range) -> tuple[int, int]:
    inside = 0
    for seed in seeds:
        truth = drawn(seed, CONTACT)
        fit = fit_contact(carried_out(PLANS, truth, seed), ENSEMBLE.replay, ROBOT, ARENA, prior=PRIOR)
        inside += sum(found.low <= truth[found.name] <= found.high for found in fit.fitted)
    return inside, len(CONTACT) * len(seeds)


@pytest.mark.long
def test_intervals_hold_what_is_true_in_80_to_97_of_100() -> None:
    """40 robots: chance alone keeps 160 intervals of 90 % between 80 and 97 in 100, 999 times of 1000."""
    inside, total = _covered(range(100, 140))
    assert 0.80 <= inside / total <= 0.97


def test_numbers_come_out_and_friction_agrees_with_who_aligns_and_who_stalls() -> None:
    """Of 4 intervals of 90 %, chance alone leaves fewer than 2 right once in 250 seeds; the seed is fixed."""
    truth = {
        "contact.friction": 0.35,
        "contact.lat": 0.6,
        "contact.ang": 150.0,
        "contact.saturation": 25.0,
    }
    trials = carried_out(PLANS, truth, 1)
    fit = fit_contact(trials, ENSEMBLE.replay, ROBOT, ARENA, prior=PRIOR)
    assert fit.numbers["contact.friction"] == pytest.approx(0.35, abs=0.05)
    assert fit.numbers["contact.lat"] == pytest.approx(0.6, rel=0.1)
    assert fit.numbers["contact.ang"] == pytest.approx(150.0, rel=0.15)
    assert fit.numbers["contact.saturation"] == pytest.approx(25.0, rel=0.3)
    inside = sum(found.low <= truth[found.name] <= found.high for found in fit.fitted)
    assert inside >= binom.ppf(0.01, len(truth), 0.9)
    encounters = encounters_of(trials, ROBOT, ARENA)
    assert len(encounters.aligned) >= 15
    assert encounters.agreeing(0.35) >= 0.8 * len(encounters.aligned)


def test_walls_are_met_head_on_and_slantwise_and_with_both_ends() -> None:
    trials = carried_out(PLANS, {"contact.friction": 0.3}, 0)
    assert all(len(trial.commands) == 100 for trial in trials)
    assert np.mean([trial.stalled.mean() for trial in trials]) > 0.05
    moves = np.concatenate([plan.commands[:, 0] for plan in PLANS])
    assert (moves > 0.5).sum() > 100
    assert (moves < -0.5).sum() > 100


def test_without_poses_nothing_is_identified_and_it_says_what_to_record() -> None:
    trials = carried_out(PLANS[:1], {"contact.friction": 0.3}, 0)
    fit = fit_contact(trials, ENSEMBLE.replay, ROBOT, ARENA, prior=PRIOR, observe="encoders")
    assert [found.identified for found in fit.fitted] == [False] * len(CONTACT)
    assert all("observe = track" in found.advice for found in fit.fitted)
    assert all(found.low <= found.estimate <= found.high for found in fit.fitted)
