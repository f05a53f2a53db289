import json
import re
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from realitygap.cli import app
from realitygap.errors import RecordError
from realitygap.families.thymio import build_enki
from realitygap.platforms import SimPlatform, SimTarget
from realitygap.records import read_observations
from realitygap.report import goal_table, write_closing_page
from realitygap.study import (
    PLANS,
    ClosingPlan,
    choose_condition,
    closing_the_gap,
    summarize_closing,
)
from realitygap.study._closing.plan import SMALL, adopt_plan
from realitygap.study._closing.summary import is_met, pooled_fall
from realitygap.study._closing.twin import ClosingTwin, held_out
from realitygap.trials import TrialPlan
from realitygap.world import Calibration, paper_arena
from tests.harness import needs_enki

pytestmark = pytest.mark.slow

# Each "twin" is `sim` with other numbers, so that a calibration can be exactly right, or exactly useless.
FAMILIES = {
    "slow": {"drive.gain_left": 0.7, "drive.gain_right": 0.8, "drive.delay": 0.3},
    "blind": {f"range.{k}.decay": 0.06 for k in range(3)} | {"drive.lag": 0.3},
}
PLAN = replace(
    SMALL, families=tuple(FAMILIES), twins=1, controllers=14, trials=8, budgets=(0, 4), transfer_budget=4
)


def controllers(n):
    """Return n held-out controllers of the plan."""
    return held_out(n, PLAN.study, PLAN.controllers_seed, are_founders=True)


class Twins:
    """Opens twins and calibrates them, and counts both."""

    def __init__(self, right=True):
        self.right, self.n_trials, self.n_fits = right, 0, 0
        self.stop_at = 10**9

    def opened(self, family):
        twins = self

        class Counted(SimTarget):
            def carry_out(self, plans, observe, tell=None):
                twins.n_trials += len(plans)
                if twins.n_trials > twins.stop_at:
                    raise KeyboardInterrupt
                return super().carry_out(plans, observe, tell)

        return Counted(SimPlatform(set=FAMILIES[family]), paper_arena(), key=3, name=f"twin:{family}")

    def calibrate(self, target, *, robot, observe, budget, seed, effort):
        self.n_fits += 1
        target.carry_out([TrialPlan(genome=controllers(1)[0], number=k) for k in range(budget)], observe)
        numbers = FAMILIES[target.name.partition(":")[2]] if self.right else {"contact.friction": 0.31}
        return Calibration(
            kind="all", robot="scribbler-s2-fluke2", target=target.name, label="SIM", observe=observe, trials=budget,
            date="2026-01-01", method="told", numbers=numbers, draws={k: (v, v) for k, v in numbers.items()},
        )  # fmt: skip


def carry_out(folder, twins, plan=PLAN):
    adopt_plan(folder, plan)
    for name in plan.names:
        ClosingTwin(
            plan, name, folder, partial(twins.opened, name.family), twins.calibrate, lambda _: None
        ).carry_out()
    return summarize_closing(folder)


@pytest.fixture(scope="module")
def right(tmp_path_factory):
    folder, twins = tmp_path_factory.mktemp("right"), Twins()
    return carry_out(folder, twins), folder, twins


def goals_of(summary):
    return {
        goal["name"].partition(" (")[0]: goal for goal in summary["goals"] if "stretch" not in goal["name"]
    }


def test_a_right_calibration_closes_the_gap(right):
    summary, _, _ = right
    assert summary["n_done"] == summary["n_units"] == 2 * 5
    assert summary["n_counted"] == 2
    goals = goals_of(summary)
    assert goals["fall of the RMS gap, track"]["figure"] > 0.8
    assert goals["smallest fall of a family, cells"]["figure"] > 0


def test_a_useless_calibration_misses_them_and_says_on_which_twins(tmp_path):
    summary = carry_out(tmp_path, Twins(right=False))
    missed = goals_of(summary)["fall of the RMS gap, track"]
    assert {each["twin"] for each in missed["why"]} == {"slow-1", "blind-1"}
    assert abs(missed["figure"]) < 0.3


