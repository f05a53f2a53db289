"""Deviations of the trials in a ledger from their locked design: computed from its events, never typed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from realitygap._wording import counted, deviations_sentence
from realitygap.errors import StudyError
from realitygap.records import (
    AMENDED,
    RESUMED,
    UNBLINDED,
    DrivenTrial,
    Ledger,
    LockedDesign,
    secret_path,
)

from ._design import count_complete, driven_trials, open_design, planned_blocks, progress
from ._paired import unblinded_advice


@dataclass(frozen=True)
class DesignReport:
    """A locked design, and how the trials so far deviate from it.

    Attributes:
        design: The design, and its changes.
        progress: How much of it is driven, in words.
        deviations: A sentence for each deviation; empty if there is none.
    """

    design: LockedDesign
    progress: str
    deviations: tuple[str, ...]

    @property
    def line(self) -> str:
        """The deviations in one line."""
        return deviations_sentence(self.deviations)

    @property
    def sentences(self) -> list[str]:
        """The design and its deviations, a line each."""
        lock, design = self.design.lock, self.design.design
        blind = ""
        if self.design.was_blind:
            blind = ", blind" if self.design.is_blind else ", unblinded"
        lines = [
            f"Design of `{design['command']}`, locked by {lock['who']} ({lock['time']}, realitygap {lock['version']})"
            f"{blind}",
            f"SHA-256: {self.design.sha256}",
        ]
        if self.design.of(AMENDED):
            lines.append(f"SHA-256 of the last change: {self.design.events[-1].details['sha256']}")
        lines += [f"{self.progress[:1].upper()}{self.progress[1:]}.", str(design["exclusion"])]
        if self.design.is_blind and self.design.arms:
            lines.append(f"Codes of the arms: {', '.join(sorted(self.design.codes().values()))}")
        if not self.deviations:
            return [*lines, self.line]
        return [*lines, "Deviations from the locked plan:", *(f"* {each}" for each in self.deviations)]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON; while the design is blind, with codes in place of names of arms."""
        design = dict(self.design.design)
        if self.design.is_blind:
            codes = self.design.codes()
            design["arms"] = [{"code": code} for code in sorted(codes.values())]
            design = {name: value for name, value in design.items() if name not in ("names", "others")}
        return {
            "sha256": self.design.sha256,
            **{name: self.design.lock[name] for name in ("who", "time", "version")},
            "is_blind": self.design.is_blind,
            "progress": self.progress,
            "deviations": list(self.deviations),
            "design": design,
        }


def design_report(source: Ledger | Path | str) -> DesignReport | None:
    """Return the locked design of trials with all deviations from it, as `realitygap trials show` without a trial.

    Args:
        source: A ledger, a file of trials, or a folder of a study.

    Returns:
        The report; None if no design is locked.

    Raises:
        RecordError: The trials cannot be read.
    """
    if not isinstance(source, Ledger):
        with open_design(source, writable=False) as ledger:
            return design_report(ledger)
    locked = source.design()
    if locked is None:
        return None
    return DesignReport(locked, progress(source, locked), tuple(_deviations(source, locked)))


def check_unblinded(file: Path | str | None) -> tuple[str, ...]:
    """Return hash and deviations of the design of a command whose trials are all driven; empty without a locked one.

    Args:
        file: File of its trials; None if there is none.

    Raises:
        StudyError: The design is blind, so its results are not shown.
    """
    report = None if file is None else design_report(file)
    if report is None:
        return ()
    if report.design.is_blind:
        raise StudyError(
            f"{report.progress}. The design is blind, so no result is shown. Unblind it, then run the same command "
            f'again: realitygap trials unblind {file} --reason "all trials are driven"'
        )
    return (f"SHA-256 of the locked design: {report.design.sha256}.", report.line)


def _deviations(ledger: Ledger, locked: LockedDesign) -> Iterator[str]:
    if locked.problem:
        yield f"The record was edited: {locked.problem}."
    if locked.is_blind and locked.secret is None:
        yield f"The secret of the codes, {secret_path(ledger.path).name}, is missing or was replaced."
    yield from _amendments(locked)
    yield from _sessions(ledger, locked)
    trials = ledger.driven()
    yield from _robots(ledger)
    if locked.design.get("unit"):
        yield from _order(trials, locked)
    else:
        yield from _void(ledger)
    yield from _batteries(ledger, locked)
    yield from _ends(ledger, locked)


def _amendments(locked: LockedDesign) -> Iterator[str]:
    for event in locked.of(AMENDED):
        details = event.details
        before, after = details.get("before", {}), details.get("after", {})
        changes = "".join(f" {name}: {before.get(name)} → {value}." for name, value in after.items())
        yield (
            f"Amended by {details.get('who')} after {counted(event.n_trials, 'trial')} ({details.get('time')}): "
            f"{details.get('reason')}.{changes}"
        )


