"""Differences in successes: published examples, scipy, and the equations that define the intervals."""

import math

import numpy as np
import pytest
import scipy

from realitygap.stats import (
    boschloo_p,
    exact_share_interval,
    mcnemar_p,
    paired_success_difference,
    success_difference,
)
from realitygap.stats._successes import _tango_score

Z = scipy.stats.norm.ppf(0.975)


def tables(seed, n=40, most=30):
    rng = np.random.default_rng(seed)
    for _ in range(n):
        sizes = rng.integers(1, most, 2).tolist()
        yield rng.integers(0, sizes[0] + 1).item(), sizes[0], rng.integers(0, sizes[1] + 1).item(), sizes[1]


def test_newcombe_example_comes_out():
    # Newcombe (1998), Statistics in Medicine 17, 873-890, table II, method 10: 56/70 against 48/80
    found = success_difference(48, 80, 56, 70)
    assert (round(found.low, 4), found.value, round(found.high, 4)) == (0.0524, pytest.approx(0.2), 0.3339)


def test_newcombe_ends_are_those_of_wilson_by_scipy():
    for count, n, other, m in tables(1):
        found = success_difference(count, n, other, m)
        first, second = (
            scipy.stats.binomtest(k, size).proportion_ci(method="wilson")
            for k, size in ((count, n), (other, m))
        )
        share, share_2 = count / n, other / m
        low = share_2 - share - math.hypot(share_2 - second.low, first.high - share)
        high = share_2 - share + math.hypot(second.high - share_2, share - first.low)
        assert (found.low, found.high) == pytest.approx((max(low, -1), min(high, 1)))
        assert found.low <= found.value <= found.high


def test_shares_have_the_exact_interval_of_scipy():
    for count, n, *_ in tables(2):
        for level in (0.95, 0.9):
            expected = scipy.stats.binomtest(count, n).proportion_ci(level, method="exact")
            assert exact_share_interval(count, n, level).ends == pytest.approx((expected.low, expected.high))


@pytest.mark.parametrize("seed", range(3))
def test_boschloo_p_is_that_of_scipy(seed):
    for count, n, other, m in tables(seed + 10, 12):
        expected = scipy.stats.boschloo_exact([[count, other], [n - count, m - other]]).pvalue
        assert boschloo_p(count, n, other, m) == pytest.approx(expected, abs=1e-6), (count, n, other, m)


def test_boschloo_p_does_not_depend_on_order_or_on_what_counts_as_success():
    for count, n, other, m in tables(4):
        p = boschloo_p(count, n, other, m)
        assert boschloo_p(other, m, count, n) == pytest.approx(p)
        assert boschloo_p(n - count, n, m - other, m) == pytest.approx(p)
        assert 0 < p <= 1


def test_boschloo_of_too_many_trials_is_refused():
    with pytest.raises(ValueError, match="too many"):
        boschloo_p(1, 5_000, 2, 5_000)


def test_mcnemar_p_is_the_binomial_test_of_scipy():
    assert mcnemar_p(0, 0) == 1
    for gained in range(12):
        for lost in range(12):
            if gained + lost:
                expected = scipy.stats.binomtest(gained, gained + lost).pvalue
                assert mcnemar_p(gained, lost) == pytest.approx(expected)


def test_tango_ends_solve_the_score_equation():
    rng = np.random.default_rng(5)
    for _ in range(60):
        n = rng.integers(1, 40).item()
        gained = rng.integers(0, n + 1).item()
        lost = rng.integers(0, n - gained + 1).item()
        found = paired_success_difference(gained, lost, n)
        assert found.low <= found.value <= found.high
        for end in found.ends:
            assert abs(end) == 1 or abs(_tango_score(end, gained, lost, n)) == pytest.approx(Z, rel=1e-6)
        mirrored = paired_success_difference(lost, gained, n)
        assert mirrored.ends == pytest.approx((-found.high, -found.low))


def test_tango_interval_without_differences_has_a_closed_form():
    same = paired_success_difference(0, 0, 20)
    assert same.ends == pytest.approx((-(Z**2) / (20 + Z**2), Z**2 / (20 + Z**2)))


FIELDTRIAL = (
    # of fieldtrial 0.3.0: `tango_interval(gained, lost, n)` and `mcnemar_exact`
    (paired_success_difference, mcnemar_p, (3, 10, 40), (-0.348337, 0.001852), 0.092285),
    (paired_success_difference, mcnemar_p, (0, 7, 20), (-0.567146, -0.132481), 0.015625),
    (paired_success_difference, mcnemar_p, (9, 1, 12), (0.164876, 0.88357), 0.021484),
    # and `newcombe_interval` and `boschloo_test`, whose first group is our second
    (success_difference, boschloo_p, (17, 20, 14, 20), (-0.389752, 0.111062), 0.287145),
    (success_difference, boschloo_p, (33, 40, 34, 40), (-0.140733, 0.189872), 0.911072),
    (success_difference, boschloo_p, (0, 5, 9, 30), (-0.154486, 0.478758), 0.208982),
)


@pytest.mark.parametrize(("difference", "test", "counts", "ends", "p"), FIELDTRIAL)
def test_another_program_gives_the_same(difference, test, counts, ends, p):
    assert difference(*counts).ends == pytest.approx(ends, abs=1e-6)
    assert test(*counts if test is boschloo_p else counts[:2]) == pytest.approx(p, abs=1e-6)
