"""The findings of the first screen, on coverages that are given."""

from __future__ import annotations

import csv
import html
import re

import numpy as np
import pytest

from realitygap._wording import Basis
from realitygap.report import (
    compare_conditions,
    summarize_tasks,
    write_report,
)
from realitygap.report._champions import Champions, retry_champions
from realitygap.report._comparisons import compare_champions
from realitygap.report._findings import find, leading_conditions
from realitygap.report._tally import read_tally
from realitygap.study import load_study, run_study
from tests.report.results import describe, settings, write_results


def findings_of(out, coverages, conditions=None, fresh=None):
    """The findings of runs of these cells of 72, and of `fresh` cells in later trials; named SEARCH-NOISE."""
    runs = {name: [[[k / 72, 0.0]] * 2 for k in cells] for name, cells in coverages.items()}
    described = conditions or [_describe(name) for name in runs]
    tally = read_tally(write_results(out, described, runs))
    tasks = summarize_tasks(tally.folder).to_dicts()
    champions = retry_champions(tally) if fresh is None else [tried(tally, *each) for each in fresh.items()]
    compared = compare_conditions(tally), compare_champions(tally, champions)
    return find(tally, compared[0], champions, compared[1], tasks)


def tried(tally, name, cells):
    """The best networks of a condition, of which each trial after the selection crosses so many cells of 72."""
    fresh = np.repeat(np.array(cells)[:, None] / 72, 20, axis=1)
    return Champions(name, "SIM", tally.run_bests(name, "line"), fresh, tally.replicates(name))


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
    assert best.claim.startswith(
        "As recorded, novelty-10 and novelty-80 have the highest median best coverage: 0.5"
    )
    assert "covers more than 2 of the 3 conditions compared with it" in best.evidence
    assert (
        search.claim == "As recorded, novelty search covers more than objective search at all 2 noise levels."
    )
    assert "Objective and novelty search cover more than random networks at all 2" in search.evidence
    assert noise.claim == (
        "As recorded, no effect of noise from 10 % to 80 % on the best coverage of objective search and novelty search "
        "is supported."
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
    assert (
        claims[2] == "As recorded, more noise from 10 % to 80 % raises the best coverage of novelty search."
    )


def test_nothing_supported_is_stated_first_with_the_runs_that_a_claim_needs(out):
    found = findings_of(out, {name: cells[:5] for name, cells in SEARCHES.items()})
    first, second = found.findings
    assert (
        first.claim
        == "As recorded, no difference in coverage between conditions is supported by 5 runs each."
    )
    assert re.fullmatch(r"A claim needs at least \d+ runs of each condition\.", first.evidence)
    assert "has the highest" not in second.claim
    assert "0.222 to 0.583" in second.claim
    assert found.limits.startswith("simulated; 5 runs per condition; 9 of 9 comparisons inconclusive;")


def test_largest_difference_is_quoted_if_runs_could_show_one(out):
    same = dict.fromkeys(("coverage-10", "novelty-10"), spread(30))
    first, second = findings_of(out, same).findings
    assert first.evidence.startswith("The largest is between novelty-10 and coverage-10: ±0.000")
    assert re.match(
        "As recorded, (novelty-10 and coverage-10|coverage-10 and novelty-10) have the highest", second.claim
    )


def test_changes_against_a_baseline_are_counted(out):
    changed = settings(jyro={"turn_per_step": 0.9})
    conditions = [describe("base"), describe("turned", baseline="base", settings=changed)]
    claims = [
        each.claim
        for each in findings_of(out, {"base": spread(20), "turned": spread(40)}, conditions).findings
    ]
    assert "As recorded, 1 of 1 change against a baseline is supported." in claims


@pytest.mark.parametrize("n", [1, 7])
def test_one_condition_has_its_median_and_nothing_to_compare(out, n):
    found = findings_of(out, {"coverage-10": spread(30, n)})
    (finding,) = found.findings
    assert finding.claim.startswith("As recorded, the median best coverage of coverage-10 is 0.")
    assert ("[" in finding.claim) == (n == 7)
    assert finding.tables == ("results",)


def test_leading_condition_is_the_one_with_the_higher_mean_of_equal_medians(out):
    cells = {"coverage-10": [10, 20, 30], "novelty-10": [10, 20, 60]}
    runs = {name: [[[k / 72, 0.0]] * 2 for k in values] for name, values in cells.items()}
    tally = read_tally(write_results(out, [_describe(name) for name in runs], runs))
    assert leading_conditions(tally) == ["novelty-10", "coverage-10"]


def test_findings_rest_on_fresh_trials_and_name_an_effect_of_recorded_scores_as_luck(out):
    """Recorded scores rise with noise, and fresh ones do not: the headline is about the fresh ones."""
    lucky = SEARCHES | {"novelty-80": spread(48), "coverage-80": spread(36)}
    found = findings_of(out, lucky, fresh=SEARCHES)
    best, search, noise = found.findings
    assert re.match(r"In fresh trials, the best networks of novelty-\d0 and novelty-\d0 have", best.claim)
    assert "As recorded, novelty-80 has the highest median best coverage: 0.6" in best.evidence
    assert search.claim.startswith("In fresh trials, novelty search covers more than objective search")
    assert noise.claim == (
        "In fresh trials, no effect of noise from 10 % to 80 % on the coverage of objective search and novelty search "
        "is supported."
    )
    assert re.search(r"As recorded, luck included: \+0\.0\d\d \[\+0", noise.evidence)
    assert {each.tables[0] for each in found.findings} == {"fresh"}
    assert "luck" not in found.limits


def test_each_finding_says_what_it_rests_on_and_recorded_scores_contain_luck(out):
    for number, fresh in enumerate((None, SEARCHES)):
        found = findings_of(out / str(number), SEARCHES, fresh=fresh)
        start = "As recorded, " if fresh is None else "In fresh trials, "
        assert all(each.claim.startswith(start) for each in found.findings)
        assert ("luck is part of them (its rows were not drawn" in found.limits) == (fresh is None)
    assert Basis("a robot drove it").claim("c has more") == "As recorded, c has more."


TRIPLE = re.compile(r"([+±−]?\d\.\d{3}) (?:\[|\()([+±−]?\d\.\d{3})(?:, | to )([+±−]?\d\.\d{3})[\])]")


def numbers(triple):
    return tuple(float(each.replace("−", "-").replace("±", "")) for each in triple)


@pytest.mark.slow
def test_each_difference_has_one_interval_on_the_whole_page(tmp_path):
    """An estimate with an interval in a sentence is a row of a table; the two estimands of a pair have two names."""
    study = run_study(load_study("paper", replicates=12), tmp_path / "paper").folder
    page = write_report(study, figures=tmp_path / "figures").read_text("utf-8")
    rows = set()
    for name in ("table-fresh", "table-comparisons"):
        for row in csv.reader((tmp_path / "figures" / f"{name}.csv").open(encoding="utf-8")):
            if match := re.fullmatch(r"\[(\S+), (\S+)\]", row[3]):
                value = numbers((row[2], *match.groups()))
                rows |= {value, (-value[0], -value[2], -value[1]), (abs(value[0]), *value[1:])}
    page = re.sub(r'id="caption-variety">.*?</table>', "", page, flags=re.S)  # distances of behaviors
    words = html.unescape(
        re.sub(r"<script.*?</script>|<style.*?</style>|<svg.*?</svg>|<[^>]+>", " ", page, flags=re.S)
    )
    found = [numbers(each) for each in TRIPLE.findall(words) if each[1][0] in "+±−"]
    assert len(found) > 3
    assert [each for each in found if each not in rows] == []
