from dataclasses import replace

import numpy as np
import pytest

from realitygap.calibration import (
    Fit,
    evidence_of,
    fit_all,
    numbers_of,
    ranges_of,
    scribbler_prior,
    values_of,
)
from realitygap.calibration._predictive import misfits
from realitygap.calibration._shots import shots_of
from realitygap.evolution import Genome
from realitygap.platforms import SimEnsemble, SimPlatform, SimTarget
from realitygap.study import calibrate_all
from realitygap.study._calibrate.held_out_trials import _mean_error, compare_on_trials, is_held_out
from realitygap.study._calibrate.whole import _bound_by_prior, all_plans
from realitygap.world import Fitted, paper_arena

pytestmark = pytest.mark.slow

ARENA = paper_arena()


def test_a_robot_without_trials_stays_as_in_its_file():
    calibration = calibrate_all(SimTarget(SimPlatform(), ARENA), budget=0)
    plain = SimPlatform().robot.numbers()
    assert calibration.trials == 0
    assert calibration.numbers == {name: plain[name] for name in calibration.numbers}
    assert {len(draws) for draws in calibration.draws.values()} == {1}


def test_a_robot_is_found_and_trials_are_kept_as_they_come():
    numbers = {"drive.gain_left": 0.85, "drive.gain_right": 0.85, "drive.track": 0.14, "range.0.decay": 0.1}
    target = SimTarget(
        SimPlatform(set=numbers | {f"range.{k}.decay": 0.1 for k in range(3)}), ARENA, name="other"
    )
    kept = []
    calibration = calibrate_all(
        target, observe="track", budget=4, effort="small", keep=kept.append, threads=1
    )
    found = {fitted.name: fitted for fitted in calibration.fitted}
    assert len(kept) == calibration.trials == 4
    assert found["drive.gain"].estimate == pytest.approx(0.85, rel=0.05)
    assert found["drive.track"].estimate == pytest.approx(0.14, rel=0.07)
    assert found["drive.gain"].identified
    assert calibration.target == "other"
    assert {len(draws) for draws in calibration.draws.values()} == {500}
    SimPlatform(set=calibration.numbers)  # numbers that a robot can have


def test_trials_are_the_same_for_the_same_seed_and_touch_nothing_at_the_start():
    robot = SimPlatform().robot
    plans, again, others = (all_plans(ARENA, robot, 5, seed) for seed in (1, 1, 2))
    assert [plan.number for plan in plans] == list(range(5))
    assert [plan.genome is None for plan in plans] == [True, False, True, False, True]
    assert plans[0].start == again[0].start
    assert np.array_equal(plans[0].commands, again[0].commands)
    assert not np.array_equal(plans[0].commands, others[0].commands)
    for plan in plans[::2]:
        assert robot.radius < plan.start.x < 42 * 0.0254 - robot.radius


@pytest.mark.parametrize(("observe", "groups"), [("cells", 2), ("encoders", 4), ("track", 1)])
def test_observed_and_simulated_vectors_have_the_same_length(observe, groups):
    platform = SimPlatform()
    with SimTarget(platform, ARENA) as target:
        trials = target.carry_out(all_plans(ARENA, platform.robot, 2), observe)
    genomes = [Genome.from_json(trial.genome) if trial.genome else None for trial in trials]
    evidence = evidence_of(trials, genomes, platform.robot, ARENA)
    ensemble = SimEnsemble(platform, ARENA, threads=1)
    assert len(evidence) == groups
    for one in evidence:
        made = ensemble.summarize(one.play, {"drive.lag": [0.0, 0.1]}, 1, one.of, keep=one.keep)
        assert made.shape == (2, len(one.seen))
        assert one.finest.shape == one.seen.shape == one.trial.shape == one.step.shape


def test_with_poses_wheels_count_only_where_no_wall_can_stop_them():
    platform = SimPlatform()
    with SimTarget(platform, ARENA, key=3) as target:
        trials = target.carry_out(all_plans(ARENA, platform.robot, 3), "track")
    near = shots_of(trials, platform.robot, ARENA).touching
    assert 0 < near.sum() < near.size

    def stopped(trial, near):
        ways = np.where(near[:, None], 0.0, np.diff(trial.wheels, axis=0))
        return replace(trial, wheels=np.vstack([np.zeros(2), np.cumsum(ways, axis=0)]))

    ensemble = SimEnsemble(platform, ARENA, threads=1)
    shares = [
        {
            misfit.kind: misfit.share
            for misfit in misfits(
                evidence_of(some, [None] * 3, platform.robot, ARENA),
                lambda one, numbers, key: ensemble.summarize(one.play, numbers, key, one.of, keep=one.keep),
                {"drive.track": np.full(20, platform.robot.numbers()["drive.track"])},
                key=5,
            )
        }
        for some in (trials, [stopped(*each) for each in zip(trials, near, strict=True)])
    ]
    assert shares[0] == pytest.approx(shares[1], abs=1e-6)
    assert {"wheels", "turn", "turn at walls"} <= set(shares[0])