def _sessions(ledger: Ledger, locked: LockedDesign) -> Iterator[str]:
    """Yield each change of the program or the robot."""
    first = {"version": locked.lock["version"], "target": locked.lock["design"].get("target", {})}
    sessions = [(first, 0), *((event.details, event.n_trials) for event in locked.of(RESUMED))]
    for (before, _), (after, n) in pairwise(sessions):
        since = f"From trial {n + 1} on"
        if before["version"] != after["version"]:
            yield f"{since}: realitygap {after['version']}, before {before['version']}."
        there, here = (dict(each.get("target") or {}) for each in (before, after))
        for name in sorted(there.keys() | here.keys()):
            if there.get(name) != here.get(name):
                yield f"{since}: the target's {name} is {_shown(here.get(name))}, before {_shown(there.get(name))}."


def _robots(ledger: Ledger) -> Iterator[str]:
    """Yield each change of the robot between the sittings of a study."""
    for before, after in pairwise(ledger.robots()):
        yield f"Another robot: {_shown(after)}, before {_shown(before)}."


def _shown(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{name} {each}" for name, each in value.items()) or "unknown"
    return str(value) if value not in (None, "") else "unknown"


def _order(trials: Sequence[DrivenTrial], locked: LockedDesign) -> Iterator[str]:
    """Yield trials that are not in the plan or out of their order, and blocks with void or repeated trials."""
    unit = str(locked.design["unit"])
    blocks = planned_blocks(locked)
    places = {key: (k, turn) for k, block in enumerate(blocks) for turn, key in enumerate(block)}
    sequence = {place: n for n, place in enumerate(sorted(places.values()))}
    others = set(locked.design.get("others", ()))
    furthest, by_block = -1, dict[int, list[DrivenTrial]]()
    for trial in trials:
        place = places.get((trial.number, trial.controller))
        if place is None:
            if trial.controller not in others:
                yield f"Trial {trial.trial} is not in the plan: it has another controller or number."
            continue
        earlier = by_block.setdefault(place[0], [])
        turn = sequence[place]
        is_repeated = turn <= furthest and any(each.state == "void" for each in earlier)
        if turn != furthest + 1 and not is_repeated:
            due = next((key for key, at in sequence.items() if at == furthest + 1), None)
            expected = "no trial" if due is None else f"one of {unit} {due[0] + 1}"
            yield f"Trial {trial.trial}, of {unit} {place[0] + 1}, is out of order: {expected} was due."
        furthest = max(furthest, turn)
        earlier.append(trial)
    for block, driven in sorted(by_block.items()):
        void = [each for each in driven if each.state == "void"]
        if void:
            reasons = ", ".join(f"trial {each.trial} ({each.reason})" for each in void)
            last = {(each.number, each.controller): each.state for each in driven}
            is_whole = all(last.get(key) == "scored" for key in blocks[block])
            again = " It was driven again." if is_whole else ""
            yield f"{unit.capitalize()} {block + 1} has void trials: {reasons}.{again}"
        whole = [(each.number, each.controller) for each in driven if each.state == "scored"]
        if len(whole) > len(set(whole)):
            yield f"{unit.capitalize()} {block + 1} has a trial twice, and both count."


def _void(ledger: Ledger) -> Iterator[str]:
    for where, trial in driven_trials(ledger):
        if trial.state == "void":
            yield f"Trial {trial.trial}{where} is void: {trial.reason}."


def _batteries(ledger: Ledger, locked: LockedDesign) -> Iterator[str]:
    least = (locked.design.get("target") or {}).get("least_battery_v")
    if not isinstance(least, int | float):
        return
    for where, trial in driven_trials(ledger):
        if trial.battery_v is not None and trial.battery_v < least:
            yield f"Trial {trial.trial}{where} began with {trial.battery_v:.2f} V, expected at least {least:.2f} V."


def _ends(ledger: Ledger, locked: LockedDesign) -> Iterator[str]:
    """Yield an end before the plan or after it, an early unblinding, and another test than the locked one."""
    unit, blocks = str(locked.design.get("unit") or ""), int(locked.design.get("blocks", 0))
    if not unit:
        return
    known = ledger.comparison()
    if known is not None and locked.design["test"] not in (None, known.plan.get("test")):
        yield "The test is not the one of the locked design."
    n, stopped_at = count_complete(ledger, locked), None
    if unit == "pair" and known is not None:
        look = unblinded_advice(ledger).comparisons[0].look
        stopped_at = look.n if look.is_stop else None
        if look.claimed_at is not None and look.claimed_at < look.n:
            yield f"{counted(look.n - look.claimed_at, unit)} were driven after the test had ended."
    planned = blocks if stopped_at is None else min(stopped_at, blocks)
    for event in locked.of(UNBLINDED):
        complete = int(event.details.get("complete", 0))
        if complete < planned:
            yield (
                f"Unblinded early, by {event.details.get('who')} ({event.details.get('time')}), after {complete} of "
                f"{counted(planned, unit)}: {event.details.get('reason')}."
            )
    if not locked.is_blind and n < planned:
        yield f"Not at the planned end: {n} of {counted(planned, unit)} complete."
