from __future__ import annotations

import re

import pytest

from realitygap.report import (
    compare_conditions,
    write_report,
)
from realitygap.report._champions import retry_champions
from realitygap.report._comparisons import compare_champions
from realitygap.report._statistics_section import statistics_content
from realitygap.report._tally import read_tally
from realitygap.study import load_study, run_study
from tests.report.results import describe, random_runs, settings, write_results
from tests.report.test_page import Page

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def paper(tmp_path_factory):
    """The paper's study with its own number of runs."""
    return run_study(load_study("paper", replicates=3), tmp_path_factory.mktemp("paper")).folder


def content_of(folder):
    tally = read_tally(folder)
    champions = retry_champions(tally)
    return statistics_content(
        tally, compare_conditions(tally), champions, compare_champions(tally, champions)
    )


@pytest.fixture(scope="module")
def words(paper):
    return Page(write_report(paper).read_text("utf-8")).words


def test_three_runs_are_refused_and_what_would_do_is_named(words):
    assert "0 of 18 comparisons support a difference; 18 have too few runs for that" in words
    assert words.count("too few runs") >= 18
    assert "first higher" not in words
    assert "The smallest p that 3 pairs can give is 0.250" in words


def test_every_table_says_sim_and_n(words, paper):
    for number in range(2, 8):
        caption = re.search(rf"Table {number} *\. .{{0,400}}", words)[0]
        assert "SIM" in caption, caption
    content = content_of(paper)
    assert [table.name for table in content.answers] == [
        "plateaus",
        "chance",
        "champions",
        "spread",
        "variety",
    ]
    for table in content.answers:
        assert [row[1] for row in table.rows] == ["3"] * 9, table.name


def test_chance_and_the_fourth_input_are_told(words):
    assert "With three runs per level, 50 % noise is the best in" in words
    assert "With novelty, networks have a fourth, constant input" in words
    assert "33 % each" in words


def test_plateaus_are_defined(words):
    assert "does not rise in the last 2 of 5 generations" in words
    assert "in 60 % of runs" in words


def test_intervals_come_with_enough_runs(out):
    conditions = [
        describe("a", settings=settings(noise=0.1) | {"pair": True, "seed": 1}),
        describe("b", settings=settings(noise=0.5) | {"pair": True, "seed": 1}),
    ]
    folder = write_results(out, conditions, {"a": random_runs(12, seed=1), "b": random_runs(12, seed=2)})
    content = content_of(folder)
    table = content.comparisons.table
    assert "BCa" in table.caption
    row = dict(zip(table.heads, table.rows[0], strict=True))
    assert row["difference: interval"].startswith("[")
    assert row["A12: interval"].startswith("[")
    assert "*" not in row["A12: interval"]
    assert content.champions.problem == "its rows were not drawn with the key of its settings"


def test_studies_of_every_shape_have_the_section(out):
    for name, conditions, runs in (
        ("one", [describe("c")], {"c": random_runs(1, 1, 1)}),
        ("plain", ["c", "d"], {"c": random_runs(2), "d": random_runs(1)}),
        ("partly", [describe("c"), describe("d", settings=settings(noise=0.5))], {"c": random_runs(2)}),
    ):
        content = content_of(write_results(out / name, conditions, runs))
        assert content.comparisons is None
        assert content.spread.rows


def test_the_same_results_give_the_same_numbers(paper):
    assert content_of(paper) == content_of(paper)
