"""The best fitness of each run by another task than coverage, and how far evolution brought it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap.records import ResultsFolder
from realitygap.report._tally import bests_of, label_of, labeled_conditions, task_of
from realitygap.stats import median_interval, quartiles

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
