"""Locked designs of comparisons: order, blinding of every view, amendments, unblinding, and deviations."""

from __future__ import annotations

import json
import os
import re
import signal
import sys
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realitygap.errors import RealityGapError, RecordError, StudyError
from realitygap.evolution import NeatSettings, Population
from realitygap.lab._counts import Counts
from realitygap.lab._lab import Lab
from realitygap.lab._mistakes import FormError
from realitygap.lab._saved import SavedFile
from realitygap.orders import OrderError
from realitygap.records import (
    LOCKED,
    RESUMED,
    DesignEvent,
    DrivenTrial,
    Ledger,
    LockedDesign,
    ResultsFolder,
    open_ledger,
    secret_path,
)
from realitygap.report import write_report
from realitygap.study import (
    BlindAdvice,
    _design,
    _deviations,
    advise,
    amend_design,
    design_report,
    drive_study,
    estimate_score,
    gap_between,
    make_calibration,
    run_transfer,
    sample_controllers,
    try_pairs,
    unblind_design,
    write_fieldtrial,
)

from ..cli.invoked import answered, printed
from ..forks import fork_context
from ..trials.fake_robot import FakeRobot
from .physical import Unattended, small_study


@pytest.fixture
def two(tmp_path):
    """Two controllers of which the first covers more, and the settings of a short comparison on sim."""
    settings = NeatSettings.named("rosenzweig-remy", population=2)
    for name, seed in (("zebra", 5), ("yak", 9)):
        Population(3, 2, settings, seed=seed).ask()[0].save(tmp_path / f"{name}.json")
    return {
        "genome": tmp_path / "zebra.json",
        "against": tmp_path / "yak.json",
        "on": "sim",
        "steps": 40,
        "trials": 12,
        "out": tmp_path / "pairs.sqlite",
    }


class StopError(Exception):
    pass


@contextmanager
def stopping_after(n):
    def stop(advice):
        if getattr(advice, "n", None) == n or (advice.comparisons and advice.comparisons[0].look.n == n):
            raise StopError

    with pytest.raises(StopError):
        yield stop


def deviations(file):
    return list(design_report(file).deviations)


def order_driven(file):
    """Which arm drove each trial."""
    with open_ledger(file, writable=False) as ledger:
        arms = ledger.design().arms
        return [arms.index(trial.controller) for trial in ledger.driven()]


def test_order_follows_from_the_hash_and_a_clean_run_has_no_deviations(two):
    said = []
    tried = try_pairs(**two, lock=True, say=said.append, tell=lambda advice: said.append(advice.line))
    locked = tried.design.design
    assert said[0].endswith(f"SHA-256: {locked.sha256}"), "before trial 1"
    assert tried.design.deviations == ()
    assert tried.design.line == "Deviations from the locked plan: none."
    n = tried.advice.comparisons[0].look.n
    assert order_driven(two["out"]) == [arm for block in range(n) for arm in locked.order(block)]
    assert locked.design["settings"]["trials"] == 12
    assert tried.advice.planned == "planned"


def test_resuming_keeps_order_and_codes_and_an_unlocked_command_is_held_to_the_design(two):
    with stopping_after(3) as stop:
        try_pairs(**two, blind=True, tell=stop)
    with Ledger.open(two["out"], writable=False) as ledger:
        codes = ledger.design().codes()
    tried = try_pairs(**two)  # without --blind
    assert isinstance(tried.advice, BlindAdvice)
    assert tried.design.design.codes() == codes
    assert tried.design.deviations == ()
    locked = tried.design.design
    assert order_driven(two["out"])[:6] == [arm for block in range(3) for arm in locked.order(block)]
    with pytest.raises(StudyError, match="trials is 20, locked: 12"):
        try_pairs(**{**two, "trials": 20})
    with pytest.raises(StudyError, match="margin"):
        try_pairs(**two, margin=0.1)


def try_and_die(two, n):
    """Compare two controllers, and end as a power cut does after n pairs."""

    def die(advice):
        if advice.n == n:
            os.kill(os.getpid(), signal.SIGKILL)

    try_pairs(**two, blind=True, tell=die)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="kills processes")
