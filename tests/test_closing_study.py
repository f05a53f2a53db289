"""The study `closing-the-gap`: its seeds, what it resumes, and its analysis, on results whose truth is known."""

import csv
import io
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from benchmarks.closing.analysis import (
    excess_violation,
    pooled_fall,
    primary,
    square_gap,
    stratified_mean,
    violations_over_floors,
)
from benchmarks.closing.figures import draw
from benchmarks.closing.plan import (
    COMMIT_FILE,
    FAMILIES,
    PLAN_FILE,
    Arm,
    Plan,
    Twin,
    Unit,
    parse_plan,
    small_plan,
)
from benchmarks.closing.results import Results, collect, read_collected
from benchmarks.closing.tables import (
    TABLES,
    _bootstrap,
    _bootstrap_of_falls,
    as_csv,
    flagged,
    identified,
    prediction,
)
from benchmarks.closing.twin import TwinOfStudy

ROOT = Path(__file__).parent.parent
ARMS = tuple(Arm(name, "none") for name in ("plain", "prior", "cells", "track"))
FIT = {"name": "drive.gain", "estimate": 1.0, "low": 0.9, "high": 1.1, "prior_low": 0.5, "prior_high": 1.5,
       "identified": True, "unit": ""}  # fmt: skip


def plan_of(n=8, **changes):
    """Return a plan with n twins of each family, whose goals are those of the study."""
    plan = Plan(
        digest="a", commit="b", twins=dict.fromkeys(FAMILIES, n), arms=ARMS,
        tasks={"arms": (), "names": ()}, goals=small_plan().goals,
    )  # fmt: skip
    return replace(plan, **changes)


def made_up(plan, gap, transfer=0.0, seed=0):
    """Return results in which each arm's controllers score `gap[arm]` too much in simulation, times a random number."""
    rng = np.random.default_rng(seed)
    n, trials = plan.controllers, plan.trials
    units = {}
    for twin in plan.names():
        truth = rng.uniform(0.2, 0.8, 2 * n)

        def tried(means, trials=trials):
            return (means[:, None] + rng.normal(0, 0.05, (len(means), trials))).tolist()

        head = {"plan": plan.digest, "code": "c", "software": "1", "seconds": 1.0, "label": "TWIN"}
        kinds = ["random"] * n + ["champion"] * n
        units[twin, Unit("coverage", "judged")] = head | {
            "kinds": kinds,
            "scores": [tried(truth), tried(truth)],
        }
        for arm in plan.arms:
            off = gap[arm.name] * rng.normal(1, 0.2, 2 * n)
            better = transfer if arm.name in ("cells", "track") else 0.0
            level = rng.normal(0.5, 0.02, plan.replicates) + better
            champions = [
                {"target": tried(np.array([one]))[0], "simulated": tried(np.array([one + gap[arm.name]]))[0]}
                for one in level
            ]
            units[twin, Unit("coverage", arm.name)] = head | {
                "scores": tried(truth + off),
                "champions": champions,
                "calibration": {"misspecified": False, "misspecification_p": 0.5, "fitted": [FIT]},
            }
    return Results(plan, units)


def test_seeds_depend_on_the_commit_the_twin_and_the_purpose():
    plan = plan_of()
    seeds = {
        which.seed_of(Twin(family, k), purpose)
        for which in (plan, replace(plan, commit="c"))
        for family in FAMILIES
        for k in range(8)
        for purpose in ("twin", "fit")
    }
    assert len(seeds) == 2 * 4 * 8 * 2
    assert plan.seed_of(Twin("worn", 3), "twin") == 1_886_636_496  # the same on each machine


def test_all_goals_are_met_by_a_calibration_that_closes_the_gap():
    gap = {"plain": 0.2, "prior": 0.2, "cells": 0.05, "track": 0.02}
    rows = primary(made_up(plan_of(), gap, transfer=0.1))
    assert [row["verdict"] for row in rows] == ["met"] * 8
    falls = [row["figure"] for row in rows if row["goal"].startswith("P3")]
    assert np.allclose(falls, [0.75, 0.9], atol=0.05)


