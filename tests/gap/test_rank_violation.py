"""MMRV on the published tables of SIMPLER, whose own examples give its two arguments in both orders."""

import numpy as np
import pytest

from realitygap.gap import mean_maximum_rank_violation, rank_violation_floor

# Success of RT-2-X, RT-1 (converged, 15 %), RT-1-X, RT-1 (begin) and Octo-Base in simulation (visual matching) and on
# the robot: Li et al. (2024), as in `simpler_env/utils/metrics.py` of simpler-env/SimplerEnv.
PUBLISHED = {
    "pick coke can": (
        (0.787, 0.857, 0.710, 0.567, 0.027, 0.170),
        (0.907, 0.853, 0.920, 0.760, 0.133, 0.293),
        0.031,
    ),
    "move near": (
        (0.779, 0.442, 0.354, 0.317, 0.050, 0.042),
        (0.733, 0.633, 0.583, 0.450, 0.017, 0.350),
        0.111,
    ),
}


def by_hand(source, target):
    """As the paper writes it."""
    worst = []
    for s, t in zip(source, target, strict=True):
        worst.append(max(abs(t - u) * ((s < r) != (t < u)) for r, u in zip(source, target, strict=True)))
    return sum(worst) / len(worst)


@pytest.mark.parametrize(("source", "target", "published"), PUBLISHED.values(), ids=list(PUBLISHED))
def test_published_tables_come_out(source, target, published):
    found = mean_maximum_rank_violation(np.array([source]), np.array([target]))[0]
    assert round(found, 3) == published
    assert found == pytest.approx(by_hand(source, target))


@pytest.mark.parametrize(("source", "target", "published"), PUBLISHED.values(), ids=list(PUBLISHED))
def test_the_other_order_of_arguments_is_another_number(source, target, published):
    swapped = mean_maximum_rank_violation(np.array([target]), np.array([source]))[0]
    assert round(swapped, 3) != published


def test_the_same_order_violates_nothing_whatever_the_level():
    target = np.array([[0.1, 0.5, 0.3]])
    assert mean_maximum_rank_violation(10 * target + 3, target) == [0.0]


def test_a_reversed_order_costs_each_its_farthest():
    assert mean_maximum_rank_violation(np.array([[3.0, 2.0, 1.0]]), np.array([[1.0, 2.0, 4.0]])) == (
        pytest.approx([(3 + 2 + 3) / 3])
    )


def test_the_floor_is_0_without_noise_and_falls_with_trials():
    rng = np.random.default_rng(1)
    level = np.linspace(0.1, 0.5, 10)[:, None]
    floors = [
        rank_violation_floor((level + rng.normal(0, noise, (10, trials)))[None], rng)[0]
        for noise, trials in ((0.0, 4), (0.2, 40), (0.2, 4))
    ]
    assert floors[0] == 0.0
    assert 0 < floors[1] < floors[2]


def test_many_resamples_of_many_controllers_come_out_block_by_block_as_one_by_one():
    """500 controllers took 4 GB an array."""
    rng = np.random.default_rng(1)
    source, target = rng.normal(size=(60, 500)), rng.normal(size=(60, 500))
    found = mean_maximum_rank_violation(source, target)
    alone = [mean_maximum_rank_violation(source[k : k + 1], target[k : k + 1])[0] for k in (0, 15, 16, 59)]
    assert found[[0, 15, 16, 59]].tolist() == alone
