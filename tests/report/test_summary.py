from __future__ import annotations

import polars as pl
import pytest

from realitygap.errors import RecordError
from realitygap.report import summarize
from realitygap.report._summary import SUMMARY_SCHEMA
from realitygap.stats import median_interval, quartiles
from tests.report.results import describe, random_runs, write_results


def test_summary_is_the_one_worked_by_hand(out):
    # bests of the runs: 0.3, 0.1, 0.4, 0.2
    runs = [
        [[0.1, 0.2], [0.3, 0.0]],
        [[0.1, 0.1], [0.1, 0.1]],
        [[0.4, 0.0], [0.2, 0.1]],
        [[0.0, 0.2], [0.1, 0.0]],
    ]
    write_results(out, [describe("coverage", published=[0.154, 0.2])], {"coverage": runs})
    row = summarize(out).row(0, named=True)
    assert row.pop("published") == [0.154, 0.2]
    assert row.pop("label") == "SIM"
    assert row.pop("condition") == "coverage"
    assert row == pytest.approx(
        {
            "n": 4,
            "line_median": 0.25,
            "line_q25": 0.175,
            "line_q75": 0.325,
            "line_low": None,
            "line_high": None,
            "ends_median": 0.125,
            "ends_q25": 0.0875,
            "ends_q75": 0.1625,
            "ends_low": None,
            "ends_high": None,
            "interval_coverage": None,
        }
    )


def test_interval_bounds_are_two_of_the_runs(out):
    runs = [[[k / 72, 0.0]] for k in (5, 3, 10, 1, 9, 2, 8, 4, 7, 6)]
    write_results(out, [describe("coverage")], {"coverage": runs})
    row = summarize(out).row(0, named=True)
    assert (row["line_low"], row["line_high"]) == (2 / 72, 9 / 72)
    assert row["interval_coverage"] == pytest.approx(1 - 22 / 1024)


@pytest.mark.parametrize("n", [1, 2, 5, 6, 7, 12, 41])
def test_summary_equals_quartiles_and_interval_of_all_runs(out, n):
    folder = write_results(out, [describe("coverage")], {"coverage": random_runs(n, seed=n)}, chunk=4)
    (row,) = summarize(folder).iter_rows(named=True)
    bests = folder.read().group_by("replicate").agg(pl.col("coverage_line", "coverage_ends").max())
    for measure in ("line", "ends"):
        values = bests[f"coverage_{measure}"].to_numpy()
        middle, interval = quartiles(values), median_interval(values)
        assert [row[f"{measure}_{name}"] for name in ("q25", "median", "q75")] == [
            middle.q25,
            middle.median,
            middle.q75,
        ]
        assert (row[f"{measure}_low"], row[f"{measure}_high"]) == (interval.low, interval.high)


def test_conditions_keep_their_order_also_without_runs(out):
    conditions = [describe("b"), describe("a"), describe("c")]
    folder = write_results(out, conditions, {"c": random_runs(2), "b": random_runs(1)})
    table = summarize(folder)
    assert table.schema == SUMMARY_SCHEMA
    assert table["condition"].to_list() == ["b", "a", "c"]
    assert table["n"].to_list() == [1, 0, 2]
    assert table["line_median"].is_null().to_list() == [False, True, False]


def test_chunks_do_not_matter(tmp_path):
    runs = random_runs(11)
    whole = write_results(tmp_path / "whole", [describe("coverage")], {"coverage": runs})
    parts = write_results(tmp_path / "parts", [describe("coverage")], {"coverage": runs}, chunk=3)
    assert summarize(whole).equals(summarize(parts))


def test_conditions_that_are_only_names_are_summarized(out):
    folder = write_results(out, ["coverage"], {"coverage": random_runs(2)})
    assert summarize(folder)["label"].to_list() == ["unlabeled"]


def test_no_rows_is_a_clear_error(out):
    write_results(out, [describe("coverage")], {})
    with pytest.raises(RecordError, match=r"holds no trials yet.*Run the study first"):
        summarize(out)


def test_no_folder_is_a_clear_error(tmp_path):
    with pytest.raises(RecordError, match="does not exist"):
        summarize(tmp_path / "nowhere")
