import json
import re
from dataclasses import replace

import numpy as np
import pytest

from realitygap.errors import DescriptionError, RealityGapError, RecordError, StudyError
from realitygap.orders import TransferOrder
from realitygap.platforms import JyroPlatform, SimPlatform, SimTarget
from realitygap.records import read_observations
from realitygap.study import (
    choose_condition,
    transfer,
)
from realitygap.study._transfer.calibrated import Calibrating, fitted_condition
from realitygap.study._transfer.result import Transferred, estimate_mean, summarize_transfer
from realitygap.study._transfer.simulated import evolve_champions
from realitygap.study._transfer.strategies import CALIBRATE, STRATEGIES, TransferPlan, _Work
from realitygap.study._transfer.transferability import distances, nsga2_order
from realitygap.world import Calibration, load_calibration, load_robot, paper_arena

pytestmark = pytest.mark.slow

# Far from `sim` as it is: wheels that are slow and hear late, and eyes that see less far.
OTHER = {"drive.gain_left": 0.8, "drive.gain_right": 0.9, "drive.delay": 0.25, "drive.lag": 0.2}
OTHER |= {f"range.{k}.decay": 0.1 for k in range(3)}
SMALL = {"runs": 8, "repeats": 2, "fresh_trials": 4}


class CountingTarget(SimTarget):
    """Counts what it carries out, and stops when it has had enough."""

    def __init__(self, enough=10**9):
        super().__init__(SimPlatform(set=OTHER), paper_arena(), key=5, name="other")
        self.n, self.enough = 0, enough

    def carry_out(self, plans, observe, tell=None):
        def count(k, trial):
            self.n += 1
            if tell is not None:
                tell(k, trial)
            if self.n >= self.enough:
                raise KeyboardInterrupt

        return super().carry_out(plans, observe, count)


@pytest.fixture(scope="module")
def calibration(tmp_path_factory):
    """As if 6 trials had told all about the target."""
    path = tmp_path_factory.mktemp("calibration") / "fit.toml"
    found = Calibration(
        kind="all", robot="scribbler-s2-fluke2", target="other", label="SIM", observe="cells", trials=6,
        date="2026-01-01", method="told", numbers=OTHER, draws={name: (value, value) for name, value in OTHER.items()},
    )  # fmt: skip
    path.write_text(found.to_toml())
    return path


@pytest.fixture(scope="module")
def result(tmp_path_factory, calibration):
    folder = tmp_path_factory.mktemp("transfer")
    target = CountingTarget()
    return (
        transfer("sim-paper", target, "all", [8], out=folder, calibration=calibration, **SMALL),
        target,
        folder,
    )


def test_every_strategy_spends_exactly_its_budget(result):
    found, _, _ = result
    spent = {each.strategy: each.spent for each in found.champions}
    assert spent == dict.fromkeys(STRATEGIES, 8) | {"plain": 0}


def test_only_trials_of_budget_and_fresh_ones_are_carried_out(result):
    found, target, _ = result
    # a calibration that was made before costs no trial here, and counts as 6 of the 8
    paid = sum(each.spent for each in found.champions) - len(CALIBRATE) * 6
    assert target.n == paid + len(found.champions) * SMALL["fresh_trials"]


def test_quality_is_the_mean_of_fresh_trials_and_regret_what_is_missing_to_the_best(result):
    found, _, folder = result
    best = max(np.mean(each.scores) for each in found.champions)
    for row, champion in zip(found.strategies, found.champions, strict=True):
        assert row.quality.value == pytest.approx(np.mean(champion.scores))
        assert row.regret.value == pytest.approx(best - np.mean(champion.scores))
        assert row.quality.low <= row.quality.value <= row.quality.high
    assert json.loads((folder / "result.json").read_text())["best_known"] == pytest.approx(best)


def test_an_interrupted_transfer_goes_on_and_ends_the_same(result, calibration, tmp_path):
    whole, target, _ = result
    arguments = ("all", [8])
    first = CountingTarget(enough=30)
    with pytest.raises(KeyboardInterrupt):
        transfer("sim-paper", first, *arguments, out=tmp_path, calibration=calibration, **SMALL)
    second = CountingTarget()
    again = transfer("sim-paper", second, *arguments, out=tmp_path, calibration=calibration, **SMALL)
    assert again == whole
    assert first.n + second.n == target.n


def test_a_folder_of_another_transfer_is_left_alone(result, calibration):
    _, target, folder = result
    before = target.n
    with pytest.raises(RecordError, match="seed was 1, is 2"):
        transfer("sim-paper", target, ["plain"], [8], out=folder, calibration=calibration, seed=2, **SMALL)
    assert target.n == before


