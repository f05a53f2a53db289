"""Why trials ended, and which of them count."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from enum import StrEnum

from ._trial_record import TrialRecord


class EndReason(StrEnum):
    """Why a trial on a robot ended."""

    STEP_LIMIT = "step limit"
    """The trial ended after its last step."""
    ABORTED = "aborted"
    """The operator aborted the trial."""
    LOST = "lost"
    """The robot, or the link to it, failed."""
    INTERRUPTED = "interrupted"
    """The program was stopped."""
    RUNNING = "running"
    """Not ended yet. After a crash, that is all that is known."""
    DRIVEN = "driven"
    """The robot has driven its last step, and a person has yet to report what they saw."""


UNDER_WAY = (EndReason.RUNNING, EndReason.DRIVEN)
"""Ends of records of unfinished trials: the robot drives, or a person has yet to report what they saw."""


def is_whole(trial: TrialRecord) -> bool:
    """Return whether a trial ended on its own and was not cut off."""
    return trial.end == EndReason.STEP_LIMIT


def taken_back(trial: TrialRecord, problem: str = "") -> TrialRecord:
    """Return a trial as one that the operator does not let count."""
    return replace(trial, end=str(EndReason.ABORTED), problem=problem)


def is_taken_back(trial: TrialRecord) -> bool:
    """Return whether a trial is the record that the one before it, of the same plan, does not count."""
    return trial.end == EndReason.ABORTED


def those_that_count(trials: Iterable[TrialRecord]) -> list[TrialRecord]:
    """Return the trials that ended on their own and were not taken back.

    If trials of one plan were driven again, only the last of them is returned.
    """
    last: dict[object, TrialRecord] = {}
    for trial in trials:
        what = (trial.purpose, trial.number, trial.start, trial.genome)
        if is_whole(trial):
            last[what] = trial
        elif is_taken_back(trial):
            last.pop(what, None)
    return list(last.values())
