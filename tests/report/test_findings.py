"""The findings of the first screen, on coverages that are given."""

from __future__ import annotations

import re

import numpy as np
import pytest

from realitygap.report import compare_conditions, retry_champions, summarize_tasks
from realitygap.report._findings import find, leading_conditions
from realitygap.report._tally import read_tally
from tests.report.results import describe, settings, write_results


def findings_of(out, coverages, conditions=None):
    """The findings of runs of these cells of 72; conditions are named SEARCH-NOISE."""
    runs = {name: [[[k / 72, 0.0]] * 2 for k in cells] for name, cells in coverages.items()}
    described = conditions or [_describe(name) for name in runs]
    tally = read_tally(write_results(out, described, runs))
    tasks = summarize_tasks(tally.folder).to_dicts()
    return find(tally, compare_conditions(tally), retry_champions(tally), tasks)


def _describe(name):
    search, noise = name.split("-")
    paired = {"pair": True, "seed": 1}
    return describe(name, settings=settings(selection=search, noise=int(noise) / 100) | paired)


def spread(center, n=20):
    return (center + np.random.default_rng(center).integers(-2, 3, n)).tolist()


SEARCHES = {
    "coverage-10": spread(30), "coverage-80": spread(30)[::-1],
    "novelty-10": spread(41), "novelty-80": spread(41)[::-1],
    "random-10": spread(15), "random-80": spread(20),
}  # fmt: skip


def test_best_search_and_noise_are_named_with_intervals_and_corrected_p(out):
    best, search, noise = findings_of(out, SEARCHES).findings
    assert best.claim.startswith("novelty-10 and novelty-80 have the highest median coverage: 0.5")
    assert "covers more than 2 of the 3 conditions compared with it" in best.evidence
    assert search.claim == "Novelty search covers more than objective search at all 2 noise levels."
    assert "Objective and novelty search cover more than random networks at all 2" in search.evidence
    assert noise.claim == (
        "No effect of noise from 10 % to 80 % on the best coverage of objective search and novelty search is supported."
    )
    for finding in (best, search, noise):
        assert re.search(r"[+±−]0\.\d{3} \[[+±−]0\.\d{3}, [+±−]0\.\d{3}\], p\s[=<≤]\s\S", finding.evidence)
        assert "comparisons" in finding.tables


def test_effect_of_noise_names_its_direction_and_the_searches(out):
    cells = SEARCHES | {"novelty-80": spread(50), "coverage-80": spread(20)}
    claims = [each.claim for each in findings_of(out, cells).findings]
    assert claims[2].endswith("raises the best coverage in some conditions and lowers it in others.")
    cells = SEARCHES | {"novelty-80": spread(50)}
    claims = [each.claim for each in findings_of(out.parent / "b", cells).findings]
    assert claims[2] == "More noise from 10 % to 80 % raises the best coverage of novelty search."


def test_nothing_supported_is_stated_first_with_the_runs_that_a_claim_needs(out):
    found = findings_of(out, {name: cells[:5] for name, cells in SEARCHES.items()})
    first, second = found.findings
    assert first.claim == "No difference in coverage between conditions is supported by 5 runs each."
    assert re.fullmatch(r"A claim needs at least \d+ runs of each condition\.", first.evidence)
    assert second.claim.startswith("novelty-10 has the highest median coverage")
    assert found.limits.startswith("simulated; 5 runs per condition; 9 of 9 comparisons inconclusive;")


def test_largest_difference_is_quoted_if_runs_could_show_one(out):
    same = dict.fromkeys(("coverage-10", "novelty-10"), spread(30))
    first, second = findings_of(out, same).findings
    assert first.evidence.startswith("The largest is between novelty-10 and coverage-10: ±0.000")
    assert second.claim.startswith("novelty-10 and coverage-10 have the highest") or second.claim.startswith(
        "coverage-10 and novelty-10 have the highest"
    )


def test_changes_against_a_baseline_are_counted(out):
    changed = settings(jyro={"turn_per_step": 0.9})
    conditions = [describe("base"), describe("turned", baseline="base", settings=changed)]
    claims = [
        each.claim
        for each in findings_of(out, {"base": spread(20), "turned": spread(40)}, conditions).findings
    ]
    assert "1 of 1 change against a baseline is supported." in claims


@pytest.mark.parametrize("n", [1, 7])
def test_one_condition_has_its_median_and_nothing_to_compare(out, n):
    found = findings_of(out, {"coverage-10": spread(30, n)})
    (finding,) = found.findings
    assert finding.claim.startswith("coverage-10 has the highest median coverage: 0.")
    assert ("[" in finding.claim) == (n == 7)
    assert finding.tables == ("results",)


def test_leading_condition_is_the_one_with_the_higher_mean_of_equal_medians(out):
    cells = {"coverage-10": [10, 20, 30], "novelty-10": [10, 20, 60]}
    runs = {name: [[[k / 72, 0.0]] * 2 for k in values] for name, values in cells.items()}
    tally = read_tally(write_results(out, [_describe(name) for name in runs], runs))
    assert leading_conditions(tally) == ["novelty-10", "coverage-10"]