def test_killed_comparison_keeps_order_and_codes(two):
    codes = []
    for n in (1, 3):
        process = fork_context().Process(target=try_and_die, args=(two, n))
        process.start()
        process.join(60)
        assert process.exitcode == -signal.SIGKILL
        with Ledger.open(two["out"], writable=False) as ledger:
            codes.append(ledger.design().codes())
    tried = try_pairs(**two)
    locked, n = tried.design.design, tried.advice.n
    assert codes == [locked.codes()] * 2
    assert order_driven(two["out"]) == [arm for block in range(n) for arm in locked.order(block)]
    assert tried.design.deviations == ()


def test_wrong_locks_are_refused(two):
    with pytest.raises(StudyError, match="stored before its first trial"):
        try_pairs(**{**two, "out": None}, lock=True)
    with pytest.raises(OrderError, match="second controller"):
        try_pairs(**{**two, "against": None}, blind=True)
    with stopping_after(1) as stop:
        try_pairs(**two, tell=stop)
    with pytest.raises(RecordError, match="before the first one"):
        try_pairs(**two, lock=True)
    for change in (amend_design, unblind_design):
        with pytest.raises(RecordError, match="no locked design"):
            change(two["out"], "late")


def test_without_a_lock_the_order_is_that_of_the_seed(two, tmp_path):
    orders = []
    for name in ("a", "b"):
        with stopping_after(2) as stop:
            try_pairs(**{**two, "out": tmp_path / f"{name}.sqlite"}, tell=stop)
        with Ledger.open(tmp_path / f"{name}.sqlite", writable=False) as ledger:
            orders.append(ledger.comparison().plan["order"])
            assert ledger.design() is None
    assert orders[0] == orders[1]
    assert design_report(tmp_path / "a.sqlite") is None


def test_no_view_shows_results_by_arm_while_the_design_is_blind(two, tmp_path):
    """Walk the commands, the functions, and what the lab reads: no name of a controller, no genome, no E, no mean."""
    file, told = two["out"], []
    tried = try_pairs(**two, blind=True, tell=lambda advice: told.append(advice.line))
    texts = {
        "told": " ".join(told),
        "result": json.dumps(tried.advice.to_dict()) + repr(tried.advice.comparisons),
    }
    words = ["try", two["genome"], "--against", two["against"], "--on", "sim", "--steps", 40, "--trials", 12]
    texts["try"] = answered(*words, "-o", file)
    for view in (
        ("list",),
        ("list", "--json"),
        ("show",),
        ("show", "--json"),
        ("show", "1"),
        ("show", "1", "--json"),
        ("show", "2", "--json"),
        ("advise",),
        ("advise", "--json"),
        ("advise", "--margin", "0.05"),
        ("agreement",),
        ("export", "-o", tmp_path / "x.jsonl"),
        ("export", "-o", tmp_path / "x.parquet"),
        ("export", "1", "-o", tmp_path / "x.mcap"),
        ("export", "--format", "fieldtrial", "--success-from", "0.1", "-o", tmp_path / "x.csv"),
    ):
        action, *rest = view
        texts[" ".join(map(str, view))] = answered("trials", action, file, *rest)
    recorded = f"recorded:{file}"
    for name, command in (
        ("gap", ("gap", "sim", recorded, "--n-controllers", 2, "--trials", 2)),
        ("estimate", ("estimate", "sim", recorded, "--trials", 2)),
        ("plan", ("plan", "--effect", "0.1", "--from", file)),
        ("calibrate", ("calibrate", "all", "--from", file, "-o", tmp_path / "fit.toml")),
        ("export-trials", ("export-trials", file, "-o", tmp_path / "y.jsonl")),
    ):
        texts[name] = answered(*command)
        assert "blind" in texts[name], (name, texts[name])
    saved = SavedFile(file).read()
    texts["lab"] = repr(saved) + " ".join(trial.name for trial in saved.trials)
    texts["lab"] += " ".join(saved.looks) + " ".join(saved.design.sentences)
    assert "Stop: the planned end is reached." in texts["lab"]
    assert "Deviations from the locked plan: none." in saved.design.sentences
    for call in (
        lambda: write_fieldtrial(file, tmp_path / "z.csv", 0.1),
        lambda: advise(file, null="mean"),
    ):
        with pytest.raises(RealityGapError, match="blind"):
            call()
    with Ledger.open(file, writable=False) as ledger:
        drivers = {each.trial: each.controller for each in ledger.driven()}
        means = [
            np.mean([len(t.cells) for t in ledger.trials() if drivers[t.trial] == arm]) / 72
            for arm in ledger.design().arms
        ]
        codes = ledger.design().codes().values()
        assert not any(code in trial.name for trial in ledger.trials() for code in codes)
    exact = [f"{abs(value):.7f}"[:-1] for value in (*means, means[0] - means[1])]
    numbers = re.compile("|".join(rf"{each}|(?<![\d.]){each[:5]}(?!\d)" for each in exact))
    for view, text in texts.items():
        for word in (
            "zebra",
            "yak",
            '"hidden"',
            "controller 1",
            "controller 2",
            "higher",
            "lower",
            "better",
            "E =",
        ):
            assert word not in text, (view, word, text)
        assert not numbers.search(text), (view, text)
        assert not re.search(r'"e":|"difference":|"verdict":', text), (view, text)
    assert not list(tmp_path.glob("x*")), "nothing was exported"


