from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from realitygap._wording import p_in_words, signed
from realitygap.report import compare_conditions
from realitygap.report._comparisons import Samples
from realitygap.stats import holm, sign_flip_p
from tests.report.results import describe, random_runs, settings, write_results


def _runs(cells):
    """Runs of one generation of two, the better of which covers so many cells of 72."""
    return [[[k / 72, 0.0]] for k in cells]


def _paired(name, **changes):
    return describe(name, settings=settings(**changes) | {"pair": True, "seed": 1})


def test_pairs_are_those_that_differ_in_one_thing(out):
    conditions = [
        _paired("c1", noise=0.1),
        _paired("c5", noise=0.5),
        _paired("n1", selection="novelty", noise=0.1),
        _paired("n5", selection="novelty", noise=0.5),
        _paired("other", jyro={"steps": 70}) | {"baseline": "c1", "change": "70 steps"},
    ]
    folder = write_results(
        out, conditions, {each["name"]: random_runs(8, seed=k) for k, each in enumerate(conditions)}
    )
    found = {(each.one, each.other): each.reason for each in compare_conditions(folder)}
    assert found == {
        ("c5", "c1"): "noise",
        ("n5", "n1"): "noise",
        ("n1", "c1"): "selection",
        ("n5", "c5"): "selection",
        ("other", "c1"): "baseline",
    }


def test_paired_runs_are_compared_in_pairs_and_numbers_are_those_of_their_methods(out):
    rng = np.random.default_rng(3)
    low = rng.integers(10, 30, 12)
    high = low + rng.integers(0, 6, 12)
    folder = write_results(
        out, [_paired("a", noise=0.1), _paired("b", noise=0.5)], {"a": _runs(low), "b": _runs(high)}
    )
    (found,) = compare_conditions(folder)
    assert (found.one, found.other, found.n, found.n_other, found.paired) == ("b", "a", 12, 12, True)
    assert found.difference.value == pytest.approx((high - low).mean() / 72)
    assert found.p == pytest.approx(sign_flip_p((high - low) / 72))
    assert found.p_holm == found.p
    assert found.difference.low <= found.difference.value <= found.difference.high
    assert found.a12.method == "BCa"
    assert found.label == "SIM"
    assert found.is_shown
    assert found.verdict == "b above a"


def test_unpaired_runs_are_relabeled(out):
    conditions = [
        describe("a", settings=settings(noise=0.1) | {"pair": False}),
        describe("b", settings=settings(noise=0.5) | {"pair": False}),
    ]
    folder = write_results(out, conditions, {"a": _runs(range(10, 15)), "b": _runs(range(30, 36))})
    (found,) = compare_conditions(folder)
    assert not found.paired
    assert (found.n, found.n_other) == (6, 5)
    assert found.p == pytest.approx(2 / 462)
    assert found.a12.value == 1.0
    assert found.a12.method == "Newcombe"
    assert found.difference.ends is None


def test_only_runs_that_both_have_make_pairs(out):
    folder = write_results(
        out, [_paired("a", noise=0.1), _paired("b", noise=0.5)], {"a": random_runs(9), "b": random_runs(7)}
    )
    (found,) = compare_conditions(folder)
    assert (found.n, found.n_other) == (7, 7)


def test_three_runs_can_claim_nothing_however_far_apart(out):
    conditions = [_paired("a", noise=0.1), _paired("b", noise=0.5), _paired("c", noise=0.8)]
    folder = write_results(
        out, conditions, {"a": _runs([1, 2, 3]), "b": _runs([40, 50, 60]), "c": _runs([70, 71, 72])}
    )
    for each in compare_conditions(folder):
        assert each.p == 0.25
        assert not each.can_claim
        assert not each.is_shown
        assert each.a12.ends is None
        assert "no claim possible: with n = 3" in each.verdict
        assert each.runs_for_a_claim == 7
        assert each.verdict.endswith("7 runs at least")


def test_holm_is_over_all_comparisons(out):
    conditions = [_paired(f"c{k}", noise=k / 10) for k in range(4)]
    folder = write_results(out, conditions, {f"c{k}": random_runs(20, seed=k) for k in range(4)})
    found = compare_conditions(folder)
    assert len(found) == 6
    assert [each.p_holm for each in found] == pytest.approx(holm(np.array([each.p for each in found])))


