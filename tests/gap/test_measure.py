"""All measures together, and what n cannot carry."""

import json

import numpy as np
import pytest

from realitygap.gap import (
    GapSide,
    measure_gap,
)
from realitygap.gap._result import MEASURES


def sides(c=12, r=8, gap=0.0, spread=0.0, noise=0.06, seed=1, cells=True):
    rng = np.random.default_rng(seed)
    quality = rng.uniform(0.1, 0.6, (c, 1))
    apart = rng.normal(gap, spread, (c, 1)) if spread else gap
    found = []
    for name, label, level in (("sim", "SIM", quality), ("twin", "TWIN", quality + apart)):
        values = level + rng.normal(0, noise, (c, r))
        crossed = rng.random((c, r, 20)) < level[:, :, None] if cells else np.empty((0, 0, 0), bool)
        found.append(GapSide(name, label, values, crossed))
    return found


def test_json_has_what_is_promised_each_with_estimate_low_high_and_n():
    found = json.loads(measure_gap(*sides(), margin=0.1).to_json())
    for name in MEASURES:
        assert {"estimate", "low", "high", "n"} <= set(found[name]), name
        assert found[name]["low"] <= found[name]["estimate"] <= found[name]["high"], name
    assert found["misspecified"] is None
    assert found["verdict"].endswith(".")


def test_a_gap_is_found_and_its_size_and_side():
    found = measure_gap(*sides(gap=-0.15), margin=0.05)
    assert found.excludes_no_gap
    assert found.rms.low < 0.15 < found.rms.high
    assert found.level.high < 0
    assert found.a12.high < 0.5
    assert found.energy.more["p"] < 0.05
    assert found.equivalence.more["equivalent"] is False
    assert found.verdict.startswith(
        f"Don’t trust sim for the level of coverage: it is {-found.level.value:.3f} ["
    )
    assert "lower on" in found.verdict


def test_no_gap_is_equivalent_at_a_wide_margin_and_keeps_the_order():
    found = measure_gap(*sides(), margin=0.1)
    assert not found.excludes_no_gap
    assert found.equivalence.more["equivalent"] is True
    assert found.srcc_disattenuated.value > 0.9
    assert found.mmrv.value <= 2 * found.mmrv_floor.value
    assert found.verdict.count("Trust ") == 2


def test_the_same_trials_give_the_same_numbers():
    assert measure_gap(*sides()).to_json() == measure_gap(*sides()).to_json()


def test_disattenuation_by_noise_is_refused_with_the_trials_that_would_do():
    rng = np.random.default_rng(2)
    quality = np.linspace(0.28, 0.32, 20)[:, None]
    noisy = [GapSide(name, "SIM", quality + rng.normal(0, 0.1, (20, 4))) for name in ("one", "other")]
    found = measure_gap(*noisy).srcc_disattenuated
    assert found.value is None
    assert "does not repeat its own order" in found.refused


def test_one_trial_a_controller_carries_level_and_order_but_no_size():
    found = measure_gap(*sides(r=1))
    assert found.level.low is not None
    assert found.srcc.value is not None
    for name in ("rms", "noise_ceiling", "srcc_disattenuated", "mmrv_floor", "energy"):
        assert getattr(found, name).value is None, name
        assert "2" in getattr(found, name).refused, name
    assert "Trust" in found.verdict


def test_four_controllers_carry_no_order_and_no_interval():
    found = measure_gap(*sides(c=4))
    for measure in (found.srcc, found.pearson, found.mmrv, found.mean_violation):
        assert measure.value is not None
        assert measure.low is None
        assert "1 of 24" in measure.refused
    assert found.level.value is not None
    assert found.level.low is None
    assert "at least 5 are needed" in found.level.refused


def test_equivalence_that_so_few_cannot_show_is_refused_with_the_number_that_can():
    found = measure_gap(*sides(c=6, r=2, spread=0.1), margin=0.02).equivalence
    assert found.more["equivalent"] is None
    assert "do so in 80 of 100" in found.refused


def test_controllers_all_alike_have_no_order():
    still = GapSide("sim", "SIM", np.full((6, 3), 0.1))
    found = measure_gap(still, sides(c=6, r=3)[1])
    assert "all controllers do equally well" in found.srcc.refused


def test_other_controllers_on_both_sides_are_refused():
    with pytest.raises(ValueError, match="expected the same ones"):
        measure_gap(sides(c=6)[0], sides(c=7)[1])


def test_a_side_must_be_finite_and_whole():
    with pytest.raises(ValueError, match="expected a finite number"):
        GapSide("sim", "SIM", np.array([[np.nan]]))
    with pytest.raises(ValueError, match="cells of sim"):
        GapSide("sim", "SIM", np.zeros((2, 3)), np.zeros((2, 2, 5), bool))


def test_a_target_that_is_always_worse_leaves_a12_an_interval():
    one, other = sides(c=5, noise=0.001)
    found = measure_gap(one, GapSide("twin", "TWIN", other.values - 0.5)).a12
    assert found.value == 0.0
    assert found.low == 0.0
    assert found.high == pytest.approx(1 - 0.025 ** (1 / 5))


def test_four_controllers_have_a_verdict_without_an_interval():
    found = measure_gap(*sides(c=4, r=3, gap=0.3))
    assert found.rms.high is None
    assert found.verdict == (
        "Too few controllers to judge the level of coverage. Too few controllers to judge the ranking."
    )


def test_the_spread_of_gaps_and_the_expected_gap_of_each_controller():
    """The interval of the standard deviation, 0.1, misses in 1 of 20 seeds."""
    one, other = sides(c=60, r=4, gap=-0.1, spread=0.1, seed=2)
    found = measure_gap(one, other)
    assert found.spread.low < 0.1 < found.spread.high
    expected = np.array([each.value for each in found.each])
    observed = other.means - one.means
    assert np.ptp(expected) < np.ptp(observed)
    assert (np.sign(expected - observed) == np.sign(found.level.value - observed)).mean() > 0.9
    assert all(0 <= each.more["p"] <= 1 for each in found.each)


def test_controllers_with_one_gap_have_no_spread_and_single_trials_no_model():
    """The lower end is above 0 in 1 of 40 seeds."""
    alike = measure_gap(*sides(c=20, gap=-0.1, seed=2))
    assert alike.spread.low == 0.0
    single = measure_gap(*sides(r=1))
    assert single.spread.value is None
    assert "Drive at least 2" in single.spread.refused
    assert single.each == ()
