"""The interval of the RMS gap: its formulas, and how often its ends miss."""

import numpy as np
import pytest
from scipy import stats

from realitygap.gap import rms_interval, square_differences
from realitygap.stats import percentile_interval


def study(rng, c, r, q, level, spread, noise=0.08):
    """Differences of means and unbiased squares of c controllers."""
    gap = rng.normal(level, spread, (c, 1))
    source, target = rng.normal(0, noise, (c, r)), gap + rng.normal(0, noise, (c, q))
    squares = square_differences(source[None], target[None])[0]
    return target.mean(axis=1) - source.mean(axis=1), squares


def found(differences, squares, **more):
    rng = np.random.default_rng(0)
    resampled = squares[rng.integers(0, len(squares), (500, len(squares)))].mean(axis=1)
    return rms_interval(differences, squares, resampled, **more)


def plain_upper_end(differences, squares):
    c = len(squares)
    mean = sum(squares) / c
    seen = sum((square - mean) ** 2 for square in squares) / (c - 1)
    level = sum(differences) / c
    spread = sum((each - level) ** 2 for each in differences) / (c - 1)
    error = np.sqrt(max(seen, 4 * level**2 * spread + 2 * spread**2) / c)
    t = stats.t.ppf(0.975, c - 1)
    if mean > 1.5 * error:
        return np.sqrt(mean * np.exp(t * error / mean))
    return np.sqrt(max(mean, 0) + 1.5 * error * (np.exp(t / 1.5) - 1))


@pytest.mark.parametrize("c", [5, 8, 30])
@pytest.mark.parametrize("level", [0.0, 0.05, 0.2])
def test_rms_upper_end_equals_its_plain_reference(c, level):
    rng = np.random.default_rng(c)
    for _ in range(20):
        differences, squares = study(rng, c, 6, 4, level, 0.05)
        assert found(differences, squares)[1] == pytest.approx(plain_upper_end(differences, squares))


def test_rms_lower_end_is_the_percentile_of_resamples():
    differences, squares = study(np.random.default_rng(4), 10, 6, 4, 0.1, 0.03)
    resampled = np.linspace(0.001, 0.004, 1_001)
    assert rms_interval(differences, squares, resampled)[0] ** 2 == pytest.approx(
        percentile_interval(resampled, 10)[0]
    )
    assert rms_interval(differences, squares, resampled - 0.01)[0] == 0.0


def test_rms_interval_is_a_point_when_all_differences_are_equal():
    apart = np.full(6, -0.25)
    assert found(apart, apart**2) == (0.25, 0.25)
    assert found(np.zeros(6), np.zeros(6)) == (0.0, 0.0)


def test_rms_interval_contains_the_estimate_and_scales_with_the_unit():
    rng = np.random.default_rng(1)
    for _ in range(50):
        differences, squares = study(rng, 7, 3, 3, 0.03, 0.05)
        low, high = found(differences, squares)
        assert low <= np.sqrt(max(squares.mean(), 0)) <= high
        assert found(100 * differences, 100**2 * squares) == pytest.approx((100 * low, 100 * high))


def test_rms_upper_end_has_no_jump_when_the_scale_changes():
    rng = np.random.default_rng(2)
    differences, squares = study(rng, 12, 5, 5, 0.03, 0.04)
    highs = [found(differences, squares + shift)[1] for shift in np.linspace(-0.003, 0.003, 601)]
    assert np.abs(np.diff(highs)).max() < 0.002


def test_rms_upper_end_rises_with_more_variance():
    differences, squares = study(np.random.default_rng(3), 12, 5, 5, 0.1, 0.04)
    assert found(differences, squares, more_variance=0.005**2)[1] > found(differences, squares)[1]


def test_rms_interval_is_refused_below_5_controllers():
    assert found(np.ones(4), np.ones(4)) is None


@pytest.mark.parametrize(
    ("c", "r", "q", "level", "spread"),
    [(5, 10, 10, 0.05, 0.05), (10, 50, 50, 0.0, 0.1), (20, 50, 5, 0.0, 0.03), (30, 10, 10, 0.0, 0.0)],
)
def test_each_end_of_the_rms_interval_misses_at_most_as_often_as_stated(c, r, q, level, spread):
    # an end that misses in 2.5 % of 1,000 studies misses 40 times or more in 1 of 400 tries
    true = np.hypot(level, spread)
    rng = np.random.default_rng([c, r])
    ends = np.array([found(*study(rng, c, r, q, level, spread)) for _ in range(1_000)])
    assert (ends[:, 0] > true).sum() < 40
    assert (ends[:, 1] < true).sum() < 40
