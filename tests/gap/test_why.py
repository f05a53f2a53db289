"""What parts of the model carry, and what to change next."""

import numpy as np
import pytest

from realitygap.gap import Why, explain_gap
from realitygap.stats import Estimate


def differences(falls, noise=0.0, c=12, draws=3):
    """(d, 4, c) of two parts that take so much of a gap of 0.3 each, without noise of trials."""
    rng = np.random.default_rng(1)
    rms = 0.3 - np.array([falls[0] * (k & 1) + falls[1] * (k >> 1) for k in range(4)])
    return np.maximum(rms[None, :, None] + noise * rng.normal(size=(draws, 1, c)), 0)


def explained(apart):
    return explain_gap(apart, apart**2, ("motor", "body"), (3, 1))


def test_parts_carry_what_they_take_and_add_up():
    found = explained(differences((0.2, 0.05)))
    assert [each.value for each in found.falls] == pytest.approx([0.2, 0.05])
    assert found.before.value == pytest.approx(0.3)
    assert found.after.value == pytest.approx(0.05)
    assert found.change.value == pytest.approx(-0.25)
    assert found.order == [0, 1]
    assert found.advice.startswith("Change this next: motor, which explains most, 0.200 [0.200, 0.200]")
    assert "is outside these numbers" in found.advice
    assert found.to_dict()["parts"]["motor"]["numbers"] == 3


def test_draws_from_the_posterior_widen_the_intervals():
    spread = differences((0.1, 0.0))
    assert explained(spread).after.low == pytest.approx(explained(spread).after.high)
    spread[1:, [1, 3]] = np.array([0.15, 0.25])[:, None, None]
    found = explained(spread)
    assert found.falls[0].high - found.falls[0].low > 0.04
    assert found.after.high - found.after.low > 0.04
    assert found.before.low == pytest.approx(found.before.high)


def test_a_part_that_may_be_chance_is_said_to_be_so_and_one_that_harms_is_not_advised():
    unsure = Estimate(0.02, -0.01, 0.05, 9)
    whole, none = Estimate(0.1, 0.05, 0.2, 9), Estimate(0.0, 0.0, 0.01, 9)
    less = Estimate(-0.1, -0.2, -0.05, 9)
    advice = Why(("motor",), (unsure,), (1,), whole, none, less).advice
    assert "this may be chance (about 21 controllers would" in advice  # 9 * (0.03 / 0.02)^2
    hardly = Estimate(0.001, -0.04, 0.05, 9)
    assert "more than 1,024 controllers" in Why(("motor",), (hardly,), (1,), whole, none, less).advice
    nearly = Estimate(0.02, 0.0, 0.05, 9)
    assert "about 10 controllers would" in Why(("motor",), (nearly,), (1,), whole, none, less).advice
    harm = Estimate(-0.02, -0.03, -0.01, 9)
    advice = Why(("motor",), (harm,), (1,), whole, whole, Estimate(0.0, -0.02, 0.02, 9)).advice
    assert advice.startswith("Change this next: none of the fitted parts")
    one = Estimate(0.02, 0.01, 0.05, 9)
    before, after = Estimate(0.01, 0.0, 0.02, 9), Estimate(0.06, 0.03, 0.1, 9)
    worse = Why(("motor",), (one,), (1,), before, after, Estimate(0.05, 0.01, 0.09, 9))
    assert worse.advice.startswith("Change this next: the fit. It makes the gap larger")
    perhaps = Why(("motor",), (one,), (1,), before, after, Estimate(0.05, -0.01, 0.09, 9))
    assert perhaps.advice.startswith("Change this next: motor, ")
    assert perhaps.advice.endswith("The whole fit is not shown to reduce the gap.")


def test_few_controllers_carry_no_advice_and_it_says_how_many_would():
    found = explained(differences((0.2, 0.05), c=2))
    assert found.after.low is None
    assert found.advice == (
        "No advice on the next change: 2 controllers are too few for an interval; at least 5 are needed."
    )
