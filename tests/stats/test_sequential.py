"""Sequential tests: against plain loops, and against the error rates and powers that the documents state."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from realitygap.stats import (
    BINARY_LAMBDAS,
    LAMBDAS,
    SequentialTest,
    betting_mean,
    e_holm,
    forecast_pairs,
    mean_e,
    plan_pairs,
)

DIFFERENCES = st.lists(st.integers(-72, 72).map(lambda k: k / 72), max_size=14)
MARGINS = st.sampled_from([None, 0.05, 0.2])
NULLS = st.sampled_from(["distribution", "mean"])


# plain references


def plain_e(differences, shift=0.0, null="distribution"):
    """E after each pair: ½ of the bets upward plus ½ of those downward."""
    values = []
    for k in range(1, len(differences) + 1):
        halves = []
        for sign in (1, -1):
            if null == "mean":
                bet = 1.0
                for j in range(k):
                    total = sum(d - shift for d in differences[:j])
                    squares = sum((d - shift) ** 2 for d in differences[:j])
                    wanted = sign * total / (squares + 0.25)
                    bet *= 1 + sign * min(max(wanted, 0.0), 0.9 / (1 + sign * shift)) * (
                        differences[j] - shift
                    )
                halves.append(bet / 2)
                continue
            products = [
                math.prod(1 + sign * math.tanh(stake * (d - shift)) for d in differences[:k])
                for stake in LAMBDAS
            ]
            halves.append(sum(products) / len(products) / 2)
        values.append(sum(halves))
    return values


def plain_mean_interval(scores, alpha=0.05):
    """The hedged interval of one mean, a mean and a trial at a time."""
    kept = []
    for k in range(200):
        m = (k + 0.5) / 200
        up = down = 1.0
        total, squares, is_kept = 0.5, 0.05, True
        for t, x in enumerate(scores, 1):
            variance = 0.05 if t == 1 else squares / t
            wanted = math.sqrt(2 * math.log(2 / alpha) / (variance * t * math.log(1 + t)))
            up *= 1 + min(wanted, 0.5 / m) * (x - m)
            down *= 1 - min(wanted, 0.5 / (1 - m)) * (x - m)
            is_kept &= max(up, down) / 2 < 1 / alpha
            total += x
            squares += (x - total / (t + 1)) ** 2
        if is_kept:
            kept.append(m)
    return kept[0] - 1 / 400, kept[-1] + 1 / 400


@settings(max_examples=60, deadline=None)
@given(DIFFERENCES, NULLS, st.sampled_from([0.0, 0.1, -0.35]))
def test_e_is_that_of_plain_loops(differences, null, shift):
    found = np.exp(SequentialTest(null=null).log_e(np.array(differences), shift))
    assert found == pytest.approx(plain_e(differences, shift, null), rel=1e-9)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(0, 72).map(lambda k: k / 72), min_size=1, max_size=30))
def test_interval_of_one_mean_is_that_of_plain_loops(scores):
    found = betting_mean(scores)
    assert found.ends == pytest.approx(plain_mean_interval(scores), abs=1e-9)


@settings(max_examples=15, deadline=None)
@given(st.lists(st.integers(-36, 36).map(lambda k: k / 36), min_size=6, max_size=9))
def test_interval_of_the_shift_keeps_what_no_look_rejects(differences):
    look = SequentialTest().look(np.array(differences))
    if look.shift.ends is None:
        return
    low, high = look.shift.ends
    for shift in (low - 0.02, low, low + 0.001, high - 0.001, high, high + 0.02):
        is_rejected = max(plain_e(differences, shift)) >= 20
        if abs(shift) < 1:
            assert is_rejected == (shift <= low or shift >= high), shift


# properties


@settings(max_examples=40, deadline=None)
@given(DIFFERENCES, MARGINS, NULLS, st.integers(0, 14))
def test_resuming_changes_nothing(differences, margin, null, k):
    test = SequentialTest(margin=margin, null=null)
    values = np.array(differences)
    whole, part = test.log_e(values), test.log_e(values[:k])
    assert part == pytest.approx(whole[:k], abs=1e-9)
    again = SequentialTest.from_dict(test.to_dict())
    assert again == test
    assert again.look(values) == test.look(values)
    if (earlier := test.look(values[:k])).verdict in ("higher", "lower"):
        assert test.look(values).verdict == earlier.verdict  # what was claimed stays claimed
    ends, before = test.look(values).shift.ends, earlier.shift.ends
    if ends is not None and before is not None:
        assert before[0] <= ends[0]
        assert ends[1] <= before[1]


@settings(max_examples=40, deadline=None)
@given(DIFFERENCES, MARGINS, NULLS)
def test_exchanging_the_two_mirrors_all_results(differences, margin, null):
    test = SequentialTest(margin=margin, null=null)
    one, other = test.look(np.array(differences)), test.look(-np.array(differences))
    assert one.e == pytest.approx(other.e, rel=1e-9)
    mirrored = {"higher": "lower", "lower": "higher"}
    assert other.verdict == mirrored.get(one.verdict, one.verdict)
    if one.shift.ends is not None:
        assert other.shift.ends == pytest.approx((-one.shift.ends[1], -one.shift.ends[0]), abs=1e-9)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(-1, 1), max_size=5))
def test_five_pairs_claim_nothing(differences):
    look = SequentialTest().look(np.array(differences))
    assert look.verdict == "open"
    assert look.e <= max(1.0, 2 ** len(differences) / 2) * (1 + 1e-9)
    assert SequentialTest().fewest == 6
    assert SequentialTest().look(np.ones(6)).verdict == "higher"


def test_pairs_without_a_difference_leave_e_unchanged():
    values = np.array([0.1, 0.2, 0.1])
    with_ties = np.array([0.0, 0.1, 0.0, 0.2, 0.1, 0.0])
    for null in ("distribution", "mean"):
        test = SequentialTest(null=null)
        assert test.look(values).e == pytest.approx(test.look(with_ties).e, rel=1e-9)


def test_asymmetric_differences_have_no_interval_instead_of_a_wrong_one():
    # nine small gains for each large loss: no center makes them symmetric
    differences = np.tile([0.1] * 9 + [-0.9], 60)
    look = SequentialTest().look(differences)
    assert look.shift.ends is None
    assert "not symmetric" in look.shift.refused


def test_wrong_values_are_refused():
    for differences in ([0.1, float("nan")], [1.5], [[0.1]]):
        with pytest.raises(ValueError, match="differences"):
            SequentialTest().look(np.array(differences))
    for wrong in ({"alpha": 0.0}, {"null": "median"}, {"margin": -1.0}, {"lambdas": ()}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            SequentialTest(**wrong)
    with pytest.raises(ValueError, match="values"):
        betting_mean([1.2])


def test_stops_of_many_studies_are_the_first_looks_that_stop():
    rng = np.random.default_rng(7)
    for test, center in ((SequentialTest(), 0.1), (SequentialTest(margin=0.1), 0.0)):
        studies = np.clip(rng.normal(center, 0.08, (6, 30)), -1, 1)
        for values, stop in zip(studies, test.stops(studies), strict=True):
            looks = [test.look(values[:k]).is_stop for k in range(1, 31)]
            first = looks.index(True) + 1 if any(looks) else 0
            assert stop == first


# error rates: each share of n studies is a binomial; 4.5 standard errors are exceeded about 7 times in a million


def at_most(count, n, share):
    """True unless a binomial with this share exceeds the count by chance less than 1 in 100,000 times."""
    return stats.binom.sf(count - 1, n, share) > 1e-5


def close(count, n, share):
    """True if a count agrees with a published share of as many studies: within 4.5 standard errors of a difference."""
    return abs(count / n - share) <= 4.5 * math.sqrt(2 * share * (1 - share) / n) + 0.005


@pytest.mark.slow
def test_error_rate_of_looking_after_each_pair_is_below_5_percent():
    # chance alone fails one of the five less than once in 20,000 runs with other seeds; the seed is fixed
    rng, n, k = np.random.default_rng(11), 1_500, 100
    drift = np.linspace(0.25, 0, 2 * k)
    coin = rng.integers(0, 2, (n, k)) * 2 - 1
    first, second = (np.clip(rng.normal(0.5, 0.1, (n, k)) + drift[i::2], 0, 1) for i in (0, 1))
    nulls = {
        "normal": rng.normal(0, 0.14, (n, k)),
        "skewed": rng.beta(0.6, 2.4, (n, k)) - rng.beta(0.6, 2.4, (n, k)),
        "binary": rng.integers(0, 2, (n, k)) - rng.integers(0, 2, (n, k)).astype(float),
        "drift": coin * (first - second),
        "cells": (rng.binomial(72, 0.3, (n, k)) - rng.binomial(72, 0.3, (n, k))) / 72,
    }
    for name, differences in nulls.items():
        claims = int((SequentialTest().stops(np.clip(differences, -1, 1)) > 0).sum())
        assert at_most(claims, n, 0.05), (name, claims / n)


@pytest.mark.slow
def test_power_and_mean_pairs_are_those_of_the_page():
    # published shares are of 1,500 studies, as here; chance alone fails one of the cells about once in 10,000 runs
    n = 1_500
    cells = (
        (0.05, 0.05, 18, 0.88, 22, 0.00),
        (0.10, 0.10, 18, 0.89, 22, 0.18),
        (0.10, 0.15, 38, 0.85, 45, 0.83),
        (0.20, 0.15, 11, 0.92, 14, 0.51),
    )
    for difference, sd, fixed, power, pairs, by_betting in cells:
        rng = np.random.default_rng(int(1000 * difference + 10 * sd))
        most = 2 * fixed + 4
        values = np.clip(rng.normal(difference, math.sqrt(2) * sd, (n, most)), -1, 1)
        ends = SequentialTest().stops(values)
        assert close(int((ends > 0).sum()), n, power), (difference, sd)
        assert np.where(ends > 0, ends, most).mean() == pytest.approx(pairs, abs=1.5)
        betting = SequentialTest(null="mean").stops(values)
        assert close(int((betting > 0).sum()), n, by_betting), (difference, sd)


@pytest.mark.slow
def test_interval_of_the_shift_covers_at_all_looks_and_equivalence_errs_rarely():
    # 300 studies; chance alone fails either less than once in 100,000 runs
    rng, n = np.random.default_rng(5), 300
    test = SequentialTest(margin=0.05)
    missed = 0
    for _ in range(n):
        ends = test.look(rng.normal(0.1, 0.14, 40).clip(-1, 1)).shift.ends
        missed += ends is None or not ends[0] < 0.1 < ends[1]
    assert at_most(missed, n, 0.05)
    # the true difference is the margin itself: equivalence must be rare
    ends = test.stops(rng.normal(0.05, 0.05, (2_000, 60)))
    values = rng.normal(0.05, 0.05, (2_000, 60))
    high = test.log_sides(values, 0.05)[1].max(axis=1) >= math.log(20)
    assert at_most(int(high.sum()), 2_000, 0.05)
    assert len(ends) == 2_000


@pytest.mark.slow
def test_equal_means_of_different_distributions_need_the_null_of_means():
    # the page says so: one controller is skewed, the other constant
    rng, n = np.random.default_rng(3), 1_000
    differences = rng.beta(0.3, 2.7, (n, 100)) - 0.1
    claims = [
        int((SequentialTest(null=null).stops(differences) > 0).sum()) for null in ("distribution", "mean")
    ]
    assert claims[0] > 0.08 * n  # the hypothesis is false, although the means are equal
    assert at_most(claims[1], n, 0.05)


@pytest.mark.slow
def test_interval_of_one_mean_covers_at_all_looks():
    # 400 studies of 40 trials; chance alone fails either less than once in 100,000 runs
    rng, n = np.random.default_rng(9), 400
    for draw, mean in (
        (lambda: rng.normal(0.5, 0.1, 40).clip(0, 1), 0.5),
        (lambda: rng.beta(0.1, 0.9, 40), 0.1),
    ):
        missed = sum(not (ends := betting_mean(draw()).ends)[0] <= mean <= ends[1] for _ in range(n))
        assert at_most(missed, n, 0.05), mean


@pytest.mark.slow
def test_stakes_for_binary_scores_find_more_and_keep_the_error_rate():
    # chance alone fails this less than once in 100,000 runs with other seeds; the seed is fixed
    rng, n = np.random.default_rng(13), 1_500
    test = SequentialTest(lambdas=BINARY_LAMBDAS)
    better = (rng.random((n, 60)) < 0.7).astype(float) - (rng.random((n, 60)) < 0.3)
    powers = [int((each.stops(better) > 0).sum()) for each in (test, SequentialTest())]
    assert powers[0] > powers[1] + 0.03 * n
    equal = (rng.random((n, 100)) < 0.6).astype(float) - (rng.random((n, 100)) < 0.6)
    assert at_most(int((test.stops(equal) > 0).sum()), n, 0.05)


# several comparisons, plans, and forecasts


def test_holm_of_e_values_is_that_of_their_reciprocals():
    e = np.array([30.0, 5.0, 90.0, 1.0])
    assert e_holm(e) == pytest.approx([10.0, 2.5, 22.5, 1.0])
    assert mean_e(e) == pytest.approx(31.5)
    assert list(e_holm([40.0])) == [40.0]


def test_plan_has_the_pairs_of_the_fixed_design_and_of_the_simulated_algorithm():
    plan = plan_pairs(0.1, 0.1 * math.sqrt(2))
    assert (plan.fixed, plan.maximum) == (18, 40)
    assert plan.power == pytest.approx(0.89, abs=0.04)
    assert plan.mean == pytest.approx(22, abs=1.5)
    assert plan.median <= plan.mean <= plan.quantile <= plan.maximum
    assert plan_pairs(1e-9, 1.0).fixed is None
    with pytest.raises(ValueError, match="effect"):
        plan_pairs(0.0, 0.1)


def test_forecast_begins_at_five_pairs_and_has_no_part_in_the_test():
    rng = np.random.default_rng(4)
    values = rng.normal(0.1, 0.1, 9)
    test = SequentialTest()
    assert forecast_pairs(values[:4], test) is None
    assert forecast_pairs(values, test, maximum=9) is None
    before = test.look(values)
    forecast = forecast_pairs(values, test)
    assert forecast is not None
    assert 0 <= forecast.more <= forecast.quantile <= 200 - 9
    assert test.look(values) == before
    nothing = forecast_pairs(np.array([0.1, -0.1, 0.1, -0.1, 0.0]), test, maximum=20)
    assert nothing is not None
    assert nothing.more is None
    assert nothing.ended < 0.5
