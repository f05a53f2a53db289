"""MMRV on the published tables of SIMPLER, whose own examples give its two arguments in both orders."""

import numpy as np
import pytest
from scipy import stats

from realitygap.gap import (
    mean_maximum_rank_violation,
    rank_violation_interval,
)
from realitygap.gap._ranks import rank_violation_floor, reliability, trials_for_reliability

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
    """As the paper writes it, but with a pair that ties on one side only violated for both."""
    worst = []
    for s, t in zip(source, target, strict=True):
        violated = [(s < r) != (t < u) or (s > r) != (t > u) for r, u in zip(source, target, strict=True)]
        worst.append(max(abs(t - u) * wrong for u, wrong in zip(target, violated, strict=True)))
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


def plain_ends(source, target):
    """A t interval of the logarithm, each controller left out in turn."""
    c = len(source)
    value = by_hand(source, target)
    left = [by_hand(np.delete(source, k), np.delete(target, k)) for k in range(c)]
    error = np.sqrt((c - 1) / c * sum((each - np.mean(left)) ** 2 for each in left))
    factor = np.exp(stats.t.ppf(0.975, c - 1) * error / value)
    return value / factor, min(value * factor, max(target) - min(target))


@pytest.mark.parametrize("c", [5, 6, 20])
def test_interval_equals_its_plain_reference(c):
    rng = np.random.default_rng(c)
    for _ in range(20):
        quality = rng.normal(0.3, 0.1, c)
        source, target = (np.round(quality + rng.normal(0, 0.1, c), 2) for _ in range(2))  # with ties
        if by_hand(source, target) > 0:
            assert rank_violation_interval(source, target) == pytest.approx(plain_ends(source, target))


def test_interval_never_exceeds_the_range_of_the_target():
    source, target = np.array([0.1, 0.2, 0.3, 0.5, 0.4]), np.array([0.1, 0.2, 0.3, 0.4, 0.5])
    low, high = rank_violation_interval(source, target)
    assert 0 < low < by_hand(source, target)
    assert high == pytest.approx(0.4)


def test_interval_of_no_violation_is_refused():
    with pytest.raises(ValueError, match="rank violation is 0"):
        rank_violation_interval(np.arange(5.0), np.arange(5.0))


@pytest.mark.long
@pytest.mark.parametrize(("c", "spread"), [(5, 0.05), (10, 0.1), (20, 0.05)])
def test_each_end_misses_at_most_5_percent_of_normal_studies(c, spread):
    # an end that misses 3.5 % of 2,000 studies misses 100 times or more in 1 of 4,000 tries
    rng = np.random.default_rng(c)

    def studies():
        quality = rng.normal(0.3, 0.1, (2_000, c))
        gap = rng.normal(0, spread, (2_000, c))
        return [side + rng.normal(0, 0.025, (2_000, c)) for side in (quality, quality + gap)]

    true = mean_maximum_rank_violation(*studies()).mean()
    pairs = [pair for pair in zip(*studies(), strict=True) if by_hand(*pair) > 0]
    low, high = np.array([rank_violation_interval(*pair) for pair in pairs]).T
    assert (low > true).sum() < 100
    assert (high < true).sum() < 100


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
