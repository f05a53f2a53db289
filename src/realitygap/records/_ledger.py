"""A ledger of trials that cost something: planned, driven, scored, and void ones. Nothing is ever deleted from it."""

from __future__ import annotations

import contextlib
import datetime
import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Literal, Self

from realitygap._limits import parse_json
from realitygap.errors import LedgerError
from realitygap.records._ending import UNDER_WAY, EndReason, is_taken_back, is_whole
from realitygap.records._ledger_file import create_file, speaking
from realitygap.records._ledger_kinds import (
    OBSERVER,
    PLAN_EVENT,
    ROBOT,
    Generation,
    Score,
    ScoreRole,
    Trial,
    TrialState,
    Turn,
    checked_cells,
)
from realitygap.records._ledger_reader import LedgerReader, arena_of
from realitygap.records._lock import FolderLock
from realitygap.records._locked_design import (
    LOCKED,
    LockedDesign,
    canonical_json,
    event_hash,
    lock_details,
    new_secret,
    secret_path,
)
from realitygap.records._observations_file import (
    Observations,
    ObservationsHead,
    not_compared,
    trial_to_dict,
)
from realitygap.records._output import write_whole
from realitygap.records._trial_record import NO_LINE, TrialRecord
from realitygap.records._version import RESULTS_VERSION


