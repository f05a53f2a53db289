"""Files in which gaps, calibrations, transfers, and `try` saved their trials."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

from realitygap.errors import RealityGapError, RecordError
from realitygap.records import LEDGER_NAME, Ledger, Score, Trial, is_observations, ledger_stamp, open_ledger
from realitygap.study import advise_ledger, design_report
from realitygap.world import Arena

from ._files import plain_files
from ._mistakes import refuse_unnamed

LONGEST_TEXT = 1000
"""Largest length of a reason or note [letters]."""


def saved_files(root: Path) -> dict[str, Path]:
    """Return the files of trials in a folder, and in folders down to the second level, by their path from it.

    `transfer` saves trials in a folder of its folder.
    """
    folders = _folders(root)
    files: dict[str, Path] = {}
    for folder in (root, *folders, *(path for parent in folders for path in _folders(parent))):
        for path in plain_files(folder, (".jsonl", ".sqlite")):
            is_converted = path.suffix == ".jsonl" and path.with_suffix(".sqlite").exists()
            with contextlib.suppress(RecordError):
                if path.name != LEDGER_NAME and not is_converted and is_observations(path):
                    files[path.relative_to(root).as_posix()] = path
    return files


def _folders(folder: Path) -> list[Path]:
    """Return the folders in a folder, without links; none if it cannot be read."""
    try:
        return sorted(path for path in folder.iterdir() if path.is_dir() and not path.is_symlink())
    except OSError:
        return []


@dataclass(frozen=True)
class SavedTrials:
    """The trials of a file at one moment.

    Attributes:
        target: Platform, as the user named it.
        label: Its label, such as TWIN.
        arena: Arena of the trials.
        trials: The trials.
        notes: Notes on each trial, by its number.
        changed: Day on which the file was last changed.
        looks: What the trials show of a comparison that is planned in the file, and its locked design with all
            deviations, a line each; empty if there is none.
    """

    target: str
    label: str
    arena: Arena
    trials: tuple[Trial, ...]
    notes: Mapping[int, str]
    changed: date
    looks: tuple[str, ...] = ()

    def trial(self, number: int | None) -> Trial | None:
        """Return a trial by its number."""
        return next((trial for trial in self.trials if trial.trial == number), None)


class SavedFile:
    """A file of trials that visitors list, correct, void, and annotate. All methods wait for the disk.

    Raises:
        RecordError: From any method: the file is damaged, in use, or cannot be written, or has no such trial.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.stamp: tuple[Any, ...] = ()

    def read(self) -> SavedTrials:
        """Return the trials."""
        self.stamp = ledger_stamp(self._path)
        with self._open(writable=False) as ledger:
            trials = tuple(ledger.trials())
            notes = {
                trial.trial: "; ".join(f"{note['who']}: {note['text']}" for note in ledger.notes(trial.trial))
                for trial in trials
            }
            head = ledger.head()
            changed = date.fromtimestamp(self._path.stat().st_mtime)
            return SavedTrials(head.target, head.label, ledger.arena, trials, notes, changed, _looks(ledger))

    def _open(self, *, writable: bool = True) -> Ledger:
        """Open the trials. Lines of JSON are converted before they are changed; then the new file has them."""
        ledger = open_ledger(self._path, writable=writable)
        self._path = ledger.path
        return ledger

    def has_changed(self) -> bool:
        """Return whether the file has changed since it was read."""
        return ledger_stamp(self._path) != self.stamp

    def score(self, number: int, cells: Sequence[int], who: str) -> None:
        """Enter the cells of a trial in place of those of before."""
        who = refuse_unnamed(who)
        with self._open() as ledger:
            if ledger.trial(number).state == "scored":
                ledger.undo(number)
            ledger.score(number, Score(cells, who))

    def void(self, number: int, reason: str, who: str) -> None:
        """Declare a trial void; its command drives it again."""
        who = refuse_unnamed(who)
        with self._open() as ledger:
            ledger.void(number, reason[:LONGEST_TEXT])
            ledger.note("void", who, number)

    def note(self, number: int, text: str, who: str) -> None:
        """Save a note about a trial."""
        who = refuse_unnamed(who)
        with self._open() as ledger:
            ledger.note(text[:LONGEST_TEXT], who, number)


def _looks(ledger: Ledger) -> tuple[str, ...]:
    """Return what the trials of a planned comparison show, and deviations from a locked design."""
    try:
        looks = () if ledger.comparison() is None else tuple(advise_ledger(ledger).sentences)
        report = design_report(ledger)
        if report is None:
            return looks
        return (*looks, report.line, f"SHA-256 of the locked design: {report.design.sha256}.")
    except RealityGapError as error:
        return (str(error),)
