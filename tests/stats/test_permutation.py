from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy import stats

from realitygap.stats import holm, lattice, permutation_p, runs_for_a_claim, sign_flip_p, smallest_p

pytestmark = pytest.mark.slow

# Darwin's 15 pairs of maize, crossed less self-fertilized [eighths of an inch]
DARWIN = np.array([49, -67, 8, 16, 6, 23, 28, 41, 14, 29, 56, 24, 75, 60, -48], dtype=float)

COVERAGES = st.integers(0, 72).map(lambda k: k / 72)


def test_darwins_maize_is_as_fisher_counted_it():
    # The Design of Experiments, section 21: 863 of 32,768 patterns reach the observed sum of 314
    assert DARWIN.sum() == 314
    assert sign_flip_p(DARWIN) == pytest.approx(2 * 863 / 2**15, rel=1e-12)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(-30, 30).map(lambda k: k / 72), min_size=1, max_size=9))
def test_sign_flips_are_those_counted_one_by_one(differences):
    values = np.array(differences)
    sums = [sum(s * d for s, d in zip(signs, values, strict=True)) for signs in
            itertools.product((-1, 1), repeat=len(values))]  # fmt: skip
    reached = sum(total >= abs(values.sum()) - 1e-9 for total in sums)
    assert sign_flip_p(values) == pytest.approx(min(1.0, 2 * reached / len(sums)), rel=1e-9)


def test_sign_flips_agree_with_scipy():
    differences = np.random.default_rng(3).integers(-5, 9, 13) / 72
    found = stats.permutation_test(
        (differences,), lambda x, axis: x.mean(axis=axis), permutation_type="samples", n_resamples=np.inf
    )
    assert sign_flip_p(differences) == pytest.approx(found.pvalue, rel=1e-9)


def test_many_pairs_are_counted_exactly_and_not_drawn():
    # 1,000 pairs apart by one cell, 600 of them upward: the sum is a binomial's
    differences = np.repeat([1 / 72, -1 / 72], [600, 400])
    exact = stats.binomtest(600, 1000, 0.5).pvalue
    assert sign_flip_p(differences) == pytest.approx(exact, rel=1e-9)


def test_pairs_off_any_grid_are_listed_or_drawn():
    few = np.random.default_rng(1).normal(0.5, 1, 10)
    listed = stats.permutation_test(
        (few,), lambda x, axis: x.mean(axis=axis), permutation_type="samples", n_resamples=np.inf
    ).pvalue
    assert sign_flip_p(few) == pytest.approx(listed, rel=1e-9)
    many = np.random.default_rng(2).normal(0.3, 1, 40)
    # seed fixed; 9,990 draws of a p of 0.03 are off by more than 30 % less than once in 10 million times
    assert sign_flip_p(many) == pytest.approx(stats.ttest_1samp(many, 0).pvalue, rel=0.3)


def test_no_difference_at_all_is_no_evidence():
    assert sign_flip_p(np.zeros(5)) == 1.0
    assert permutation_p(np.ones(4), np.ones(3)) == 1.0


@settings(max_examples=40, deadline=None)
@given(st.lists(COVERAGES, min_size=1, max_size=5), st.lists(COVERAGES, min_size=1, max_size=5))
@example(
    [10 / 72, 14 / 72, 31 / 72, 56 / 72, 59 / 72], [0.0, 68 / 72]
)  # equal means: neither side is the observed
def test_relabelings_are_those_counted_one_by_one(one, other):
    both = np.array(one + other)
    sums = np.array([both[list(which)].sum() for which in itertools.combinations(range(len(both)), len(one))])
    upper, lower = (sums >= sum(one) - 1e-9).mean(), (sums <= sum(one) + 1e-9).mean()
    found = permutation_p(np.array(one), np.array(other))
    assert found == pytest.approx(min(1.0, 2 * min(upper, lower)), rel=1e-9)
    assert found == pytest.approx(permutation_p(np.array(other), np.array(one)), rel=1e-9)


def test_relabelings_agree_with_scipy():
    rng = np.random.default_rng(5)
    one, other = rng.integers(5, 30, 7) / 72, rng.integers(8, 35, 6) / 72
    found = stats.permutation_test(
        (one, other), lambda x, y, axis: x.mean(axis=axis) - y.mean(axis=axis), n_resamples=np.inf
    )
    assert permutation_p(one, other) == pytest.approx(found.pvalue, rel=1e-9)


def test_drawn_relabelings_are_near_a_t_test():
    rng = np.random.default_rng(8)
    one, other = rng.normal(0, 1, 60), rng.normal(0.4, 1, 50)
    # seed fixed; both are within a tenth of a p of 0.05 of one another, or of each other's noise of 0.002
    assert permutation_p(one, other) == pytest.approx(stats.ttest_ind(one, other).pvalue, abs=0.01)


def test_three_against_three_cannot_be_below_a_tenth():
    assert smallest_p(3, 3) == pytest.approx(0.1)
    assert permutation_p(np.array([0.5, 0.6, 0.7]), np.array([0.1, 0.2, 0.3])) == pytest.approx(0.1)
    assert smallest_p(3) == 0.25
    assert sign_flip_p(np.array([0.25, 0.5, 0.75])) == 0.25


@given(st.integers(1, 8), st.integers(1, 8))
def test_the_smallest_p_is_that_of_complete_separation(n, m):
    one, other = np.arange(n) + 100.0, np.arange(m) * 1.0
    assert permutation_p(one, other) == pytest.approx(smallest_p(n, m), rel=1e-9)


def test_runs_for_a_claim_are_the_first_that_suffice():
    assert runs_for_a_claim(paired=False) == 4
    assert 2 / math.comb(6, 3) >= 0.05 > 2 / math.comb(8, 4)
    assert runs_for_a_claim(paired=True) == 6
    assert runs_for_a_claim(18, paired=True) == 10


def test_holm_is_as_in_the_textbook_example():
    # the example of R's p.adjust and of most introductions
    assert holm(np.array([0.01, 0.04, 0.03, 0.005])) == pytest.approx([0.03, 0.06, 0.06, 0.02])


@given(st.lists(st.floats(0, 1), min_size=1, max_size=12), st.randoms(use_true_random=False))
def test_holm_keeps_the_order_and_lies_between_none_and_bonferroni(p, random):
    values = np.array(p)
    corrected = holm(values)
    order = np.argsort(values, kind="stable")
    assert (np.diff(corrected[order]) >= 0).all()
    assert (corrected >= values).all()
    assert (corrected <= np.minimum(1, values * len(values)) + 1e-15).all()
    shuffled = random.sample(range(len(p)), len(p))
    assert holm(values[shuffled]) == pytest.approx(corrected[shuffled])


def test_coverages_have_a_unit_and_measurements_have_none():
    assert lattice(np.array([11, 31, 0]) / 72).tolist() == [11, 31, 0]
    assert lattice(np.array([0.5, 0.25])).tolist() == [2, 1]
    assert lattice(np.array([math.pi])) is None


@pytest.mark.parametrize("values", [[], [np.nan], [np.inf]])
def test_values_that_are_no_finite_numbers_are_refused(values):
    with pytest.raises(ValueError, match="finite"):
        sign_flip_p(np.array(values))
    with pytest.raises(ValueError, match="finite"):
        permutation_p(np.array(values), np.array([1.0]))