def test_a_calibration_may_lie_elsewhere_and_not_say_something_else(result, calibration, tmp_path):
    """A folder that had been moved with its calibration was taken for another transfer's."""
    _, target, folder = result
    arguments, before = ("sim-paper", target, ["plain"], [8]), target.n
    moved = tmp_path / "moved.toml"
    text = calibration.read_text()
    moved.write_text(re.sub("^date = .*$", 'date = "2026-01-01T00:00:00+00:00"', text, flags=re.MULTILINE))
    transfer(*arguments, out=folder, calibration=moved, **SMALL)
    moved.write_text(re.sub("^trials = .*$", "trials = 7", text, flags=re.MULTILINE))
    with pytest.raises(RecordError, match="fit was"):
        transfer(*arguments, out=folder, calibration=moved, **SMALL)
    with pytest.raises(DescriptionError, match="There is no calibration"):
        transfer(*arguments, out=folder, calibration=tmp_path / "none.toml", **SMALL)
    assert target.n == before


def test_a_known_target_may_have_another_name_and_not_another_identity(result, calibration, tmp_path):
    """An emulator on another port was taken for another target."""

    class Known(CountingTarget):
        identity = "s2, Fluke 2, twin a"

    target = Known()
    target.name = "scribbler:socket://127.0.0.1:7001"
    transfer("sim-paper", target, ["plain"], [0], out=tmp_path, calibration=calibration, **SMALL)
    again = Known()
    again.name = "scribbler:socket://127.0.0.1:7002"
    transfer("sim-paper", again, ["plain"], [0], out=tmp_path, calibration=calibration, **SMALL)
    assert (target.n, again.n) == (SMALL["fresh_trials"], 0)
    again.identity = "s2, Fluke 2, twin b"
    with pytest.raises(RecordError, match="identity was 's2, Fluke 2, twin a', is 's2, Fluke 2, twin b'"):
        transfer("sim-paper", again, ["plain"], [0], out=tmp_path, calibration=calibration, **SMALL)


@pytest.mark.parametrize(("platform", "step_s"), [(SimPlatform(step_s=0.8), 0.8), (JyroPlatform(), 0.5)])
def test_controllers_evolve_with_commands_as_long_as_those_of_the_robot(platform, step_s, tmp_path):
    target = SimTarget(platform, paper_arena(), name="other")
    transfer("sim-paper", target, ["plain"], [0], out=tmp_path, **SMALL)
    evolved = json.loads((tmp_path / "transfer.json").read_text())["settings"]["sim"]
    assert (evolved["step_s"] or evolved["robot"]["step_s"]) == step_s


def test_a_strategy_that_cannot_run_is_refused_before_another_spends(calibration, tmp_path):
    target = CountingTarget()
    target.n_sensors = 1
    with pytest.raises(StudyError, match="other has 1 range sensors and robot"):
        transfer("sim-paper", target, "all", 3, out=tmp_path, **SMALL)
    with pytest.raises(StudyError, match="took 6 trials, more than a budget of 5"):
        transfer("sim-paper", target, "all", [8, 5], out=tmp_path, calibration=calibration, **SMALL)
    with pytest.raises(StudyError, match="platform 'jyro' of condition"):
        transfer("paper", target, "all", 3, out=tmp_path, **SMALL)
    assert target.n == 0
    assert not list(tmp_path.iterdir())


def test_a_fit_on_the_budget_builds_on_the_robot_of_the_study(calibration, tmp_path):
    """One that a file describes was looked for by its name, when half of the budget had been spent."""
    robot = load_robot("scribbler-s2-fluke2")
    own = robot.with_numbers({"drive.speed": 0.2}).model_copy(update={"name": "mine"})
    condition = choose_condition("sim-paper", None, 1).model_copy(update={"on": SimPlatform(robot=own)})
    made = load_calibration(calibration).model_copy(update={"robot": "mine"})
    (tmp_path / "3-cells-0.toml").write_text(made.to_toml())
    calibrating = Calibrating(CountingTarget(), tmp_path, 0, 0, 7, "cells", None, print)
    found, base = calibrating(condition, 6)
    fitted = fitted_condition(condition, found, "posterior", base)
    assert fitted.on.robot.drive.speed == 0.2
    assert fitted.on.robot.drive.gain_left == OTHER["drive.gain_left"]
    assert fitted.on.draws["drive.delay"] == (0.25, 0.25)


