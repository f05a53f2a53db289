"""A ledger of physical trials, read: what there is of conditions, generations and trials."""

from __future__ import annotations

import hashlib
import sqlite3
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from realitygap._closed_on_exit import ClosedOnExit
from realitygap._limits import parse_json
from realitygap.drawing import ShownAsCard
from realitygap.errors import LedgerError
from realitygap.records._ending import UNDER_WAY, EndReason
from realitygap.records._ledger_file import connect, speaking
from realitygap.records._ledger_kinds import (
    PATH_PARTS,
    PLAN_EVENT,
    DrivenTrial,
    PlannedComparison,
    Score,
    Trial,
    TrialState,
)
from realitygap.records._locked_design import (
    DESIGN_EVENTS,
    HIDDEN_CODE,
    LOST_CODE,
    DesignEvent,
    LockedDesign,
    read_design,
)
from realitygap.records._observations_file import (
    Note,
    Observations,
    ObservationsHead,
    head_from_dict,
    trial_from_dict,
)
from realitygap.records._trial_record import TrialRecord
from realitygap.settings import shown
from realitygap.world import Arena

_TRIALS = """
SELECT trials.id, condition, replicate, generation, individual, attempt, place, sheet, pen, code, state, reason, end,
    problem, n_steps, stalls, purpose, controller, generations.closed IS NOT NULL AS is_closed, counted.cells
FROM trials LEFT JOIN generations USING (condition, replicate, generation)
    LEFT JOIN (
        SELECT trial, cells, max(id) FROM scores WHERE role = 'score' AND undone IS NULL GROUP BY trial
    ) AS counted ON counted.trial = trials.id
"""

_OBSERVED = """
SELECT trials.id, state, reason, end, problem, record, genome, (
    SELECT cells FROM scores WHERE trial = trials.id AND role = 'score' AND undone IS NULL
) AS cells, EXISTS (SELECT 1 FROM scores WHERE trial = trials.id AND role = 'score') AS was_counted
FROM trials LEFT JOIN controllers ON controllers.id = trials.controller
"""

_ENDS: Mapping[str, EndReason] = {
    "running": EndReason.RUNNING,
    "driven": EndReason.DRIVEN,
    "scored": EndReason.STEP_LIMIT,
}
"""Ends of trials of commands that are not void, by their state."""


