from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from realitygap.stats import (
    RESAMPLES,
    SEED,
    a12,
    a12_of_effect,
    bca_interval,
    bca_mean,
    detectable_effect,
    difference_of_means,
    effect_of_a12,
    exact_share_interval,
    newcombe_interval,
    ratio_of_robust_spreads,
    ratio_of_spreads,
    robust_spread,
    runs_needed,
    share_above,
    share_interval,
)

SAMPLES = st.lists(st.integers(0, 72).map(lambda k: k / 72), min_size=1, max_size=12).map(np.array)


def test_a12_equals_the_one_by_hand():
    # of the 6 pairs 4 are above, 1 is tied: (4 + 1/2) / 6
    assert a12(np.array([3.0, 5.0]), np.array([1.0, 3.0, 4.0])) == pytest.approx(4.5 / 6)


@given(SAMPLES, SAMPLES)
def test_a12_is_mann_whitneys_u_over_nm_and_symmetric(one, other):
    u = stats.mannwhitneyu(one, other).statistic
    assert a12(one, other) == pytest.approx(u / (len(one) * len(other)))
    assert a12(one, other) + a12(other, one) == pytest.approx(1.0)
    assert a12(one, one) == pytest.approx(0.5)


@given(SAMPLES, SAMPLES)
def test_a12_knows_ranks_only(one, other):
    assert a12(one**3 + 1, other**3 + 1) == pytest.approx(a12(one, other))


def _scipy(function, one, other, *, paired):
    found = stats.bootstrap(
        (one, other),
        function,
        vectorized=False,
        paired=paired,
        n_resamples=RESAMPLES,
        method="BCa",
        rng=np.random.default_rng(SEED),
    )
    return found.confidence_interval


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize(
    ("statistic", "plain"),
    [
        (difference_of_means, lambda x, y: x.mean() - y.mean()),
        (share_above, a12),
        (ratio_of_spreads, lambda x, y: x.std(ddof=1) / y.std(ddof=1)),
        (ratio_of_robust_spreads, lambda x, y: robust_spread(x) / robust_spread(y)),
    ],
)
def test_bca_is_scipys(statistic, plain, paired):
    rng = np.random.default_rng(11)
    one = rng.normal(1, 1, 20)
    other = 0.5 * one + rng.normal(0.4, 1, 20)
    if not paired:
        other = other[:14]
    ours = bca_interval(statistic, one, other, paired=paired)
    theirs = _scipy(plain, one, other, paired=paired)
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), rel=1e-6)


def test_interval_of_a_mean_is_scipys():
    values = np.random.default_rng(4).gamma(2, 1, 25)
    theirs = stats.bootstrap(
        (values,), np.mean, n_resamples=RESAMPLES, rng=np.random.default_rng(SEED)
    ).confidence_interval
    ours = bca_mean(values)
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), rel=1e-6)


def test_counts_do_not_change_with_the_block(monkeypatch):
    rng = np.random.default_rng(2)
    one, other = rng.integers(0, 30, 40) / 72, rng.integers(0, 30, 40) / 72
    before = bca_interval(share_above, one, other, paired=True)
    monkeypatch.setattr("realitygap.stats._resampling._BLOCK", 1000)
    assert bca_interval(share_above, one, other, paired=True) == before


def test_bca_of_a_mean_covers_what_it_should():
    # 300 samples of 30: an interval of 93 % or more falls below 87 % less than once in 1,000 sets; seed fixed
    rng = np.random.default_rng(21)
    hits = 0
    for _ in range(300):
        interval = bca_mean(rng.integers(0, 40, 30) / 72)
        hits += interval.low <= 19.5 / 72 <= interval.high
    assert hits / 300 >= 0.87


def test_few_or_equal_values_have_no_bootstrap_interval():
    rng = np.random.default_rng(1)
    nine = rng.normal(size=9)
    assert bca_interval(difference_of_means, nine, nine, paired=False).ends is None
    assert bca_mean(np.full(20, 0.25)).ends is None
    apart = bca_interval(share_above, rng.random(10) + 2, rng.random(10), paired=False)
    assert apart.ends is None, "all above: resamples cannot tell how surely"
    flat = bca_interval(ratio_of_spreads, rng.normal(size=20), np.ones(20), paired=False)
    assert flat.ends is None


