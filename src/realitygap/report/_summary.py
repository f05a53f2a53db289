"""The best coverage of each run, condition by condition: the paper's Table 2 with more runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap._medians import interval_ranks, median_interval, quartiles
from realitygap.records import ResultsFolder
from realitygap.report._driven import read_driven
from realitygap.report._tally import (
    Measure,
    Results,
    Tally,
    label_of,
    labeled_conditions,
    no_trials,
    run_bests_of,
)

_STATISTICS = ("median", "q25", "q75", "low", "high")
_MEASURES: tuple[Measure, ...] = ("line", "ends")

SUMMARY_SCHEMA = pl.Schema(
    {
        "condition": pl.String(),
        "label": pl.String(),
        "n": pl.UInt32(),
        **{f"{measure}_{name}": pl.Float64() for measure in _MEASURES for name in _STATISTICS},
        "interval_coverage": pl.Float64(),
        "published": pl.List(pl.Float64()),
    }
)


def summarize(folder: Results) -> pl.DataFrame:
    """Return one row per condition, on the best coverage of each run (the highest of all its individuals).

    Args:
        folder: Results of a study, or the path to them. They are read chunk by chunk.

    Returns:
        Columns `condition`; `label`, such as SIM; `n`, the number of runs. Then for coverage along the line (`line_`)
        and at the ends of steps (`ends_`) [0..1]: `median`, the quartiles `q25` and `q75`, and the bounds `low` and
        `high` of the median's 95 % interval. `interval_coverage` is the true probability of that interval. `published`
        has the paper's values, one for each of its runs. Null if there are no runs, no counted cells, too few for an
        interval (below 6), or nothing published.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
    """
    rows = []
    for condition, runs in _runs_by_condition(folder):
        n = len(runs)
        ranks = interval_ranks(n)
        row: dict[str, Any] = {
            "condition": condition["name"],
            "label": label_of(condition),
            "n": n,
            "interval_coverage": None if ranks is None else ranks.coverage,
            "published": condition.get("published"),
        }
        for measure in _MEASURES if n else ():
            row |= {f"{measure}_{key}": value for key, value in _describe(runs[measure].to_numpy()).items()}
        rows.append(row)
    return pl.DataFrame(rows, schema=SUMMARY_SCHEMA)


def _runs_by_condition(folder: Results) -> Iterator[tuple[Mapping[str, Any], pl.DataFrame]]:
    """Yield each condition with the best coverage of its runs, of which only those of one are in memory."""
    if isinstance(folder, Tally):
        for condition in folder.conditions:
            yield condition, folder.runs.filter(pl.col("condition") == condition["name"])
        return
    folder = folder if isinstance(folder, ResultsFolder) else ResultsFolder.open(folder)
    is_empty = True
    for condition in labeled_conditions(folder):
        runs = run_bests_of(folder, condition["name"])
        is_empty &= runs.is_empty()
        yield condition, runs
    if is_empty:
        raise no_trials(folder, read_driven(folder))


def _describe(values: npt.NDArray[np.float64]) -> dict[str, float | None]:
    if np.isnan(values).any():  # a robot's cells were not counted, or the ends of its steps are unknown
        return dict.fromkeys(_STATISTICS)
    middle = quartiles(values)
    interval = median_interval(values)
    return {
        "median": middle.median,
        "q25": middle.q25,
        "q75": middle.q75,
        "low": None if interval is None else interval.low,
        "high": None if interval is None else interval.high,
    }