class LedgerReader(ClosedOnExit, ShownAsCard):
    """A reader of a ledger of physical trials.

    Raises:
        LedgerError: from any method: the file is torn, foreign, locked, or has no such trial.
    """

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self._connection = connection
        (self._version,) = connection.execute("PRAGMA data_version").fetchone()
        self._design: tuple[tuple[int, int], LockedDesign | None] | None = None

    @classmethod
    def open(cls, path: str | Path, *, writable: bool = True) -> Self:
        """Return the ledger in a file."""
        return cls(Path(path), connect(Path(path), writable=writable))

    def __repr__(self) -> str:
        where = f"{type(self).__name__}({str(self.path)!r}"
        try:
            conditions = self.conditions()
            states = [row["state"] for row in self._all("SELECT state FROM trials")]
        except (LedgerError, sqlite3.Error):
            return f"{where}, damaged or closed)"
        labels = dict.fromkeys(str(about["label"]) for about in conditions.values() if about["label"])
        n_scored, n_whole = states.count("scored"), len(states) - states.count("void")
        shown = [f"{n_scored:,}/{n_whole:,} trials scored"]
        if conditions:
            shown.insert(0, f"{len(conditions)} condition{'s' * (len(conditions) != 1)}")
        return ", ".join([where, *shown, *(["+".join(labels)] if labels else [])]) + ")"

    def close(self) -> None:
        """Let go of the file."""
        self._connection.close()

    # conditions and sittings

    def conditions(self) -> dict[str, dict[str, Any]]:
        """Return the hash, label (None before the first trial) and sizes of each condition, by name."""
        return {row["name"]: dict(row) for row in self._all("SELECT * FROM conditions ORDER BY rowid")}

    def sittings(self) -> list[dict[str, Any]]:
        """Return all sittings, oldest first; `robot` and `preflight` as they were given."""
        rows = self._all("SELECT * FROM sittings ORDER BY id")
        return [self._decoded(row, "robot", "preflight") for row in rows]

    def robots(self) -> list[dict[str, str]]:
        """Return the identity of each robot that drove a trial, without repeats, oldest first."""
        rows = self._all(
            "SELECT DISTINCT robot FROM sittings JOIN trials ON trials.sitting = sittings.id ORDER BY sittings.id"
        )
        return [self._value(text) for text in dict.fromkeys(row["robot"] for row in rows)]

    # generations

    def generations(self, condition: str, replicate: int) -> list[tuple[int, bool]]:
        """Return the number of each generation planned, and whether it is closed, in order."""
        rows = self._all(
            "SELECT generation, closed FROM generations WHERE condition = ? AND replicate = ? ORDER BY generation",
            *(condition, replicate),
        )
        return [(row["generation"], row["closed"] is not None) for row in rows]

    def individuals(self, condition: str, replicate: int, generation: int) -> list[dict[str, Any]]:
        """Return the individuals of a generation in order; once it is closed with `fitness`, `novelty` and `cells`."""
        rows = self._all(
            "SELECT individuals.*, scores.cells FROM individuals LEFT JOIN scores ON scores.id = individuals.score "
            "WHERE condition = ? AND replicate = ? AND generation = ? ORDER BY individual",
            *(condition, replicate, generation),
        )
        return [self._decoded(row, "parents", "genome", "cells") for row in rows]

    # trials

    def trials(
        self,
        condition: str | None = None,
        replicate: int | None = None,
        generation: int | None = None,
        *,
        states: Iterable[TrialState] | None = None,
    ) -> list[Trial]:
        """Return trials in the order of their turns; all of them, or those chosen."""
        wanted = {"condition": condition, "replicate": replicate, "generation": generation}
        given = {name: value for name, value in wanted.items() if value is not None}
        clauses = [f"{name} = ?" for name in given]
        values: list[Any] = list(given.values())
        if states is not None:
            chosen = list(states)
            clauses.append(f"state IN ({', '.join('?' * len(chosen))})")
            values += chosen
        where = f"WHERE {' AND '.join(clauses)} " if clauses else ""
        rows = self._all(f"{_TRIALS}{where}ORDER BY place, attempt", *values)
        codes = self._codes(rows)
        return [self._trial(row, codes) for row in rows]

    def trial(self, number: int) -> Trial:
        """Return a trial by its number.

        Raises:
            LedgerError: there is none.
        """
        row = self._one(f"{_TRIALS}WHERE trials.id = ?", number)
        if row is None:
            (most,) = self._one("SELECT max(id) FROM trials") or (None,)
            has = f"its trials are 1 to {most}" if most else "it has none yet"
            raise LedgerError(f"{self.path} has no trial {number}: {has}.")
        return self._trial(row, self._codes([row]))

    def notes(self, number: int | None = None) -> list[dict[str, Any]]:
        """Return notes, oldest first; of one trial, or all."""
        where, values = ("", ()) if number is None else ("WHERE trial = ? ", (number,))
        return [dict(row) for row in self._all(f"SELECT * FROM notes {where}ORDER BY id", *values)]

    # trials of a command

    def head(self) -> ObservationsHead:
        """Return what the trials of a command have in common.

        Raises:
            LedgerError: The ledger is that of a study.
        """
        row = self._one("SELECT head FROM head")
        if row is None:
            raise LedgerError(
                f"{self.path} has the trials of a study. Name its folder, or a file in which a command saved trials."
            )
        try:
            return head_from_dict(self._value(row["head"]))
        except ValueError as error:
            raise LedgerError(f"{self.path} is damaged: its head {error}.") from None

    def origin(self) -> str:
        """Return the SHA-256 of the file from which the trials of a command were converted; empty if there is none."""
        row = self._one("SELECT origin FROM head")
        return "" if row is None else str(row["origin"] or "")

    @property
    def arena(self) -> Arena:
        """Arena of the trials of a command.

        Raises:
            LedgerError: The ledger is that of a study, or has no arena that can be read.
        """
        return arena_of(self.head().arena, self.path)

    def has_changed(self) -> bool:
        """Return whether another program has changed the ledger since the last call, or since it was opened."""
        (version,) = self._all("PRAGMA data_version")[0]
        before, self._version = self._version, version
        return bool(version != before)

    def observations(self) -> Observations:
        """Return the trials of a command, in the order in which they began, and its notes.

        Raises:
            LedgerError: The ledger is that of a study.
        """
        head = self.head()
        records = [self._observed(row) for row in self._all(f"{_OBSERVED}ORDER BY place")]
        under_way = tuple(record for record in records if record.end in UNDER_WAY)
        ended = tuple(record for record in records if record.end not in UNDER_WAY)
        notes = tuple(
            Note(trial=note["trial"], text=note["text"], who=note["who"], time=note["time"])
            for note in self.notes()
        )
        return Observations(head, ended, "", under_way, notes)

    def _observed(self, row: sqlite3.Row) -> TrialRecord:
        """Return a trial of a command with the cells that count; one that a person declared void is aborted."""
        try:
            record = trial_from_dict({**self._value(row["record"]), "genome": row["genome"] or ""})
        except ValueError as error:
            raise LedgerError(f"{self.path} is damaged: trial {row['id']} is {error}.") from None
        end, problem = _ENDS.get(row["state"]), row["problem"] or ""
        if row["state"] == "void":
            is_cut_off = row["end"] not in _ENDS.values()
            end = row["end"] if is_cut_off else EndReason.ABORTED
            problem = problem if is_cut_off else row["reason"] or ""
        cells = self._numbers(row["cells"] or "[]") if row["was_counted"] else record.cells
        return replace(record, end=str(end), problem=problem, cells=cells)

    def record(self, number: int) -> TrialRecord:
        """Return a trial as it was driven and observed.

        In a study, it has poses if the driven path was recorded, and a last look if the robot had one. `step_s` is
        the median of the times between commands. A trial that was not driven has no commands.
        """
        trial, score = self.trial(number), self.counted_score(number)
        if not trial.condition:
            return self._observed(self._all(f"{_OBSERVED}WHERE trials.id = ?", number)[0])
        rows = self._all("SELECT * FROM steps WHERE trial = ? ORDER BY step", number)
        readings = [self._numbers(row["readings"]) for row in rows]
        raw = [self._numbers(row["raw"]) for row in rows]
        n = len(rows)
        t = n if trial.n_steps is None else trial.n_steps
        path = () if score is None or score.path is None else score.path
        try:
            times = np.array([row["time"] for row in rows], np.float64)
            poses = np.array(path, np.float64).reshape(-1, 3)[::PATH_PARTS]
            return TrialRecord(
                start=tuple(poses[0].tolist()) if len(poses) else (0.0, 0.0, 0.0),
                step_s=float(np.median(np.diff(times[:t]))) if t > 1 else 0.0,
                commands=np.array([(row["move"], row["turn"]) for row in rows[:t]], np.float64).reshape(t, 2),
                readings=np.array(readings[:t], np.float64).reshape(t, -1 if t else 0),
                stalled=np.array([row["stalled"] for row in rows[:t]], np.bool_),
                cells=trial.cells or (),
                poses=poses,
                number=number,
                end=trial.end or "",
                last_readings=np.array(readings[t:], np.float64).reshape(-1),
                last_stalled=any(row["stalled"] for row in rows[t:]),
                times=times,
                raw=np.array(raw, np.float64).reshape(n, -1 if n else 0),
                problem=trial.problem or "",
            )
        except (OverflowError, TypeError, ValueError) as error:
            raise LedgerError(
                f"{self.path} is damaged: trial {number} has steps of several forms ({error})."
            ) from None

    def counted_score(self, number: int) -> Score | None:
        """Return the score of a trial that counts for selection, with the driven path if it is known."""
        row = self._one(
            "SELECT * FROM scores WHERE trial = ? AND role = 'score' AND undone IS NULL ORDER BY id DESC LIMIT 1",
            number,
        )
        if row is None:
            return None
        values = self._decoded(row, "cells", "path")
        return Score(tuple(values["cells"]), values["who"], n_ends=values["n_ends"], path=values["path"])

    def scores(self) -> list[dict[str, Any]]:
        """Return all scores ever entered, oldest first, with their trial, role, who, and when they were undone."""
        rows = self._all("SELECT * FROM scores ORDER BY id")
        return [self._decoded(row, "cells", "path") for row in rows]

    def events(self) -> list[dict[str, Any]]:
        """Return everything that changed a trial, oldest first."""
        return [self._decoded(row, "details") for row in self._all("SELECT * FROM events ORDER BY id")]

    def comparison(self) -> PlannedComparison | None:
        """Return the plan of a comparison, and the plan of before the first trial; None without a plan."""
        rows = self._all("SELECT id, details FROM events WHERE what = ? ORDER BY id", PLAN_EVENT)
        if not rows:
            return None
        begun = self._one("SELECT min(id) AS id FROM events WHERE what = 'running'")
        first_trial = None if begun is None else begun["id"]
        before = [row for row in rows if first_trial is None or row["id"] < first_trial]
        first = self._value(before[-1]["details"]) if before else None
        return PlannedComparison(self._value(rows[-1]["details"]), first)

    def design(self) -> LockedDesign | None:
        """Return the design that was locked in the ledger, with its changes; None if there is none.

        Raises:
            LedgerError: An event of it cannot be read. An edited event is reported by `LockedDesign.problem` instead.
        """
        (version,) = self._all("PRAGMA data_version")[0]
        stamp = (version, self._connection.total_changes)
        if self._design is None or self._design[0] != stamp:
            marks = ", ".join("?" * len(DESIGN_EVENTS))
            rows = self._all(
                "SELECT what, details, (SELECT count(*) FROM events AS begun WHERE begun.what = 'running' AND "
                f"begun.id < events.id) AS n FROM events WHERE what IN ({marks}) ORDER BY id",
                *DESIGN_EVENTS,
            )
            events = [DesignEvent(row["what"], self._value(row["details"]), row["n"]) for row in rows]
            try:
                design = read_design(events, self.path)
            except (KeyError, TypeError, ValueError) as error:
                raise LedgerError(f"{self.path} is damaged: the event {error}.") from None
            self._design = (stamp, design)
        return self._design[1]

    def _codes(self, rows: Iterable[sqlite3.Row]) -> Mapping[int, str]:
        """Return the code of each controller, by its number, if the design of these trials is blind."""
        is_of_command = any(row["controller"] is not None for row in rows)
        return self._codes_of(self.design()) if is_of_command else {}

    def _codes_of(self, design: LockedDesign | None) -> dict[int, str]:
        """Return the code of each controller of a blind design, by its number in the ledger."""
        if design is None or not design.is_blind:
            return {}
        codes = design.codes()
        rows = self._all("SELECT id, genome FROM controllers")
        return {
            row["id"]: codes.get(hashlib.sha256(row["genome"].encode()).hexdigest(), LOST_CODE)
            for row in rows
        }

    def driven(self) -> list[DrivenTrial]:
        """Return each trial with its controller, in the order in which they began; none for a study's planned ones."""
        rows = self._all(
            "SELECT trials.id, number, state, reason, genome, json_extract(record, '$.battery_v') AS battery "
            "FROM trials LEFT JOIN controllers ON controllers.id = trials.controller "
            "WHERE state <> 'planned' ORDER BY place"
        )
        return [
            DrivenTrial(
                row["id"],
                row["number"] or 0,
                hashlib.sha256((row["genome"] or "").encode()).hexdigest(),
                row["state"],
                row["reason"] or "",
                row["battery"],
            )
            for row in rows
        ]

    def used_codes(self) -> set[str]:
        """Return the codes that are names of trials."""
        return {row["code"] for row in self._all("SELECT code FROM trials WHERE code IS NOT NULL")}

    def last_sheet(self) -> int:
        """Return the highest number of a sheet of paper; 0 before the first."""
        row = self._one("SELECT coalesce(max(sheet), 0) AS sheet FROM trials")
        return 0 if row is None else int(row["sheet"])

    # inside

    def _count(self, command: str, *values: Any) -> int:
        """Run a command. Return the number of changed rows."""
        return self._connection.execute(command, values).rowcount

    def _one(self, query: str, *values: Any) -> sqlite3.Row | None:
        with speaking(self.path, self._connection):
            row: sqlite3.Row | None = self._connection.execute(query, values).fetchone()
            return row

    def _all(self, query: str, *values: Any) -> list[sqlite3.Row]:
        with speaking(self.path, self._connection):
            return self._connection.execute(query, values).fetchall()

    def _trial(self, row: sqlite3.Row, codes: Mapping[int, str]) -> Trial:
        values = {name: row[name] for name in row.keys() if name not in ("id", "cells", "is_closed")}  # noqa: SIM118
        cells = None if row["cells"] is None else self._numbers(row["cells"])
        texts = {name: values[name] or "" for name in ("condition", "code", "purpose")}
        numbers = {
            name: values[name] or 0 for name in ("replicate", "generation", "individual", "sheet", "pen")
        }
        given = {**values, **texts, **numbers}
        if given["controller"] in codes:
            # a list of codes beside cells would show results by arm
            given |= {"controller": None, "arm": codes[given["controller"]] if cells is None else HIDDEN_CODE}
        return Trial(trial=row["id"], cells=cells, is_closed=bool(row["is_closed"]), **given)

    def _decoded(self, row: sqlite3.Row, *names: str) -> dict[str, Any]:
        """Return the values of a row, some of which are written as JSON."""
        return dict(row) | {name: None if row[name] is None else self._value(row[name]) for name in names}

    def _value(self, text: str) -> Any:
        try:
            return parse_json(text, nan=True)
        except ValueError as error:
            raise LedgerError(f"{self.path} is damaged: a value is not JSON ({error}).") from None

    def _numbers(self, text: str) -> tuple[Any, ...]:
        values = self._value(text)
        if not isinstance(values, list) or not all(isinstance(each, int | float) for each in values):
            raise LedgerError(f"{self.path} is damaged: {shown(text)} is no list of numbers.")
        return tuple(values)


def arena_of(values: Mapping[str, Any], path: Path) -> Arena:
    """Return the arena of a head.

    Raises:
        LedgerError: The head of the trials in this file has none that can be read.
    """
    try:
        return Arena.from_dict(dict(values))
    except (KeyError, TypeError, ValueError) as error:
        raise LedgerError(f"{path} is damaged: its head has no arena that can be read ({error}).") from None