def test_unblinding_shows_results_and_is_logged(two):
    try_pairs(**two, blind=True)
    with pytest.raises(StudyError, match="reason"):
        unblind_design(two["out"], " ")
    out = printed("trials", "unblind", two["out"], "--reason", "complete", "--who", "ben")
    assert "Deviations from the locked plan: none." in out
    assert "zebra is better than yak" in printed("trials", "advise", two["out"])
    with Ledger.open(two["out"], writable=False) as ledger:
        event = ledger.design().events[-1]
        assert (event.what, event.details["who"], event.details["reason"]) == (
            "design unblinded",
            "ben",
            "complete",
        )
        assert event.details["complete"] == len(ledger.trials()) // 2
    with pytest.raises(StudyError, match="before"):
        unblind_design(two["out"], "again")


def test_early_unblinding_and_an_early_end_are_deviations(two):
    with stopping_after(2) as stop:
        try_pairs(**two, blind=True, tell=stop)
    assert deviations(two["out"]) == []
    unblind_design(two["out"], "curious", who="ben")
    early, end = deviations(two["out"])
    assert "Unblinded early, by ben" in early
    assert "after 2 of 12 pairs: curious." in early
    assert end == "Not at the planned end: 2 of 12 pairs complete."
    try_pairs(**two)
    assert [each[:15] for each in deviations(two["out"])] == ["Unblinded early"]


def test_amendments_change_the_plan_keep_the_order_and_are_listed(two):
    with stopping_after(2) as stop:
        try_pairs(**two, lock=True, tell=stop)
    for wrong, message in (
        ({"pairs": "20"}, "no setting 'pairs'"),
        ({"trials": "2"}, "at least 6 pairs"),
        ({"trials": "many"}, "trials"),
    ):
        with pytest.raises(StudyError, match=message):
            amend_design(two["out"], "a try", wrong)
    printed("trials", "amend", two["out"], "--set", "trials=20", "--reason", "varies", "--who", "ann")
    amend_design(two["out"], "the floor was replaced")
    with pytest.raises(StudyError, match="trials is 12, locked: 20"):
        try_pairs(**two)
    tried = try_pairs(**{**two, "trials": 20})
    locked, n = tried.design.design, tried.advice.comparisons[0].look.n
    assert order_driven(two["out"]) == [arm for block in range(n) for arm in locked.order(block)]
    first, second = tried.design.deviations
    assert "Amended by ann after 4 trials" in first
    assert first.endswith("varies. trials: 12 → 20.")
    assert second.endswith("the floor was replaced.")


def test_void_trials_and_repeated_pairs_are_deviations(two):
    with stopping_after(4) as stop:
        try_pairs(**two, lock=True, tell=stop)
    with Ledger.open(two["out"]) as ledger:
        ledger.void(3, "it was pushed")
    assert "Pair 2 has void trials: trial 3 (it was pushed)." in deviations(two["out"])
    (void,) = try_pairs(**two).design.deviations
    assert void.startswith("Pair 2 has void trials: trial 3 (it was pushed), trial 4 (")
    assert void.endswith("It was driven again.")


