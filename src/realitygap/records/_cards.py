"""Cards of results, ledgers, and trials, for notebooks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import polars as pl

from realitygap.drawing import Card, Spark, Table, card_of
from realitygap.errors import RealityGapError
from realitygap.records._chunk import read_rows
from realitygap.records._ledger_kinds import Trial
from realitygap.records._ledger_reader import LedgerReader
from realitygap.records._listing import LEDGER_NAME
from realitygap.records._published_results import PublishedResults
from realitygap.stats import median_interval

MOST_DIGESTED_BYTES = 1_500_000
MOST_READ_BYTES = 24_000_000
MOST_READ_FILES = 64
"""Size and number of the result files that a card reads: more take over half a second. The digest needs all rows."""

MOST_SPARK = 60
"""Points of a line of medians."""

_KEYS = ["replicate", "generation"]


@dataclass(frozen=True)
class _Read:
    """The content of a folder that its card needs.

    Attributes:
        identity: Size and time of each file that it was read from.
        bests: Best of each generation of each run by condition; None without scores.
        digest: Digest of the results; empty if they are too large.
    """

    identity: tuple[tuple[str, int, int], ...]
    bests: Mapping[str, pl.DataFrame | None]
    digest: str = ""


_read: WeakKeyDictionary[PublishedResults, _Read] = WeakKeyDictionary()


@card_of.register(PublishedResults)
def folder_card(folder: PublishedResults) -> Card:
    """Return the conditions of a study with the medians of their runs; it never raises."""
    try:
        return _folder_card(folder)
    except Exception as error:  # a notebook shows the object all the same
        return Card(repr(folder), warning=f"These results cannot be read. {_message(error)}")


def _folder_card(folder: PublishedResults) -> Card:
    description = folder.description
    n_there, n_runs = folder.count_runs()
    name = str(description.get("title") or description.get("name") or folder.path)
    if n_runs is None:
        state = f"{n_there:,} runs"
    else:
        state = f"{'Complete' if n_there >= n_runs else 'Not complete'}: {n_there:,} of {n_runs:,} runs"
    path = str(folder.path)
    code = [
        f"folder = realitygap.ResultsFolder.open({path!r})",
        "realitygap.summarize(folder)",
        "folder.scan()",
    ]
    read = _read_again(folder, description)
    parts: list[Table | str] = [_conditions_table(folder, read)]
    if read is not None and read.digest:
        parts.append(f"Digest: {read.digest}")
    else:
        code.append("folder.digest()")
    if folder.version_note:
        parts.append(folder.version_note)
    return Card(
        name,
        folder.labels,
        f"{state} in {path}",
        parts=parts,
        code=[*code, f"realitygap.write_report({path!r})"],
    )


def _conditions_table(folder: PublishedResults, read: _Read | None) -> Table:
    if read is None:
        rows = [[name, f"{folder.count_of(name):,}"] for name in folder.conditions]
        return Table(["condition", "runs"], rows, "Medians of these runs: realitygap.summarize(folder).")
    lines = {name: _line(read.bests[name]) for name in folder.conditions}
    ends = [value for line in lines.values() for value in line]
    table = [
        [
            name,
            f"{folder.count_of(name):,}",
            _median(read.bests[name]),
            Spark(lines[name], min(ends), max(ends)) if lines[name] else "",
        ]
        for name in folder.conditions
    ]
    return Table(["condition", "runs", "median best of a run [95 % interval]", "best by generation"], table)


def _read_again(folder: PublishedResults, description: Mapping[str, Any]) -> _Read | None:
    """Return the bests of a folder, read again if a file has changed; None if they are too many."""
    files = folder.files()
    paths = [path for _, path in files]
    # While a robot is driven, SQLite writes into a file beside the ledger, which itself stays as it is.
    ledger = [folder.path / (LEDGER_NAME + ending) for ending in ("", "-wal")]
    stats = [(path.name, path.stat()) for path in (*paths, *(path for path in ledger if path.exists()))]
    identity = tuple((name, status.st_size, status.st_mtime_ns) for name, status in stats)
    known = _read.get(folder)
    if known is not None and known.identity == identity:
        return known
    n_bytes = sum(status.st_size for _, status in stats)
    if n_bytes > MOST_READ_BYTES or len(files) > MOST_READ_FILES:
        return None
    columns = {name: _score_column(name, description) for name in folder.conditions}
    frames: dict[str, list[pl.DataFrame]] = {name: [] for name in folder.conditions}

    def look(condition: str, frame: pl.DataFrame) -> None:
        frames[condition].append(_best_of(frame, columns[condition]))

    digest = ""
    if n_bytes <= MOST_DIGESTED_BYTES:
        digest = folder.digest_with(look)
    else:
        for name, path in files:
            look(name.condition, read_rows(path, [*_KEYS, columns[name.condition]])[1])
    for condition in frames:
        for frame in folder.driven_frames(condition):
            look(condition, frame)
    joined = {condition: pl.concat(parts) if parts else None for condition, parts in frames.items()}
    bests = {
        condition: None if best is None or best["best"].null_count() else best
        for condition, best in joined.items()
    }
    _read[folder] = _Read(identity, bests, digest)
    return _read[folder]


def _best_of(frame: pl.DataFrame, column: str) -> pl.DataFrame:
    if column not in frame.columns:
        frame = frame.with_columns(pl.lit(None, pl.Float64).alias(column))
    return frame.group_by(_KEYS, maintain_order=True).agg(pl.col(column).cast(pl.Float64).max().alias("best"))


def _score_column(condition: str, description: Mapping[str, Any]) -> str:
    """Return the column that selection is by: the score of another task, or the coverage that is counted."""
    kinds, cells = {}, set()
    for each in description["conditions"]:
        settings = each.get("settings") if isinstance(each, dict) else None
        task = (settings or {}).get("task", {})
        if isinstance(each, dict):
            kinds[each["name"]] = task.get("kind", "coverage")
        cells.add(task.get("cells"))
    if kinds.get(condition, "coverage") != "coverage":
        return "task_fitness"
    return "coverage_ends" if cells == {"ends"} else "coverage_line"


def _median(best: pl.DataFrame | None) -> str:
    if best is None:
        return "–"
    of_runs = best.group_by("replicate").agg(pl.col("best").max())["best"].to_numpy()
    if not np.isfinite(of_runs).all():
        return "–"
    return str(median_interval(of_runs))


def _line(best: pl.DataFrame | None) -> tuple[float, ...]:
    """Return the median over runs of the best of each generation."""
    if best is None:
        return ()
    medians = best.group_by("generation").agg(pl.col("best").median()).sort("generation")["best"].to_numpy()
    if not np.isfinite(medians).all():
        return ()
    chosen = np.unique(np.linspace(0, len(medians) - 1, min(len(medians), MOST_SPARK)).round().astype(int))
    return tuple(float(value) for value in medians[chosen])


@card_of.register(LedgerReader)
def ledger_card(ledger: LedgerReader) -> Card:
    """Return the conditions of a ledger and how far their trials are; it never raises."""
    try:
        conditions, trials = ledger.conditions(), ledger.trials()
    except Exception as error:
        return Card(repr(ledger), warning=f"This ledger cannot be read. {_message(error)}")
    rows = []
    for name, about in conditions.items():
        own = [trial for trial in trials if trial.condition == name]
        states = [
            sum(trial.state == state for trial in own) for state in ("planned", "driven", "scored", "void")
        ]
        rows.append([name, about["label"] or "–", *(f"{n:,}" for n in states)])
    labels = dict.fromkeys(str(about["label"]) for about in conditions.values() if about["label"])
    heads = ["condition", "label", "planned", "driven", "scored", "void"]
    lead = "No trials yet." if not trials else f"{len(trials):,} trials in {ledger.path}"
    return Card("Ledger of physical trials", tuple(labels), lead, parts=[Table(heads, rows)])


@card_of.register(Trial)
def trial_card(trial: Trial) -> Card:
    """Return what a ledger has of a trial."""
    facts = {
        "state": trial.state,
        "code": trial.code,
        "sheet, pen": f"{trial.sheet}, {trial.pen}",
        "steps": "–" if trial.n_steps is None else f"{trial.n_steps:,}",
        "blocked steps": "–" if trial.stalls is None else f"{trial.stalls:,}",
        "crossed cells": "–" if trial.cells is None else f"{len(trial.cells):,}",
        "end": trial.end or "–",
    }
    problem = trial.problem or trial.reason or ""
    return Card(
        f"Trial {trial.trial}: {trial.name}",
        warning=problem,
        parts=[Table(["", ""], [[key, value] for key, value in facts.items()])],
    )


def _message(error: Exception) -> str:
    return str(error) if isinstance(error, RealityGapError) else f"{type(error).__name__}: {error}"
