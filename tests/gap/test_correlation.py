"""Order over controllers, and what noise hides of it."""

import numpy as np
import pytest
from scipy import stats

from realitygap.gap import reliability, spearman, trials_for_reliability


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