def test_other_program_and_other_robot_are_deviations(two, monkeypatch):
    with stopping_after(2) as stop:
        try_pairs(**two, lock=True, tell=stop)
    with Ledger.open(two["out"]) as ledger:
        target = ledger.design().lock["design"]["target"]
        robot = {**target, "robot": {"model": "s1"}}
        ledger.change_design(RESUMED, {"version": ledger.design().lock["version"], "target": robot})
    monkeypatch.setattr(_design, "__version__", "9.9")
    one, two_, three = try_pairs(**two).design.deviations
    assert one == "From trial 5 on: the target's robot is model s1, before unknown."
    assert two_.startswith("From trial 5 on: realitygap 9.9, before ")
    assert three == "From trial 5 on: the target's robot is unknown, before model s1."


def test_trials_out_of_order_or_out_of_the_plan_and_low_batteries_are_deviations(two):
    with stopping_after(1) as stop:
        try_pairs(**two, lock=True, tell=stop)
    with Ledger.open(two["out"]) as ledger:
        plan = _design.planned_blocks(ledger.design())
        genomes = {trial.controller: ledger.record(trial.trial).genome for trial in ledger.driven()}
        record = ledger.record(1)

        def drive(block, turn, **others):
            number, controller = plan[block][turn]
            ledger.append(replace(record, **{"number": number, "genome": genomes[controller], **others}))

        drive(1, 1)
        drive(1, 0)
        drive(2, 0, number=999)
        drive(4, 0)
        found = [each for each in deviations(two["out"]) if "planned end" not in each]
    assert found == [
        "Trial 3, of pair 2, is out of order: one of pair 2 was due.",
        "Trial 4, of pair 2, is out of order: one of pair 3 was due.",
        "Trial 5 is not in the plan: it has another controller or number.",
        "Trial 6, of pair 5, is out of order: one of pair 3 was due.",
    ]


def test_low_batteries_are_deviations(two, monkeypatch):
    facts = _design.target_facts
    monkeypatch.setattr(_design, "target_facts", lambda target: facts(target) | {"least_battery_v": 6.0})
    with stopping_after(1) as stop:
        try_pairs(**two, lock=True, tell=stop)
    with Ledger.open(two["out"]) as ledger:
        number, controller = _design.planned_blocks(ledger.design())[1][0]
        genome = next(ledger.record(t.trial).genome for t in ledger.driven() if t.controller == controller)
        ledger.append(replace(ledger.record(1), number=number, genome=genome, battery_v=5.5))
    assert "Trial 3 began with 5.50 V, expected at least 6.00 V." in deviations(two["out"])


def test_edited_design_is_reported_and_drives_nothing(two):
    with stopping_after(1) as stop:
        try_pairs(**two, lock=True, tell=stop)
    with Ledger.open(two["out"]) as ledger:
        details = json.dumps(dict(ledger.design().lock) | {"who": "another"})
        ledger._run("UPDATE events SET details = ? WHERE what = 'design locked'", details)
    assert "The record was edited" in deviations(two["out"])[0]
    with pytest.raises(RecordError, match="Nothing was driven"):
        try_pairs(**two)


def test_missing_secret_is_reported(two):
    with stopping_after(1) as stop:
        try_pairs(**two, blind=True, tell=stop)
    secret_path(two["out"]).unlink()
    assert "is missing or was replaced" in deviations(two["out"])[0]
    assert "zebra" not in printed("trials", "list", two["out"])
    assert "zebra" not in printed("trials", "show", two["out"], "--json")


def test_wrong_options_of_changes_get_one_message(two):
    try_pairs(**two, lock=True)
    for words, message in (
        (("amend", two["out"]), "--reason is missing"),
        (("amend", two["out"], "--reason", "x", "--set", "trials"), "expected NAME=VALUE"),
        (("amend", two["out"], "3", "--reason", "x"), "whole design"),
        (("unblind", two["out"], "--reason", "x", "--set", "trials=3"), "only for amend"),
        (("unblind", two["out"], "--reason", "x"), "not blind"),
        (("list", two["out"], "--reason", "x"), "only for amend and unblind"),
    ):
        assert message in answered("trials", *words), words


