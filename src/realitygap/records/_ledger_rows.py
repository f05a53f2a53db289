"""The rows of physical trials, with the columns of the records."""

from __future__ import annotations

from typing import Any

import polars as pl

from realitygap._limits import parse_json
from realitygap.errors import LedgerError
from realitygap.records._columns import schema_with
from realitygap.records._ledger import Ledger

_ROWS = """
SELECT individuals.*, trials.stalls, n_cells, scores.n_ends, coalesce((
    SELECT cells FROM scores WHERE trial = individuals.trial AND role = 'correction' AND undone IS NULL
    ORDER BY id DESC LIMIT 1
), scores.cells) AS cells
FROM individuals
    JOIN conditions ON conditions.name = individuals.condition
    JOIN trials ON trials.id = individuals.trial
    JOIN scores ON scores.id = individuals.score
WHERE individuals.condition = ? AND individuals.replicate IN ({runs})
ORDER BY individuals.replicate, individuals.generation, individuals.individual
"""

_COMPLETE = """
SELECT replicate FROM generations JOIN conditions ON conditions.name = generations.condition
WHERE condition = ? AND closed IS NOT NULL GROUP BY replicate HAVING count(*) = n_generations ORDER BY replicate
"""


def complete_runs(ledger: Ledger, condition: str) -> list[int]:
    """Return replicates all of whose generations are closed, in order."""
    return [row["replicate"] for row in ledger._all(_COMPLETE, condition)]


def ledger_frame(ledger: Ledger, condition: str) -> pl.DataFrame:
    """Return a row for each individual of a condition's complete runs, with the columns of records, in key order.

    Cells and coverage are those of the last correction, if there is one. `fitness` and `novelty` are the values that
    selection used. `coverage_ends` is null if the cells in which steps end are unknown, and `coverage_line` if cells
    were not counted. For another task than coverage, `task_fitness` is the score of the trial.
    """
    runs = complete_runs(ledger, condition)
    settings = ledger._one("SELECT settings FROM conditions WHERE name = ?", condition)
    task = {} if settings is None else parse_json(settings["settings"]).get("task", {})
    schema = schema_with(["task_fitness"] if "kind" in task else [])
    query = _ROWS.format(runs=", ".join(map(str, runs)))
    rows = ledger._all(query, condition)
    try:
        return pl.DataFrame([_row(dict(row)) for row in rows], schema=schema)
    except (
        ArithmeticError,
        AttributeError,
        LookupError,
        TypeError,
        ValueError,
        pl.exceptions.PolarsError,
    ) as error:
        raise LedgerError(
            f"{ledger.path} is damaged: an individual of condition {condition!r} is not as it was written ({error}). "
            "Restore it from a copy."
        ) from error


def _row(row: dict[str, Any]) -> dict[str, Any]:
    genome = parse_json(row["genome"])
    cells = parse_json(row["cells"])
    n_ends = row["n_ends"]
    return {
        **{name: row[name] for name in ("condition", "replicate", "generation", "individual", "species")},
        "parents": parse_json(row["parents"]),
        "fitness": row["fitness"],
        "novelty": row["novelty"],
        "task_fitness": row["fitness"],
        "coverage_line": len(cells) / row["n_cells"] if cells else None,
        "coverage_ends": None if n_ends is None else n_ends / row["n_cells"],
        "cells": cells,
        "stalls": row["stalls"],
        "nodes": row["nodes"],
        "connections": sum(genome["enabled"]),
        "genome": genome,
        "key": int(row["key"]),
    }
