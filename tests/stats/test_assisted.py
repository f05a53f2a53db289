"""Means assisted by a simulator: against a plain reference, and in studies whose truth is known."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from realitygap.stats import Assisted, assisted_mean, least_correlation


def plain(real, driven, others):
    """Return the estimate and its standard error by the formulas of Cochran (1977), with a line from `polyfit`."""
    n, m = len(real), len(others)
    slope, start = np.polyfit(driven, real, 1)
    everything = [*driven, *others]
    mean = sum(everything) / (n + m)
    value = start + slope * mean
    residual = sum((y - start - slope * f) ** 2 for y, f in zip(real, driven, strict=True)) / (n - 2)
    leverage = (mean - np.mean(driven)) ** 2 / sum((f - np.mean(driven)) ** 2 for f in driven)
    spread = sum((f - mean) ** 2 for f in everything) / (n + m - 1)
    return value, math.sqrt(residual * (1 / n + leverage) + slope**2 * spread / (n + m))


def drawn(rng, n, m, correlation=0.8):
    one, other = rng.normal(size=(2, n + m))
    simulated = correlation * one + math.sqrt(1 - correlation**2) * other
    return one[:n], simulated[:n], simulated[n:]


def ends(found: Assisted):
    return [found.estimate.value, *found.estimate.ends]


def test_estimate_and_interval_are_those_of_the_plain_reference():
    real, driven, others = drawn(np.random.default_rng(1), 12, 50)
    value, error = plain(real, driven, others)
    reach = stats.t.ppf(0.975, 10) * error
    assert ends(assisted_mean(real, driven, others)) == pytest.approx([value, value - reach, value + reach])


def test_target_alone_is_the_interval_of_student():
    real, driven, others = drawn(np.random.default_rng(2), 9, 20)
    found = assisted_mean(real, driven, others).real_only
    low, high = stats.t.interval(0.95, 8, real.mean(), stats.sem(real))
    assert [found.value, *found.ends] == pytest.approx([real.mean(), low, high])


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10_000), st.floats(-5, 5), st.floats(0.1, 10) | st.floats(-10, -0.1))
def test_a_simulator_with_another_scale_and_another_zero_gives_the_same(seed, shift, scale):
    real, driven, others = drawn(np.random.default_rng(seed), 10, 30)
    one = assisted_mean(real, driven, others)
    other = assisted_mean(real, shift + scale * driven, shift + scale * others)
    if one.estimate.ends is not None:
        assert ends(other) == pytest.approx(ends(one), rel=1e-6, abs=1e-9)
        assert other.worth == pytest.approx(one.worth, rel=1e-4, abs=1e-4)


def test_intervals_cover_whatever_the_error_of_the_simulator():
    """95 of 100 are wanted. If 95 cover, chance alone gives fewer than 930 of 1,000 in 2 of 1,000 draws."""
    rng = np.random.default_rng(3)
    simulators = (
        lambda f: 3 * f + 2,
        lambda f: -f,
        lambda f: np.exp(f / 2),
        lambda f: rng.normal(size=f.shape),
    )
    for simulator in simulators:
        covered = n = 0
        while n < 1_000:
            real, driven, others = drawn(rng, 10, 100)
            found = assisted_mean(real, simulator(driven), simulator(others)).estimate
            if found.ends is not None:
                n += 1
                covered += found.low <= 0 <= found.high
        assert covered >= 930


def test_intervals_of_a_fleet_cover_the_mean_of_its_units():
    """95 of 100 are wanted. If 95 cover, chance alone gives fewer than 930 of 1,000 in 2 of 1,000 draws."""
    rng, covered, widths = np.random.default_rng(4), 0, []
    for _ in range(1_000):
        one = rng.normal(size=30)
        simulated = one + 0.3 * rng.normal(size=30)
        real = one[:10] + 0.1 * rng.normal(size=10)
        found = assisted_mean(real, simulated[:10], simulated[10:], fleet=True, noise=0.01)
        if found.estimate.ends is None:
            covered += 1
            continue
        covered += found.estimate.low <= one.mean() <= found.estimate.high
        without = assisted_mean(real, simulated[:10], simulated[10:], fleet=True)
        widths.append(
            (found.estimate.high - found.estimate.low) / (without.estimate.high - without.estimate.low)
        )
    assert covered >= 930
    assert np.mean(widths) < 1


def test_a_simulation_is_worth_the_units_that_give_the_target_alone_as_short_an_interval():
    real, driven, others = drawn(np.random.default_rng(5), 20, 2_000, 0.95)
    found = assisted_mean(real, driven, others)
    n = 20 + found.worth
    wide = stats.t.ppf(0.975, n - 1) * real.std(ddof=1) / math.sqrt(n)
    assert wide == pytest.approx((found.estimate.high - found.estimate.low) / 2, rel=1e-6)
    assert found.helps
    assert found.width_ratio < 1


@pytest.mark.parametrize(
    ("real", "driven", "others", "word"),
    [
        ([0.1, 0.2, 0.3, 0.4], [0.1, 0.2, 0.3, 0.4], [0.2], "at least 5"),
        ([0.1] * 5, [0.1, 0.2, 0.3, 0.4, 0.5], [], "nothing to add"),
        ([0.1, 0.2, 0.3, 0.4, 0.5], [0.2] * 5, [0.2, 0.3], "same score in simulation"),
        ([0.1, 0.2, 0.3, 0.4, 0.5], [0.1, 0.2, 0.3, 0.4, 0.5], [0.9] * 50, "outside the scores"),
    ],
)
def test_no_estimate_without_ground_has_the_reason_and_keeps_the_target_alone(real, driven, others, word):
    found = assisted_mean(np.array(real), np.array(driven), np.array(others))
    assert found.estimate.value is None
    assert word in found.estimate.refused
    assert found.worth is None
    assert not found.helps
    assert found.real_only.value == pytest.approx(np.mean(real))


def test_intervals_end_within_the_range_of_scores():
    real = np.array([0.0, 0.0, 0.01, 0.0, 0.02, 0.6])
    found = assisted_mean(real, real + 0.1, np.linspace(0.1, 0.3, 9), within=(0, 1))
    assert 0 <= found.estimate.low <= found.estimate.high <= 1


@pytest.mark.parametrize(
    "wrong", [([0.1], [0.1, 0.2], [0.1]), ([], [], [0.1]), ([np.nan] * 5, [0.1] * 5, [0.1])]
)
def test_other_shapes_and_values_are_refused(wrong):
    with pytest.raises(ValueError, match="expected"):
        assisted_mean(*(np.array(each, float) for each in wrong))


def test_least_correlation_is_that_of_its_source():
    assert [round(least_correlation(n), 2) for n in (5, 10, 20, 40)] == [0.58, 0.35, 0.24, 0.16]
