"""The best coverage of each run, condition by condition: the paper's Table 2 with more runs."""

from __future__ import annotations

from typing import Any

import numpy as np
import polars as pl

from realitygap._medians import interval_ranks, median_interval, quartiles
from realitygap.report._tally import Measure, Results, Tally, label_of, read_tally

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
    """One row per condition, on the best coverage of each run (the highest of all its individuals).

    Args:
        folder: the results of a study, or the path to them. They are read chunk by chunk.

    Returns:
        Columns `condition`; `label`, such as SIM; `n`, the number of runs; then for coverage along the line
        (`line_`) and at the ends of steps (`ends_`) [0..1] `median`, the quartiles `q25` and `q75`, and the
        bounds `low` and `high` of the median's 95 % interval; `interval_coverage`, what that interval covers
        in truth; `published`, what the paper reports, one value per run of its own. Null where there are no
        runs, no counted cells, too few for an interval (below 6), or nothing published.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
    """
    tally = read_tally(folder, with_uncounted=True)
    rows = []
    for condition in tally.conditions:
        name = condition["name"]
        n = len(tally.replicates(name))
        ranks = interval_ranks(n)
        row: dict[str, Any] = {
            "condition": name,
            "label": label_of(condition),
            "n": n,
            "interval_coverage": None if ranks is None else ranks.coverage,
            "published": condition.get("published"),
        }
        for measure in _MEASURES if n else ():
            row |= {f"{measure}_{key}": value for key, value in _describe(tally, name, measure).items()}
        rows.append(row)
    return pl.DataFrame(rows, schema=SUMMARY_SCHEMA)


def _describe(tally: Tally, condition: str, measure: Measure) -> dict[str, float | None]:
    values = tally.run_bests(condition, measure)
    if np.isnan(values).any():  # nobody counted a robot's cells, or saw where its steps end
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
