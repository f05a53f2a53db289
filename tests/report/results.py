"""Small folders of results whose coverages are given; genomes and keys in them mean nothing."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from realitygap.records import ResultsFolder
from realitygap.runs import Condition
from tests.records.rows import HASH, make_rows

Runs = Sequence[Sequence[Sequence[float]]]
"""(runs, generations, individuals) coverage along the line."""


def settings(selection: str = "coverage", noise: float = 0.1, **changes: Any) -> dict[str, Any]:
    """Settings as a study has them; a table in `changes` changes some of its values."""
    neat = {"population": 2, "generations": 2, "add_link": 0.1, "add_node": 0.05}
    given = Condition(name="any", neat=neat).settings() | {"selection": selection, "noise": noise}
    for key, value in changes.items():
        given[key] = {**given.get(key, {}), **value} if isinstance(value, dict) else value
    return given


def describe(name: str, **fields: Any) -> dict[str, Any]:
    """A condition as `study.json` has it."""
    return {"name": name, "label": "SIM", "hash": HASH, "settings": settings()} | fields


def write_results(
    path: Path,
    conditions: list[dict[str, Any]],
    coverages: dict[str, Runs],
    *,
    chunk: int = 1000,
    **description: Any,
) -> ResultsFolder:
    """A folder with the coverages given; `coverage_ends` is half of `coverage_line`."""
    most = max((len(runs) for runs in coverages.values()), default=1)
    study = {
        "name": "example",
        "title": "An example",
        "software": "0.1.0",
        "seed": 1,
        "pair": True,
        "replicates": most,
        "report": {"points": "best-of-generation"},
        "conditions": conditions,
    }
    folder = ResultsFolder.create(path, study | description)
    for condition, runs in coverages.items():
        for first in range(0, len(runs), chunk):
            folder.publish(condition, first, _rows(condition, first, runs[first : first + chunk]), HASH)
    return folder


def _rows(condition: str, first: int, runs: Runs) -> pl.DataFrame:
    line = np.array(runs, dtype=np.float64)
    n, generations, individuals = line.shape
    rows = make_rows(condition, first, n, generations, individuals)
    return rows.with_columns(
        pl.Series("coverage_line", line.ravel()), pl.Series("coverage_ends", line.ravel() / 2)
    )


def random_runs(n: int, generations: int = 3, individuals: int = 2, seed: int = 0) -> Runs:
    """Coverages of k/72 that mean nothing."""
    rng = np.random.default_rng(seed)
    return (rng.integers(5, 40, (n, generations, individuals)) / 72).tolist()
