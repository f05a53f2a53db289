"""Conditions that a robot drove, in the words of a report: their label, void trials, and unfinished runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from realitygap.errors import RecordError
from realitygap.records import LEDGER_NAME, Ledger, ResultsFolder, complete_runs

Paths = dict[tuple[int, int], npt.NDArray[np.float64]]
"""Poses of the driven line, (4 t + 1, 3), by generation and individual."""


@dataclass(frozen=True)
class DrivenCondition:
    """The state of one condition, as recorded in the ledger.

    Attributes:
        label: EMULATED or REAL; None before its first trial.
        n_driven: Number of trials that count, including those of unfinished runs.
        n_void: Number of trials that were begun or driven and do not count.
        unfinished: Replicate of each unfinished run, and the number of its closed generations.
        n_generations: Number of generations of a whole run.
        n_corrected: Number of trials whose cells were corrected after their generation was closed.
    """

    label: str | None
    n_driven: int
    n_void: int
    unfinished: tuple[tuple[int, int], ...]
    n_generations: int
    n_corrected: int


def read_driven(folder: ResultsFolder) -> dict[str, DrivenCondition]:
    """Return the state of each condition in a folder's ledger; empty without a ledger."""
    if not (folder.path / LEDGER_NAME).exists():
        return {}
    with Ledger.open(folder.path / LEDGER_NAME, writable=False) as ledger:
        return {name: _of(ledger, name, about) for name, about in ledger.conditions().items()}


def _of(ledger: Ledger, name: str, about: Mapping[str, Any]) -> DrivenCondition:
    trials = ledger.trials(name)
    complete = set(complete_runs(ledger, name))
    unfinished = []
    for replicate in sorted({trial.replicate for trial in trials} - complete):
        unfinished.append((replicate, sum(closed for _, closed in ledger.generations(name, replicate))))
    own = {trial.trial for trial in trials}
    corrected = {row["trial"] for row in ledger.scores() if row["role"] == "correction"} & own
    return DrivenCondition(
        label=about["label"],
        n_driven=sum(trial.state in ("driven", "scored") for trial in trials),
        n_void=sum(trial.state == "void" for trial in trials),
        unfinished=tuple(unfinished),
        n_generations=about["n_generations"],
        n_corrected=len(corrected),
    )


def describe_driven(name: str, driven: DrivenCondition) -> str:
    """Return the description in a sentence or two."""
    parts = [
        f"{name} ({driven.label or 'not driven yet'}): {driven.n_driven:,} trials that count, {driven.n_void} void"
    ]
    if driven.n_corrected:
        parts.append(
            f"{driven.n_corrected} corrected afterwards, which the figures use and the evolution did not know"
        )
    if driven.unfinished:
        runs = ", ".join(
            f"run {replicate} ({closed} of {driven.n_generations} generations)"
            for replicate, closed in driven.unfinished
        )
        parts.append(f"left out because unfinished: {runs}")
    return "; ".join(parts) + "."


def driven_paths(folder: ResultsFolder, condition: str, replicate: int) -> Paths:
    """Return the lines of a run as the emulator's witness recorded them; none if a person scored them on paper."""
    with Ledger.open(folder.path / LEDGER_NAME, writable=False) as ledger:
        which = {
            trial.trial: (trial.generation, trial.individual)
            for trial in ledger.trials(condition, replicate, states=["scored"])
        }
        return {
            which[row["trial"]]: np.array(row["path"], np.float64).reshape(-1, 3)
            for row in ledger.scores()
            if row["trial"] in which and row["path"] is not None and row["undone"] is None
        }


def refuse_replay(condition: str) -> RecordError:
    """Return the error for a trial of a robot, which cannot be computed again."""
    return RecordError(
        f"The trials of condition {condition!r} were driven by a robot, and no program drives them again. What it "
        "saw and was told stands step by step in the ledger: realitygap.records.Ledger.open(...).record(TRIAL)."
    )