def test_gap_and_estimate_drive_each_round_in_the_order_of_the_hash_and_list_deviations(tmp_path):
    order = {"n_controllers": 4, "trials": 3, "observe": "cells"}
    gap = gap_between("sim", "sim:scribbler-s1", **order, results=tmp_path / "gap.sqlite", lock=True)
    assert "Deviations from the locked plan: none." in gap.study.result.notes
    locked = design_report(tmp_path / "gap.sqlite").design
    driven = order_driven(tmp_path / "gap.sqlite")
    assert driven == [arm for block in range(3) for arm in locked.order(block)]
    assert driven != [0, 1, 2, 3] * 3, "equal once in 13,824"
    plain = gap_between("sim", "sim:scribbler-s1", **order)
    np.testing.assert_array_equal(gap.study.target.values, plain.study.target.values)
    assert not [note for note in plain.study.result.notes if "Deviations" in note]
    few = {**order, "others": 5, "sim_trials": 2, "results": tmp_path / "e.sqlite"}
    with pytest.raises(StudyError, match="3 of 3 rounds complete"):
        estimate_score("sim", "sim:scribbler-s1", **few, blind=True)
    unblind_design(tmp_path / "e.sqlite", "all trials are driven")
    estimate = estimate_score("sim", "sim:scribbler-s1", **few)
    assert estimate.basis.endswith("Deviations from the locked plan: none.")
    with pytest.raises(StudyError, match="there is none"):
        gap_between("sim", "sim:scribbler-s1", **order, lock=True)


def test_blind_gap_shows_no_controller_until_it_is_unblinded(tmp_path):
    order = {"n_controllers": 3, "trials": 2, "observe": "cells", "results": tmp_path / "gap.sqlite"}
    with pytest.raises(StudyError, match="2 of 2 rounds complete") as end:
        gap_between("sim", "sim:scribbler-s1", **order, blind=True)
    file = order["results"]
    saved = SavedFile(file).read()
    texts = [str(end.value), *saved.looks, *saved.design.sentences]
    views = (("list",), ("list", "--json"), ("show",), ("show", "--json"), ("show", "2", "--json"))
    for action, *rest in (*views, ("advise",), ("advise", "--json")):
        texts.append(answered("trials", action, file, *rest))
    assert "2 rounds of at most 2 complete. Stop" in texts[-2]
    names = [each.name for each in sample_controllers("random", 3, 1)]
    for text in texts:
        for word in (*names, '"hidden"', "controller 1", '"number": 4', "E ="):
            assert word not in text, (word, text)
    unblind_design(file, "all trials are driven")
    notes = gap_between("sim", "sim:scribbler-s1", **order).study.result.notes
    assert notes[-1].startswith("Deviations from the locked plan")
    again = gap_between("sim", f"recorded:{file}", n_controllers=3, trials=2)
    assert again.study.result.notes[-2:] == notes[-2:], (
        "the report of recorded trials lists the same deviations"
    )


def test_calibration_and_single_controller_lock_their_rules(two, tmp_path):
    fit = {"robot": "sim", "budget": 2, "out": tmp_path / "fit.toml"}
    made = make_calibration("path", **fit, lock=True)
    assert made.notes[-1] == "Deviations from the locked plan: none."
    with Ledger.open(tmp_path / "fit.trials.sqlite") as ledger:
        ledger.void(1, "it was pushed")
    assert deviations(tmp_path / "fit.trials.sqlite") == ["Trial 1 is void: it was pushed."]
    with pytest.raises(StudyError, match="budget is 3, locked: 2"):
        make_calibration("path", **{**fit, "budget": 3})
    assert "Deviations from the locked plan: Trial 1 is void" in make_calibration("path", **fit).notes[-1]
    single = ["try", two["genome"], "--on", "sim", "--steps", 10, "--trials", 2]
    assert "Deviations from the locked plan: none." in answered(
        *single, "--lock", "-o", tmp_path / "one.sqlite"
    )
    assert "trials is 3, locked: 2" in answered(*single[:-1], 3, "-o", tmp_path / "one.sqlite")
    assert "there is none" in answered(*single, "--lock")


