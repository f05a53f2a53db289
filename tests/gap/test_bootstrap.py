"""Intervals that cover what they should, also of few controllers."""

import numpy as np
import pytest

from realitygap.gap import (
    GapSide,
    bootstrap,
)
from realitygap.gap._level import mean_difference
from realitygap.gap._resampling import shrunk_means
from realitygap.stats import percentile_interval

pytestmark = pytest.mark.slow


def sides(rng, c, r, level, spread, noise=0.08):
    quality = rng.normal(0.3, 0.1, (c, 1))
    gap = rng.normal(level, spread, (c, 1))
    source = quality + rng.normal(0, noise, (c, r))
    target = quality + gap + rng.normal(0, noise, (c, r))
    return GapSide("sim", "SIM", source), GapSide("twin", "TWIN", target)


def level_intervals(c, r, level, spread, studies, first_seed=0):
    """(studies, 2) intervals of the level."""
    ends = []
    for seed in range(first_seed, first_seed + studies):
        rng = np.random.default_rng(seed)
        drawn = bootstrap({"level": mean_difference}, *sides(rng, c, r, level, spread), 500, rng)
        ends.append(percentile_interval(drawn["level"], c))
    return np.array(ends)


@pytest.mark.parametrize(
    ("c", "r", "level", "spread"), [(5, 10, 0.05, 0.05), (10, 4, 0.0, 0.05), (30, 10, 0.05, 0.05)]
)
def test_95_percent_intervals_cover_at_least_90(c, r, level, spread):
    # an interval of 95 % covers fewer than 135 of 150 in 1 of 200 tries; of 5 controllers they are wider than needed
    low, high = level_intervals(c, r, level, spread, 150).T
    assert ((low <= level) & (level <= high)).mean() >= 0.9


def test_no_gap_is_excluded_no_more_often_than_stated():
    # two sides of one distribution: 5 % of 100 intervals of the level exclude 0; 12 or more in 1 of 250 tries
    low, high = level_intervals(20, 10, 0.0, 0.0, 100, first_seed=1_000).T
    assert ((low > 0) | (high < 0)).sum() < 12


def test_shrunk_means_spread_as_controllers_do_without_noise():
    rng = np.random.default_rng(3)
    latent = rng.multivariate_normal([0.4, 0.3], [[0.01, 0.008], [0.008, 0.01]], 2_000)
    noisy = latent[:, :, None] + rng.normal(0, 0.2, (2_000, 2, 4))
    means = shrunk_means(GapSide("s", "SIM", noisy[:, 0]), GapSide("t", "TWIN", noisy[:, 1]))
    # 2,000 controllers give a covariance to about 0.0007
    assert np.cov(means.T) == pytest.approx(np.array([[0.01, 0.008], [0.008, 0.01]]), abs=0.002)


def test_four_controllers_give_no_interval():
    assert percentile_interval(np.linspace(0, 1, 100), 4) is None