def test_pairs_need_one_size():
    with pytest.raises(ValueError, match="10 and 11"):
        bca_interval(share_above, np.arange(10.0), np.arange(11.0), paired=True)


@settings(max_examples=30, deadline=None)
@given(st.floats(0, 1), st.integers(2, 30), st.integers(2, 30))
def test_newcombe_holds_the_estimate_and_mirrors(share, n, m):
    interval, mirrored = newcombe_interval(share, n, m), newcombe_interval(1 - share, n, m)
    assert 0 <= interval.low <= share + 1e-9
    assert share - 1e-9 <= interval.high <= 1
    assert interval.low == pytest.approx(1 - mirrored.high, abs=1e-6)
    assert interval.method == "Newcombe"


def test_newcombe_solves_its_equation_and_narrows_with_n():
    z = stats.norm.ppf(0.975)
    interval = newcombe_interval(0.8, 8, 12)
    for bound in (interval.low, interval.high):
        others = (8 + 12) / 2 - 1
        variance = bound * (1 - bound) * (1 + others * ((1 - bound) / (2 - bound) + bound / (1 + bound))) / 96
        assert (bound - 0.8) ** 2 == pytest.approx(z * z * variance)
    widths = [newcombe_interval(0.8, n, n) for n in (4, 8, 16, 64)]
    assert all(a.high - a.low > b.high - b.low for a, b in itertools.pairwise(widths))


def test_newcombe_covers_with_five_runs_each():
    # 1,000 studies at a true A12 of 0.5 and of 0.71: 93 % or more fall below 90 % less than once in 1,000; seed fixed
    rng = np.random.default_rng(6)
    for truth in (0.5, 0.71):
        shift = effect_of_a12(truth)
        hits = 0
        for _ in range(1000):
            share = a12(rng.normal(shift, 1, 5), rng.normal(0, 1, 5))
            interval = newcombe_interval(share, 5, 5)
            hits += interval.low <= truth <= interval.high
        assert hits / 1000 >= 0.9


def test_intervals_of_shares_are_scipys():
    for method, ours in (("wilson", share_interval), ("exact", exact_share_interval)):
        for count, n in ((0, 5), (3, 12), (81, 263), (7, 7)):
            theirs = stats.binomtest(count, n).proportion_ci(method=method)
            estimate = ours(count, n)
            assert (estimate.low, estimate.high) == pytest.approx((theirs.low, theirs.high)), (
                method,
                count,
                n,
            )
            assert estimate.value == count / n
    assert share_interval(0, 0).value is None


def test_runs_needed_are_cohens():
    # Cohen (1988), table 2.4.1: d = 0.2, 0.5, 0.8 at 5 % two-sided and power 0.80
    assert [runs_needed(d, paired=False) for d in (0.5, 0.8)] == [64, 26]
    assert runs_needed(0.2, paired=False) in (393, 394)
    assert runs_needed(0.5, paired=True) == 34
    assert runs_needed(0.0, paired=False) is None


def test_detectable_and_needed_are_inverse():
    for n in (4, 10, 63, 1000):
        for paired in (True, False):
            effect = detectable_effect(n, paired=paired)
            assert runs_needed(effect * 1.0001, paired=paired) == n
    assert detectable_effect(1, paired=True) is None


def test_three_runs_find_giants_only():
    effect = detectable_effect(3, paired=False)
    assert effect == pytest.approx(3.07, abs=0.01)
    assert a12_of_effect(effect) > 0.98


def test_power_is_what_simulation_gives():
    # 2,000 studies of 26 against 26 at d = 0.8: 80 % within 3.6 points but once in 10,000 times; seed fixed
    rng = np.random.default_rng(9)
    one, other = rng.normal(0.8, 1, (2000, 26)), rng.normal(0, 1, (2000, 26))
    found = (stats.ttest_ind(one, other, axis=1).pvalue < 0.05).mean()
    assert found == pytest.approx(0.8, abs=0.036)


def test_robust_spread_is_that_of_a_normal_distribution():
    values = stats.norm.ppf((np.arange(100_000) + 0.5) / 100_000) * 3
    assert robust_spread(values) == pytest.approx(3, rel=1e-3)