def test_transfer_locks_its_rule_for_all_files_of_its_folder(tmp_path):
    small = {"runs": 2, "repeats": 1, "fresh_trials": 2, "budget": (2,), "strategy": ("plain", "select")}
    order = {"study": "sim-paper", "to": "jyro", "out": tmp_path / "t", **small}
    run_transfer(**order, lock=True)
    assert deviations(tmp_path / "t") == []
    assert "6 scored trials" in design_report(tmp_path / "t").progress
    with Ledger.open(next((tmp_path / "t" / "fresh").glob("*.sqlite"))) as ledger:
        ledger.void(1, "it was pushed")
    (void,) = deviations(tmp_path / "t")
    assert void.endswith("is void: it was pushed.")
    with pytest.raises(StudyError, match="fresh_trials is 3, locked: 2"):
        run_transfer(**{**order, "fresh_trials": 3})
    amend_design(tmp_path / "t", "more", {"fresh_trials": "3"})
    run_transfer(**{**order, "fresh_trials": 3})
    assert "fresh_trials: 2 → 3" in printed("trials", "show", tmp_path / "t")
    run_transfer(**{**order, "out": tmp_path / "plain"})
    with pytest.raises(RecordError, match="before the first one"):
        run_transfer(**{**order, "out": tmp_path / "plain"}, lock=True)


def test_study_on_a_robot_locks_its_conditions_and_lists_deviations(tmp_path):
    def drive(lock=False, who=None, **changes):
        open_robot = {"open_robot": lambda platform: FakeRobot(platform.wait_s)}
        return drive_study(
            small_study(**changes), "fake", tmp_path, operator=Unattended(), lock=lock, who=who, **open_robot
        )

    drive(lock=True, who="anna")
    assert design_report(tmp_path).design.lock["who"] == "anna"
    assert deviations(tmp_path) == []
    with Ledger.open(tmp_path / "ledger.sqlite", writable=False) as ledger:
        assert [arm["name"] for arm in ledger.design().design["arms"]] == ["robot"]
    with pytest.raises(StudyError, match="replicates is 2, locked: 1"):
        drive(replicates="2")
    for settings in ({"replicates": "many"}, {"replicates": "0"}, {"order": "backwards"}):
        with pytest.raises(StudyError, match=f"{next(iter(settings))}.*expected"):
            amend_design(tmp_path, "more runs", settings)
    amend_design(tmp_path, "more runs", {"replicates": "2"})
    drive(replicates="2")
    (amended,) = deviations(tmp_path)
    assert amended.endswith("more runs. replicates: 1 → 2.")
    counts = Counts(tmp_path, ResultsFolder.open(tmp_path).description)
    counts.look()
    assert counts.design.deviations == (amended,)
    lab = Lab(tmp_path.parent)
    with pytest.raises(FormError) as refused:
        lab.go_on(tmp_path.name, port="emulator://s2?fluke=2", lock=True, who="anna")
    lab.close()
    assert list(refused.value.problems) == ["lock"]
    assert amended in write_report(tmp_path).read_text("utf-8").replace("&#39;", "'")


PLAN = {"arms": [{"name": name, "sha256": name} for name in "AB"], "unit": "pair", "blocks": 6, "first": 0}
DRIVEN = st.lists(st.integers(0, 2), min_size=1, max_size=6)
"""Times that each pair was void, of the pairs that were driven."""


def driven_as_planned(plan, voids):
    """The trials of a comparison in which pairs are void and driven again at once, as the command does it."""
    trials = []
    for block, n_void in zip(plan, voids, strict=False):
        for attempt in range(n_void + 1):
            state = "scored" if attempt == n_void else "void"
            trials += [(*key, state) for key in block]
    return [
        DrivenTrial(k + 1, number, controller, state, "it was pushed", None)
        for k, (number, controller, state) in enumerate(trials)
    ]


@given(st.binary(min_size=32, max_size=32).map(bytes.hex), DRIVEN, st.data())
def test_only_other_orders_than_the_planned_one_are_out_of_order(sha256, voids, data):
    locked = LockedDesign((DesignEvent(LOCKED, {"sha256": sha256, "design": PLAN}, 0),))
    trials = driven_as_planned(_design.planned_blocks(locked), voids)
    found = list(_deviations._order(trials, locked))
    assert len(found) == sum(n > 0 for n in voids), "a line for each pair with void trials"
    assert all("has void trials" in each for each in found)
    clean = driven_as_planned(_design.planned_blocks(locked), [0] * len(voids))
    k = data.draw(st.integers(0, len(clean) - 2))
    clean[k], clean[k + 1] = clean[k + 1], clean[k]
    assert [each for each in _deviations._order(clean, locked) if "out of order" in each]