def test_no_goal_is_met_by_a_calibration_that_changes_nothing():
    rows = primary(made_up(plan_of(), dict.fromkeys(("plain", "prior", "cells", "track"), 0.2)))
    verdicts = {row["goal"][:2]: row["verdict"] for row in rows}
    assert verdicts == {"P1": "open", "P2": "open", "P3": "missed", "P4": "missed"}


def test_intervals_of_the_stratified_mean_cover_as_often_as_they_say():
    """2,000 studies of 8 normal values in each of 4 families; by chance alone 94.0 to 96.0 % in 96 of 100 seeds."""
    rng = np.random.default_rng(1)
    families = [name for name in FAMILIES for _ in range(8)]
    centers = np.repeat([0.0, 1.0, 2.0, 5.0], 8)
    found = [stratified_mean(rng.normal(centers, 1.0), families).ends for _ in range(2000)]
    assert 0.94 < np.mean([low <= 2.0 <= high for low, high in found]) < 0.96


def test_the_pooled_fall_is_that_of_both_root_mean_squares():
    before, after = [0.04, 0.01, 0.04, 0.01], [0.01, 0.0025, 0.01, 0.0025]
    found, _ = pooled_fall(before, after, ["a", "a", "b", "b"], 0.4)
    assert found.value == pytest.approx(0.5)


def test_a_limit_at_the_truth_is_refuted_about_as_often_as_the_level_says():
    """200 studies of 32 twins; more than 24 below 5 % occur in 1 of 10,000 seeds at a level of 5 %."""
    rng = np.random.default_rng(2)
    families = [name for name in FAMILIES for _ in range(8)]
    n_refuted = 0
    for _ in range(200):
        before = rng.gamma(4.0, 0.01, 32)
        after = before / 4 * rng.gamma(20.0, 1 / 20, 32)  # half of the root mean square
        n_refuted += pooled_fall(before, after, families, 0.5)[1] < 0.05
    assert n_refuted <= 24


def test_a_calibration_that_leaves_no_gap_meets_its_goals():
    """The mean squares after it are noise about 0, in part negative."""
    results = made_up(plan_of(), {"plain": 0.2, "prior": 0.2, "cells": 0.0, "track": 0.0}, transfer=0.1)
    rows = primary(results)
    assert [row["verdict"] for row in rows] == ["met"] * 8


def test_there_is_no_verdict_before_all_units_exist():
    results = made_up(plan_of(), {"plain": 0.2, "prior": 0.2, "cells": 0.05, "track": 0.02}, transfer=0.1)
    del results.units[Twin("worn", 7), Unit("coverage", "track")]
    assert {row["verdict"] for row in primary(results)} == {"none: 1 unit missing"}


def test_npe_is_of_the_twins_with_an_even_index():
    plan = replace(small_plan(), twins=dict.fromkeys(FAMILIES, 3))
    with_npe = [twin.index for twin in plan.names() if Unit("coverage", "npe") in plan.units(twin)]
    assert sorted(with_npe) == [0] * 4 + [2] * 4
    assert all(Unit("coverage", "cma-es") in plan.units(twin) for twin in plan.names())


def test_an_arm_whose_fit_failed_scores_as_plain():
    results = made_up(plan_of(), {"plain": 0.2, "prior": 0.2, "cells": 0.05, "track": 0.02})
    twin = Twin("worn", 7)
    results.units[twin, Unit("coverage", "track")] |= {"failed": "no", "scores": [], "champions": []}
    (row,) = [row for row in flagged(results) if (row["family"], row["simulator"]) == ("worn", "track")]
    assert (row["failed"], row["rejected"]) == (1, 0)
    assert square_gap(results, twin, "track", "random") == square_gap(results, twin, "plain", "random")


def test_a_perfect_simulator_has_no_excess_of_rank_violations():
    """The mean over 32 twins; its standard error is about 0.002."""
    results = made_up(plan_of(), dict.fromkeys(("plain", "prior", "cells", "track"), 0.0), seed=3)
    excess = [excess_violation(results, twin, "track") for twin in results.twins()]
    assert abs(np.mean(excess)) < 0.01
    over = np.array([violations_over_floors(results, twin, "track") for twin in results.twins()])
    assert 0.8 < np.median(over[:, 0]) < 1.25  # the standard error is about 0.1
    assert 0.2 < np.median(over[:, 1]) < 1.0  # halves have half of the trials, so they are noisier