def test_a_difference_that_is_not_shown_states_the_detectable_one(out):
    folder = write_results(
        out,
        [_paired("a", noise=0.1), _paired("b", noise=0.5)],
        {"a": random_runs(30, seed=1), "b": random_runs(30, seed=2)},
    )
    (found,) = compare_conditions(folder)
    assert not found.is_shown
    assert found.can_claim
    assert found.verdict.startswith(
        f"inconclusive: {found.n} runs detect {found.detectable:.3f} with 80 % power"
    )


def _pair_with_differences(out, differences):
    base = np.full(len(differences), 30)
    folder = write_results(
        out,
        [_paired("a", noise=0.1), _paired("b", noise=0.5)],
        {"a": _runs(base), "b": _runs(base + differences)},
    )
    (found,) = compare_conditions(folder)
    return found


def test_small_difference_is_equivalent_if_its_interval_lies_within_the_margin(out):
    differences = np.array([1, -1, 2, -2, 0] * 8)
    found = _pair_with_differences(out, differences)
    reach = stats.t.ppf(0.95, 39) * differences.std(ddof=1) / 40**0.5 / 72
    ends = found.equivalence_interval.low, found.equivalence_interval.high
    assert ends == pytest.approx((-reach, reach), rel=1e-3)  # on the scale of differences from -1 to 1
    assert found.is_equivalent
    assert found.verdict.endswith("equivalent within ±0.02 (90 % interval [−0.005, +0.005])")


def test_difference_that_is_not_shown_is_not_called_equivalent_if_its_interval_is_wide(out):
    found = _pair_with_differences(out, np.array([20, -20, 15, -15, 2] * 4))
    assert not found.is_shown
    assert found.is_equivalent is False
    assert "; not shown equivalent within ±0.02 (90 % interval " in found.verdict


def test_few_runs_give_no_verdict_on_equivalence(out):
    found = _pair_with_differences(out, np.array([1, -1, 0] * 3))
    assert found.is_equivalent is None
    assert "equivalent" not in found.verdict


def test_unpaired_equivalence_interval_is_that_of_welch():
    rng = np.random.default_rng(1)
    one, other = rng.normal(0.3, 0.02, 12), rng.normal(0.3, 0.05, 30)
    found = Samples(one, other, paired=False).equivalence_interval()
    expected = stats.ttest_ind(one, other, equal_var=False).confidence_interval(0.9)
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high), rel=1e-3)


def test_equal_runs_and_single_runs_are_no_accident(out):
    conditions = [_paired("a", noise=0.1), _paired("b", noise=0.5)]
    folder = write_results(out / "equal", conditions, {"a": _runs([20] * 12), "b": _runs([20] * 12)})
    (found,) = compare_conditions(folder)
    assert (found.p, found.a12.value, found.difference.value, found.detectable) == (1.0, 0.5, 0.0, None)
    assert found.difference.ends is None
    folder = write_results(out / "one", conditions, {"a": _runs([20]), "b": _runs([30])})
    (found,) = compare_conditions(folder)
    assert found.p == 1.0
    assert not found.can_claim


def test_a_study_with_nothing_to_compare_has_no_comparisons(out):
    assert compare_conditions(write_results(out / "a", [describe("a")], {"a": random_runs(5)})) == []
    assert (
        compare_conditions(write_results(out / "b", ["a", "b"], {"a": random_runs(5), "b": random_runs(5)}))
        == []
    )


def test_random_conditions_that_are_alike_are_rarely_told_apart(out):
    # 40 pairs of 20 runs of one distribution, each its own family: more than 8 claims at 5 % come out less
    # than once in 1,000 times; seeds fixed
    rng = np.random.default_rng(17)
    claims = sum(
        sign_flip_p((rng.integers(5, 40, 20) - rng.integers(5, 40, 20)) / 72) < 0.05 for _ in range(40)
    )
    assert claims <= 8


def test_p_values_and_differences_are_written_as_people_read_them():
    assert [p_in_words(p) for p in (1.0, 0.05, 0.001, 4.46e-5, 1e-12)] == [
        "1",
        "0.050",
        "0.001",
        "4·10⁻⁵",
        "< 10⁻⁹",
    ]
    assert [signed(value) for value in (0.0123, -0.5, 0.0, -0.0001)] == [
        "+0.012",
        "−0.500",
        "±0.000",
        "±0.000",
    ]
