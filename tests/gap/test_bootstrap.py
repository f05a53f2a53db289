"""Intervals that cover what they should, also of few controllers."""

import numpy as np
import pytest

from realitygap.gap import GapSide, bootstrap, interval, mean_difference, shrunk_means, square_differences

STATISTICS = {
    "level": mean_difference,
    "square": lambda one, other: square_differences(one, other).mean(axis=1),
}


def sides(rng, c, r, level, spread, noise=0.08):
    quality = rng.normal(0.3, 0.1, (c, 1))
    gap = rng.normal(level, spread, (c, 1))
    source = quality + rng.normal(0, noise, (c, r))
    target = quality + gap + rng.normal(0, noise, (c, r))
    return GapSide("sim", "SIM", source), GapSide("twin", "TWIN", target)


def coverage(c, r, level, spread, studies=150):
    covered = dict.fromkeys(STATISTICS, 0)
    truth = {"level": level, "square": level**2 + spread**2}
    for seed in range(studies):
        rng = np.random.default_rng(seed)
        drawn = bootstrap(STATISTICS, *sides(rng, c, r, level, spread), 500, rng)
        for name, values in drawn.items():
            low, high = interval(values, c)
            covered[name] += low <= truth[name] <= high
    return {name: count / studies for name, count in covered.items()}


@pytest.mark.parametrize(
    ("c", "r", "level", "spread"), [(5, 10, 0.05, 0.05), (10, 4, 0.0, 0.05), (30, 10, 0.05, 0.05)]
)
def test_95_percent_intervals_cover_at_least_90(c, r, level, spread):
    # an interval of 95 % covers fewer than 135 of 150 in 1 of 200 tries; of 5 controllers they are wider than needed
    found = coverage(c, r, level, spread)
    assert min(found.values()) >= 0.9, found


def test_no_gap_is_excluded_no_more_often_than_stated():
    # two sides of one distribution: 5 % of 100 intervals of the level exclude 0; 12 or more in 1 of 250 tries
    excluded = {"level": 0, "square": 0}
    for seed in range(100):
        rng = np.random.default_rng(1_000 + seed)
        drawn = bootstrap(STATISTICS, *sides(rng, 20, 10, 0.0, 0.0), 500, rng)
        for name, values in drawn.items():
            low, high = interval(values, 20)
            excluded[name] += low > 0 or high < 0
    assert excluded["level"] < 12
    assert excluded["square"] < 6


def test_shrunk_means_spread_as_controllers_do_without_noise():
    rng = np.random.default_rng(3)
    latent = rng.multivariate_normal([0.4, 0.3], [[0.01, 0.008], [0.008, 0.01]], 2_000)
    noisy = latent[:, :, None] + rng.normal(0, 0.2, (2_000, 2, 4))
    means = shrunk_means(GapSide("s", "SIM", noisy[:, 0]), GapSide("t", "TWIN", noisy[:, 1]))
    # 2,000 controllers give a covariance to about 0.0007
    assert np.cov(means.T) == pytest.approx(np.array([[0.01, 0.008], [0.008, 0.01]]), abs=0.002)


def test_four_controllers_give_no_interval():
    assert interval(np.linspace(0, 1, 100), 4) == (None, None)