@pytest.mark.long
@pytest.mark.parametrize("observe", ["cells", "encoders", "track"])
def test_intervals_of_robots_from_the_prior_cover_as_often_as_they_say(observe):
    """Simulation-based calibration (Talts et al. 2018) at a reduced size: 12 robots, 20 trials of each."""
    platform = SimPlatform()
    prior = scribbler_prior(platform.robot)
    ensemble = SimEnsemble(platform, ARENA, ranges=ranges_of(prior, platform.robot))
    inside = []
    for k in range(12):
        standard = np.clip(np.random.default_rng(k).normal(size=(1, len(prior))), -3, 3)
        numbers = numbers_of(prior, values_of(prior, standard), platform.robot)
        truth = {name: float(value[0]) for name, value in numbers.items()}
        with SimTarget(SimPlatform(set=truth), ARENA, key=k) as target:
            trials = target.carry_out(all_plans(ARENA, platform.robot, 20, k), observe)
        genomes = [Genome.from_json(trial.genome) if trial.genome else None for trial in trials]
        evidence = evidence_of(trials, genomes, platform.robot, ARENA)
        places = fit_all(
            evidence,
            lambda one, some, key: ensemble.summarize(one.play, some, key, one.of, keep=one.keep),
            prior,
            platform.robot,
            seed=k,
            effort="small",
        ).places
        low, high = np.quantile(places, [0.05, 0.95], axis=0)
        inside.append((low <= standard[0]) & (standard[0] <= high))
    # 300 intervals of 90 %, those of one robot alike: 0.84 to 0.96 is three standard errors were they independent 1.7.
    assert 0.83 <= np.mean(inside) <= 0.97


def test_held_out_trials_are_spread_and_recommend_what_predicts_them():
    """A fit that is wrong by half of the gain loses against the numbers that it started from, and a true one wins."""
    truth = {"drive.gain_left": 0.8, "drive.gain_right": 0.8}
    with SimTarget(SimPlatform(set=truth), ARENA, key=4) as target:
        trials = target.carry_out(all_plans(ARENA, SimPlatform().robot, 5), "track")
    asked = []

    def judged(gain: float, trials=trials) -> Fit:
        numbers = dict.fromkeys(truth, gain)

        def fit(some):
            asked.append(len(some))
            return numbers, {name: [value] for name, value in numbers.items()}

        parts = Fit((), numbers, {}, "given")
        return compare_on_trials(parts, trials, fit, SimEnsemble(SimPlatform(), ARENA, threads=1))

    right, wrong = judged(0.8), judged(0.4)
    assert asked == [4, 4]
    assert right.evidence["held_out"]["recommended"] == "fitted"
    assert (
        right.evidence["held_out"]["errors"]["fitted"]
        < right.evidence["held_out"]["errors"]["nominal numbers"]
    )
    assert right.reasons[0].startswith("1 of 5 trials were held out.")
    assert wrong.evidence["held_out"]["recommended"] == "nominal numbers"
    assert "use them instead" in wrong.verdict
    assert wrong.numbers == dict.fromkeys(truth, 0.4)  # a recommendation changes no number
    unseen = [replace(trial, poses=np.empty((0, 3)), wheels=np.empty((0, 2))) for trial in trials]
    blind = judged(0.4, unseen)  # of which no motion was seen
    errors = blind.evidence["held_out"]["errors"]
    assert errors["nominal numbers"] < errors["fitted"]
    assert blind.evidence["held_out"]["recommended"] == "fitted"
    assert blind.verdict.endswith("trials cannot show that the numbers that it started from are better.")
    few = compare_on_trials(right, trials[:4], lambda _: 1 / 0, SimEnsemble(SimPlatform(), ARENA, threads=1))
    assert few is right
    assert np.flatnonzero(is_held_out(20)).tolist() == [4, 9, 14, 19]  # of both kinds of trials


def test_kind_that_nothing_predicts_does_not_outweigh_one_that_the_fit_predicts():
    # readings, commands, and cells of a twin whose fit closed nine tenths of the gap
    fitted, nominal = (0.273, 0.00384, 0.587), (0.300, 0.01047, 0.410)
    assert np.mean(fitted) > np.mean(nominal)
    assert _mean_error(fitted) < _mean_error(nominal)
    assert _mean_error((0.0, 1.0)) == pytest.approx(1e-3)


def test_parameters_at_an_end_of_their_prior_are_named():
    """A Thymio that does not turn at walls had `contact.ang` at the end of its prior, and no note said so."""

    def fitted(name, low, high):
        ends = {
            "low": low,
            "high": high,
            "estimate": (low + high) / 2,
            "prior_low": 50.0,
            "prior_high": 3000.0,
        }
        return Fitted(name=name, identified=True, unit="1/m2", **ends)

    (note,) = _bound_by_prior([fitted("contact.ang", 50.1, 80.0), fitted("drive.track", 100.0, 200.0)])
    assert note.startswith("Intervals that reach an end of their prior: contact.ang (50 to 3,000 1/m2). ")
    assert not _bound_by_prior([fitted("drive.heading_noise_per_m", 50.1, 80.0)])
    wide = {"name": "contact.ang", "low": 50.0, "high": 400.0, "prior_low": 50.0, "prior_high": 3000.0}
    at_end, inside = (Fitted(estimate=at, identified=False, advice="Record.", **wide) for at in (50.1, 200.0))
    assert at_end.advice.startswith("The estimate is at an end of its prior")
    assert inside.advice == "Record."


def test_trials_without_poses_give_a_calibration():
    """They have no patterns of residuals."""
    found = calibrate_all(
        SimTarget(SimPlatform(), ARENA, key=3), observe="cells", budget=2, effort="least", threads=1
    )
    assert 0 <= found.misspecification_p <= 1
    assert found.trials == 2
