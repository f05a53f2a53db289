"""Order over controllers, and what noise hides of it."""

import math

import numpy as np
import pytest
from scipy import stats

from realitygap.gap import attenuated, reliability, spearman, trials_for_reliability


def test_spearman_is_that_of_scipy_with_ties():
    rng = np.random.default_rng(1)
    one, other = rng.integers(0, 5, (7, 12)).astype(float), rng.integers(0, 5, (7, 12)).astype(float)
    expected = [stats.spearmanr(a, b).statistic for a, b in zip(one, other, strict=True)]
    assert spearman(one, other) == pytest.approx(expected)


def test_values_all_alike_have_no_correlation():
    assert np.isnan(spearman(np.ones((1, 4)), np.arange(4.0)[None])[0])


@pytest.mark.parametrize("trials", [5, 10])
def test_reliability_is_the_share_of_variance_that_is_not_noise(trials):
    # 3,000 controllers: standard error about 0.02; ranks of normal values correlate a little less
    rng = np.random.default_rng(trials)
    values = rng.normal(0, 1, (3_000, 1)) + rng.normal(0, 2, (3_000, trials))
    assert reliability(values[None], rng, 20)[0] == pytest.approx(1 / (1 + 4 / trials), abs=0.04)


def test_trials_for_a_reliability_undo_spearman_and_brown():
    # 0.2 with 4 trials: one trial has 1/17, and 16 trials 0.5
    assert trials_for_reliability(0.2, 4, 0.5) == 16
    assert trials_for_reliability(0.0, 4, 0.5) is None


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
