"""The best of each run, condition by condition: coverage, as the paper's Table 2, and scores of other tasks."""

from __future__ import annotations

import bisect
from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap.records import ResultsFolder
from realitygap.report._driven import read_driven
from realitygap.report._tally import (
    DescribedCondition,
    Measure,
    Results,
    Tally,
    bests_of,
    label_of,
    labeled_conditions,
    no_trials,
    task_of,
)
from realitygap.stats import IntervalRanks, interval_ranks, median_interval, quartiles

_STATISTICS = ("median", "q25", "q75", "low", "high")
_MEASURES: tuple[Measure, ...] = ("line", "ends")
_Bests = dict[Measure, Counter[float | None]]
"""How often each best coverage of a run occurs; None if it is unknown. Memory does not grow with the runs."""

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
    for condition, bests in _bests_by_condition(folder):
        n = bests["line"].total()
        ranks = interval_ranks(n)
        row: dict[str, Any] = {
            "condition": condition["name"],
            "label": label_of(condition),
            "n": n,
            "interval_coverage": None if ranks is None else ranks.coverage,
            "published": condition.get("published"),
        }
        for measure in _MEASURES if n else ():
            row |= {f"{measure}_{key}": value for key, value in _describe(bests[measure], ranks).items()}
        rows.append(row)
    return pl.DataFrame(rows, schema=SUMMARY_SCHEMA)


def _bests_by_condition(folder: Results) -> Iterator[tuple[DescribedCondition, _Bests]]:
    """Yield each condition with the best coverage of its runs."""
    if isinstance(folder, Tally):
        for condition in folder.conditions:
            yield condition, _counted([folder.runs.filter(pl.col("condition") == condition["name"])])
        return
    folder = folder if isinstance(folder, ResultsFolder) else ResultsFolder.open(folder)
    is_empty = True
    for condition in labeled_conditions(folder):
        frames = folder.frames(condition["name"], ["replicate", "coverage_line", "coverage_ends"])
        bests = _counted(
            frame.group_by("replicate").agg(
                pl.col("coverage_line").max().alias("line"), pl.col("coverage_ends").max().alias("ends")
            )
            for frame in frames
        )
        is_empty &= not bests["line"]
        yield condition, bests
    if is_empty:
        raise no_trials(folder, read_driven(folder))


def _counted(parts: Iterable[pl.DataFrame]) -> _Bests:
    """Count the values of the runs in frames. There are few values, as each is a number of cells."""
    counts: _Bests = {measure: Counter() for measure in _MEASURES}
    for part in parts:
        for measure in _MEASURES:
            counts[measure].update(part[measure].to_list())
    return counts


def _describe(counts: Counter[float | None], ranks: IntervalRanks | None) -> dict[str, float | None]:
    """Return the quartiles, and the values at the ranks of the interval."""
    if None in counts:  # a robot's cells were not counted, or the ends of its steps are unknown
        return dict.fromkeys(_STATISTICS)
    values = sorted(value for value in counts if value is not None)
    up_to = list(accumulate(counts[value] for value in values))
    n = up_to[-1]

    def at(rank: int) -> float:
        return values[bisect.bisect_left(up_to, rank)]

    def quantile(share: float) -> float:  # as `quartiles` of all values
        below = int((n - 1) * share)
        ends = [at(below + 1), at(min(below + 2, n))]
        return float(np.quantile(ends, (n - 1) * share - below))

    return {
        "median": quantile(0.5),
        "q25": quantile(0.25),
        "q75": quantile(0.75),
        "low": None if ranks is None else at(ranks.lower),
        "high": None if ranks is None else at(ranks.upper),
    }


TASK_SCHEMA = pl.Schema(
    {
        "condition": pl.String(),
        "label": pl.String(),
        "task": pl.String(),
        "n": pl.UInt32(),
        **{name: pl.Float64() for name in ("first", "last", "median", "q25", "q75", "low", "high")},
    }
)


def summarize_tasks(folder: ResultsFolder | str | Path) -> pl.DataFrame:
    """Return one row per condition of another task than coverage, on the best fitness of each run.

    Args:
        folder: Results of a study, or the path to them. They are read chunk by chunk.

    Returns:
        Columns `condition`; `label`, such as SIM; `task`, its kind; `n`, the number of runs; `first` and `last`, the
        median of the best in the first and in the last generation. Then for the best of the whole run: `median`, the
        quartiles `q25` and `q75`, and the bounds `low` and `high` of the median's 95 % interval. Null if there are no
        runs, or too few for an interval (below 6). No rows if all conditions are of coverage.

    Raises:
        RecordError: there is no such folder, or a file in it is damaged.
    """
    folder = folder if isinstance(folder, ResultsFolder) else ResultsFolder.open(folder)
    rows: list[dict[str, Any]] = []
    for condition in labeled_conditions(folder):
        task = task_of(condition)
        if task == "coverage":
            continue
        best = bests_of(folder, condition["name"])
        row = {"condition": condition["name"], "label": label_of(condition), "task": task, "n": len(best)}
        rows.append(row | _described(best) if len(best) else row)
    return pl.DataFrame(rows, schema=TASK_SCHEMA)


def _described(best: npt.NDArray[np.float64]) -> dict[str, float | None]:
    of_runs = best.max(axis=1)
    middle, median = quartiles(of_runs), median_interval(of_runs)
    return {
        "first": float(np.median(best[:, 0])),
        "last": float(np.median(best[:, -1])),
        "median": middle.median,
        "q25": middle.q25,
        "q75": middle.q75,
        "low": median.low,
        "high": median.high,
    }
