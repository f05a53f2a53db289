"""`realitygap score`: the cells of trials, from a photo of their sheet."""

from __future__ import annotations

import getpass
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import realitygap
from realitygap._terminal import echo, prompt
from realitygap.errors import StudyError

from ._grid_editor import pick_cells
from ._options import correct_option, print_json, second_option, who_option
from ._print_sheet import sheet_layout, study_sheet
from ._trials import _Titles

if TYPE_CHECKING:
    from realitygap.records import Ledger, Score, ScoreRole, Trial
    from realitygap.vision import SheetScore, SheetTrials, TraceScore
    from realitygap.world import Arena


_WITH_STUDY = "Only with --study"
_WITHOUT_STUDY = "Only without --study"


def score(
    photo: Annotated[
        Path, typer.Argument(metavar="PHOTO", help="Photo of the whole sheet (JPEG, PNG, TIFF or WebP).")
    ],
    study: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of results whose ledger gets the confirmed cells."),
    ] = None,
    generation: Annotated[
        int | None,
        typer.Option(
            min=0, metavar="G", help="Generation of the trials on the sheet.", rich_help_panel=_WITH_STUDY
        ),
    ] = None,
    condition: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Condition of the trials on the sheet.", rich_help_panel=_WITH_STUDY
        ),
    ] = None,
    run: Annotated[
        int | None,
        typer.Option(min=0, help="Run of the trials on the sheet.", rich_help_panel=_WITH_STUDY),
    ] = None,
    sheet: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Number of the sheet, from `realitygap trials list`.",
            rich_help_panel=_WITH_STUDY,
        ),
    ] = None,
    arena: Annotated[
        str, typer.Option(metavar="NAME", help="Arena by name or file.", rich_help_panel=_WITHOUT_STUDY)
    ] = "paper",
    pens: Annotated[
        str | None,
        typer.Option(
            metavar="LIST",
            help="Pens as printed on the sheet. [default: the eight of a study]",
            rich_help_panel=_WITHOUT_STUDY,
        ),
    ] = None,
    overlay: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.png",
            help="Picture to write, for your check. [default: DIR/sheet-N.png with a study]",
        ),
    ] = None,
    yes: Annotated[
        bool,
        typer.Option(
            "--yes",
            help="Enter the cells of the picture without asking. Check the picture first.",
            rich_help_panel=_WITH_STUDY,
        ),
    ] = False,
    who: Annotated[str | None, who_option(_WITH_STUDY)] = None,
    second: Annotated[bool, second_option(_WITH_STUDY)] = False,
    correct: Annotated[bool, correct_option(_WITH_STUDY)] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON. Enters nothing without --yes.")
    ] = False,
) -> None:
    """Read the crossed cells from a photo of a sheet.

    The command finds the sheet by its four tags and its grid, and corrects lens, tilt and light. It identifies each pen
    by its line in the pen's box. Check the picture that it writes: cells less than 90 % sure have a frame. In a
    terminal, the command then asks for each trial. Without a terminal, run the same command again with --yes to enter
    the cells. The ledger records the photo's SHA-256, the cells read, and the name of the person who confirmed them.

    Example: realitygap score sheet.jpg --study results/paper-robot --generation 0

    Example: realitygap score sheet.jpg --overlay seen.png

    In Python: realitygap.vision.score_sheet(photo, layout)
    """
    if second and correct:
        raise StudyError("--second and --correct exclude each other: a correction replaces the first count.")
    if study is None:
        chosen = {"--generation": generation, "--condition": condition, "--run": run, "--sheet": sheet}
        alone = [name for name, value in chosen.items() if value is not None]
        alone += [
            name for name, value in (("--yes", yes), ("--second", second), ("--correct", correct)) if value
        ]
        if alone:
            raise StudyError(f"{', '.join(alone)}: expected a study. Name its folder (--study DIR).")
        _only_show(photo, arena, pens, overlay, as_json=as_json)
        return
    if pens is not None:
        raise StudyError(
            "--pens cannot be combined with --study, because the study names its pens. Leave it out."
        )

    role: ScoreRole = "second" if second else "correction" if correct else "score"
    with realitygap.records.Ledger.open(study / realitygap.records.LEDGER_NAME) as ledger:
        on_sheet = realitygap.vision.trials_on_sheet(
            ledger, generation, condition=condition, replicate=run, sheet=sheet, role=role
        )
        read = _Photo(photo, realitygap.vision.photo_bytes(photo), who or getpass.getuser())
        _score_trials(ledger, study, read, on_sheet, role, overlay, yes=yes, as_json=as_json)


def _only_show(photo: Path, arena: str, pens: str | None, overlay: Path | None, *, as_json: bool) -> None:
    data = realitygap.vision.photo_bytes(photo)
    found = realitygap.vision.score_sheet(realitygap.vision.read_photo(data), sheet_layout(arena, pens, None))
    if overlay is not None:
        realitygap.records.write_whole(overlay, realitygap.vision.overlay_png(found))
    if as_json:
        rows = [_as_json(trace) for trace in found.traces]
        print_json({"photo": realitygap.vision.photo_hash(data), "traces": rows, "overlay": overlay})
        return
    for trace in found.traces:
        echo(f"{trace.pen + 1} {trace.name}: {_told(trace)}")
    _say_what_was_guessed(found)
    if overlay is not None:
        echo(f"Written: {overlay}")


