"""Distances of behaviors, and a test that compares a controller with itself only."""

import numpy as np
import pytest

from realitygap.gap._behavior import energy_distances, energy_test, smallest_energy_p


def by_hand(one, other):
    def mean(pairs):
        return np.mean([np.linalg.norm(a - b) for a, b in pairs])

    within = [[(a, b) for i, a in enumerate(s) for j, b in enumerate(s) if i != j] for s in (one, other)]
    return 2 * mean([(a, b) for a in one for b in other]) - mean(within[0]) - mean(within[1])


def test_energy_distance_is_its_definition():
    rng = np.random.default_rng(1)
    one, other = rng.random((3, 4, 2)), rng.random((3, 5, 2)) + 0.5
    expected = [by_hand(a, b) for a, b in zip(one, other, strict=True)]
    assert energy_distances(one, other) == pytest.approx(expected)


def test_the_same_distribution_has_0_on_average():
    rng = np.random.default_rng(2)
    found = energy_distances(rng.normal(size=(2_000, 4, 3)), rng.normal(size=(2_000, 4, 3)))
    assert abs(found.mean()) < 4 * found.std() / np.sqrt(2_000)


def test_controllers_that_differ_make_no_gap_and_a_moved_target_does():
    # without strata the controllers' own differences would drown both
    rng = np.random.default_rng(3)
    places = rng.normal(0, 10, (8, 1, 2))
    here, there = (places + rng.normal(0, 1, (8, 6, 2)) for _ in range(2))
    assert energy_test(here, there, rng) > 0.05
    assert energy_test(here, there + 1.0, rng) == pytest.approx(0.001)


def test_p_is_even_where_there_is_no_gap():
    # 200 studies without a gap: fewer than 20 have p below 0.05 but in 1 of 400 tries
    rng = np.random.default_rng(4)
    ps = [energy_test(rng.normal(size=(5, 4, 2)), rng.normal(size=(5, 4, 2)), rng, 99) for _ in range(200)]
    assert np.sum(np.array(ps) <= 0.05) < 20


def test_ways_to_share_out_trials_that_are_mirror_images_count_once():
    assert smallest_energy_p(1, 2, 2) == pytest.approx(1 / 3)
    assert smallest_energy_p(2, 2, 2) == pytest.approx(1 / 9)
    assert smallest_energy_p(1, 2, 3) == pytest.approx(1 / 10)
    # and no permutation gives less: 2 and 2 trials, far apart
    far = energy_test(np.array([[[0.0], [0.1]]]), np.array([[[9.0], [9.1]]]), np.random.default_rng(0))
    assert far == pytest.approx(1 / 3, abs=0.06)