@pytest.mark.parametrize(
    ("recommended", "randomize"),
    [
        ("fitted", "no"),
        ("draws of the posterior", "posterior"),
        ("nominal numbers", "no"),
        ("", "posterior"),  # nothing was held out
    ],
)
def test_the_strategy_recommended_simulates_what_the_calibration_recommends(
    recommended, randomize, calibration
):
    made = load_calibration(calibration)
    made = made.model_copy(update={"evidence": {"held_out": {"recommended": recommended}}})
    condition = choose_condition("sim-paper", None, 1)
    nominal = condition.on.robot.numbers()["drive.gain_left"]
    fitted = fitted_condition(condition, made, "recommended")
    assert fitted.on.robot.drive.gain_left == (
        nominal if recommended == "nominal numbers" else OTHER["drive.gain_left"]
    )
    assert fitted.on.randomize == randomize
    assert fitted.name == "recommended"


def test_a_calibration_that_cost_more_than_the_budget_is_refused(calibration, tmp_path):
    with pytest.raises(StudyError, match="took 6 trials, more than a budget of 5"):
        transfer(
            "sim-paper", CountingTarget(), "posterior", 5, out=tmp_path, calibration=calibration, **SMALL
        )


@pytest.mark.parametrize(
    ("study", "strategies", "text"),
    [
        ("sim-paper", ["plane"], "Did you mean 'plain'"),
        ("wall", "plain", "range.3 to range.7 are missing"),
        ("paper", "randomized", "platform 'jyro' of condition"),
    ],
)
def test_studies_that_cannot_be_transferred_are_refused_with_a_reason(study, strategies, text, tmp_path):
    with pytest.raises(RealityGapError, match=text):
        transfer(study, CountingTarget(), strategies, 3, out=tmp_path, **SMALL)


AVOID = """
[study]
name = "avoid-3"
[neat]
population = 8
generations = 3
[task]
kind = "avoid"
inputs = ["range.0", "range.1", "range.2", "bias"]
[[condition]]
name = "avoid"
platform = "sim"
"""


def test_all_strategies_carry_over_to_another_task(calibration, tmp_path):
    """Readings score avoidance, so that only a strategy that compares cells asks for them."""
    file = tmp_path / "avoid.toml"
    file.write_text(AVOID)
    found = transfer(file, CountingTarget(), "all", 6, out=tmp_path / "t", calibration=calibration, **SMALL)
    assert found.score == "avoidance score"
    assert {row.strategy for row in found.strategies} == set(STRATEGIES)
    for champion in found.champions:
        assert all(0 <= score <= 1 for score in champion.scores)
    values = found.to_dict()
    assert values["score"] == "avoidance score"
    assert len(values["champions"][0]["scores"]) == SMALL["fresh_trials"]
    seen = {
        path.stem.partition("-")[0]: read_observations(path).head.observe
        for path in (tmp_path / "t" / "trials").glob("*")
    }
    assert seen["select"] == "readings"
    assert seen["transferability"] == "cells"


@pytest.mark.long
def test_a_calibration_on_the_budget_carries_over_to_another_task(tmp_path):
    file = tmp_path / "avoid.toml"
    file.write_text(AVOID)
    target = CountingTarget()
    found = transfer(file, target, "calibrated", 6, out=tmp_path / "t", **SMALL)
    assert target.n == 6 + SMALL["fresh_trials"]
    assert found.score == "avoidance score"


def test_evolution_in_the_true_simulator_does_better_than_plain(calibration, tmp_path):
    # over 4 replicates; seed fixed, and with these seeds far from chance: 0.1 of coverage and more
    found = transfer(
        "sim-paper", CountingTarget(), ["plain", "calibrated"], 6, out=tmp_path, calibration=calibration,
        runs=40, repeats=4, fresh_trials=10, replicates=4,
    )  # fmt: skip
    plain, calibrated = (row.quality.value for row in found.strategies)
    assert calibrated > plain + 0.03


def test_champions_come_the_best_first_and_do_not_depend_on_the_other_runs():
    condition = choose_condition("sim-paper", None, 3)
    both = evolve_champions(condition, range(0, 4), repeats=2)
    assert [each.simulated for each in both] == sorted((each.simulated for each in both), reverse=True)
    alone = evolve_champions(condition, range(2, 3), repeats=2)
    assert alone[0].genome.to_json() in [each.genome.to_json() for each in both]


def test_interval_of_one_replicate_narrows_with_trials_and_holds_the_mean():
    rng = np.random.default_rng(0)
    few, many = (estimate_mean(rng.normal(0.5, 0.1, (1, n))) for n in (5, 500))
    assert many.high - many.low < 0.3 * (few.high - few.low)
    # replicates that differ count, however many trials each has
    apart = estimate_mean(np.repeat([[0.2], [0.4], [0.6], [0.8]], 500, axis=1))
    assert apart.high - apart.low > 0.3


