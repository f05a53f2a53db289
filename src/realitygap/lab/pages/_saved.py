"""Saved trials: those that gaps and calibrations saved in files, to list, correct, void, and annotate."""

from __future__ import annotations

from collections.abc import Callable
from urllib.parse import quote

from nicegui import run, ui
from starlette.exceptions import HTTPException
from starlette.requests import Request

from realitygap._wording import counted, platform_in_words
from realitygap.errors import RealityGapError
from realitygap.lab._lab import Lab
from realitygap.lab._saved import SavedFile, SavedTrials, saved_files

from ._design import DesignFold
from ._elements import CellGrid
from ._fields import Form
from ._frame import LONGEST_NAME, framed, hint, remember_who, section, text_of, visitor_of
from ._notices import attempt, notify, show_at_fields

_COLUMNS = {"number": "Trial", "name": "Description", "state": "State", "cells": "Cells", "notes": "Notes"}


def add_saved(lab: Lab) -> None:
    """Add the list of files, and the page of each."""

    @ui.page("/saved", response_timeout=30)
    async def files() -> None:
        names = await run.io_bound(saved_files, lab.root) or {}
        with framed(lab, "Saved trials", ""):
            hint("Trials of studies are on the page of each study.")
            for name, path in names.items():
                with ui.row().classes("lab-row"):
                    ui.link(name, f"/saved/{quote(name)}")
                    try:
                        _show_facts(await run.io_bound(SavedFile(path).read))
                    except RealityGapError as error:
                        ui.label(str(error)).classes("lab-problem")
            if not names:
                ui.label("No saved trials yet. A gap or a calibration saves its trials.")

    @ui.page("/saved/{name:path}", response_timeout=30)
    async def trials(name: str, request: Request) -> None:
        path = (await run.io_bound(saved_files, lab.root) or {}).get(name)
        if path is None:
            raise HTTPException(404, name)
        file = SavedFile(path)
        try:
            saved = await run.io_bound(file.read)
        except RealityGapError as error:
            with framed(lab, name, "", above=[("Saved trials", "/saved")]):
                ui.label(str(error)).classes("lab-problem")
            return
        if saved is not None:
            with framed(lab, name, "", above=[("Saved trials", "/saved")]):
                _Page(file, saved, visitor_of(request).who).show()


def _show_facts(saved: SavedTrials | None) -> None:
    """Show the label, platform, number of trials, and date of a file."""
    if saved is not None:
        label = saved.label
        ui.label(label).classes(f"lab-label-{label.lower()} lab-badge")
        n_trials = counted(len(saved.trials), "trial")
        ui.label(f"{platform_in_words(saved.target, label)}, {n_trials}, {saved.changed}")


class _Page:
    def __init__(self, file: SavedFile, saved: SavedTrials, who: str) -> None:
        self._file, self._saved, self._who = file, saved, who
        self._chosen: int | None = None
        self._cells: list[int] = []

    def show(self) -> None:
        hint("The command that saved these trials uses your changes when it resumes. It repeats void trials.")
        self._facts = ui.row().classes("lab-row")
        self._looks = ui.label().classes("lab-finding").props('role="status"')
        self._design = DesignFold(
            lambda: self._file.path,
            lambda: self._saved.design,
            lambda: self._who,
            lambda: True,
            self._reload,
        )
        self._design.show()
        columns = [
            {"name": key, "label": label, "field": key, "align": "left"} for key, label in _COLUMNS.items()
        ]
        # It stays when its rows change, and so does what is selected in it.
        self._table = ui.table(rows=[], columns=columns, row_key="number", pagination=20, selection="single")
        self._table.classes("lab-table").props("flat bordered dense wrap-cells")
        self._table.on_select(lambda event: self._choose([row["number"] for row in event.selection]))
        self._fill()
        with ui.element("div").classes("lab-wide").props("data-counting"):  # below the table, as is the trial
            form = Form()
            name = form.text("who", "Your name", self._who, explanation="Your name is saved with each entry.")
        show_at_fields(form.refuse)
        name.props(f"debounce=400 maxlength={LONGEST_NAME}")
        name.on_value_change(lambda event: self._named(text_of(event)))
        self._card = ui.refreshable(self._show_card)
        self._card()
        ui.timer(1.0, self._look)  # a command may save trials

    def _named(self, who: str) -> None:
        self._who = who[:LONGEST_NAME]
        remember_who(self._who)

    async def _look(self) -> None:
        if await run.io_bound(self._file.has_changed):
            await self._reload()

    async def _reload(self) -> None:
        try:
            saved = await run.io_bound(self._file.read)
        except RealityGapError:  # it is being written; the next look reads it again
            self._file.stamp = ()
            return
        if saved is not None:
            self._saved = saved
            self._fill()

    def _fill(self) -> None:
        self._facts.clear()
        with self._facts:
            _show_facts(self._saved)
        self._looks.text = " ".join(self._saved.looks)
        self._looks.set_visibility(bool(self._saved.looks))
        self._design.look()
        self._table.rows = [
            {
                "number": trial.trial,
                "name": trial.name.removeprefix("controller, "),
                "state": f"{trial.state}: {trial.reason}" if trial.reason else trial.state,
                "cells": "" if trial.cells is None else str(len(trial.cells)),
                "notes": self._saved.notes[trial.trial],
            }
            for trial in self._saved.trials
        ]

    def _choose(self, numbers: list[int]) -> None:
        self._chosen = numbers[0] if numbers else None
        self._card.refresh()
        if numbers:
            ui.run_javascript("document.querySelector('[data-counting]').scrollIntoView()")

    def _show_card(self) -> None:
        trial = self._saved.trial(self._chosen)
        if trial is None:
            ui.label("Select a trial to correct its cells, void it, or add a note.")
            return
        number = trial.trial
        section(f"Trial {number}: {trial.name}")
        if trial.state in ("driven", "scored"):
            self._cells = list(trial.cells or ())
            with ui.element("div").classes("lab-wide"):
                CellGrid(
                    self._saved.arena, cells=self._cells, name=f"Cells of trial {number}", change=self._marked
                )
            ui.button("Save cells", on_click=lambda: self._score(number)).props("unelevated no-caps")
        text = ui.input("Note or reason").props("outlined dense").classes("lab-wide")
        with ui.row().classes("lab-row"):
            ui.button("Save note", on_click=lambda: self._note(number, text_of(text))).props(
                "outline no-caps"
            )
            ui.button("Void trial", on_click=lambda: self._void(number, text_of(text))).props(
                "outline no-caps"
            ).set_enabled(trial.state != "void")

    def _marked(self, cells: list[int]) -> None:
        self._cells = cells

    async def _score(self, number: int) -> None:
        cells, who = sorted(self._cells), self._who
        done = f"Trial {number}: {counted(len(cells), 'cell')} saved."
        await self._enter(lambda: self._file.score(number, cells, who), done)

    async def _note(self, number: int, text: str) -> None:
        who = self._who
        await self._enter(lambda: self._file.note(number, text, who), "Note saved.")

    async def _void(self, number: int, reason: str) -> None:
        who = self._who
        done = f"Trial {number} is void. It will be repeated."
        await self._enter(lambda: self._file.void(number, reason, who), done)

    async def _enter(self, act: Callable[[], None], done: str) -> None:
        with ui.context.client:  # the button that was pressed may be gone by then
            if await attempt(act):
                await self._reload()
                self._card.refresh()
                notify(done)  # last: what is typed after it stays
