"""Numbers of controllers that do what they promise in simulated studies."""

import pytest

from realitygap.gap import (
    plan_correlation,
    plan_effect,
    plan_margin,
    spread_of_differences,
    trial_reliability,
)


def test_effect_needs_what_tables_say():
    # Cohen (1988): a paired t test finds half a standard deviation with 34 pairs in 80 of 100
    found = plan_effect(0.05, spread=0.1, noise=0.0, trials=1)
    assert found.controllers == 34
    assert found.low < 0.807 < found.high


def test_more_trials_need_fewer_controllers_down_to_what_controllers_differ():
    found = [plan_effect(0.05, spread=0.05, noise=0.1, trials=trials).controllers for trials in (1, 5, 100)]
    assert found[0] > found[1] > found[2] > 8


@pytest.mark.parametrize("margin", [0.03, 0.08])
def test_margin_has_its_power(margin):
    found = plan_margin(margin, spread=0.05, noise=0.1, trials=10)
    assert found.low < 0.9
    assert found.high > 0.8


def test_correlation_has_its_power():
    found = plan_correlation(0.9, least=0.5, reliability=0.8, trials=10)
    assert found.controllers > 5
    assert found.high > 0.77  # the normal formula is a little off


def test_what_cannot_be_is_refused():
    with pytest.raises(ValueError, match="least"):
        plan_correlation(0.5, least=0.6, reliability=1.0, trials=1)
    with pytest.raises(ValueError, match="effect is 0"):
        plan_effect(0.0, spread=0.1, noise=0.1, trials=1)


def test_spread_and_reliability_by_hand():
    assert spread_of_differences(0.03, 0.1, 50) == pytest.approx((0.0009 + 0.0004) ** 0.5)
    assert trial_reliability(0.1, 0.2, 4) == pytest.approx(0.5)


def test_no_plan_is_for_fewer_controllers_than_give_an_interval():
    assert plan_effect(0.5, spread=0.01, noise=0.05, trials=10).controllers == 5
