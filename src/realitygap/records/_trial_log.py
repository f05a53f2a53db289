"""The trials in a file of observations, which a person lists, scores, voids, and annotates like those of a ledger."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from realitygap._closed_on_exit import ClosedOnExit
from realitygap.errors import RecordError
from realitygap.world import Arena

from ._ending import EndReason, is_whole, taken_back
from ._ledger_kinds import Score, ScoreRole, TrialState, checked_cells
from ._observations_file import Note, Observations, ObservationsFile, read_observations
from ._trial_record import NO_LINE, TrialRecord

_STATES: Mapping[str, TrialState] = {
    EndReason.STEP_LIMIT: "scored",
    EndReason.RUNNING: "running",
    EndReason.DRIVEN: "driven",
}


@dataclass(frozen=True)
class LoggedTrial:
    """A trial of a file, as a person sees it.

    Attributes:
        trial: Number of the trial.
        name: Purpose, and number of its controller in the file, from 1 on.
        state: `scored` if the trial counts, `driven` if a person has yet to report on it; or `running` or `void`.
        reason: Reason why it is void; empty if it is not.
        cells: Crossed cells; None if nobody has counted them.
    """

    trial: int
    name: str
    state: TrialState
    reason: str
    cells: tuple[int, ...] | None


class TrialLog(ClosedOnExit):
    """The trials of `gap`, `calibrate`, `transfer`, or `try` in a file. Nothing that the file has is overwritten.

    The command that recorded the trials uses the changes when it runs again: it drives void trials once more.

    Raises:
        RecordError: From any method: the file is damaged, in use, or cannot be written, or has no such trial.
    """

    def __init__(self, path: Path, observations: Observations, file: ObservationsFile | None) -> None:
        self.path = path
        self._observations, self._file = observations, file

    @classmethod
    def open(cls, path: str | Path, *, writable: bool = True) -> Self:
        """Return the trials of an existing file."""
        path = Path(path)
        observations = read_observations(path)
        return cls(path, observations, ObservationsFile(path, observations.head) if writable else None)

    @property
    def arena(self) -> Arena:
        """Arena of the trials.

        Raises:
            RecordError: The file has none that can be read.
        """
        try:
            return Arena.from_dict(dict(self._observations.head.arena))
        except (KeyError, TypeError, ValueError) as error:
            raise RecordError(
                f"{self.path} is damaged: its first line has no arena that can be read ({error})."
            ) from None

    def trials(self, *, states: Iterable[TrialState] | None = None) -> list[LoggedTrial]:
        """Return the present state of each trial, in the order in which they ended; all of them, or those chosen."""
        chosen = None if states is None else set(states)
        genomes: dict[str, int] = {}
        logged = []
        for record in self._records():
            name = record.purpose
            if record.genome:
                name += f", controller {genomes.setdefault(record.genome, len(genomes) + 1)}"
            state = _STATES.get(record.end, "void")
            reason = (record.problem or record.end) if state == "void" else ""
            if chosen is None or state in chosen:
                logged.append(LoggedTrial(record.number, name, state, reason, record.cells or None))
        return logged

    def trial(self, number: int) -> LoggedTrial:
        """Return a trial by its number."""
        self.record(number)
        return next(trial for trial in self.trials() if trial.trial == number)

    def record(self, number: int) -> TrialRecord:
        """Return a trial as it was driven and observed."""
        records = [record for record in self._records() if record.number == number]
        if len(records) != 1:
            has = f"{len(records)} trials with the number" if records else "no trial"
            raise RecordError(
                f"{self.path} has {has} {number}. `realitygap trials list {self.path}` shows all trials."
            )
        return records[0]

    def notes(self, number: int | None = None) -> list[Note]:
        """Return notes, oldest first; of one trial, or all."""
        return [note for note in self._observations.notes if number in (None, note["trial"])]

    def score_all(self, scores: Mapping[int, Score], role: ScoreRole = "score") -> None:
        """Enter the cells of trials by number, in place of those of before: of all of them, or of none.

        Raises:
            RecordError: One of the trials draws no line, or a cell is outside the grid.
        """
        if role != "score":
            raise RecordError(
                f"{self.path} has one count of each trial; --second and --correct are for the trials of a study. "
                "Leave them out: the cells replace those of before."
            )
        n_cells = self.arena.grid.n_cells
        entries = []
        for number, score in scores.items():
            record = self._require(number, "driven", "scored")
            if record.purpose in NO_LINE or (is_whole(record) and not record.cells):
                raise RecordError(
                    f"The cells of trial {number} ({record.purpose}) are not counted. Nothing was entered."
                )
            cells = tuple(sorted(checked_cells(score.cells, n_cells)))
            entries.append((replace(record, cells=cells, end=str(EndReason.STEP_LIMIT)), score.who))
        for record, who in entries:
            self._writable().note(f"{len(record.cells)} cells were entered", who, record.number)
            self._append(record)

    def void(self, number: int, reason: str) -> None:
        """Void a trial; its command drives it again.

        Raises:
            RecordError: It is void already, or no reason is given.
        """
        if not reason.strip():
            raise RecordError(f"Trial {number} cannot be void without a reason. Give a reason.")
        record = self._require(number, "running", "driven", "scored")
        self._append(taken_back(record, reason))

    def note(self, text: str, who: str, number: int | None = None) -> None:
        """Add a remark on a trial or on the whole file."""
        if not text.strip():
            raise RecordError("An empty note was not saved. Enter a text.")
        if number is not None:
            self.record(number)
        self._writable().note(text, who, number)

    def close(self) -> None:
        """Let go of the file; safe to call twice."""
        if self._file is not None:
            self._file.close()

    def _records(self) -> list[TrialRecord]:
        """Return the last record of each trial. One that was lost and driven again counts."""
        last: dict[tuple[str, int, str], TrialRecord] = {}
        for record in (*self._observations.trials, *self._observations.under_way):
            last[record.purpose, record.number, record.genome] = record
        return list(last.values())

    def _require(self, number: int, *states: TrialState) -> TrialRecord:
        state = self.trial(number).state
        if state not in states:
            raise RecordError(
                f"Trial {number} is {state}; that can be done only while it is {' or '.join(states)}. Nothing was "
                "changed."
            )
        return self.record(number)

    def _append(self, record: TrialRecord) -> None:
        self._writable().append(record)
        self._observations = read_observations(self.path)

    def _writable(self) -> ObservationsFile:
        if self._file is None:
            raise RecordError(f"{self.path} was opened for reading only.")
        return self._file
