"""The trials of a ledger as people who count cells see them, and what they say of them."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from realitygap.errors import LedgerError, RealityGapError
from realitygap.platforms import emulated_robots, is_physical
from realitygap.playback import RobotShape
from realitygap.records import (
    LEDGER_NAME,
    Ledger,
    Score,
    ScoreRole,
    Trial,
    ledger_stamp,
    settings_of_condition,
)
from realitygap.runs import Condition
from realitygap.study import DesignReport, advise, design_report
from realitygap.world import Arena

from ._mistakes import refuse_unnamed
from ._scoring_files import (
    FOLDER,
    Draft,
    Proposal,
    forget_draft,
    keep_draft,
    read_draft,
    read_drawn,
    read_proposals,
)

LONGEST_NOTE = 2000


@dataclass(frozen=True)
class CountedTrial:
    """A trial, and who has counted it.

    Attributes:
        trial: As the ledger has it.
        title: What to call it; its code where counting is blind.
        pen: The color that it was drawn with.
        label: Label of the robot that drives its condition; empty before one was met.
        first, second: Who counted it; empty where nobody has.
        is_corrected: Whether a correction was entered after its generation was closed.
        notes: What was noted of it.
    """

    trial: Trial
    title: str
    pen: str
    label: str
    first: str
    second: str
    is_corrected: bool
    notes: tuple[str, ...]

    @property
    def number(self) -> int:
        """Number of the trial."""
        return self.trial.trial

    def role_of(self, who: str) -> ScoreRole | None:
        """Return the role in which this person may count the trial now; None if there is none."""
        if self.trial.state == "driven":
            return "score"
        if self.trial.state != "scored" or who in (self.first, self.second):
            return None
        return None if self.second else "second"


@dataclass(frozen=True)
class CountCard:
    """Facts that a page shows while a trial is counted.

    Attributes:
        draft: What they have tapped so far.
        arena: Where the trial was driven.
        proposals: What a photograph or a camera saw, the last one first.
        line: (x, y) [m] that an emulated robot drew; empty if nobody saw it.
    """

    draft: Draft
    arena: Arena
    proposals: list[Proposal]
    line: list[tuple[float, float]]


class Counts:
    """The trials of a study in the order of their turns.

    `trials`, `trial`, `proposals`, `arena` and `keep` wait for nothing, as pages need it. All other methods wait for
    the disk, and for other programs that write to the ledger: pages call them in threads.

    Args:
        folder: Of the study.
        description: What it says of itself.

    Attributes:
        design: The locked design with all deviations, as last read; None without one.
    """

    def __init__(self, folder: Path, description: dict[str, Any]) -> None:
        self._folder = folder
        self.name = folder.name
        self.description = description
        self._settings = {each["name"]: each["settings"] for each in description["conditions"]}
        trials = description.get("trials") or {}
        self.is_blind = bool(trials.get("blind"))
        self._pens = list(trials.get("pens") or ["black"])
        self._arenas: dict[str, Arena] = {}
        self._stamp: tuple[Any, ...] = ()
        self._found: list[CountedTrial] = []
        self.design: DesignReport | None = None
        self._proposed: dict[int, list[Proposal]] = {}
        self._proposed_stamp: tuple[Any, ...] = ()
        self._drafts: dict[tuple[int, str, ScoreRole], Draft] = {}
        self._looking = threading.Lock()
        self._keeper = ThreadPoolExecutor(1)  # one: drafts are written in the order of the taps

    @property
    def n_planned(self) -> int:
        """Number of trials in the whole study on a robot, without those that are repeated."""
        neat = [each["neat"] for each in self._settings.values() if is_physical(each)]
        return int(self.description["replicates"]) * sum(
            int(each["population"]) * int(each["generations"]) for each in neat
        )

    @property
    def emulated_robot(self) -> str:
        """Port of an emulated robot of the platform that drives; empty if the platform has none."""
        names = [each["platform"] for each in self._settings.values() if is_physical(each)]
        return next((port for port in emulated_robots() if port.partition(":")[0] in names), "")

    def look(self) -> list[CountedTrial]:
        """Read the trials again if the ledger has changed, and their proposals likewise; return all trials.

        Raises:
            LedgerError: The ledger cannot be read.
        """
        with self._looking:
            path = self._folder / LEDGER_NAME
            stamp = ledger_stamp(path)
            if stamp and stamp != self._stamp:
                with Ledger.open(path, writable=False) as ledger:
                    self._found = self._read(ledger)
                    self.design = design_report(ledger)
                self._stamp = stamp
            stamp = (self._stamp, _changed(self._folder / FOLDER))
            if stamp != self._proposed_stamp:
                self._proposed = {
                    each.number: read_proposals(self._folder, each.number) for each in self._found
                }
                self._proposed_stamp = stamp
            for condition in {each.trial.condition for each in self._found}:
                self.arena(condition)
            return self._found

    def looks(self) -> str:
        """Return what complete runs show of the conditions on a robot; nothing of one condition, or of blind ones."""
        physical = [each for each in self._settings.values() if is_physical(each)]
        if not (self._folder / LEDGER_NAME).exists() or len(physical) < 2 or self.is_blind:
            return ""
        try:
            return advise(self._folder).summary
        except RealityGapError as error:
            return str(error)

    @property
    def has_begun(self) -> bool:
        """True if a trial has begun, so that the design cannot be locked any more."""
        return any(each.trial.state != "planned" for each in self._found)

    def trials(self) -> list[CountedTrial]:
        """Trials as last read."""
        return self._found

    def trial(self, number: int) -> CountedTrial:
        """Return a trial by its number.

        Raises:
            LedgerError: There is none.
        """
        for each in self.trials():
            if each.number == number:
                return each
        raise LedgerError(f"There is no trial {number} in {self._folder.name}.")

    def arena(self, condition: str) -> Arena:
        """Return the arena of a condition."""
        if condition not in self._arenas:
            settings = settings_of_condition(self.description, condition)
            resolved = Condition.from_settings(condition, settings)
            self._arenas[condition] = resolved.arena.arena()
        return self._arenas[condition]

    def outlines(self, condition: str) -> tuple[tuple[tuple[float, float], ...], ...]:
        """Return the outlines of the robot's parts, (forward, left) [m]."""
        settings = settings_of_condition(self.description, condition)
        return RobotShape.of(Condition.from_settings(condition, settings).on).outlines

    def _read(self, ledger: Ledger) -> list[CountedTrial]:
        scores = [row for row in ledger.scores() if row["undone"] is None]
        who = {(row["trial"], row["role"]): row["who"] for row in scores}
        labels = {name: each["label"] or "" for name, each in ledger.conditions().items()}
        notes: dict[int, list[str]] = {}
        for note in ledger.notes():
            notes.setdefault(note["trial"], []).append(f"{note['who']}: {note['text']}")
        return [
            CountedTrial(
                trial=trial,
                title=trial.code if self.is_blind and not trial.is_closed else trial.name,
                pen=self._pens[trial.pen % len(self._pens)],
                label=labels.get(trial.condition, ""),
                first=who.get((trial.trial, "score"), ""),
                second=who.get((trial.trial, "second"), ""),
                is_corrected=(trial.trial, "correction") in who,
                notes=tuple(notes.get(trial.trial, ())),
            )
            for trial in ledger.trials()
        ]

    # what people say; each is in the ledger when it returns

    def score(self, number: int, draft: Draft, who: str, role: ScoreRole) -> None:
        """Enter the cells of a trial, and what they were confirmed from.

        Raises:
            LedgerError: The ledger does not allow it: the text says why.
        """
        self.score_all({number: draft}, who, role)

    def score_all(self, drafts: Mapping[int, Draft], who: str, role: ScoreRole = "score") -> None:
        """Enter the cells of several trials by their numbers; if one is refused, enter none of them.

        Raises:
            LedgerError: The ledger does not allow it: the text says why.
        """
        who = refuse_unnamed(who)
        seen = {number: self._proposal(number, draft.proposal) for number, draft in drafts.items()}
        scores = {
            number: Score(sorted(draft.cells), who)
            if (found := seen[number]) is None
            else found.score(sorted(draft.cells), who)
            for number, draft in drafts.items()
        }
        with self._writing() as ledger:
            ledger.score_all(scores, role)
            for number, found in seen.items():
                if found is not None and found.told:
                    ledger.note(found.told, who, number)
        for number in drafts:
            self._drafts.pop((number, who, role), None)
            self._keeper.submit(forget_draft, self._folder, number, who, role).result()

    def draft(self, number: int, who: str, role: ScoreRole) -> Draft:
        """Return the cells marked so far; for a first score without any, those of the last proposal."""
        draft = self._drafts.get((number, who, role)) or read_draft(self._folder, number, who, role)
        if draft is not None:
            return draft
        if role == "correction":
            return Draft(list(self.trial(number).trial.cells or ()))
        found = self.proposals(number)
        if role == "score" and found and found[0].is_usable:
            return Draft(found[0].cells, found[0].mark)
        return Draft([])

    def keep(self, number: int, who: str, role: ScoreRole, draft: Draft) -> Future[None]:
        """Save the cells that a person has tapped so far; the result is there when they are on the disk."""
        self._drafts[number, who, role] = draft
        return self._keeper.submit(keep_draft, self._folder, number, who, role, draft)

    def card(self, number: int, who: str, role: ScoreRole) -> CountCard:
        """Return the facts that a page shows while a trial is counted."""
        draft = self.draft(number, who, role)
        arena = self.arena(self.trial(number).trial.condition)
        return CountCard(draft, arena, self.proposals(number), read_drawn(self._folder, number))

    def proposals(self, number: int) -> list[Proposal]:
        """Return the proposals of photographs and cameras for a trial, the last one first."""
        return self._proposed.get(number, [])

    def _proposal(self, number: int, mark: str) -> Proposal | None:
        return next((each for each in self.proposals(number) if mark and each.mark == mark), None)

    def undo(self, number: int) -> None:
        """Take a score back unless its generation is closed."""
        with self._writing() as ledger:
            ledger.undo(number)

    def void(self, number: int, reason: str) -> None:
        """Declare a trial void; it is driven again."""
        with self._writing() as ledger:
            ledger.void(number, reason[:LONGEST_NOTE])

    def note(self, number: int | None, text: str, who: str) -> None:
        """Save a note about a trial."""
        with self._writing() as ledger:
            ledger.note(text[:LONGEST_NOTE], refuse_unnamed(who), number)

    @contextlib.contextmanager
    def _writing(self) -> Iterator[Ledger]:
        """Open the ledger for writing, and read it again afterwards."""
        with Ledger.open(self._folder / LEDGER_NAME) as ledger:
            yield ledger
        self.look()


def _changed(folder: Path) -> int:
    """Return when a file was last added to a folder or removed from it; 0 if there is no folder."""
    try:
        return folder.stat().st_mtime_ns
    except OSError:
        return 0
