"""Order over controllers, and what noise hides of it."""

import math

import numpy as np
import pytest
from scipy import stats

from realitygap.stats import (
    rank_correlation,
    spearman,
)
from realitygap.stats._correlation import attenuated


def test_spearman_is_that_of_scipy_with_ties():
    rng = np.random.default_rng(1)
    one, other = rng.integers(0, 5, (7, 12)).astype(float), rng.integers(0, 5, (7, 12)).astype(float)
    expected = [stats.spearmanr(a, b).statistic for a, b in zip(one, other, strict=True)]
    assert spearman(one, other) == pytest.approx(expected)


def test_values_all_alike_have_no_correlation():
    assert np.isnan(spearman(np.ones((1, 4)), np.arange(4.0)[None])[0])


@pytest.mark.parametrize(
    ("correlation", "source", "target", "seen"),
    [
        (
            1.0,
            2 - math.sqrt(3),
            1.0,
            0.5,
        ),  # 2 sin(pi / 12), squared: Pearson's correlation where Spearman's is 0.5
        (0.5, 1.0, 1 / (2 * math.cos(math.pi / 24)) ** 2, 0.25),  # sin(2 x) = 2 sin x cos x
        (0.9, 0.8, 0.8, 0.709879),
        (-0.9, 0.8, 0.8, -0.709879),
    ],
)
def test_attenuated_correlation_has_known_values(correlation, source, target, seen):
    assert attenuated(correlation, source, target) == pytest.approx(seen, abs=1e-6)
    assert attenuated(correlation, target, source) == pytest.approx(seen, abs=1e-6)


def test_attenuated_correlation_is_unchanged_without_noise_and_0_without_anything_else():
    assert attenuated(0.6, 1.0, 1.0) == pytest.approx(0.6)
    assert attenuated(0.6, 0.0, 1.0) == 0.0


def test_attenuated_correlation_is_that_of_noisy_normal_values():
    # the standard error of the correlation of 200,000 pairs is about 0.0015
    rng = np.random.default_rng(1)
    pearson = 2 * np.sin(np.pi * 0.9 / 6)
    latent = rng.multivariate_normal([0, 0], [[1, pearson], [pearson, 1]], 200_000).T
    noisy = [
        side + rng.normal(0, np.sqrt(1 / share - 1), 200_000)
        for side, share in zip(latent, (0.8, 0.5), strict=True)
    ]
    assert spearman(noisy[0][None], noisy[1][None])[0] == pytest.approx(attenuated(0.9, 0.8, 0.5), abs=0.006)


@pytest.mark.slow
def test_correlations_are_scipys_and_their_interval_is_wide_enough():
    rng = np.random.default_rng(2)
    covered = 0
    for _ in range(200):
        one, other = rng.multivariate_normal([0, 0], [[1, 0.6], [0.6, 1]], 60).T
        found = rank_correlation(one, other)
        assert found.value == pytest.approx(stats.spearmanr(one, other)[0])
        covered += found.low < 6 / math.pi * math.asin(0.3) < found.high
    assert covered >= 180  # of 200; fewer than 1 in 1,000 where 95 % hold
    assert rank_correlation(np.ones(20), np.arange(20.0)).value is None
    assert rank_correlation(np.arange(20.0), np.arange(20.0)).low == 1.0
