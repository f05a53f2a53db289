"""Numbers of controllers that do what they promise in simulated studies."""

import math

import numpy as np
import pytest
from scipy import stats

from realitygap.gap import GapSide, measure_gap
from realitygap.stats import (
    check_plan,
    detectable_difference,
    plan_correlation,
    plan_effect,
    plan_margin,
    spread_of_differences,
    trial_reliability,
)
from realitygap.stats._correlation import attenuated

pytestmark = pytest.mark.slow


def test_effect_needs_what_tables_say():
    # Cohen (1988): a paired t test finds half a standard deviation with 34 pairs in 80 of 100
    found = plan_effect(0.05, spread=0.1, noise=0.0, trials=1)
    assert found.controllers == 34
    assert found.low < 0.807 < found.high


def test_detectable_difference_is_the_effect_that_so_many_controllers_detect():
    assert detectable_difference(34, spread=0.1, noise=0.0, trials=1) == pytest.approx(0.0496, abs=1e-4)
    for trials in (1, 10):
        spreads = {"spread": 0.05, "noise": 0.1, "trials": trials}
        effect = detectable_difference(20, **spreads)
        assert plan_effect(1.001 * effect, **spreads).controllers == 20
        assert plan_effect(0.999 * effect, **spreads).controllers == 21
    with pytest.raises(ValueError, match="n is 1"):
        detectable_difference(1, spread=0.1, noise=0.0, trials=1)


def test_more_trials_need_fewer_controllers_down_to_what_controllers_differ():
    found = [plan_effect(0.05, spread=0.05, noise=0.1, trials=trials).controllers for trials in (1, 5, 100)]
    assert found[0] > found[1] > found[2] > 8


@pytest.mark.parametrize("margin", [0.03, 0.08])
def test_margin_has_its_power(margin):
    found = plan_margin(margin, spread=0.05, noise=0.1, trials=10)
    assert found.low < 0.9
    assert found.high > 0.8


def normal_studies(correlation, reliability, n, trials, studies, rng):
    """Two (studies, n, trials) sides: controllers with this rank correlation, whose means repeat so well."""
    pearson = 2 * math.sin(math.pi * correlation / 6)
    latent = rng.multivariate_normal([0, 0], [[1, pearson], [pearson, 1]], (studies, n))
    noise = math.sqrt(trials * (1 / reliability - 1))
    return [latent[..., [side]] + noise * rng.normal(size=(studies, n, trials)) for side in (0, 1)]


@pytest.mark.parametrize(
    ("correlation", "least", "reliability", "trials"),
    [(0.9, 0.7, 0.8, 5), (0.9, 0.5, 0.8, 2), (0.8, 0.3, 0.9, 10)],
)
def test_correlation_plan_has_its_power_in_independent_studies_of_trials(
    correlation, least, reliability, trials
):
    """Noise of trials lowers a rank correlation by more than the formula said: 107 controllers had 0.76, not 0.82."""
    plan = plan_correlation(correlation, least=least, reliability=reliability, trials=trials)
    sides = normal_studies(
        correlation, reliability, plan.controllers, trials, 1_000, np.random.default_rng(11)
    )
    means = [side.mean(axis=2) for side in sides]
    seen = np.array([stats.spearmanr(*pair).statistic for pair in zip(*means, strict=True)])
    errors = np.sqrt((1 + seen**2 / 2) / (plan.controllers - 3))
    shown = np.arctanh(seen) - stats.norm.ppf(0.95) * errors > math.atanh(
        attenuated(least, reliability, reliability)
    )
    # two shares of 0.8, of 2,000 and of 1,000 studies, differ by more than 0.05 in 1 of 800 tries
    assert shown.mean() == pytest.approx(plan.power, abs=0.05)
    assert plan.low >= 0.78


@pytest.mark.long
def test_correlation_plan_is_enough_for_the_interval_that_gap_prints():
    # 200 studies: a power of 0.8 gives 136 or fewer in 1 of 20,000 tries
    plan = plan_correlation(0.9, least=0.7, reliability=0.8, trials=5)
    sides = normal_studies(0.9, 0.8, plan.controllers, 5, 200, np.random.default_rng(12))
    lows = [
        measure_gap(
            GapSide("sim", "SIM", source), GapSide("target", "SIM", target), resamples=300
        ).srcc_disattenuated.low
        for source, target in zip(*sides, strict=True)
    ]
    assert sum(low > 0.7 for low in lows) > 136


def test_plans_refuse_goals_that_cannot_be_reached():
    with pytest.raises(ValueError, match="least"):
        plan_correlation(0.5, least=0.6, reliability=1.0, trials=1)
    with pytest.raises(ValueError, match="effect is 0"):
        plan_effect(0.0, spread=0.1, noise=0.1, trials=1)


@pytest.mark.parametrize("value", [0.0, -0.05, math.nan, math.inf])
@pytest.mark.parametrize("question", ["effect", "margin", "correlation"])
def test_question_out_of_range_is_refused(question, value):
    with pytest.raises(ValueError, match=f"{question} is {value}"):
        check_plan(**{question: value})


@pytest.mark.parametrize("power", [0.0, 1.0, math.nan])
def test_power_out_of_range_is_refused(power):
    with pytest.raises(ValueError, match=f"power is {power}"):
        check_plan(power, effect=0.1)


@pytest.mark.parametrize("least", [0.9, -1.0, math.nan])
def test_least_correlation_out_of_range_is_refused(least):
    with pytest.raises(ValueError, match=f"least is {least}"):
        check_plan(correlation=0.9, least=least)


def test_tiny_effect_needs_more_controllers_than_are_planned_for():
    assert plan_effect(1e-9, spread=0.1, noise=0.1, trials=1).controllers is None


def test_spread_and_reliability_equal_those_by_hand():
    assert spread_of_differences(0.03, 0.1, 50) == pytest.approx((0.0009 + 0.0004) ** 0.5)
    assert trial_reliability(0.1, 0.2, 4) == pytest.approx(0.5)


def test_no_plan_is_for_fewer_controllers_than_give_an_interval():
    assert plan_effect(0.5, spread=0.01, noise=0.05, trials=10).controllers == 5
