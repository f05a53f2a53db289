"""The wording of results, in the one place that asserts it."""

from __future__ import annotations

from realitygap import _wording as wording
from realitygap.stats import Estimate, mean_interval


def test_counts_have_their_noun_in_the_right_number():
    assert [wording.counted(n, "run") for n in (0, 1, 2, 2_000)] == [
        "0 runs",
        "1 run",
        "2 runs",
        "2,000 runs",
    ]


def test_one_value_is_no_range():
    assert wording.values_between([0.139]) == "0.139"
    assert wording.values_between([0.1391, 0.1389]) == "0.139"
    assert wording.values_between([0.2, 0.1, 0.3]) == "0.100 to 0.300"


def test_a_single_condition_is_not_called_the_highest():
    assert (
        wording.highest_median(["a"], ["0.139"], n_conditions=1) == "the median best coverage of a is 0.139"
    )
    assert wording.highest_median(["a"], ["0.139"]) == "a has the highest median best coverage: 0.139"
    assert wording.highest_median(["a", "b"], ["0.1", "0.1"]).startswith("a and b have the highest")


def test_too_few_runs_name_no_highest_and_state_how_many_would():
    claim = wording.undecided_highest("median score", [0.1, 0.2], "SIM, 5 runs each", 6)
    assert "highest median" not in claim
    assert "6 runs" in claim


def test_numbers_have_their_interval_if_there_is_one():
    estimate = Estimate(-0.1, -0.2, 0.05, 20)
    assert wording.with_interval(estimate) == "−0.100 [−0.200, 0.050]"
    assert wording.with_interval(estimate, signs=True) == "−0.100 [−0.200, +0.050]"
    assert wording.bracketed(estimate, signs=True) == "[−0.200, +0.050]"
    few = mean_interval([0.25, 0.75])
    assert (wording.with_interval(few), wording.bracketed(few, missing="–")) == ("0.500", "–")
    assert (few.needed, few.ends) == (5, None)
    assert wording.with_interval(Estimate.refusal(0, "no runs")) == "–"


def test_a_difference_reads_as_its_two_sides_do():
    assert wording.higher_verdict("a", "b", 0.1) == wording.higher_verdict("b", "a", -0.1) == "a above b"
    difference = Estimate(0.01, -0.01, 0.015, 20)
    turned = difference.mirrored(0.0)
    assert (turned.value, turned.low, turned.high) == (-0.01, -0.015, 0.01)
    assert wording.equivalence_verdict(True, 0.02, difference).startswith("equivalent within ±0.02")


def test_platforms_have_names_in_words():
    assert wording.platform_in_words("twin:runs/worn-1.toml", "TWIN") == "the twin worn-1"
    assert wording.platform_in_words("sim:fit.toml", "SIM") == "sim with fit"
    assert wording.platform_in_words("jyro", "SIM") == "jyro"
    assert (
        wording.platform_in_words("scribbler:emulator://s2?speed=off", "EMULATED") == "the emulated scribbler"
    )
    assert wording.platform_in_words("scribbler:/dev/rfcomm0", "REAL") == "the robot scribbler"