def _as_json(trace: TraceScore) -> dict[str, Any]:
    return {
        "pen": trace.name, "is_tried": trace.is_tried, "cells": list(trace.cells), "doubtful": list(trace.doubtful),
        "confidence": [round(float(trace.confidence[cell]), 4) for cell in trace.cells],
    }  # fmt: skip


def _told(trace: TraceScore) -> str:
    cells = " ".join(map(str, trace.cells)) or "none"
    doubt = f"; to look at: {' '.join(map(str, trace.doubtful))}" if trace.doubtful else ""
    return f"{len(trace.cells)} cells: {cells}{doubt}"


def _say_what_was_guessed(found: SheetScore) -> None:
    guessed = [trace.name for trace in found.traces if not trace.is_tried]
    if guessed:
        echo(
            f"Not tried in their boxes, so their colors are guessed from their names: {', '.join(guessed)}.",
            err=True,
        )


@dataclass(frozen=True)
class _Photo:
    """A photo of a sheet, and the person who confirms the cells read from it."""

    path: Path
    data: bytes
    who: str

    def score(self, trace: TraceScore, cells: tuple[int, ...]) -> Score:
        """Return the score of a trial with confirmed cells."""
        count = realitygap.records.PhotoCount(
            self.path.name,
            realitygap.vision.photo_hash(self.data),
            trace.cells,
            trace.doubtful,
            is_confirmed=True,
        )
        return realitygap.records.Score(cells, self.who, photo=count)


def _score_trials(
    ledger: Ledger,
    folder: Path,
    photo: _Photo,
    on_sheet: SheetTrials,
    role: ScoreRole,
    overlay: Path | None,
    *,
    yes: bool,
    as_json: bool,
) -> None:
    arena, pens = study_sheet(folder, on_sheet.waiting[0].condition)
    titles = _Titles(ledger)
    found = realitygap.vision.score_sheet(
        realitygap.vision.read_photo(photo.data), realitygap.vision.SheetLayout.of(arena, pens), on_sheet.pens
    )
    traces = {trace.pen: trace for trace in found.traces}
    names = {
        trial.pen: f"{traces[trial.pen].name}, trial {trial.trial}, {trial.code if titles.blind else trial.name}"
        for trial in on_sheet.waiting
    }
    place = overlay or folder / f"sheet-{on_sheet.sheet}.png"
    realitygap.records.write_whole(
        place, realitygap.vision.overlay_png(found, names), within=folder if overlay is None else None
    )
    if not as_json:
        for trial in on_sheet.waiting:
            echo(f"{names[trial.pen]}: {_told(traces[trial.pen])}")
        _say_what_was_guessed(found)
        echo(f"Written: {place}")
    _say_what_is_spoiled(on_sheet)
    is_asked = not yes and not as_json and sys.stdin.isatty() and sys.stdout.isatty()
    entries = (
        _confirmed(on_sheet, traces, photo, arena)
        if is_asked
        else _all_confirmed(on_sheet, traces, photo)
        if yes
        else iter(())
    )
    n_entered = 0
    for scores in entries:
        ledger.score_all(scores, role)
        n_entered += len(scores)
    if as_json:
        rows = [
            {
                "trial": trial.trial,
                "name": trial.code if titles.blind else trial.name,
                **_as_json(traces[trial.pen]),
            }
            | {"spoiled_by": on_sheet.spoiled[trial.pen].trial if trial.pen in on_sheet.spoiled else None}
            for trial in on_sheet.waiting
        ]
        print_json({"sheet": on_sheet.sheet, "overlay": place, "entered": n_entered, "trials": rows})
    else:
        echo(
            f"{n_entered} trials entered."
            if n_entered
            else "Nothing was entered. Look at the picture, then run the same command with --yes."
        )


def _say_what_is_spoiled(on_sheet: SheetTrials) -> None:
    for trial in on_sheet.waiting:
        if trial.pen in on_sheet.spoiled:
            void = on_sheet.spoiled[trial.pen].trial
            echo(
                f"Trial {trial.trial}: the pen also drew trial {void}, which is void. If that line is still on "
                "the sheet, the two cannot be distinguished, and --yes skips this trial.",
                err=True,
            )


def _all_confirmed(
    on_sheet: SheetTrials, traces: dict[int, TraceScore], photo: _Photo
) -> Iterator[dict[int, Score]]:
    """Confirm all trials as they were read, except those whose pen drew twice and those without visible ink."""
    scores = {
        trial.trial: photo.score(traces[trial.pen], traces[trial.pen].cells)
        for trial in on_sheet.waiting
        if trial.pen not in on_sheet.spoiled and traces[trial.pen].cells
    }
    if scores:
        yield scores


def _confirmed(
    on_sheet: SheetTrials, traces: dict[int, TraceScore], photo: _Photo, arena: Arena
) -> Iterator[dict[int, Score]]:
    """Yield the cells of each trial, as the operator at the terminal confirms them."""
    for trial in on_sheet.waiting:
        trace = traces[trial.pen]
        cells: tuple[int, ...] | None = trace.cells
        answer = _answer(trial, trace)
        if answer == "e":
            picked = pick_cells(arena, trace.cells)
            cells = None if picked is None else tuple(picked)
        if answer != "s" and cells:
            yield {trial.trial: photo.score(trace, cells)}


def _answer(trial: Trial, trace: TraceScore) -> str:
    while True:
        question = (
            f"Trial {trial.trial}, {trace.name}, {len(trace.cells)} cells. Enter: accept, e: edit, s: skip"
        )
        answer = prompt(question, default="", show_default=False).strip().lower()
        if answer in ("", "e", "s"):
            return answer