def test_summary_keeps_strategies_and_budgets_apart():
    champions = [
        Transferred(name, budget, 0, replicate, "", None, (value, value))
        for name, budget, replicate, value in [
            ("a", 1, 0, 0.1),
            ("a", 1, 1, 0.3),
            ("a", 2, 0, 0.5),
            ("b", 1, 0, 0.7),
        ]
    ]
    rows, best = summarize_transfer(champions)
    assert [(row.strategy, row.budget, row.quality.n) for row in rows] == [
        ("a", 1, 2),
        ("a", 2, 1),
        ("b", 1, 1),
    ]
    assert best == pytest.approx(0.7)
    assert rows[0].regret.value == pytest.approx(0.5)


def test_nsga2_puts_fronts_first_and_ends_of_a_front_before_its_middle():
    #                    front 1: 0, 2, 4; front 2: 1; front 3: 3
    objectives = np.array([[1.0, 0.0], [0.4, 0.4], [0.5, 0.5], [0.1, 0.1], [0.0, 1.0]])
    order, front = nsga2_order(objectives)
    assert front.tolist() == [0, 2, 4]
    assert set(order[:2].tolist()) == {0, 4}
    assert order[2:].tolist() == [2, 1, 3]


def test_behavior_distance_is_jaccards_where_visits_are_sure():
    one, other = np.array([[1.0, 1.0, 0.0, 0.0]]), np.array([[0.0, 1.0, 1.0, 0.0], [1.0, 1.0, 0.0, 0.0]])
    assert distances(one, other).tolist() == [[1 - 1 / 3, 0.0]]
    assert distances(np.zeros((1, 2)), np.zeros((1, 2))).tolist() == [[0.0]]


def test_a_trial_that_was_cut_off_is_carried_out_again(calibration, tmp_path):
    """It counted as one that visited nothing, or kept a calibration from ever going on."""

    class CutOff(CountingTarget):
        def carry_out(self, plans, observe, tell=None):
            def cut(k, trial):
                self.n += 1
                if self.n == self.enough:
                    tell(k, replace(trial, cells=(), end="interrupted"))
                    raise KeyboardInterrupt
                tell(k, trial)

            return SimTarget.carry_out(self, plans, observe, cut)

    arguments = ("sim-paper", ["plain", "select"], [4])
    whole = transfer(arguments[0], CountingTarget(), *arguments[1:], out=tmp_path / "whole", **SMALL)
    with pytest.raises(KeyboardInterrupt):
        transfer(arguments[0], CutOff(enough=6), *arguments[1:], out=tmp_path / "cut", **SMALL)
    again = CountingTarget()
    assert transfer(arguments[0], again, *arguments[1:], out=tmp_path / "cut", **SMALL) == whole
    assert again.n == 4 + 4 + 4 - 5


def test_regret_is_to_the_best_that_the_folder_knows(result, calibration, tmp_path):
    found, target, folder = result
    best = json.loads((folder / "result.json").read_text())["best_known"]
    alone = transfer("sim-paper", target, ["plain"], [8], out=folder, calibration=calibration, **SMALL)
    assert alone.best_known == pytest.approx(best)
    plain = next(row for row in found.strategies if row.strategy == "plain")
    assert alone.strategies[0].regret.value == pytest.approx(plain.regret.value)


def test_intervals_of_few_replicates_cover_as_often_as_they_say():
    """A resampling of two or three replicates ended at the two or three, and covered half to three quarters."""
    rng = np.random.default_rng(2)
    for r in (2, 3, 4):
        held = []
        for _ in range(400):
            found = estimate_mean(rng.normal(0, 0.05, (r, 1)) + rng.normal(0.5, 0.1, (r, 20)))
            held.append(found.low <= 0.5 <= found.high)
        # 0.95 with a standard deviation of 0.011: chance alone fails 1 in 300 seeds; replicates alike make it wider
        assert np.mean(held) > 0.92
    alone = estimate_mean(np.array([[0.5]]))
    assert (alone.low, alone.high) == (None, None)
    alike = estimate_mean(np.array([[0.4, 0.6], [0.6, 0.4]]))
    assert alike.low < 0.45


def test_calibrations_of_another_seed_are_other_ones(tmp_path):
    seeds = []
    for seed in (1, 2):
        order = TransferOrder(study="sim-paper", to="other", budget=(6,), seed=seed)
        plan = TransferPlan(order, "", {}, "other", "")
        work = _Work(plan, choose_condition("sim-paper", None, seed), CountingTarget(), tmp_path, print)
        seeds += [work._calibration(replicate).seed for replicate in (0, 1)]
    assert len(set(seeds)) == 4