def written(results, folder):
    """Write results as `run` does."""
    (folder / "units").mkdir()
    for (twin, unit), result in results.units.items():
        (folder / "units" / f"{twin}-{unit}.json").write_text(json.dumps(result))
    return folder


def test_the_bootstrap_is_as_wide_as_the_interval_of_the_mean():
    """32 twins without noise of replicates; the bootstrap of 8 values lacks a factor of the root of 7 / 8."""
    rng = np.random.default_rng(4)
    pairs = [(family, np.array([rng.normal()])) for family in FAMILIES for _ in range(8)]
    low, high = _bootstrap(pairs, rng)
    mean = stratified_mean([float(each[0]) for _, each in pairs], [family for family, _ in pairs])
    ratio = (high - low) / (mean.ends[1] - mean.ends[0])
    assert 0.8 < ratio < 1.0


def test_the_bootstrap_of_falls_is_about_as_wide_as_fieller_s_interval():
    rng = np.random.default_rng(5)
    squares = [
        (family, np.array([0.04, 0.01]) * rng.gamma(20.0, 1 / 20, 2)) for family in FAMILIES for _ in range(8)
    ]
    low, high = _bootstrap_of_falls(squares, rng)
    fall, _ = pooled_fall(*np.array([each for _, each in squares]).T, [family for family, _ in squares], 0.0)
    assert low < fall.value < high
    assert 0.7 < (high - low) / (fall.ends[1] - fall.ends[0]) < 1.05


def test_the_collected_results_are_those_of_the_units(tmp_path):
    """A fit that failed is one of them."""
    results = made_up(plan_of(2), {"plain": 0.2, "prior": 0.2, "cells": 0.05, "track": 0.02})
    failed = Twin("worn", 1), Unit("coverage", "track")
    results.units[failed] |= {
        "failed": "No draw: all were lost.",
        "scores": [],
        "champions": [],
        "calibration": None,
    }
    collect(results.plan, written(results, tmp_path), tmp_path / "out")
    again = read_collected(results.plan, tmp_path / "out")
    for name, rows in TABLES.items():
        if name != "sensitivity":
            assert as_csv(rows(again)) == as_csv(rows(results)), name
    assert again.units[failed]["failed"] == "No draw: all were lost."
    assert identified(again) == [
        {"parameter": "drive.gain", "identified, cells": "8 of 8", "identified, track": "7 of 7"}
    ]
    assert [row["failed fits"] for row in prediction(again)] == ["0", "0", "0", "1"]
    with pytest.raises(SystemExit, match="another plan"):
        read_collected(replace(results.plan, digest="changed"), tmp_path / "out")


