"""Files in which gaps, calibrations, transfers, and `try` saved their trials."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any

from realitygap.errors import RealityGapError, RecordError
from realitygap.records import LEDGER_NAME, Ledger, Score, Trial, is_observations, ledger_stamp, open_ledger
from realitygap.study import DesignReport, advise_ledger, design_report
from realitygap.world import Arena

from ._design import LONGEST_TEXT
from ._files import plain_files
from ._mistakes import refuse_unnamed


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
        looks: What the trials show of a comparison that is planned in the file, a line each; empty if there is none.
        design: Its locked design with all deviations; None if there is none.
    """

    target: str
    label: str
    arena: Arena
    trials: tuple[Trial, ...]
    notes: Mapping[int, str]
    changed: date
    looks: tuple[str, ...] = ()
    design: DesignReport | None = field(default=None, repr=False)

    def trial(self, number: int | None) -> Trial | None:
        """Return a trial by its number."""
        return next((trial for trial in self.trials if trial.trial == number), None)


class SavedFile:
    """A file of trials that visitors list, correct, void, and annotate. All methods wait for the disk.

    Attributes:
        path: Path of the file.
        stamp: Changes with the file.

    Raises:
        RecordError: From any method: the file is damaged, in use, or cannot be written, or has no such trial.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.stamp: tuple[Any, ...] = ()

    def read(self) -> SavedTrials:
        """Return the trials."""
        self.stamp = ledger_stamp(self.path)
        with self._open(writable=False) as ledger:
            trials = tuple(ledger.trials())
            notes = {
                trial.trial: "; ".join(f"{note['who']}: {note['text']}" for note in ledger.notes(trial.trial))
                for trial in trials
            }
            head = ledger.head()
            changed = date.fromtimestamp(self.path.stat().st_mtime)
            return SavedTrials(head.target, head.label, ledger.arena, trials, notes, changed, *_looks(ledger))

    def _open(self, *, writable: bool = True) -> Ledger:
        """Open the trials. Lines of JSON are converted before they are changed; then the new file has them."""
        ledger = open_ledger(self.path, writable=writable)
        self.path = ledger.path
        return ledger

    def has_changed(self) -> bool:
        """Return whether the file has changed since it was read."""
        return ledger_stamp(self.path) != self.stamp

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


def _looks(ledger: Ledger) -> tuple[tuple[str, ...], DesignReport | None]:
    """Return what the trials of a planned comparison show, and their locked design."""
    report = None
    try:
        report = design_report(ledger)
        return () if ledger.comparison() is None else tuple(advise_ledger(ledger).sentences), report
    except RealityGapError as error:
        return (str(error),), report
