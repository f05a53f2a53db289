"""Two trials are as far apart as their poses are, whatever a step lasts."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from realitygap.playback import measure_divergence, own_divergence


def trial(*poses):
    return SimpleNamespace(poses=np.array(poses, np.float64))


def test_distance_and_heading_are_those_between_the_poses():
    one = trial((0, 0, 0), (1, 0, 0.1), (2, 0, math.tau - 0.1))
    other = trial((0, 0, 0), (1, 3, 0.4), (5, 4, 0.1))
    apart = measure_divergence([one], [other])
    assert apart.distance.tolist() == [[0.0, 3.0, 5.0]]
    assert apart.heading[0] == pytest.approx([0.0, 0.3, 0.2])
    assert (apart.n_pairs, apart.n_steps) == (1, 2)


def test_it_is_the_same_from_both_sides_and_headings_that_wind_on_are_the_same():
    generator = np.random.default_rng(1)
    trials = [trial(*generator.uniform(-3, 3, (9, 3))) for _ in range(4)]
    wound = [trial(*(each.poses + np.array([0, 0, math.tau * k]))) for k, each in enumerate(trials)]
    forth, back = measure_divergence(trials[:2], trials[2:]), measure_divergence(wound[2:], wound[:2])
    np.testing.assert_allclose(forth.distance, back.distance)
    np.testing.assert_allclose(forth.heading, back.heading, atol=1e-12)
    assert forth.heading.max() <= math.pi


def test_opposite_headings_are_pi_apart():
    assert measure_divergence([trial((0, 0, 0.0))], [trial((0, 0, math.pi))]).heading[0, 0] == math.pi


def test_a_longer_trial_is_compared_as_long_as_both_last():
    apart = measure_divergence([trial((0, 0, 0), (1, 0, 0))], [trial((0, 0, 0), (1, 1, 0), (9, 9, 9))])
    assert apart.distance.tolist() == [[0.0, 1.0]]


def test_repeats_that_are_alike_are_not_apart():
    same = trial((0, 0, 0), (1, 0, 1))
    assert own_divergence([same, same, same]).distance.max() == 0.0
    assert own_divergence([same, same, same]).n_pairs == 3


def test_unequal_numbers_are_refused():
    same = trial((0, 0, 0))
    with pytest.raises(ValueError, match="There are 2 trials beside 1, expected as many of both"):
        measure_divergence([same, same], [same])
    with pytest.raises(ValueError, match="There are 0 trials beside 0"):
        measure_divergence([], [])
    with pytest.raises(ValueError, match="There is 1 trial, expected two or more"):
        own_divergence([same])
