from __future__ import annotations

import numpy as np
import pytest

from realitygap.stats import _medians, interval_ranks, median_interval, quartiles, share_interval


def test_ranks_for_ten_values_are_those_worked_by_hand():
    # P(X <= 1) = (1 + 10) / 1024 for X ~ Binomial(10, 1/2) is below 0.025; P(X <= 2) = 56 / 1024 is not
    ranks = interval_ranks(10)
    assert ranks is not None
    assert (ranks.lower, ranks.upper) == (2, 9)
    assert ranks.coverage == pytest.approx(1 - 2 * 11 / 1024)


def test_ranks_for_a_hundred_values_are_those_of_tables():
    # tabulated in many textbooks: the 40th and the 61st
    ranks = interval_ranks(100)
    assert ranks is not None
    assert (ranks.lower, ranks.upper) == (40, 61)
    assert ranks.coverage == pytest.approx(0.9648, abs=5e-5)


def test_six_is_the_least_that_gives_an_interval():
    assert [interval_ranks(n) for n in range(6)] == [None] * 6
    ranks = interval_ranks(6)
    assert ranks is not None
    assert (ranks.lower, ranks.upper, ranks.coverage) == (1, 6, 1 - 2 / 64)


@pytest.mark.parametrize("confidence", [0.5, 0.9, 0.95, 0.99])
def test_ranks_are_the_innermost_that_cover_enough(confidence):
    for n in range(1, 300):
        ranks = interval_ranks(n, confidence)
        if ranks is None:
            assert 1 - 2 / 2**n < confidence
            continue
        assert ranks.coverage >= confidence
        assert 1 <= ranks.lower <= ranks.upper == n + 1 - ranks.lower
        inner = ranks.lower + 1
        if inner <= n + 1 - inner:
            below = sum(_choose(n, k) for k in range(inner)) / 2**n
            assert 1 - 2 * below < confidence


def _choose(n: int, k: int) -> int:
    value = 1
    for i in range(k):
        value = value * (n - i) // (i + 1)
    return value


def test_ranks_counted_in_whole_numbers_are_those_of_scipy(monkeypatch):
    n_values = [*range(1, 300), 301, 500, 999]
    ranks = {}
    for largest_counted in (0, 1000):
        monkeypatch.setattr(_medians, "_LARGEST_COUNTED_N", largest_counted)
        interval_ranks.cache_clear()
        ranks[largest_counted] = [interval_ranks(n) for n in n_values]
    interval_ranks.cache_clear()
    for n, by_scipy, counted in zip(n_values, *ranks.values(), strict=True):
        if by_scipy is None or counted is None:
            assert by_scipy is counted, n
            continue
        assert (counted.lower, counted.upper) == (by_scipy.lower, by_scipy.upper), n
        assert counted.coverage == pytest.approx(by_scipy.coverage, rel=1e-13), n


def test_interval_takes_the_values_of_its_ranks_in_any_order():
    values = np.array([7.0, 1.0, 10.0, 4.0, 2.0, 9.0, 3.0, 8.0, 5.0, 6.0])
    interval = median_interval(values)
    assert (interval.low, interval.high) == (2.0, 9.0)
    assert values[0] == 7.0, "the caller's array was sorted in place"


def test_interval_covers_the_median_as_often_as_it_says():
    # 20,000 samples of 11: a difference of five standard deviations; chance alone fails 6 times in ten million
    n_samples, expected = 20_000, 1 - 2 * 12 / 2048
    ordered = np.sort(np.random.default_rng(1).exponential(size=(n_samples, 11)), axis=1)
    ranks = interval_ranks(11)
    assert ranks is not None
    assert ranks.coverage == pytest.approx(expected)
    covered = (ordered[:, ranks.lower - 1] <= np.log(2)) & (np.log(2) <= ordered[:, ranks.upper - 1])
    spread = np.sqrt(expected * (1 - expected) / n_samples)
    assert abs(covered.mean() - expected) < 5 * spread


def test_interval_of_a_discrete_median_covers_at_least_as_often():
    # k/72 with k ~ Binomial(72, 0.3), median 22/72 (P(X <= 21) = 0.49); below by five standard deviations: chance
    # alone fails 3 times in ten million
    n_samples, n = 20_000, 20
    ordered = np.sort(np.random.default_rng(2).binomial(72, 0.3, (n_samples, n)), axis=1)
    ranks = interval_ranks(n)
    assert ranks is not None
    covered = (ordered[:, ranks.lower - 1] <= 22) & (ordered[:, ranks.upper - 1] >= 22)
    assert covered.mean() > ranks.coverage - 5 * np.sqrt(0.25 / n_samples)


def test_intervals_of_medians_and_shares_are_those_of_the_tables():
    # Conover (1999), table A3: of 10 values ranks 2 and 9 bound the median at 97.9 %; none of 5 at 95 %
    ten = median_interval(range(1, 11))
    assert (ten.value, ten.low, ten.high) == (5.5, 2.0, 9.0)
    assert (median_interval(range(5)).ends, median_interval(range(5)).needed) == (None, 6)
    assert median_interval(range(6)).low == 0.0
    # Newcombe (1998), table I, Wilson's: 81 of 263
    assert share_interval(81, 263).ends == pytest.approx((0.2553, 0.3662), abs=5e-5)


def test_quartiles_are_those_worked_by_hand():
    # definition 7: position (n - 1) p, so 0.75, 1.5 and 2.25 between four values
    found = quartiles(np.array([4.0, 1.0, 2.0, 3.0]))
    assert (found.q25, found.median, found.q75) == (1.75, 2.5, 3.25)


def test_one_value_is_its_own_quartiles():
    found = quartiles(np.array([0.25]))
    assert (found.q25, found.median, found.q75) == (0.25, 0.25, 0.25)
    assert median_interval(np.array([0.25])).ends is None
    assert median_interval([]).value is None


def test_bad_values_are_refused():
    with pytest.raises(ValueError, match="empty"):
        quartiles(np.array([]))
    with pytest.raises(ValueError, match="finite"):
        median_interval(np.array([1.0, np.nan]))
    with pytest.raises(ValueError, match="shape"):
        quartiles(np.ones((2, 2)))
    with pytest.raises(ValueError, match="between 0 and 1"):
        interval_ranks(10, 95)
    with pytest.raises(ValueError, match="0 or more"):
        interval_ranks(-1)