@pytest.mark.parametrize("fault", ["plan", "code", "infinite", "no judge"])
def test_results_that_cannot_be_those_of_the_study_are_refused(tmp_path, fault):
    results = made_up(plan_of(1), dict.fromkeys(("plain", "prior", "cells", "track"), 0.1))
    unit = results.units[Twin("worn", 0), Unit("coverage", "track")]
    if fault == "no judge":
        del results.units[Twin("worn", 0), Unit("coverage", "judged")]
    elif fault == "infinite":
        unit["scores"][3][2] = float("nan")
    else:
        unit[fault] = "changed"
    says = {
        "plan": "another plan",
        "code": "2 states",
        "infinite": "not finite",
        "no judge": "coverage-judged",
    }
    with pytest.raises(SystemExit, match=says[fault]):
        collect(results.plan, written(results, tmp_path), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_damaged_facts_are_refused_with_the_command_that_writes_them(tmp_path):
    plan = plan_of(1)
    for name in ("scores.parquet", "fits.parquet"):
        (tmp_path / name).touch()
    (tmp_path / "facts.json").write_text("{")
    with pytest.raises(SystemExit, match="closing collect"):
        read_collected(plan, tmp_path)


def test_the_published_tables_follow_from_the_published_scores():
    plan = parse_plan(PLAN_FILE.read_bytes(), COMMIT_FILE.read_text().strip())  # the history may be shallow
    results = read_collected(plan, PLAN_FILE.parent)
    for name, rows in TABLES.items():
        path = PLAN_FILE.with_name(f"{name}.csv")
        if name == "sensitivity":  # which needs statsmodels
            assert {row["goal"][:2] for row in csv.DictReader(io.StringIO(path.read_text()))} == {
                "P1",
                "P2",
                "P3",
                "P4",
            }
        else:
            assert as_csv(rows(results)) == path.read_text(), name


def test_the_numbers_of_the_answer_are_those_of_the_tables():
    answer = (ROOT / "docs/explanations/closing-the-gap.md").read_text("utf-8")
    answer = answer.split("## Answer")[1].split("## Goals")[0]
    tables = "".join(PLAN_FILE.with_name(f"{name}.csv").read_text("utf-8") for name in TABLES)
    numbers = re.findall(r"[+−]?\d+\.\d+|\d+ %|\d+ of \d+", answer)
    assert len(numbers) > 20
    assert [each for each in numbers if each not in tables] == [
        "2 of 4"
    ]  # a row of `flagged` has its two numbers


def test_a_folder_without_results_or_scores_is_refused_with_the_command_that_makes_them(tmp_path):
    with pytest.raises(SystemExit, match="closing run"):
        collect(plan_of(1), tmp_path, tmp_path / "out")
    with pytest.raises(SystemExit, match="closing collect"):
        draw(plan_of(1), tmp_path, tmp_path / "figures")
    assert not list(tmp_path.iterdir())


def test_each_figure_shows_all_arms_that_it_is_about(tmp_path):
    arms = tuple(Arm(name, "none") for name in ("plain", "prior", "cells", "track-10", "track", "track-40"))
    plan = plan_of(2, arms=arms)
    results = made_up(plan, {arm.name: 0.1 for arm in arms})
    collect(plan, written(results, tmp_path), tmp_path)
    draw(plan, tmp_path, tmp_path / "figures")
    shown = {path.stem: path.read_text() for path in (tmp_path / "figures").iterdir()}
    assert shown.keys() == {"scatter", "falls", "evolved", "budget"}
    names = {
        "scatter": ["320 controllers on 8 twins"],
        "falls": ["prior", "cells", "track-10", "track", "track-40"],
        "evolved": [arm.name for arm in arms],
        "budget": ["close", "worn", "slippery", "delayed"],
    }
    for figure, texts in names.items():
        assert [text for text in texts if f">{text}<" not in shown[figure]] == [], figure


@pytest.mark.slow
def test_a_twin_is_taken_up_where_it_was_left(tmp_path):
    few = {"controllers": 2, "trials": 2, "replicates": 1, "runs": 2, "repeats": 1, "fresh_trials": 2}
    arms = (Arm("plain", "none"), Arm("prior", "prior", evolves=False), Arm("path", "path", evolves=False))
    outside = Arm("npe", "outside")
    plan = replace(small_plan(), **few, twins={"same": 1}, budget=4, arms=(*arms, outside), fresh_simulated=2)
    for part in ("twins", "units", "fits", "trials"):
        (tmp_path / part).mkdir()
    twin = TwinOfStudy(plan, Twin("same", 0), tmp_path)
    assert [unit.what for unit in twin.missing] == [
        "judged",
        "plain",
        "prior",
        "path",
    ]  # no fit of the other yet
    twin.carry_out()
    assert twin.missing == []
    scores = {path.name: path.read_bytes() for path in (tmp_path / "units").iterdir()}
    removed = tmp_path / "units" / "same-0-coverage-path.json"
    removed.unlink()
    twin.carry_out()
    again = {path.name: path.read_bytes() for path in (tmp_path / "units").iterdir()}
    assert again.keys() == scores.keys()
    for name, before in scores.items():
        assert json.loads(again[name])["scores"] == json.loads(before)["scores"]
