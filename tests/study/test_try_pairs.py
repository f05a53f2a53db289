"""Comparisons of two controllers: planned in the ledger, resumed, repeated in blocks, and advised on."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from realitygap.errors import RecordError, StudyError
from realitygap.evolution import NeatSettings, Population
from realitygap.lab._counts import Counts
from realitygap.lab._saved import SavedFile
from realitygap.records import Ledger, ResultsFolder
from realitygap.stats import SequentialTest
from realitygap.study import (
    advise,
    advise_on,
    gap_between,
    plan_gap,
    run_transfer,
    try_genome,
    try_pairs,
)
from realitygap.study._advise import strategy_differences
from realitygap.study._gap.plan import Spreads
from realitygap.study._paired import Blocks

from ..cli.invoked import answered
from .physical import drive, small_study


@pytest.fixture
def two(tmp_path):
    """Two controllers of which the first covers more, and the settings of a short comparison on sim."""
    settings = NeatSettings.named("rosenzweig-remy", population=2)
    for name, seed in (("one", 5), ("two", 9), ("three", 14)):
        Population(3, 2, settings, seed=seed).ask()[0].save(tmp_path / f"{name}.json")
    return {
        "genome": tmp_path / "one.json",
        "against": tmp_path / "two.json",
        "on": "sim",
        "steps": 40,
        "trials": 30,
        "out": tmp_path / "pairs.sqlite",
    }


def test_comparison_is_stored_before_trial_1_and_ends_when_something_is_shown(two):
    looks = []
    tried = try_pairs(**two, tell=looks.append)
    comparison = tried.advice.comparisons[0]
    assert (comparison.first, comparison.second, comparison.look.verdict) == ("one", "two", "higher")
    assert comparison.look.n == len(looks) == comparison.look.claimed_at < 30
    assert tried.advice.planned == "planned"
    with Ledger.open(two["out"], writable=False) as ledger:
        events = ledger.events()
        assert events[0]["what"] == "comparison planned"
        plan = events[0]["details"]
        assert SequentialTest.from_dict(plan["test"]) == SequentialTest()
        assert (plan["maximum"], len(plan["order"]), set(plan["order"])) == (30, 30, {"A", "B"})
        assert len(ledger.trials()) == 2 * comparison.look.n
        by_turn = [trial.controller for trial in ledger.trials()]
    firsts = [by_turn[0] if letter == plan["order"][0] else by_turn[1] for letter in plan["order"]]
    assert by_turn[::2] == firsts[: comparison.look.n], "the coin decides which goes first"
    assert advise(two["out"]).to_dict() == tried.advice.to_dict(), "a function of the ledger alone"


def test_resuming_a_comparison_changes_nothing(two, tmp_path):
    whole = try_pairs(**two).advice

    class StopError(Exception):
        pass

    def stop(advice):
        if advice.comparisons[0].look.n == 3:
            raise StopError

    again = {**two, "out": tmp_path / "again.sqlite"}
    with pytest.raises(StopError):
        try_pairs(**again, tell=stop)
    assert advise(again["out"]).comparisons[0].look.n == 3
    assert try_pairs(**again).advice.to_dict() == whole.to_dict()


def test_void_trial_repeats_its_whole_pair(two):
    before = try_pairs(**two).advice.comparisons[0].look.n
    with Ledger.open(two["out"]) as ledger:
        ledger.void(5, "it was pushed")
    assert advise(two["out"]).comparisons[0].look.n == before - 1
    after = try_pairs(**two).advice
    assert after.comparisons[0].look.n == before
    with Ledger.open(two["out"], writable=False) as ledger:
        states = {trial.trial: trial.state for trial in ledger.trials()}
        assert [number for number, state in states.items() if state == "void"] == [5, 6]
        assert len(states) == 2 * before + 2


def test_pair_counts_only_if_both_trials_stand_together(two):
    try_pairs(**two)
    with Ledger.open(two["out"]) as ledger:
        blocks = Blocks(*(lambda plan: (tuple(plan["controllers"]), plan["order"]))(ledger.comparison().plan))
        assert list(blocks.complete(ledger)) == list(range(len(ledger.trials()) // 2))
        ledger.undo(1)
        assert 0 not in blocks.complete(ledger), "a trial without a score is none"


def test_wrong_comparisons_are_refused_and_leave_the_plan_alone(two, tmp_path):
    try_pairs(**two)
    with pytest.raises(RecordError, match="other controllers"):
        try_pairs(**{**two, "against": tmp_path / "three.json"})
    with pytest.raises(RecordError, match="another order of trials"):
        try_pairs(**{**two, "seed": 7})
    with pytest.raises(StudyError, match="same controller"):
        try_pairs(**{**two, "against": two["genome"], "out": tmp_path / "same.sqlite"})
    for wrong, message in (
        ({"trials": 5}, "at least 6 pairs"),
        ({"out": None}, "stored before its first trial"),
        ({"against": None, "margin": 0.1}, "second controller"),
    ):
        with pytest.raises(StudyError, match=message):
            try_pairs(**{**two, **wrong})
    with Ledger.open(two["out"], writable=False) as ledger:
        assert [event["what"] for event in ledger.events()].count("comparison planned") == 1


def test_another_test_than_the_planned_one_is_reported(two):
    try_pairs(**two)
    assert advise(two["out"], margin=0.05).planned == "changed"
    assert advise(two["out"], null="mean").planned == "changed"
    try_pairs(**{**two, "margin": 0.5})
    assert advise(two["out"]).planned == "changed"
    try_pairs(**two)
    assert advise(two["out"]).planned == "planned"


def test_error_rate_is_that_of_the_order(two):
    with pytest.raises(StudyError, match="at least 8 pairs"):
        try_pairs(**{**two, "trials": 7}, alpha=0.01)
    tried = try_pairs(**two, alpha=0.01).advice
    assert (tried.test.alpha, tried.planned) == (0.01, "planned")
    assert tried.comparisons[0].e >= 100


def test_equivalence_ends_a_comparison(two, tmp_path):
    alike = {**two, "genome": tmp_path / "two.json", "against": tmp_path / "three.json", "margin": 0.2}
    comparison = try_pairs(**alike).advice.comparisons[0]
    assert comparison.look.verdict == "equivalent"
    low, high = comparison.shift.ends
    assert -0.2 <= low < high <= 0.2


def test_file_without_a_plan_says_that_nobody_planned_the_looks(two):
    single = {name: two[name] for name in ("on", "steps", "out")} | {"trials": 8}
    try_genome(**single, genome=two["genome"])
    with pytest.raises(RecordError, match="without a comparison"):
        try_pairs(**two)
    with pytest.raises(StudyError, match="1 controller, expected 2"):
        advise(two["out"])
    with Ledger.open(two["out"]) as ledger:
        other = json.loads(two["against"].read_text())
        for k in range(7):
            record = ledger.record(k + 1)
            ledger.append(replace(record, genome=json.dumps(other), number=record.number, cells=(13,)))
    advice = advise(two["out"])
    assert advice.planned == "unplanned"
    assert advice.comparisons[0].look.n == 7
    assert "Nobody planned" in " ".join(advice.sentences)


def test_several_comparisons_share_the_error_rate():
    rng = np.random.default_rng(8)
    differences = [("b", "a", rng.normal(0.2, 0.05, 7)), ("c", "a", rng.normal(0.0, 0.05, 7))]
    alone = advise_on(differences[:1], test=SequentialTest(), score="coverage", label="SIM")
    both = advise_on(differences, test=SequentialTest(), score="coverage", label="SIM")
    assert both.comparisons[0].e == pytest.approx(alone.comparisons[0].e / 2)
    assert both.test.alpha == pytest.approx(0.025)
    assert "2 comparisons" in " ".join(both.sentences)
    champions = [(name, 8, k, [k / 10 + 0.1 * n]) for k in range(3) for n, name in enumerate("ab")]
    ((first, second, values),) = strategy_differences(champions)
    assert (first, second, list(values)) == ("b", "a", pytest.approx([0.1, 0.1, 0.1]))


def test_scores_of_other_ranges_are_scaled_and_those_without_a_range_refused():
    values = np.array([8.0, 12.0, 9.0, 11.0, 10.0, 8.0, 9.0])
    advise_in = partial(advise_on, test=SequentialTest(margin=30.0), score="points", label="SIM")
    wide = advise_in([("a", "b", values)], score_range=(0.0, 100.0)).comparisons[0]
    assert wide.look.test.margin == pytest.approx(0.3)
    assert wide.shift.value == pytest.approx(values.mean())
    with pytest.raises(StudyError, match="no maximum"):
        advise_in([("a", "b", values)], score_range=(0.0, np.inf))


def test_command_prints_and_advises(two):
    words = ["try", two["genome"], "--against", two["against"], "--on", "sim", "--steps", 40, "--trials", 30]
    out = answered(*words, "-o", two["out"])
    assert "Stop: one is better than two" in out
    assert "same distribution of scores" in out
    values = json.loads(answered("trials", "advise", two["out"], "--json"))
    assert values["planned"] == "planned"
    assert values["comparisons"][0]["verdict"] == "higher"
    for wrong, message in (
        (("trials", "advise", two["out"], "--margin", "-1"), "above 0"),
        (("trials", "advise", two["out"], "--null", "median"), "expected distribution or mean"),
        (("trials", "list", two["out"], "--margin", "0.1"), "only for advise"),
        (("trials", "advise", "nothing.sqlite"), "no ledger"),
    ):
        assert message in answered(*wrong)


def test_gap_stores_its_rounds_and_more_trials_continue_the_looks(tmp_path):
    order = {"n_controllers": 4, "results": tmp_path / "gap.sqlite", "observe": "cells"}
    part = gap_between("sim", "sim:scribbler-s1", trials=3, **order)
    assert part.study.advice.comparisons[0].look.n == 3
    whole = gap_between("sim", "sim:scribbler-s1", trials=7, **order).study
    comparison = whole.advice.comparisons[0]
    rounds = whole.target.values.mean(axis=0) - whole.source.values.mean(axis=0)
    assert comparison.look.n == 7
    assert comparison.shift.value == pytest.approx(rounds.mean())
    assert comparison.look.e == pytest.approx(SequentialTest().look(rounds).e)
    assert (comparison.first, comparison.second) == ("sim with scribbler-s1", "sim"), "no folder of a file"
    assert whole.advice.planned == "planned"
    assert advise(order["results"]).to_dict() == whole.advice.to_dict()
    with Ledger.open(order["results"], writable=False) as ledger:
        plans = [each["details"] for each in ledger.events() if each["what"] == "comparison planned"]
        assert [len(plan.get("rounds", ())) for plan in plans] == [0, 3, 7]
    assert gap_between("sim", "jyro", n_controllers=2, trials=1).study.advice is None, "nothing is saved"


def test_gap_that_is_not_complete_says_what_to_do(tmp_path):
    two = {"n_controllers": 2, "trials": 2, "results": tmp_path / "gap.sqlite"}
    gap_between("sim", "jyro", **two)
    with Ledger.open(two["results"]) as ledger:
        plan = dict(ledger.comparison().plan)
        del plan["rounds"]
        ledger.plan_comparison(plan)
    with pytest.raises(StudyError, match="to the end"):
        advise(two["results"])


def test_transfer_compares_strategies_over_replicates(tmp_path):
    order = {
        "study": "sim-paper",
        "to": "jyro",
        "strategy": ("plain", "select"),
        "budget": (2,),
        "out": tmp_path / "t",
    }
    small = {"runs": 2, "repeats": 1, "replicates": 2, "fresh_trials": 2}
    result = run_transfer(**order, **small)
    comparison = result.advice.comparisons[0]
    assert (comparison.first, comparison.second, comparison.look.n) == ("select", "plain", 2)
    assert advise(tmp_path / "t").to_dict() == result.advice.to_dict()


def test_conditions_of_a_study_are_compared_run_by_run(tmp_path):
    other = '[[condition]]\nname = "novel"\nselection = "novelty"\nplatform = "scribbler"\n'
    looks = "[trials]\nnull = 'mean'\nmargin = 0.1\n"
    drive(small_study(more=other + looks, replicates="2"), tmp_path)
    advice = advise(tmp_path)
    comparison = advice.comparisons[0]
    assert (comparison.first, comparison.second, comparison.look.n) == ("novel", "robot", 2)
    assert (advice.planned, advice.maximum, advice.unit) == ("planned", 2, "run")
    assert advice.test == SequentialTest(null="mean", margin=0.1)


def test_sequential_plan_has_the_pairs_next_to_the_fixed_design():
    plan = plan_gap(effect=0.1, sequential=True, spreads=Spreads(0.1, 0.2, "a test"))
    assert (plan.pairs.fixed, plan.pairs.maximum) == (18, 40)
    assert plan.needed == ()
    strict = plan_gap(effect=0.1, sequential=True, alpha=0.01, spreads=Spreads(0.1, 0.2, "a test"))
    assert (strict.pairs.fixed, strict.pairs.maximum) == (27, 58)
    with pytest.raises(StudyError, match="needs"):
        plan_gap(margin=0.1, sequential=True)


def test_lab_shows_what_pairs_and_runs_show(two, tmp_path):
    tried = try_pairs(**two)
    assert SavedFile(two["out"]).read().looks == tuple(tried.advice.sentences)
    folder = tmp_path / "study"
    other = '[[condition]]\nname = "novel"\nselection = "novelty"\nplatform = "scribbler"\n'
    for is_blind in (False, True):
        study = small_study(more=other + f"\n[trials]\nblind = {str(is_blind).lower()}\n")
        drive(study, folder)
        looks = Counts(folder, ResultsFolder.open(folder).description).looks()
        assert looks == ("" if is_blind else advise(folder).summary)
