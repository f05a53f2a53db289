"""Drives are fitted to what was seen of them, with intervals that hold what is true."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom, multivariate_normal

from realitygap.calibration import Fit, fit_motion, motion_plans, step_of
from realitygap.calibration._identify import advice_for, collinear_groups
from realitygap.calibration._prior import CONTACT, MOTION, MOTION_NOISE
from realitygap.calibration._scatter import LEAST, Scatter
from realitygap.records import CALIBRATES
from realitygap.world import load_arena, load_robot

from .drawn_robots import ARENA, ENSEMBLE, PRIOR, ROBOT, carried_out, drawn

pytestmark = pytest.mark.slow

NAMES = (*MOTION, *MOTION_NOISE, "drive.dead_band")
PLANS = motion_plans(ARENA, ROBOT)


def _fit(seed: int, n_trials: int = 10, **options: object) -> tuple[dict[str, float], Fit]:
    truth = drawn(seed, NAMES)
    trials = carried_out(PLANS[:n_trials], truth, seed)
    return truth, fit_motion(trials, ENSEMBLE.replay, ROBOT, ARENA, prior=PRIOR, **options)  # type: ignore[arg-type]


def _covered(seeds: range) -> tuple[int, int]:
    inside = total = 0
    for seed in seeds:
        truth, fit = _fit(seed)
        inside += sum(found.low <= truth[found.name] <= found.high for found in fit.fitted)
        total += len(fit.fitted)
    return inside, total


def test_every_parameter_has_advice_at_every_level() -> None:
    for name in (*NAMES, *CONTACT):
        for observe in CALIBRATES:
            assert advice_for(name, observe).startswith("Not identified: ")


@pytest.mark.long
def test_intervals_hold_what_is_true_in_85_to_95_of_100() -> None:
    """40 robots: chance alone keeps 560 intervals of 90 % between 85 and 95 in 100, 999 times of 1000."""
    inside, total = _covered(range(100, 140))
    assert 0.85 <= inside / total <= 0.95


def test_gains_and_track_come_out_within_a_percent_of_what_is_possible() -> None:
    """Of 14 intervals of 90 %, chance alone leaves fewer than 10 right once in 100 seeds; the seed is fixed."""
    truth, fit = _fit(7)
    assert sum(part.low <= truth[part.name] <= part.high for part in fit.fitted) >= binom.ppf(0.01, 14, 0.9)
    found = {each.name: each for each in fit.fitted}
    for name in ("drive.gain", "drive.asymmetry", "drive.axle", "drive.lag", "drive.delay", "drive.track"):
        each = found[name]
        assert each.identified, name
        assert abs(each.estimate - truth[name]) < 0.02 * (each.prior_high - each.prior_low), name
    assert fit.numbers["drive.gain_left"] - fit.numbers["drive.gain_right"] == pytest.approx(
        found["drive.asymmetry"].estimate
    )
    assert len({len(draws) for draws in fit.draws.values()}) == 1


def test_encoders_alone_do_not_tell_the_track_and_say_what_does() -> None:
    _, fit = _fit(3, 5, observe="encoders")
    found = {each.name: each for each in fit.fitted}
    assert found["drive.gain"].identified
    assert found["drive.delay"].identified
    for name in ("drive.track", "drive.axle", "drive.heading_noise_per_m"):
        assert not found[name].identified
        assert "observe = track" in found[name].advice


def test_poses_alone_tell_gain_and_slip_only_together() -> None:
    truth = drawn(5, NAMES)
    trials = [replace(trial, wheels=np.empty((0, 2))) for trial in carried_out(PLANS[:6], truth, 5)]
    fit = fit_motion(trials, ENSEMBLE.replay, ROBOT, ARENA, prior=PRIOR)
    slip = next(each for each in fit.fitted if each.name == "drive.slip")
    assert not slip.identified
    assert "drive.gain" in slip.advice
    assert "encoders" in slip.advice


def test_cells_alone_identify_nothing_and_say_what_to_record() -> None:
    _, fit = _fit(3, 2, observe="cells")
    assert {each.name for each in fit.fitted} == set(NAMES)
    assert not any(each.identified for each in fit.fitted)
    assert all(
        "record" in each.advice or "drive" in each.advice or "turn" in each.advice for each in fit.fitted
    )


def test_plans_stay_away_from_walls_and_come_back() -> None:
    still = {"drive.heading_noise_per_m": 0.02, "drive.travel_noise_per_m": 0.002, "drive.delay_jitter": 0.0}
    ends = []
    for trial in carried_out(PLANS, still, 0):
        assert len(trial.commands) <= 100
        assert not trial.stalled.any()
        gone = np.hypot(*(trial.poses[:, :2] - trial.poses[0, :2]).T)
        assert gone.max() < 0.45
        ends.append(gone[-1])
    assert np.median(ends) < 0.12


def test_a_place_too_narrow_to_turn_is_refused() -> None:
    with pytest.raises(ValueError, match="turn in place"):
        motion_plans(
            replace(ARENA, walls=((0, 0, 0.2, 0), (0.2, 0, 0.2, 0.2), (0.2, 0.2, 0, 0.2), (0, 0.2, 0, 0))),
            ROBOT,
        )


def test_scatter_is_the_normal_distribution_that_its_covariance_says() -> None:
    rng = np.random.default_rng(1)
    moved = rng.normal(size=(5, 5)) * 0.1
    late = moved @ moved.T
    scatter = Scatter(
        way=np.array([0.07]),
        chord=np.array([0.9]),
        wheel_way=np.array([[0.08, 0.06]]),
        moving_s=np.array([0.5]),
        late=late[None],
        seen=np.ones((1, 5), np.bool_),
    )
    noise = np.array([0.05, 0.02, 0.1, 0.03, 0.01, 0.001, 0.002, 0.004, 0.0005])
    own = np.array([
        0.02**2 * 0.07 * 0.9**2 + 2e-6, 0.01**2 * 0.07 + 2e-6, 0.1**2 * 0.07 + 0.03**2 * 0.5 + 2 * 0.002**2,
        0.004**2 * 0.08 + 2 * 0.0005**2, 0.004**2 * 0.06 + 2 * 0.0005**2,
    ]) + LEAST  # fmt: skip
    covariance = np.diag(own) + 0.05**2 * late
    off = rng.normal(size=(1, 5)) * 0.01
    expected = multivariate_normal(np.zeros(5), covariance).logpdf(off[0]) + 2.5 * np.log(2 * np.pi)
    assert scatter.log_likelihood(off, noise) == pytest.approx(expected, rel=1e-9)
    white = scatter.whitened(np.eye(5)[None], noise)[0]
    assert white.T @ white == pytest.approx(np.linalg.inv(covariance), rel=1e-6, abs=1e-6)


def test_parameters_that_only_their_sum_decides_are_named_together() -> None:
    rng = np.random.default_rng(2)
    both, alone, nothing = rng.normal(size=(3, 400))
    sensitivities = np.stack([both, both * 1.1, alone, 1e-3 * nothing], axis=1) * 10
    assert collinear_groups(sensitivities, ["a", "b", "c", "d"]) == [("a", "b")]


def test_trials_with_other_commands_are_refused() -> None:
    trials = carried_out(PLANS[:2], {"drive.gain": 1.0}, 0)
    with pytest.raises(ValueError, match="expected one length"):
        fit_motion([trials[0], replace(trials[1], step_s=0.25)], ENSEMBLE.replay, ROBOT, ARENA)
    over_a_radio_link = [trials[0], replace(trials[1], step_s=0.51)]
    assert step_of(over_a_radio_link) == pytest.approx(0.505)


def test_any_arena_and_robot_with_room_has_plans() -> None:
    assert len(motion_plans(load_arena("paper"), load_robot("e-puck"), 3)) == 3
