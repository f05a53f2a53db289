"""Scored trials as a table that `fieldtrial import` reads."""

from __future__ import annotations

import csv
import io
import math
import re
from collections import Counter
from pathlib import Path

from realitygap.errors import RecordError, StudyError
from realitygap.records import Trial, open_ledger, refuse_blind, refuse_results, write_whole
from realitygap.tasks import CoverageTask, Task, score_observed

from ._tracked import trial_in

COLUMNS = ("condition", "arm", "success", "duration_s", "operator", "rig", "session", "notes")
"""Columns that `fieldtrial import` 0.3 reads."""

_NO_NAME = re.compile(r"[^A-Za-z0-9_.-]+")
_MOST_LETTERS = 64


def write_fieldtrial(
    source: str | Path, out: str | Path, success_from: float, task: Task | None = None
) -> int:
    """Write scored trials as a table that `fieldtrial import` reads.

    An arm is a condition of a study, or a controller of a file of trials. The starting condition of the k-th trial of
    an arm is `trial=k`. A study of fieldtrial has it with the factor `trial: {range: [1, N]}`.

    Args:
        source: A folder of results with a ledger, or a file of trials.
        out: New file that ends in .csv.
        success_from: Score from which a trial is a success.
        task: Task that scores the trials. Default: coverage.

    Returns:
        The number of trials.

    Raises:
        RecordError: The source cannot be read, or the file exists or cannot be written.
        StudyError: The source has no scored trial.
        TaskError: A trial has less than the task needs.
        ValueError: `success_from` is not a finite number.
    """
    source, out = Path(source), Path(out)
    if not math.isfinite(success_from):
        raise ValueError(f"success_from is {success_from}, expected a finite number.")
    refuse_results(out)
    if out.exists():
        raise RecordError(f"{out} exists already, and was not changed. Name another file.")
    buffer = io.StringIO(newline="")
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(COLUMNS)
    numbers: Counter[str] = Counter()
    with open_ledger(source, writable=False) as ledger:
        refuse_blind(ledger)
        operators = {row["trial"]: row["who"] for row in ledger.scores() if row["undone"] is None}
        for trial in ledger.trials(states=("scored",)):
            if not trial.n_steps:
                continue
            driven = trial_in(ledger, source, trial.trial)
            score = float(score_observed(task or CoverageTask(), [driven.trial], driven.arena)[0])
            arm = _arm(trial)
            numbers[arm] += 1
            writer.writerow(
                (
                    f"trial={numbers[arm]}",
                    arm,
                    str(score >= success_from).lower(),
                    f"{len(driven.trial.commands) * driven.trial.step_s:g}",
                    _plain(operators.get(trial.trial) or "realitygap"),
                    _plain(driven.head.target),
                    "realitygap",
                    f"trial {trial.trial}, score {score:.4f}",
                )
            )
    if not numbers:
        raise StudyError(f"{source} has no scored trial. Score one first: realitygap trials score {source}")
    write_whole(out, buffer.getvalue().encode("utf-8"))
    return numbers.total()


def _arm(trial: Trial) -> str:
    if trial.condition:
        name = trial.condition
    elif trial.controller is not None:
        name = f"controller-{trial.controller}"
    else:
        name = trial.purpose or "controller"
    return _NO_NAME.sub("-", name).strip("-_.")[:_MOST_LETTERS] or "controller"


def _plain(text: str) -> str:
    """Return a text that no spreadsheet takes for a formula."""
    return text.lstrip("=+-@\t\r") or "realitygap"
