"""Replays beside what the target did."""

import numpy as np
import pytest

from realitygap.gap import GapSide, coverage_maps, replay_error


def test_distance_and_heading_are_to_each_replay_and_noise_between_replays():
    observed = np.array([[[0.0, 0.0, 3.1], [1.0, 0.0, 3.1]]])
    replayed = np.array([[[[0.0, 0.0, -3.1], [1.0, 0.3, -3.1]]], [[[0.0, 0.0, -3.1], [1.0, 0.1, -3.1]]]])
    found = replay_error(observed, replayed)
    assert found.distance == pytest.approx(np.array([[0.0, 0.2]]))
    assert found.heading == pytest.approx(np.full((1, 2), 2 * np.pi - 6.2))
    assert found.noise_distance == pytest.approx(np.array([[0.0, 0.2]]))
    assert found.noise_heading == pytest.approx(np.zeros((1, 2)))


def test_its_mean_over_controllers_has_an_interval_at_each_step():
    rng = np.random.default_rng(1)
    observed, off = np.zeros((12, 4, 3)), rng.uniform(0, 1, 6)
    replayed = np.zeros((2, 12, 4, 3))
    replayed[..., 1:, 0] = np.repeat(off, 2)[:, None]
    found = replay_error(observed, replayed, np.repeat(np.arange(6), 2))
    spread = 2.571 * off.std(ddof=1) / np.sqrt(6)  # t with 5 degrees of freedom
    assert found.at_end.n == 6
    assert found.at_end.value == pytest.approx(off.mean())
    assert found.at_end.high == pytest.approx(off.mean() * np.exp(spread / off.mean()), rel=1e-3)
    told = found.to_dict()
    assert told["trials"] == 12
    assert told["distance"]["estimate"] == pytest.approx([0.0] + 3 * [off.mean()])
    assert told["distance"]["low"][0] == 0.0
    assert len(told["noise_heading"]["high"]) == 4


def test_one_replay_shows_no_noise():
    with pytest.raises(ValueError, match="at least 2"):
        replay_error(np.zeros((1, 3, 3)), np.zeros((1, 1, 3, 3)))


def test_maps_are_shares_of_trials_and_their_difference_target_less_source():
    cells = np.array([[[True, False], [True, True]]])
    maps = coverage_maps(
        GapSide("s", "SIM", np.zeros((1, 2)), cells), GapSide("t", "TWIN", np.zeros((1, 2)), ~cells)
    )
    assert maps.source == pytest.approx([1.0, 0.5])
    assert maps.difference == pytest.approx([-1.0, 0.0])
    assert (
        coverage_maps(GapSide("s", "SIM", np.zeros((1, 2))), GapSide("t", "TWIN", np.zeros((1, 2)))) is None
    )
