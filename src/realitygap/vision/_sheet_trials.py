"""The trials of a ledger that drew on a sheet of paper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from realitygap.errors import LedgerError
from realitygap.records import Ledger, ScoreRole, Trial


@dataclass(frozen=True)
class SheetTrials:
    """The trials whose lines are on one sheet of paper.

    Attributes:
        sheet: Number of the sheet.
        waiting: Trials whose cells are not entered yet, in their order.
        pens: Numbers of all pens that drew on it, ascending.
        spoiled: Void trials by the number of the pen, because their lines may still be on the sheet.
    """

    sheet: int
    waiting: tuple[Trial, ...]
    pens: tuple[int, ...]
    spoiled: dict[int, Trial]


def trials_on_sheet(
    ledger: Ledger,
    generation: int | None = None,
    *,
    condition: str | None = None,
    replicate: int | None = None,
    sheet: int | None = None,
    role: ScoreRole = "score",
) -> SheetTrials:
    """Return the trials on a sheet that wait for their cells.

    Args:
        ledger: Ledger of the study.
        generation, condition, replicate, sheet: Selection of trials, all of which must be on one sheet.
        role: `score` takes what is driven; `second` and `correction` also what is scored.

    Raises:
        LedgerError: There are none, or they are on several sheets.
    """
    wanted = [
        trial
        for trial in ledger.trials(condition, replicate, generation)
        if sheet is None or trial.sheet == sheet
    ]
    states = ("driven",) if role == "score" else ("driven", "scored")
    waiting = tuple(trial for trial in wanted if trial.state in states)
    sheets = sorted({trial.sheet for trial in waiting})
    if not sheets:
        raise LedgerError(_why_none(ledger, wanted, role))
    if len(sheets) > 1:
        numbers = ", ".join(map(str, sheets))
        raise LedgerError(
            f"{ledger.path}: these trials are on sheets {numbers}, and a photo shows one. Say which (--sheet "
            f"{sheets[0]})."
        )
    return _on_one(ledger, sheets[0], waiting)


def _on_one(ledger: Ledger, sheet: int, waiting: Sequence[Trial]) -> SheetTrials:
    drawn = [
        trial
        for trial in ledger.trials()
        if trial.sheet == sheet and trial.state not in ("planned", "running")
    ]
    spoiled = {trial.pen: trial for trial in drawn if trial.state == "void"}
    return SheetTrials(sheet, tuple(waiting), tuple(sorted({trial.pen for trial in drawn})), spoiled)


def _why_none(ledger: Ledger, wanted: Sequence[Trial], role: ScoreRole) -> str:
    if not wanted:
        return f"{ledger.path} has no such trials. `realitygap trials list` shows what it has."
    states = [trial.state for trial in wanted]
    counts = ", ".join(f"{states.count(state)} {state}" for state in dict.fromkeys(states))
    hint = " Scored trials take a second count (--second) or, once closed, a correction (--correct)."
    more = hint if role == "score" else ""
    return f"{ledger.path}: none of these trials waits for its cells; they are {counts}.{more}"