@pytest.mark.parametrize(
    ("low", "high", "goal", "sense", "expected"),
    [
        (0.778, 0.826, 0.6, "at least", True),
        (
            0.775,
            0.833,
            0.8,
            "at least",
            None,
        ),  # the figure, 0.804, reaches the goal; the interval contains it
        (0.3, 0.39, 0.4, "at least", False),
        (2.53, 4.59, 2.0, "at most", False),
        (0.5, 0.9, 0.5, "more than", None),
        (None, None, 0.4, "at least", None),
    ],
)
def test_goal_is_decided_only_by_its_whole_interval(low, high, goal, sense, expected):
    assert is_met(low, high, goal, sense) is expected


def test_goal_of_two_twins_is_open(right):
    verdicts = {row[0]: row[-1] for row in goal_table(right[0]).rows}
    assert verdicts["fall of the RMS gap, track"] == "open"


def test_finished_parts_are_not_computed_again(right):
    summary, folder, twins = right
    before = twins.n_trials, twins.n_fits
    assert carry_out(folder, twins) == summary
    assert (twins.n_trials, twins.n_fits) == before


def test_an_interrupted_study_goes_on_and_ends_the_same(right, tmp_path):
    summary, _, whole = right
    twins = Twins()
    twins.stop_at = whole.n_trials // 2
    with pytest.raises(KeyboardInterrupt):
        carry_out(tmp_path, twins)
    half = summarize_closing(tmp_path)
    assert 0 < half["n_done"] < half["n_units"]
    twins.stop_at = 10**9
    again = carry_out(tmp_path, twins)
    for each in (again, summary):
        for twin in each["twins"]:
            twin.pop("seconds", None)
    assert again == summary


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="reads /proc for who is whose child")
def test_a_killed_study_leaves_no_process_behind(tmp_path):
    def children(pid):
        try:
            return [int(one) for one in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
        except OSError:  # gone
            return []

    def is_there(pid):
        try:
            return "Z" not in Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            return False

    pytest.importorskip("mujoco", reason="twins need the extra twin")
    command = [sys.executable, "-m", "realitygap", "closing-the-gap", "--small", "--processes", "2"]
    study = subprocess.Popen([*command, "--out", str(tmp_path / "results")], stdout=subprocess.DEVNULL)
    began = time.monotonic()
    below = []
    while time.monotonic() - began < 120 and not any(
        children(pid) for pid in below
    ):  # until twins are at work
        below = children(study.pid)
        time.sleep(0.1)
    below += [pid for each in below for pid in children(each)]
    study.kill()
    study.wait()
    assert len(below) > 2
    while time.monotonic() - began < 180 and any(is_there(pid) for pid in below):
        time.sleep(0.1)
    assert not [pid for pid in below if is_there(pid)]


def test_each_calibration_sees_only_its_budget(right):
    _, folder, _ = right
    budgets = set()
    for path in (folder / "calibrations").glob("*.sqlite"):
        budget = int(path.stem.rpartition("-")[2])
        assert len(read_observations(path).trials) == budget
        budgets.add(budget)
    assert budgets == {2, 4}  # by which the gap is measured, and half of it for transfer


def test_a_twin_whose_floor_is_0_is_named_and_not_dropped_in_silence(right, tmp_path):
    _, whole, _ = right
    folder = shutil.copytree(whole, tmp_path / "copied")
    unit = next((folder / "units").glob("slow-1-gap-cells-*.json"))
    found = json.loads(unit.read_text())
    found["gap"]["mmrv"]["estimate"], found["gap"]["mmrv_floor"]["estimate"] = 0.0123, 0.0
    unit.write_text(json.dumps(found))
    summary = summarize_closing(folder)
    goal = goals_of(summary)["MMRV over its split-half floor, cells"]
    assert goal["n"] == 1
    said = "its floor is 0, the same order in both halves of its trials; MMRV is 0.012"
    assert goal["unknown"] == [{"twin": "slow-1", "why": said}]
    row = next(row for row in goal_table(summary).rows if row[0] == goal["name"])
    assert row[4] == "1 of 2"
    page = write_closing_page(summary, tmp_path / "page.html").read_text("utf-8")
    assert f"1 of 2 twins are judged. slow-1 is not: {said}." in page


def without_styles(page: str) -> str:
    """Return a page without its styles, which have a class for each label."""
    return re.sub(r"<style.*?</style>", "", page, flags=re.DOTALL)


def test_page_says_what_is_simulated_and_holds_all_figures(right, tmp_path):
    summary, _, _ = right
    page = write_closing_page(summary, tmp_path / "page.html").read_text("utf-8")
    assert page.count("<figure") == 4
    assert "TWIN" in without_styles(page)
    assert "No robot was driven" in page
    for row in goal_table(summary).rows:
        assert row[0] in page


def test_a_page_of_half_a_study_says_so(right, tmp_path):
    _, folder, _ = right
    adopt_plan(tmp_path, PLAN)
    for path in (folder / "units").glob("slow-*.json"):
        (tmp_path / "units" / path.name).write_text(path.read_text())
    summary = summarize_closing(tmp_path)
    page = write_closing_page(summary, tmp_path / "page.html").read_text("utf-8")
    assert "5 of 10 parts are done" in page


def test_a_folder_of_another_plan_is_left_alone_and_more_twins_extend_it(tmp_path):
    adopt_plan(tmp_path, PLAN)
    with pytest.raises(RecordError, match="trials was 8, is 9"):
        adopt_plan(tmp_path, replace(PLAN, trials=9))
    with pytest.raises(RecordError, match="observations was"):  # its transfer is of both ways to observe
        adopt_plan(tmp_path, replace(PLAN, observations=("cells",)))
    adopt_plan(tmp_path, replace(PLAN, twins=3))
    assert json.loads((tmp_path / "plan.json").read_text())["twins"] == 3
    with pytest.raises(RecordError, match="realitygap closing-the-gap"):
        summarize_closing(tmp_path / "nothing")


def test_the_plan_is_that_of_the_question():
    plan = ClosingPlan()
    assert (len(plan.families), plan.twins, plan.budgets) == (4, 10, (0, 10, 20, 40))
    assert (plan.controllers, plan.trials, plan.observations) == (30, 20, ("cells", "track"))
    assert [str(name) for name in plan.names[:5]] == [
        *("close-1000", "worn-1000", "slippery-1000", "delayed-1000", "close-1001")
    ]


def test_held_out_controllers_are_half_random_and_half_champions():
    genomes = controllers(6)
    assert len(genomes) == 6
    assert [genome.to_json() for genome in genomes] == [genome.to_json() for genome in controllers(6)]


def test_pooled_fall_is_of_mean_squares_and_its_interval_covers_the_truth():
    assert pooled_fall([0.3, 0.4], [0.3, 0.4]).value == pytest.approx(0.0)
    half = pooled_fall([0.3, 0.4], [0.15, 0.2])
    assert (half.value, half.low, half.high) == pytest.approx((0.5, 0.5, 0.5))
    assert pooled_fall([0.0, 0.0], [0.1, 0.1]).value is None
    one = pooled_fall([0.2], [0.1])
    assert (one.value, one.ends) == (0.5, None)
    rng = np.random.default_rng(1)
    before = 0.08 * np.exp(0.25 * rng.normal(size=(1000, 8)))
    after = 0.02 * np.exp(0.5 * rng.normal(size=(1000, 8)))
    truth = 1 - 0.25 * np.exp(0.5**2 - 0.25**2)  # roots of the means of lognormal squares
    covers = [found.low <= truth <= found.high for found in map(pooled_fall, before, after)]
    # 93.7 %; a right interval of 95 % would be outside these limits once in a thousand seeds
    assert 0.91 <= np.mean(covers) <= 0.975


def test_plan_of_other_platforms_has_sittings_and_leaves_out_what_cannot_be_seen():
    plan, small = PLANS["thymio"]
    assert [str(name) for name in plan.names[:4]] == ["enki-21", "playground-21", "enki-22", "enki-23"]
    assert len(plan.names) == 9
    units = {name.family: list(plan.units(name)) for name in plan.names}
    assert "gap-encoders-20" in units["enki"]
    assert units["playground"] == ["judged", "gap-none-0", "gap-track-20", "gap-track-10", "gap-track-40"]
    assert len({plan.seed_of_controllers(name) for name in plan.names}) == 8  # of each sitting
    assert small.n_units == 4


def test_plan_of_the_playground_begins_with_a_robot_that_has_its_sensors():
    plan = PLANS["playground"][0]
    assert [str(name) for name in plan.names] == ["playground-31"]
    assert list(plan.platforms) == ["playground"]
    robot = choose_condition(plan.study, None, plan.seed).on.robot
    assert all(sensor.keeps_edge for sensor in robot.range)


def test_plan_of_fresh_twins_shares_no_twin_and_no_controllers_with_the_first():
    plan, first = PLANS["fresh"][0], PLANS["twins"][0]
    assert len(plan.names) == 24
    assert not set(plan.names) & set(first.names)
    seeds = {plan.seed_of_controllers(name) for name in plan.names}
    assert seeds == set(range(2026112800 + 5000, 2026112800 + 5006))
    assert plan.n_units == 24 * 4  # no transfers


def test_folder_made_before_plans_of_other_platforms_opens(right, tmp_path):
    _, folder, _ = right
    shutil.copytree(folder, tmp_path / "old")
    path = tmp_path / "old" / "plan.json"
    plan = json.loads(path.read_text())
    for name in (
        "study",
        "platforms",
        "unseen",
        "fewer",
        "controllers_seed",
        "has_own_controllers",
        "transfers",
    ):
        del plan[name]
    path.write_text(json.dumps(plan))
    assert summarize_closing(tmp_path / "old")["goals"] == summarize_closing(folder)["goals"]
    adopt_plan(tmp_path / "old", PLAN)


def test_command_judges_and_calibrates_a_twin_and_drives_what_is_transferred(tmp_path, monkeypatch):
    pytest.importorskip("mujoco", reason="twins need the extra twin")
    sizes = {
        "controllers": 4,
        "trials": 2,
        "budgets": (0, 2),
        "observations": ("track",),
        "transfer_budget": 4,
    }
    few = replace(SMALL, families=("worn",), fresh_trials=2, runs=4, repeats=2, **sizes)
    monkeypatch.setitem(PLANS, "twins", (few, few))
    words = ["closing-the-gap", "--small", "--processes", "1", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, words, catch_exceptions=False)
    assert done.exit_code == 0
    summary = summarize_closing(tmp_path / "out")
    assert summary["n_done"] == summary["n_units"] == 4
    assert summary["label"] == "TWIN"
    for row in goal_table(summary).rows:
        assert row[0] in done.output
    assert "transfer" in (tmp_path / "out" / "report.html").read_text("utf-8")


@needs_enki
def test_sitting_on_another_platform_is_judged_and_calibrated(tmp_path):
    build_enki()
    study = tmp_path / "study.toml"
    study.write_text(
        '[study]\nname = "thymio"\n[platform.sim]\nrobot = "thymio"\nstep_s = 0.5\n'
        '[[condition]]\nname = "coverage"\nplatform = "sim"\nselection = "coverage"\n'
    )
    sizes = {"controllers": 4, "trials": 2, "budgets": (0, 2), "observations": ("track",)}
    few = replace(PLANS["thymio"][1], study=str(study), **sizes)
    summary = closing_the_gap(tmp_path, few, processes=1)
    assert summary["n_done"] == summary["n_units"] == 3
    assert [goal["name"] for goal in summary["goals"]] == [
        *("fall of the RMS gap, enki, track", "fall of the RMS gap, enki, track, random"),
        *("fall of the RMS gap, enki, track, champions", "disattenuated SRCC, enki, track"),
    ]
    assert summary["label"] == "EMULATED"
    page = write_closing_page(summary, tmp_path / "page.html").read_text("utf-8")
    assert "a simulator of other authors" in page
    assert "TWIN" not in without_styles(page)
