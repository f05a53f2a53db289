"""`realitygap trials`: the trials of a robot, their scores, and notes."""

from __future__ import annotations

import getpass
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from realitygap._limits import MOST_TABLE_BYTES, read_file
from realitygap._terminal import echo
from realitygap.errors import LedgerError, StudyError, did_you_mean

from ._json import print_json

if TYPE_CHECKING:
    from realitygap.records import Ledger, ScoreRole, Trial

_WHAT = ("list", "score", "undo", "void", "note", "agreement")
_READING = ("list", "agreement")
"""What changes no ledger."""


_ONLY_SCORE = "Only for score"


def trials(
    what: Annotated[
        str, typer.Argument(metavar="WHAT", help="Action: list, score, undo, void, note or agreement.")
    ],
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of results with a ledger.")],
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
    who: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Name to record with each entry. [default: your account's name]"),
    ] = None,
    second: Annotated[
        bool,
        typer.Option(
            "--second",
            help="Enter the cells as a second count, only for the agreement.",
            rich_help_panel=_ONLY_SCORE,
        ),
    ] = False,
    correct: Annotated[
        bool,
        typer.Option(
            "--correct",
            help="Enter the cells as a correction, after the generation was closed. Only reports use it.",
            rich_help_panel=_ONLY_SCORE,
        ),
    ] = False,
    text: Annotated[
        str | None,
        typer.Option(
            metavar="TEXT",
            help="Text of the note, or reason why the trial is void.",
            rich_help_panel="Only for note and void",
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """List, score, and annotate physical trials.

    The number of a cell is columns * row + column. Cell 0 is the lower left of the reachable cells. Without --cells and
    --file, you pick the cells in the terminal. undo removes a score until its generation is closed. After that, only
    --correct changes it: reports use the correction, and the evolution does not. If two people counted cells, agreement
    prints Cohen's kappa with its interval.

    Example: realitygap trials list results/paper-robot

    Example: realitygap trials score results/paper-robot 12 --cells 13,14,15,27 --who anna

    Example: realitygap trials score results/paper-robot --file sheet-2.txt --second --who ben

    Example: realitygap trials void results/paper-robot 12 --text "the pen fell out"

    Example: realitygap trials agreement results/paper-robot

    In Python: realitygap.records.Ledger.open("results/paper-robot/ledger.sqlite").trials()
    """
    from realitygap.records import LEDGER_NAME, Ledger

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
    if as_json and what not in _READING:
        raise StudyError(f"--json is only for {' and '.join(_READING)}, not for {what}. Leave it out.")
    name = who or getpass.getuser()
    with Ledger.open(folder / LEDGER_NAME, writable=what not in _READING) as ledger:
        if what == "list":
            _list(ledger, as_json=as_json)
        elif what == "agreement":
            _agreement(folder, as_json=as_json)
        elif what == "score":
            role: ScoreRole = "second" if second else "correction" if correct else "score"
            _score(ledger, folder, trial, cells, file, name, role)
        elif what == "note":
            ledger.note(_needed(text, "--text"), name, None if trial is None else _number(ledger, trial))
            echo("Noted.")
        else:
            number = _number(ledger, _needed(trial, "a trial"))
            if what == "undo":
                ledger.undo(number)
                echo(f"The score of trial {number} is withdrawn. Enter a new one.")
            else:
                ledger.void(number, _needed(text, "--text"))
                echo(f"Trial {number} is void; it will be driven again.")


_LONGEST_NUMBER = 19
"""Digits of a number that surely fits into SQLite's."""


def _needed(value: str | None, what: str) -> str:
    if value is None:
        raise StudyError(f"{what} is missing. See `realitygap trials --help` for an example.")
    return value


def _number(ledger: Ledger, text: str) -> int:
    """Return a trial's number, from itself or its code."""
    if text.isdecimal() and len(text) < _LONGEST_NUMBER:
        return ledger.trial(int(text)).trial
    codes = {each.code: each.trial for each in ledger.trials()}
    if text.upper() not in codes:
        raise LedgerError(
            f"{ledger.path} has no trial {text!r}. `realitygap trials list` shows numbers and codes."
        )
    return codes[text.upper()]


def _score(
    ledger: Ledger,
    folder: Path,
    trial: str | None,
    cells: str | None,
    file: Path | None,
    who: str,
    role: ScoreRole,
) -> None:
    from realitygap.records import Score

    if file is not None:
        entries: Iterable[dict[int, list[int]]] = [_read_file(ledger, file)]
    elif cells is not None:
        entries = [{_number(ledger, _needed(trial, "a trial")): _cells(cells, "--cells")}]
    else:
        entries = _pick(ledger, folder, trial, role)
    n_entered = 0
    for given in entries:  # each as a whole or not at all
        ledger.score_all({number: Score(found, who) for number, found in given.items()}, role)
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


def _read_file(ledger: Ledger, path: Path) -> dict[int, list[int]]:
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
        which = _number(ledger, trial.strip())
        if which in found:
            raise StudyError(f"{path}, line {number}: trial {which} is listed twice. Nothing was entered.")
        found[which] = _cells(text, f"{path}, line {number}")
    return found


def _pick(ledger: Ledger, folder: Path, trial: str | None, role: ScoreRole) -> Iterator[dict[int, list[int]]]:
    """Yield cells picked in the terminal, of one trial or, one after the other, of all that wait."""
    import sys

    from ._operator import pick_cells

    if not sys.stdin.isatty():
        raise StudyError("There is no terminal in which to pick cells. Give --cells or --file.")
    if trial is not None or role == "correction":
        waiting = [ledger.trial(_number(ledger, _needed(trial, "a trial")))]
    else:
        seconded = {row["trial"] for row in ledger.scores() if row["role"] == role and row["undone"] is None}
        states: tuple[Any, ...] = ("driven",) if role == "score" else ("driven", "scored")
        waiting = [each for each in ledger.trials(states=states) if each.trial not in seconded]
    shows = _Titles(folder)
    for each in waiting:
        echo(
            f"\nTrial {each.trial}, {each.code if shows.blind else each.name}, sheet {each.sheet}, {shows.pen(each)}"
        )
        cells = pick_cells(shows.arena(each), each.cells or () if role == "correction" else ())
        if cells is None:
            return
        yield {each.trial: cells}


class _Titles:
    """Names that the list of a folder's trials shows."""

    def __init__(self, folder: Path) -> None:
        from realitygap.records import ResultsFolder

        self._description = ResultsFolder.open(folder).description
        settings = self._description.get("trials") or {}
        self.blind = bool(settings.get("blind"))
        self._pens = settings.get("pens") or []

    def pen(self, trial: Trial) -> str:
        return f"pen: {self._pens[trial.pen % len(self._pens)]}" if self._pens else f"pen {trial.pen}"

    def arena(self, trial: Trial) -> Any:
        from realitygap.records import settings_of_condition
        from realitygap.runs import Condition

        settings = settings_of_condition(self._description, trial.condition)
        return Condition.from_settings(trial.condition, settings).arena.arena()


def _list(ledger: Ledger, *, as_json: bool) -> None:
    found = ledger.trials()
    if as_json:
        blinded = {"condition", "replicate", "generation", "individual"} if _is_blind(ledger) else set()
        rows = [
            {
                name: None if name in blinded and not each.is_closed else value
                for name, value in vars(each).items()
            }
            | {"notes": [note["text"] for note in ledger.notes(each.trial)]}
            for each in found
        ]
        print_json(rows)
        return
    from rich.table import Table

    from ._tables import wide_console

    table = Table(box=None, padding=(0, 2, 0, 0))
    for head in ("trial", "code", "sheet", "state", "cells", "description"):
        table.add_column(head, no_wrap=head not in ("code", "description"), overflow="fold")
    hidden = _is_blind(ledger)
    for each in found:
        what = "" if hidden and not each.is_closed else each.name
        said = [
            each.reason or each.problem or "",
            *(f"note: {note['text']}" for note in ledger.notes(each.trial)),
        ]
        more = "; ".join(part for part in (what, *said) if part)
        table.add_row(
            *(str(each.trial), each.code, str(each.sheet), each.state),
            *("" if each.cells is None else str(len(each.cells)), more),
        )
    wide_console().print(table)
    states = [each.state for each in found]
    counts = ", ".join(f"{states.count(state)} {state}" for state in dict.fromkeys(states))
    echo(f"{len(found)} trials: {counts}." if found else "No trial is planned yet.")


def _is_blind(ledger: Ledger) -> bool:
    path = ledger.path.parent / "study.json"
    return path.exists() and _Titles(ledger.path.parent).blind


def _agreement(folder: Path, *, as_json: bool) -> None:
    from realitygap.report import measure_agreement

    found = measure_agreement(folder)
    if as_json:
        print_json(found.to_dict())
        return
    echo(found.sentence)
