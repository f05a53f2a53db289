"""How large a difference is, without the noise of trials."""

import numpy as np
import pytest

from realitygap.gap import square_differences
from realitygap.gap._level import mean_difference, rms_of, shares_above


def test_level_is_the_mean_of_differences_of_means_target_less_source():
    source = np.array([[[0.2, 0.4], [0.5, 0.5]]])
    target = np.array([[[0.1, 0.3, 0.2], [0.5, 0.6, 0.4]]])
    assert mean_difference(source, target) == pytest.approx([-0.05])


def test_mean_square_is_right_on_average_however_few_the_trials():
    # of 20,000 controllers with 2 trials; standard error 0.0003, so that chance fails this in 1 of 1,000
    rng = np.random.default_rng(1)
    gap = rng.normal(0.05, 0.05, (20_000, 1))
    source = rng.normal(0.3, 0.1, (20_000, 2))[None]
    target = (rng.normal(0.3, 0.1, (20_000, 2)) + gap)[None]
    found = square_differences(source, target).mean()
    naive = ((target.mean(axis=2) - source.mean(axis=2)) ** 2).mean()
    assert found == pytest.approx((gap**2).mean(), abs=0.001)
    assert naive > 0.012  # twice what is there


def test_a_mean_square_below_0_is_no_gap():
    assert rms_of(np.array([-0.01, 0.04])) == pytest.approx([0.0, 0.2])


def test_one_trial_does_not_tell_noise():
    with pytest.raises(ValueError, match="at least 2"):
        square_differences(np.zeros((1, 3, 1)), np.zeros((1, 3, 5)))


def test_ties_count_half_in_a12():
    source = np.array([[1.0, 1.0], [0.0, 1.0], [0.0, 0.0]])
    target = np.array([[1.0, 1.0], [1.0, 1.0], [1.0, 2.0]])
    assert shares_above(source, target) == pytest.approx([0.5, 0.75, 1.0])