class Ledger(LedgerReader):
    """The ledger of a study's physical trials, or of those that `gap`, `calibrate`, `transfer`, or `try` saved.

    Each method that writes is one transaction, and what it wrote survives a crash once it returns. Several
    programs may have the ledger open at a time.

    Raises:
        LedgerError: from any method: the file is torn, foreign, locked or cannot be written, or does not allow what was
            asked; what was written before is safe.
    """

    lock: FolderLock | None = None
    """Lock that keeps out other commands that would save trials; it is released when the ledger is closed."""
    _begun = 0
    """Number of the trial of a command that is under way in this program; 0 if there is none."""

    @classmethod
    def create(cls, path: str | Path) -> Self:
        """Create a ledger; raise an error if the file exists."""
        create_file(Path(path))
        return cls.open(path)

    def close(self) -> None:
        """Let go of the file; safe to call twice."""
        super().close()
        lock, self.lock = self.lock, None
        if lock is not None:
            lock.release()

    # trials of a command

    def begin(
        self, head: ObservationsHead, observations: Observations | None = None, origin: str = ""
    ) -> None:
        """Make an empty ledger that of a command.

        Args:
            head: What its trials have in common.
            observations: Its first trials and notes, which were saved elsewhere.
            origin: SHA-256 of the file that had them.
        """
        n_cells = arena_of(head.arena, self.path).grid.n_cells
        with self._writing():
            self._run(
                "INSERT INTO head VALUES (1, ?, ?, ?, ?)",
                *(_now(), n_cells, _json(head.to_dict()), origin or None),
            )
            if observations is not None:
                self._take_over(observations)

    def adopt(self, head: ObservationsHead) -> None:
        """Raise an error if the trials of the ledger are of another target, arena, robot, or observation level.

        A target whose identity is known on both sides may have another name, such as another port. Without trials,
        the ledger gets the new head.

        Raises:
            LedgerError: They are.
        """
        there, wanted = self.head().to_dict(), head.to_dict()
        of_no_matter = not_compared(there, wanted)
        others = [name for name in wanted if name != of_no_matter and there[name] != wanted[name]]
        if not others:
            return
        with self._writing():
            if self._one("SELECT id FROM trials") is not None:
                what = "; ".join(
                    f"{name} {_short(there[name])} and not {_short(wanted[name])}" for name in others
                )
                raise LedgerError(
                    f"{self.path} has trials of another kind: {what}. They cannot be combined. Name another file."
                )
            n_cells = arena_of(head.arena, self.path).grid.n_cells
            self._run("UPDATE head SET n_cells = ?, head = ?", n_cells, _json(wanted))

    def append(self, trial: TrialRecord) -> None:
        """Save the state of a command's trial by its end: as it begins, when it was driven, when it counts, or is void.

        A state continues the last trial of the same purpose, number, and controller that is not void, unless that one
        is complete: then it is another trial.
        """
        with self._writing():
            self._append(trial, _now())

    # a comparison

    def plan_comparison(self, plan: Mapping[str, Any]) -> None:
        """Store how trials will be compared, as an event; nothing if the last such plan is the same.

        A plan that differs from an earlier one is added to it. `comparison` reports whether the plans were stored
        before the first trial.
        """
        last = self._one("SELECT details FROM events WHERE what = ? ORDER BY id DESC LIMIT 1", PLAN_EVENT)
        if last is not None and self._value(last["details"]) == parse_json(_json(plan)):
            return
        with self._writing():
            self._run(
                "INSERT INTO events (time, trial, what, details) VALUES (?, NULL, ?, ?)",
                *(_now(), PLAN_EVENT, _json(plan)),
            )

    # a locked design

    def lock_design(
        self, design: Mapping[str, Any], *, who: str, version: str, is_blind: bool = False
    ) -> LockedDesign:
        """Lock a design before trial 1, and return it. If it is blind, its secret is saved next to the ledger.

        Args:
            design: What decides which trials are driven and how they are judged, as plain values.
            who: Person who locks it.
            version: Version of the program.
            is_blind: True to show codes in place of its arms until it is unblinded.

        Raises:
            LedgerError: A trial has begun, or a design is locked already.
            RecordError: The secret cannot be saved.
        """
        secret = new_secret() if is_blind else None
        if secret is not None and self.design() is None:  # first: a design without its secret has no codes
            write_whole(secret_path(self.path), secret)
            with contextlib.suppress(OSError):
                secret_path(self.path).chmod(0o600)
        with self._writing():
            if self.design() is not None:
                raise LedgerError(f"{self.path} has a locked design already. Nothing was changed.")
            if self._one("SELECT id FROM events WHERE what = 'running'") is not None:
                raise LedgerError(
                    f"{self.path} has trials, and a design is locked before the first one. Nothing was changed. Name "
                    "another file or folder, or drive on without a lock."
                )
            self._note_design(LOCKED, lock_details(design, who, version, _now(), secret))
        return self._locked()

    def change_design(
        self,
        what: Literal["design resumed", "design amended", "design unblinded"],
        details: Mapping[str, Any],
    ) -> LockedDesign:
        """Add an event to a locked design, and return it.

        Raises:
            LedgerError: No design is locked, or its events were edited.
        """
        with self._writing():
            self._locked()
            self._note_design(what, {"time": _now(), **details})
        return self._locked()

    def _locked(self) -> LockedDesign:
        """Return the locked design, whose events are as they were written."""
        design = self.design()
        if design is None:
            raise LedgerError(f"{self.path} has no locked design. A design is locked before the first trial.")
        if design.problem:
            raise LedgerError(f"{self.path}: {design.problem}. Nothing was changed. Restore it from a copy.")
        return design

    def _note_design(self, what: str, details: Mapping[str, Any]) -> None:
        """Add an event of a design with its hash and that of the event before it."""
        design = self.design()
        previous = "" if design is None else str(design.events[-1].details["sha256"])
        content = parse_json(canonical_json({**details, "previous": previous}))
        self._run(
            "INSERT INTO events (time, trial, what, details) VALUES (?, NULL, ?, ?)",
            *(_now(), what, canonical_json({**content, "sha256": event_hash(content)})),
        )

    # conditions and sittings

    def add_condition(
        self, name: str, condition_hash: str, settings: Mapping[str, Any], *, n_generations: int, n_cells: int
    ) -> None:
        """Take in a condition; nothing when it is there already.

        Raises:
            LedgerError: it is there with other settings, or its numbers are another version's.
        """
        with self._writing():
            known = self._one("SELECT hash, results_version FROM conditions WHERE name = ?", name)
            if known is None:
                self._run(
                    "INSERT INTO conditions VALUES (?, ?, ?, ?, ?, ?, NULL)",
                    *(name, condition_hash, RESULTS_VERSION, _json(settings), n_generations, n_cells),
                )
            elif known["hash"] != condition_hash:
                raise LedgerError(
                    f"{self.path} holds trials of condition {name!r} with other settings. Give the condition another "
                    "name, or name another folder."
                )
            elif known["results_version"] != RESULTS_VERSION:
                raise LedgerError(
                    f"The trials of condition {name!r} in {self.path} were planned by results version "
                    f"{known['results_version']}; this realitygap breeds generations by version {RESULTS_VERSION}, "
                    "which may differ. Use the version that began it."
                )

    def begin_sitting(
        self,
        label: str,
        port: str,
        robot: Mapping[str, Any],
        preflight: Mapping[str, Any],
        names: Iterable[str],
    ) -> int:
        """Note which robot drives now, for these conditions.

        Returns:
            The sitting's number.

        Raises:
            LedgerError: a condition was driven by the other of an emulated and a real robot.
        """
        with self._writing():
            for name in names:
                self._refuse_mixing(name, label)
            return self._run(
                "INSERT INTO sittings (began, label, port, robot, preflight) VALUES (?, ?, ?, ?, ?)",
                *(_now(), label, port, _json(robot), _json(preflight)),
            )

    def end_sitting(self, sitting: int) -> None:
        """Note that the robot was let go."""
        with self._writing():
            self._run("UPDATE sittings SET ended = ? WHERE id = ?", _now(), sitting)

    # generations

    def plan(self, generations: Sequence[Generation], turns: Sequence[Turn]) -> None:
        """Plan generations, and trials of all their individuals in the order of `turns`."""
        with self._writing():
            for each in generations:
                run = (each.condition, each.replicate, each.generation)
                self._run("INSERT INTO generations VALUES (?, ?, ?, ?, NULL)", *run, _now())
                for one in each.individuals:
                    self._run(
                        "INSERT INTO individuals VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, NULL, NULL, NULL, NULL)",
                        *(*run, one.individual, one.species, _json(list(one.parents)), one.nodes),
                        *(_json(one.genome), str(one.key)),
                    )
            for turn in turns:
                trial = self._insert_trial(turn, attempt=0)
                self._note_event(trial, "planned", {})

    def close_generation(
        self,
        condition: str,
        replicate: int,
        generation: int,
        fitness: Sequence[float],
        novelty: Sequence[float | None],
        *,
        cells: Sequence[Sequence[int]] | None = None,
    ) -> None:
        """Freeze the scores of a generation, with what selection made of them.

        Args:
            condition, replicate, generation: Generation of a run.
            fitness: (n,) fitness in the order of individuals.
            novelty: (n,) novelty in the order of individuals; None if selection uses something else.
            cells: Cells from which fitness and novelty were computed. A person may have entered others meanwhile.

        Raises:
            LedgerError: a trial of it is not scored, or scored otherwise, or it is closed.
        """
        run = (condition, replicate, generation)
        with self._writing():
            trials = [each for each in self.trials(*run) if each.state != "void"]
            unscored = [each.individual for each in trials if each.state != "scored"]
            if unscored or len(trials) != len(fitness):
                raise LedgerError(
                    f"Generation {generation} of {condition!r}, run {replicate}, cannot be closed: individuals "
                    f"{unscored} are not scored."
                )
            others = [
                each.trial
                for each in trials
                if cells is not None and each.cells != tuple(cells[each.individual])
            ]
            if others:
                raise LedgerError(
                    f"Other cells of trials {others} were entered while the generation was being closed; it "
                    "stays open, and all entries are saved. Run the same command again."
                )
            changed = self._count(
                "UPDATE generations SET closed = ? WHERE condition = ? AND replicate = ? AND generation = ? AND "
                "closed IS NULL",
                *(_now(), *run),
            )
            if not changed:
                raise LedgerError(
                    f"Generation {generation} of {condition!r}, run {replicate}, is closed, and cannot be closed again."
                )
            for trial in trials:
                self._run(
                    "UPDATE individuals SET fitness = ?, novelty = ?, trial = ?, score = (SELECT max(id) FROM scores "
                    "WHERE trial = ? AND role = 'score' AND undone IS NULL) "
                    "WHERE condition = ? AND replicate = ? AND generation = ? AND individual = ?",
                    *(fitness[trial.individual], novelty[trial.individual], trial.trial, trial.trial),
                    *(*run, trial.individual),
                )

    # trials

    def start(self, number: int, sitting: int) -> None:
        """A planned trial begins; call before its robot moves. The first one gives its condition its label.

        Raises:
            LedgerError: the condition was driven by the other of an emulated and a real robot.
        """
        with self._writing():
            name = self._require(number, "planned").condition
            (label,) = self._one("SELECT label FROM sittings WHERE id = ?", sitting) or (None,)
            self._refuse_mixing(name, label)
            self._run("UPDATE conditions SET label = ? WHERE name = ? AND label IS NULL", label, name)
            self._run(
                "UPDATE trials SET state = 'running', sitting = ?, started = ? WHERE id = ?",
                *(sitting, _now(), number),
            )
            self._note_event(number, "running", {"sitting": sitting})

    def finish(self, number: int, record: TrialRecord, score: Score | None = None) -> None:
        """Keep a running trial that has ended, and counts; with a score it is scored, too."""
        with self._writing():
            self._keep_steps(number, record)
            self._drive(number, {"end": record.end})
            if score is not None:
                self._score(number, score, "score")

    def interrupt(self, number: int, record: TrialRecord) -> None:
        """Store a running trial that was cut off or not scored. `settle` decides whether it counts."""
        with self._writing():
            self._keep_steps(number, record)
            self._note_event(number, "interrupted", {"end": record.end, "problem": record.problem})

    def settle(self, number: int, verdict: Literal["void", "driven"], reason: str) -> None:
        """Say what becomes of a running trial that was cut off: void, to be driven again, or driven."""
        with self._writing():
            self._require(number, "running", "driven")
            if verdict == "void":
                self._void(number, reason)
            else:
                self._drive(number, {"reason": reason})

    def score(self, number: int, score: Score, role: ScoreRole = "score") -> None:
        """Enter cells: what selection counts, what a second person counts, or a correction once that is frozen."""
        self.score_all({number: score}, role)

    def score_all(self, scores: Mapping[int, Score], role: ScoreRole = "score") -> None:
        """Enter the cells of several trials by number: all of them, or none if one is refused."""
        with self._writing():
            for number, score in scores.items():
                self._score(number, score, role)

    def undo(self, number: int) -> None:
        """Withdraw the score of a trial whose generation is not closed, so that a new one can be entered."""
        with self._writing():
            self._refuse_closed(self._require(number, "scored"))
            self._run(
                "UPDATE scores SET undone = ? WHERE trial = ? AND role = 'score' AND undone IS NULL",
                _now(),
                number,
            )
            self._run("UPDATE trials SET state = 'driven' WHERE id = ?", number)
            self._note_event(number, "undone", {})

    def void(self, number: int, reason: str) -> None:
        """Void a trial. A study plans another attempt in its place; a command drives one when it resumes.

        Raises:
            LedgerError: its generation is closed, it is void already, or no reason is given.
        """
        with self._writing():
            self._refuse_closed(self._require(number, "running", "driven", "scored"))
            self._void(number, reason)

    def note(self, text: str, who: str, number: int | None = None) -> None:
        """Add a remark on a trial or on the whole ledger."""
        if not text.strip():
            raise LedgerError("An empty note was not saved. Enter a text.")
        with self._writing():
            if number is not None:
                self.trial(number)
            self._run(
                "INSERT INTO notes (trial, text, who, time) VALUES (?, ?, ?, ?)", number, text, who, _now()
            )

    # inside

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        """Run one transaction, which is stored as a whole or not at all."""
        with speaking(self.path):
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._commit()
            except BaseException:
                with contextlib.suppress(sqlite3.Error):
                    if self._connection.in_transaction:
                        self._connection.execute("ROLLBACK")
                raise

    def _commit(self) -> None:
        self._connection.execute("COMMIT")

    def _run(self, command: str, *values: Any) -> int:
        """Run a command. Return the number of the inserted row."""
        return int(self._connection.execute(command, values).lastrowid or 0)

    def _take_over(self, observations: Observations) -> None:
        """Take in trials and notes that were saved elsewhere."""
        trials = (*observations.trials, *observations.under_way)
        free = 1 + max((trial.number for trial in trials), default=0)  # then each number means what it did
        for trial in trials:
            is_free = (
                trial.number >= 0 and self._one("SELECT id FROM trials WHERE id = ?", trial.number) is None
            )
            self._append(trial, None, trial.number if is_free else free)
            free += not is_free
        for note in observations.notes:
            row = self._one("SELECT max(id) AS id FROM trials WHERE number = ?", note["trial"])
            number = None if row is None else row["id"]
            self._run(
                "INSERT INTO notes (trial, text, who, time) VALUES (?, ?, ?, ?)",
                *(number, note["text"], note["who"], note["time"]),
            )

    def _append(self, trial: TrialRecord, time: str | None, new: int | None = None) -> None:
        """Save the state of a trial, at a time if that is known, under a new number if it is another trial."""
        key = (trial.purpose, trial.number, self._controller(trial.genome))
        rows = self._all(
            "SELECT id, state FROM trials WHERE purpose = ? AND number = ? AND controller IS ? ORDER BY place",
            *key,
        )
        row = rows[-1] if rows else None
        is_withdrawn = row is not None and (row["id"], row["state"]) == (
            self._begun,
            "void",
        )  # by a person, meanwhile
        is_new = (
            row is None or trial.end == EndReason.RUNNING or (row["state"] == "void" and not is_withdrawn)
        )
        if row is not None and row["state"] == "scored" and not is_taken_back(trial):
            is_new = True
            if is_whole(trial) and self.record(row["id"]).start == trial.start:
                self._void(row["id"], "another record replaced it")
        elif row is not None and is_new and row["state"] in ("running", "driven"):
            self._void(row["id"], "it did not end, and was driven again")
        if row is None or is_new:
            (place,) = self._one("SELECT coalesce(max(place), 0) + 1 FROM trials") or (1,)
            number = self._run(
                "INSERT INTO trials (id, attempt, place, state, end, started, purpose, number, controller, record) "
                "VALUES (?, ?, ?, 'running', 'running', ?, ?, ?, ?, '{}')",
                *(new, len(rows), place, time, *key),
            )
            self._note_event(number, "running", {})
        else:
            number = row["id"]
        values = trial_to_dict(trial)
        del values["genome"]
        self._run(
            "UPDATE trials SET end = ?, problem = ?, n_steps = ?, stalls = ?, record = ? WHERE id = ?",
            *(trial.end, trial.problem or None, len(trial.commands), trial.n_stalls),
            *(json.dumps(values, separators=(",", ":"), allow_nan=False), number),
        )
        self._begun = number if trial.end in UNDER_WAY else 0
        if trial.end == EndReason.RUNNING or (is_withdrawn and not is_new):
            return
        if trial.end != EndReason.DRIVEN and not is_whole(trial):
            self._void(number, trial.problem or trial.end)
            return
        self._run("UPDATE trials SET state = 'driven', driven = ? WHERE id = ?", time, number)
        self._note_event(number, "driven", {"end": trial.end})
        if is_whole(trial):
            self._enter(number, Score(trial.cells, OBSERVER if trial.cells else ROBOT), "score")

    def _controller(self, genome: str) -> int | None:
        """Return the number of a controller; None if there is none."""
        if not genome:
            return None
        row = self._one("SELECT id FROM controllers WHERE genome = ?", genome)
        return (
            self._run("INSERT INTO controllers (genome) VALUES (?)", genome)
            if row is None
            else int(row["id"])
        )

    def _insert_trial(self, turn: Turn, attempt: int, place: int | None = None) -> int:
        if place is None:
            (most,) = self._one("SELECT coalesce(max(place), 0) FROM trials") or (0,)
            place = most + 1
        return self._run(
            "INSERT INTO trials "
            "(condition, replicate, generation, individual, attempt, place, sheet, pen, code, state) "
            "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, 'planned')",
            *(turn.condition, turn.replicate, turn.generation, turn.individual, attempt, place),
            *(turn.sheet, turn.pen, turn.code),
        )

    def _keep_steps(self, number: int, record: TrialRecord) -> None:
        """Keep a row for each command, and one with a command of 0, 0 for a look after the last."""
        self._require(number, "running")
        readings = [*record.readings.tolist(), record.last_readings.tolist()]
        stalled = [*record.stalled.tolist(), record.last_stalled]
        commands = [*record.commands.tolist(), (0.0, 0.0)]
        rows = zip(record.times.tolist(), record.raw.tolist(), readings, stalled, commands, strict=False)
        self._connection.executemany(
            "INSERT INTO steps VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
            [
                (number, k, time, _json(raw), _json(near), is_stalled, *command)
                for k, (time, raw, near, is_stalled, command) in enumerate(rows)
            ],
        )
        self._run(
            "UPDATE trials SET end = ?, problem = ?, n_steps = ?, stalls = ? WHERE id = ?",
            *(record.end, record.problem or None, len(record.commands), record.n_stalls, number),
        )

    def _drive(self, number: int, details: Mapping[str, Any]) -> None:
        self._run(
            "UPDATE trials SET state = 'driven', driven = ?, stalls = coalesce(stalls, 0) WHERE id = ?",
            _now(),
            number,
        )
        self._note_event(number, "driven", details)

    def _score(self, number: int, score: Score, role: ScoreRole) -> None:
        cells = [] if score.who == ROBOT else self._checked(number, score.cells)
        trial = self._require(number, *(("driven",) if role == "score" else ("driven", "scored")))
        if role == "score":
            self._refuse_closed(trial)
        if role == "correction" and not trial.is_closed:
            raise LedgerError(
                f"The generation of trial {number} is not closed yet: withdraw its score (undo) and enter a new one."
                if trial.condition
                else f"Trial {number} of a command needs no correction: withdraw its score (undo) and enter a new one."
            )
        if role == "second" and score.who in self._counters(number):
            raise LedgerError(
                f"{score.who!r} already counted the cells of trial {number}. A second count must be by "
                "another person: name them (--who NAME). Nothing was entered."
            )
        self._enter(number, replace(score, cells=cells), role)

    def _enter(self, number: int, score: Score, role: ScoreRole) -> None:
        """Enter a score, which was checked."""
        if role == "score":
            self._run("UPDATE trials SET state = 'scored' WHERE id = ?", number)
        self._run(
            "INSERT INTO scores (trial, cells, n_ends, path, role, who, time) VALUES (?, ?, ?, ?, ?, ?, ?)",
            *(number, _json(list(score.cells)), score.n_ends),
            *(None if score.path is None else _json(score.path), role, score.who, _now()),
        )
        details: dict[str, Any] = {"who": score.who, "n_cells": len(score.cells)}
        if score.photo is not None:
            details["photo"] = asdict(score.photo)
        self._note_event(number, {"score": "scored"}.get(role, role), details)

    def _refuse_mixing(self, condition: str, label: str | None) -> None:
        known = self._one("SELECT label FROM conditions WHERE name = ?", condition)
        if known is not None and known["label"] not in (None, label):
            raise LedgerError(
                f"The trials of condition {condition!r} in {self.path} are {known['label']}, but this robot's would "
                f"be {label}. They cannot be combined. Name another folder (--out DIR)."
            )

    def _counters(self, number: int) -> set[str]:
        """Return the people who entered the score that counts."""
        rows = self._all(
            "SELECT who FROM scores WHERE trial = ? AND role = 'score' AND undone IS NULL", number
        )
        return {row["who"] for row in rows}

    def _checked(self, number: int, cells: Sequence[int]) -> list[int]:
        """Return cells of a trial, each at most once, all within its grid, and at least the one it starts in."""
        trial = self.trial(number)
        if trial.purpose in NO_LINE or (not trial.condition and self.head().observe == "readings"):
            raise LedgerError(
                f"The cells of trial {number} ({trial.name}) are not counted. Nothing was entered."
            )
        (n_cells,) = (
            self._one("SELECT n_cells FROM conditions WHERE name = ?", trial.condition)
            or self._one("SELECT n_cells FROM head")
            or (0,)
        )
        return checked_cells(cells, n_cells)

    def _void(self, number: int, reason: str) -> None:
        if not reason.strip():
            raise LedgerError(f"Trial {number} cannot be void without a reason. Give a reason.")
        trial = self.trial(number)
        self._run("UPDATE trials SET state = 'void', reason = ? WHERE id = ?", reason, number)
        self._note_event(number, "void", {"reason": reason, "was": trial.state})
        if not trial.condition:
            return
        turn = Turn(
            trial.condition, trial.replicate, trial.generation, trial.individual,
            trial.sheet, trial.pen, f"{trial.code.split('-')[0]}-{trial.attempt + 2}",
        )  # fmt: skip
        again = self._insert_trial(turn, trial.attempt + 1, trial.place)
        self._note_event(again, "planned", {"in_place_of": number})

    def _require(self, number: int, *states: TrialState) -> Trial:
        trial = self.trial(number)
        if trial.state not in states:
            raise LedgerError(
                f"Trial {number} ({trial.name}) is {trial.state}; that can be done only while it is "
                f"{' or '.join(states)}. Nothing was changed."
            )
        return trial

    def _refuse_closed(self, trial: Trial) -> None:
        if trial.is_closed:
            raise LedgerError(
                f"The generation of trial {trial.trial} ({trial.name}) is closed: its score bred the next one and "
                "stays. Enter a correction, which reports use, or a note."
            )

    def _note_event(self, trial: int, what: str, details: Mapping[str, Any]) -> None:
        self._run(
            "INSERT INTO events (time, trial, what, details) VALUES (?, ?, ?, ?)",
            _now(),
            trial,
            what,
            _json(details),
        )


def _json(value: Any) -> str:
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)


def _now() -> str:
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")


def _short(value: Any) -> str:
    if isinstance(value, Mapping):
        return f"{value.get('name', '...')!r}"
    return repr(value)
