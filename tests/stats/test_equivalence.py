"""Two one-sided tests."""

import numpy as np
import pytest

from realitygap.stats import (
    controllers_for_margin,
    prove_equivalence,
)
from realitygap.stats._planning import equivalence_power


def test_equivalence_is_shown_where_the_interval_lies_within_the_margin():
    differences = np.array([0.01, -0.02, 0.015, 0.0, -0.01, 0.005])
    shown, not_shown = prove_equivalence(differences, 0.05), prove_equivalence(differences, 0.01)
    assert shown.equivalent
    assert -0.05 < shown.difference.low < shown.difference.high < 0.05
    assert not not_shown.equivalent
    assert not -0.01 < not_shown.difference.low < not_shown.difference.high < 0.01


def test_the_false_claim_at_the_margin_is_5_percent():
    # 2,000 studies with a true difference at the margin: 5 % +- 1 % (two standard errors)
    rng = np.random.default_rng(1)
    found = [prove_equivalence(rng.normal(0.05, 0.05, 20), 0.05).equivalent for _ in range(2_000)]
    assert 0.035 < np.mean(found) < 0.065


@pytest.mark.parametrize("n", [10, 20])
def test_power_is_that_of_simulated_studies(n):
    rng = np.random.default_rng(n)
    found = [prove_equivalence(rng.normal(0.0, 0.06, n), 0.05).equivalent for _ in range(2_000)]
    assert equivalence_power(0.05, 0.06, n) == pytest.approx(np.mean(found), abs=0.035)


def test_fewest_controllers_have_the_power_and_one_less_has_not():
    n = controllers_for_margin(0.05, 0.08)
    assert equivalence_power(0.05, 0.08, n) >= 0.8 > equivalence_power(0.05, 0.08, n - 1)


def test_a_margin_of_nothing_is_refused():
    with pytest.raises(ValueError, match="above 0"):
        prove_equivalence(np.array([0.1, 0.2]), 0.0)
