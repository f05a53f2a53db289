"""`realitygap trials`: the trials of a study on a robot, or of another command, their scores, and notes."""

from __future__ import annotations

import getpass
import math
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import realitygap
from realitygap._limits import MOST_TABLE_BYTES, read_file
from realitygap._terminal import echo
from realitygap._wording import counted
from realitygap.errors import LedgerError, StudyError, did_you_mean

from ._designs import deviations_of, print_deviations
from ._export import write_trials
from ._grid_editor import pick_cells
from ._options import (
    Json,
    correct_option,
    export_option,
    print_json,
    second_option,
    who_option,
)
from ._tables import wide_console

if TYPE_CHECKING:
    from realitygap.records import Ledger, ScoreRole, Trial
    from realitygap.stats import Null
    from realitygap.study import DesignReport
    from realitygap.world import Arena

_WHAT = ("list", "show", "score", "undo", "void", "note", "export", "agreement", "advise", "amend", "unblind")
_READING = ("list", "show", "export", "agreement")
_PRINTING = ("list", "show", "agreement", "advise")
"""Actions that change nothing."""


_ONLY_SCORE = "Only for score"
_ONLY_DESIGNS = "Only for amend and unblind"


def trials(
    what: Annotated[
        str,
        typer.Argument(
            metavar="WHAT",
            help="Action: list, show, score, undo, void, note, export, agreement, advise, amend or unblind.",
        ),
    ],
    source: Annotated[
        Path,
        typer.Argument(metavar="TRIALS", help="Folder of results with a ledger, or file of trials."),
    ],
    trial: Annotated[
        str | None,
        typer.Argument(
            metavar="TRIAL", help="Number or code of a trial. [default: all driven trials, for score]"
        ),
    ] = None,
    cells: Annotated[
        str | None,
        typer.Option(metavar="LIST", help="Crossed cells, such as 0,1,13.", rich_help_panel=_ONLY_SCORE),
    ] = None,
    file: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="File with the cells of many trials: lines 'TRIAL: 0 1 13'. TRIAL is a number or code.",
            rich_help_panel=_ONLY_SCORE,
        ),
    ] = None,
    who: Annotated[str | None, who_option()] = None,
    second: Annotated[bool, second_option(_ONLY_SCORE)] = False,
    correct: Annotated[bool, correct_option(_ONLY_SCORE)] = False,
    text: Annotated[
        str | None,
        typer.Option(
            metavar="TEXT",
            help="Text of the note, or reason why the trial is void.",
            rich_help_panel="Only for note and void",
        ),
    ] = None,
    out: Annotated[Path | None, export_option("Only for export")] = None,
    margin: Annotated[
        float | None,
        typer.Option(
            metavar="M",
            help="Largest difference that counts as equivalent. [default: from the plan]",
            rich_help_panel="Only for advise",
        ),
    ] = None,
    null: Annotated[
        str | None,
        typer.Option(
            metavar="WHICH",
            help="Hypothesis of the test: distribution or mean. [default: from the plan, or distribution]",
            rich_help_panel="Only for advise",
        ),
    ] = None,
    format: Annotated[
        str | None,
        typer.Option(
            metavar="FORMAT",
            help="fieldtrial: a table that `fieldtrial import` reads (.csv). [default: by the ending of NAME]",
            rich_help_panel="Only for export",
        ),
    ] = None,
    success_from: Annotated[
        float | None,
        typer.Option(
            metavar="SCORE",
            help="Score from which a trial is a success, for fieldtrial.",
            rich_help_panel="Only for export",
        ),
    ] = None,
    task: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="Task that scores the trials for fieldtrial. [default: coverage]",
            rich_help_panel="Only for export",
        ),
    ] = None,
    reason: Annotated[
        str | None,
        typer.Option(metavar="TEXT", help="Reason for the change.", rich_help_panel=_ONLY_DESIGNS),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="New value of a setting of the design, such as trials=60. Repeatable.",
            rich_help_panel=_ONLY_DESIGNS,
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """List, show, score, annotate, and export trials.

    TRIALS is the folder of a study with trials on a robot, or a file in which gap, calibrate, transfer, or try saved
    theirs.

    The number of a cell is columns * row + column. Cell 0 is the lower left of the reachable cells. Without --cells and
    --file, you pick the cells in the terminal. undo removes a score until its generation is closed. After that, only
    --correct changes it: reports use the correction, and the evolution does not. If two people counted cells, agreement
    prints Cohen's kappa with its interval.

    When the command that saved the trials resumes, it uses the new cells, and drives void trials again. If you remove
    a score without a new one, the command asks for it.

    advise prints what the trials so far show of two that are compared: controllers, conditions, strategies, or
    platforms. You may look after each pair, and stop at any time. TRIALS may also be the folder of a transfer.

    Example: realitygap trials list results/paper-robot

    Example: realitygap trials score results/paper-robot 12 --cells 13,14,15,27 --who anna

    Example: realitygap trials score results/paper-robot --file sheet-2.txt --second --who ben

    Example: realitygap trials void results/paper-robot 12 --text "the pen fell out"

    Example: realitygap trials void gap.sqlite 7 --text "it was pushed"

    Example: realitygap trials show gap.sqlite 7

    Example: realitygap trials export results/paper-robot -o trials.parquet

    Example: realitygap trials export gap.sqlite --format fieldtrial --success-from 0.3 -o trials.csv

    Example: realitygap trials agreement results/paper-robot

    Example: realitygap trials advise pairs.sqlite --margin 0.05

    Example: realitygap trials show pairs.sqlite

    Example: realitygap trials amend pairs.sqlite --set trials=60 --reason "scores vary more than planned"

    Example: realitygap trials unblind pairs.sqlite --reason "all pairs are complete"

    In Python: realitygap.records.Ledger.open("results/paper-robot/ledger.sqlite").trials()
    """
    if what not in _WHAT:
        raise StudyError(f"Cannot {what!r} trials. {did_you_mean(what, _WHAT)}")
    if cells is not None and file is not None:
        raise StudyError("--cells and --file exclude each other: a file has the cells of many trials.")
    if second and correct:
        raise StudyError("--second and --correct exclude each other: a correction replaces the first count.")
    if what != "score" and (cells is not None or file is not None or second or correct):
        raise StudyError(f"--cells, --file, --second and --correct go with score, not with {what}.")
    if file is not None and trial is not None:
        raise StudyError("--file names its trials itself. Leave the trial out.")
    if as_json and what not in _PRINTING:
        raise StudyError(f"--json is only for {', '.join(_PRINTING)}, not for {what}. Leave it out.")
    if out is not None and what != "export":
        raise StudyError(f"--out is only for export, not for {what}. Leave it out.")
    _check_format(what, format, success_from, task)
    if what != "advise" and (margin is not None or null is not None):
        raise StudyError(f"--margin and --null are only for advise, not for {what}. Leave them out.")
    is_change = what in ("amend", "unblind")
    if not is_change and (reason is not None or settings):
        raise StudyError(
            f"--reason and --set are only for amend and unblind, not for {what}. Leave them out."
        )
    if is_change and trial is not None:
        raise StudyError(f"{what} is about a whole design. Leave the trial {trial} out.")
    if what == "unblind" and settings:
        raise StudyError("--set is only for amend. Leave it out.")
    if what == "advise":
        _advise(source, margin, null, as_json=as_json)
        return
    if is_change:
        _change_design(what, source, _needed(reason, "--reason"), settings or [], who)
        return
    if what == "show" and trial is None and (report := realitygap.study.design_report(source)) is not None:
        _show_design(report, as_json=as_json)
        return
    name = who or getpass.getuser()
    with realitygap.records.open_ledger(source, writable=what not in _READING) as opened:
        if what == "list":
            _list(opened, as_json=as_json)
        elif what == "show":
            _show(opened, _number(opened, _needed(trial, "The number of a trial")), as_json=as_json)
        elif what == "export" and format is not None:
            _export_fieldtrial(opened, source, out, trial, success_from, task)
        elif what == "export":
            write_trials(source, out, () if trial is None else [_number(opened, trial)])
        elif what == "agreement":
            _agreement(source, as_json=as_json)
        elif what == "score":
            role: ScoreRole = "second" if second else "correction" if correct else "score"
            _score(opened, trial, cells, file, name, role)
        elif what == "note":
            opened.note(_needed(text, "--text"), name, None if trial is None else _number(opened, trial))
            echo("Noted.")
        elif what == "undo":
            number = _number(opened, _needed(trial, "The number of a trial"))
            opened.undo(number)
            echo(f"The score of trial {number} is withdrawn. Enter a new one.")
        else:
            number = _number(opened, _needed(trial, "The number of a trial"))
            opened.void(number, _needed(text, "--text"))
            echo(f"Trial {number} is void; it will be driven again.")


def _check_format(what: str, format: str | None, success_from: float | None, task: str | None) -> None:
    """Raise an error if options of the format fieldtrial are used without it, or it lacks one."""
    if format is None and (success_from is not None or task is not None):
        raise StudyError("--success-from and --task go with --format fieldtrial. Add it, or leave them out.")
    if format is None:
        return
    if what != "export":
        raise StudyError(f"--format is only for export, not for {what}. Leave it out.")
    if format != "fieldtrial":
        raise StudyError(f"There is no format {format!r}. {did_you_mean(format, ['fieldtrial'])}")
    if success_from is None or not math.isfinite(success_from):
        raise StudyError(
            "fieldtrial has successes and no scores. Give the score from which a trial is a success: --success-from 0.3"
        )


def _export_fieldtrial(
    opened: Ledger,
    source: Path,
    out: Path | None,
    trial: str | None,
    success_from: float | None,
    task: str | None,
) -> None:
    if trial is not None:
        raise StudyError("--format fieldtrial exports all scored trials. Leave the trial out.")
    if out is None or out.suffix != ".csv":
        raise StudyError("Name the output with -o: a file that ends in .csv.")
    if hidden := _hidden(opened):
        raise StudyError(
            f"The conditions of {len(hidden)} trials are blind until their generation is closed. Export them then."
        )
    scorer = None if task is None else realitygap.study.task_named(task)
    n = realitygap.study.write_fieldtrial(source, out, success_from or 0.0, scorer)
    echo(f"Written: {out} ({counted(n, 'trial')})")


_LONGEST_NUMBER = 19
"""Digits of a number that surely fits into SQLite's."""


def _needed(value: str | None, what: str) -> str:
    if value is None:
        raise StudyError(f"{what} is missing. See `realitygap trials --help` for an example.")
    return value


def _number(opened: Ledger, text: str) -> int:
    """Return a trial's number, from itself or its code."""
    if text.isdecimal() and len(text) < _LONGEST_NUMBER:
        return opened.trial(int(text)).trial
    codes = {each.code: each.trial for each in opened.trials() if each.code}
    if text.upper() not in codes:
        raise LedgerError(
            f"{opened.path} has no trial {text!r}. `realitygap trials list` shows numbers and codes."
        )
    return codes[text.upper()]


def _score(
    opened: Ledger,
    trial: str | None,
    cells: str | None,
    file: Path | None,
    who: str,
    role: ScoreRole,
) -> None:
    if file is not None:
        entries: Iterable[dict[int, list[int]]] = [_read_file(opened, file)]
    elif cells is not None:
        entries = [{_number(opened, _needed(trial, "The number of a trial")): _cells(cells, "--cells")}]
    else:
        entries = _pick(opened, trial, role)
    n_entered = 0
    for given in entries:  # each as a whole or not at all
        opened.score_all(
            {number: realitygap.records.Score(found, who) for number, found in given.items()}, role
        )
        n_entered += len(given)
        for number, found in given.items():
            echo(f"Trial {number}: {len(set(found))} cells.")
    if not n_entered:
        echo("Nothing was entered.")


def _cells(text: str, where: str) -> list[int]:
    try:
        return [int(word) for word in text.replace(",", " ").split()]
    except ValueError:
        raise StudyError(f"{where}: expected numbers of cells such as 0,1,13, got {text!r}.") from None


def _read_file(opened: Ledger, path: Path) -> dict[int, list[int]]:
    """Return the cells of each trial in a file, all of it read before anything is entered."""
    try:
        lines = read_file(path, MOST_TABLE_BYTES).decode("utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise StudyError(f"{path} cannot be read ({error}). Expected lines such as '12: 0 1 13'.") from error
    found: dict[int, list[int]] = {}
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        trial, colon, text = line.partition(":")
        if not colon:
            raise StudyError(
                f"{path}, line {number}: expected 'TRIAL: 0 1 13', got {line!r}. Nothing was entered."
            )
        which = _number(opened, trial.strip())
        if which in found:
            raise StudyError(f"{path}, line {number}: trial {which} is listed twice. Nothing was entered.")
        found[which] = _cells(text, f"{path}, line {number}")
    return found


def _pick(opened: Ledger, trial: str | None, role: ScoreRole) -> Iterator[dict[int, list[int]]]:
    """Yield cells selected in the terminal, of one trial or of each trial without a score."""
    if not sys.stdin.isatty():
        raise StudyError("There is no terminal in which to pick cells. Give --cells or --file.")
    for number, title, arena, cells in _waiting(opened, trial, role):
        echo(f"\nTrial {number}, {title}")
        picked = pick_cells(arena, cells)
        if picked is None:
            return
        yield {number: picked}


def _waiting(
    opened: Ledger, trial: str | None, role: ScoreRole
) -> Iterator[tuple[int, str, Arena, tuple[int, ...]]]:
    """Yield number, title, arena, and cells of before of the trial that is named, or of all that wait."""
    number = None
    if trial is not None or role == "correction":
        number = _number(opened, _needed(trial, "The number of a trial"))
    if number is not None:
        waiting = [opened.trial(number)]
    else:
        seconded = {row["trial"] for row in opened.scores() if row["role"] == role and row["undone"] is None}
        states: tuple[Any, ...] = ("driven",) if role == "score" else ("driven", "scored")
        waiting = [each for each in opened.trials(states=states) if each.trial not in seconded]
    titles = _Titles(opened)
    for each in waiting:
        yield (
            each.trial,
            titles.title(each),
            titles.arena(each),
            each.cells or () if role == "correction" else (),
        )


class _Titles:
    """Names and arenas of trials; those of a study are in its description."""

    def __init__(self, opened: Ledger) -> None:
        self._opened = opened
        folder = opened.path.parent
        self._description: Mapping[str, Any] = {}
        if opened.conditions() and (folder / "study.json").exists():
            self._description = realitygap.records.ResultsFolder.open(folder).description
        settings = self._description.get("trials") or {}
        self.blind = bool(settings.get("blind"))
        self._pens = settings.get("pens") or []

    def title(self, trial: Trial) -> str:
        if not trial.condition:
            return trial.name
        pen = f"pen: {self._pens[trial.pen % len(self._pens)]}" if self._pens else f"pen {trial.pen}"
        return f"{trial.code if self.blind else trial.name}, sheet {trial.sheet}, {pen}"

    def arena(self, trial: Trial) -> Arena:
        if not trial.condition:
            return self._opened.arena
        settings = realitygap.records.settings_of_condition(self._description, trial.condition)
        return realitygap.runs.Condition.from_settings(trial.condition, settings).arena.arena()


def _list(opened: Ledger, *, as_json: bool) -> None:
    trials = opened.trials()
    hidden = _hidden(opened)
    if as_json:
        rows = [
            {
                name: None if trial.trial in hidden and name in _BLINDED else value
                for name, value in vars(trial).items()
            }
            | {"notes": [note["text"] for note in opened.notes(trial.trial)]}
            for trial in trials
        ]
        print_json(rows)
        return
    from rich.table import Table

    table = Table(box=None, padding=(0, 2, 0, 0))
    more = ("code", "sheet") if any(trial.code for trial in trials) else ()
    for head in ("trial", *more, "state", "cells", "description"):
        table.add_column(head, no_wrap=head not in ("code", "description"), overflow="fold")
    for trial in trials:
        on_sheet = (trial.code, str(trial.sheet)) if more else ()
        parts = [
            "" if trial.trial in hidden else trial.name,
            trial.reason or trial.problem or "",
            *(f"note: {note['text']}" for note in opened.notes(trial.trial)),
        ]
        table.add_row(
            *(str(trial.trial), *on_sheet, trial.state),
            *(
                "" if trial.cells is None else str(len(trial.cells)),
                "; ".join(part for part in parts if part),
            ),
        )
    wide_console().print(table)
    states = [trial.state for trial in trials]
    counts = ", ".join(f"{states.count(state)} {state}" for state in dict.fromkeys(states))
    echo(f"{len(trials)} trials: {counts}." if trials else "No trial is planned yet.")


def _show(opened: Ledger, number: int, *, as_json: bool) -> None:
    """Print the facts of a trial, or as JSON all that was recorded."""
    trial, record, notes = opened.trial(number), opened.record(number), opened.notes(number)
    is_hidden = number in _hidden(opened)
    if as_json:
        facts = {
            name: None if is_hidden and name in _BLINDED else value for name, value in vars(trial).items()
        }
        recorded = realitygap.records.trial_to_dict(record)
        if trial.arm:  # of a blind design
            recorded |= {"genome": "", "number": None}
        print_json({**facts, "record": recorded, "notes": notes})
        return
    cells = "not counted" if trial.cells is None else ", ".join(map(str, trial.cells)) or "none"
    lines = {
        "description": "" if is_hidden else trial.name,
        "state": f"{trial.state}: {trial.reason}" if trial.reason else trial.state,
        "end": f"{record.end}: {record.problem}" if record.problem else record.end,
        "steps": f"{len(record.commands)} of {record.step_s:g} s" if len(record.commands) else "none",
        "observed": record.observe,
        "blocked steps": str(record.n_stalls),
        "cells": cells,
        "battery": "" if math.isnan(record.battery_v) else f"{record.battery_v:.2f} V",
    }
    echo(f"Trial {number}")
    for name, text in lines.items():
        if text:
            echo(f"  {name}: {text}")
    for note in notes:
        echo(f"  note by {note['who']} ({note['time']}): {note['text']}")


_BLINDED = ("condition", "replicate", "generation", "individual")


def _hidden(opened: Ledger) -> set[int]:
    """Return the trials of a blind study whose conditions are not shown yet."""
    if not _Titles(opened).blind:
        return set()
    return {trial.trial for trial in opened.trials() if not trial.is_closed}


def _advise(source: Path, margin: float | None, null: str | None, *, as_json: bool) -> None:
    if margin is not None and not (math.isfinite(margin) and margin > 0):
        raise StudyError(f"--margin is {margin}, expected a number above 0, such as 0.05.")
    hypothesis: Null | None = "mean" if null == "mean" else "distribution" if null == "distribution" else None
    if null is not None and hypothesis is None:
        raise StudyError(f"--null is {null!r}, expected distribution or mean.")
    advice = realitygap.study.advise(source, margin=margin, null=hypothesis)
    if as_json:
        print_json(advice.to_dict() | deviations_of(source))
        return
    for sentence in advice.sentences:
        echo(sentence)
    print_deviations(source)


def _change_design(what: str, source: Path, reason: str, settings: Sequence[str], who: str | None) -> None:
    if what == "unblind":
        realitygap.study.unblind_design(source, reason, who=who)
        echo("Unblinded. The results are shown by arm from now on.")
    else:
        pairs = [each.partition("=") for each in settings]
        for name, equals, _ in pairs:
            if not equals:
                raise StudyError(f"--set is {name!r}, expected NAME=VALUE, such as trials=60.")
        changes = {name: value for name, _, value in pairs}
        design = realitygap.study.amend_design(source, reason, changes, who=who)
        echo(f"Amended. The new hash is {design.events[-1].details['sha256']}.")
    if (report := realitygap.study.design_report(source)) is not None:
        _show_design(report, as_json=False)


def _show_design(report: DesignReport, *, as_json: bool) -> None:
    if as_json:
        print_json(report.to_dict())
        return
    for sentence in report.sentences:
        echo(sentence)


def _agreement(source: Path, *, as_json: bool) -> None:
    found = realitygap.report.measure_agreement(source)
    if as_json:
        print_json(found.to_dict())
        return
    echo(found.sentence)
