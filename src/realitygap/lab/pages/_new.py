"""A new study: from a form made of all settings, or from a file."""

from __future__ import annotations

import asyncio
from importlib import resources
from typing import Any, Literal

from nicegui import events, run, ui

from realitygap.errors import StudyError
from realitygap.lab._checks import Check
from realitygap.lab._files import LONGEST_TEXT
from realitygap.lab._form import (
    TITLES,
    Field,
    condition_fields,
    entered,
    form_sections,
    read_form,
    toml_value,
    written_form,
)
from realitygap.lab._lab import Lab
from realitygap.study import named_studies

from ._frame import framed, hint, section, text_of
from ._notices import attempt, notify, told

BEGINNING = """[study]
name = "my-study"
replicates = 100

[[condition]]
name = "coverage-10"
selection = "coverage"
noise = 0.1

[[condition]]
name = "novelty-10"
selection = "novelty"
noise = 0.1
"""


MOST_SHOWN = 50
"""Conditions in the form."""


class _Draft:
    """The study that is being made: the values of its file."""

    def __init__(self) -> None:
        self.data: dict[str, Any] = read_form(BEGINNING)

    def value(self, place: str) -> Any:
        found: Any = self.data
        for key in place.split("."):
            found = found.get(key) if isinstance(found, dict) else None
        return found

    def put(self, place: str, value: Any) -> None:
        """Set a value, or take it out where it is None."""
        *above, key = place.split(".")
        table = self.data
        for each in above:
            if not isinstance(table.get(each), dict):
                table[each] = {}
            table = table[each]
        table.pop(key, None) if value is None else table.__setitem__(key, value)


def add_new(lab: Lab) -> None:
    """Add the page."""

    @ui.page("/new", response_timeout=30)
    async def new() -> None:
        await run.io_bound(lab.checks.prepare)
        draft = _Draft()
        with framed(lab, "New study", "/new"):
            _Page(lab, draft).show()


class _Page:
    def __init__(self, lab: Lab, draft: _Draft) -> None:
        self._lab = lab
        self._draft = draft
        self._check: Check | None = None

    def show(self) -> None:
        hint(
            "Begin with one of the studies that come with realitygap, or with a file; change what you like; then start "
            "it. Every setting stands below with what it means; an empty one has its default."
        )
        with ui.row().classes("lab-row"):
            ui.select(named_studies(), label="Begin with", on_change=self._begin_with).classes("lab-wide")
            upload = ui.upload(on_upload=self._uploaded, auto_upload=True, max_file_size=LONGEST_TEXT)
            upload.props('accept=".toml"').classes("lab-hidden")  # its own buttons have no names
            upload.on("rejected", self._rejected)
            ui.button("or with a file").props("outline no-caps").on(
                "click", js_handler=f"() => getElement({upload.id}).pickFiles()"
            )
        self._form = ui.refreshable(self._show_form)
        self._conditions = ui.refreshable(self._show_conditions)
        with ui.tabs().props("no-caps align=left") as tabs:
            form_tab, file_tab = ui.tab("Form"), ui.tab("File")
        with ui.tab_panels(tabs, value=form_tab, on_change=self._turned).classes("lab-panels"):
            with ui.tab_panel(form_tab):
                self._form()
            with ui.tab_panel(file_tab):
                self._text = (
                    ui.textarea("The study file", value=written_form(self._draft.data))
                    .classes("lab-file")
                    .props(
                        "outlined spellcheck=false input-style='font-family: monospace; min-height: 24rem'"
                    )
                )
        self._is_text = False
        self._said = ui.label("").classes("lab-problem lab-lines").props('role="status"')
        with ui.row().classes("lab-row") as self._waiting:
            ui.spinner()
            ui.label("Reading the study file ...").props('role="status"')
            ui.button("Cancel", on_click=self._cancel).props("flat no-caps")
        self._waiting.set_visibility(False)
        with ui.row().classes("lab-row"):
            ui.button("Check", on_click=self._checked).props("outline no-caps")
            ui.button("Start the study", on_click=self._start).props("unelevated no-caps")

    # where it comes from

    async def _begin_with(self, event: events.ValueChangeEventArguments[Any]) -> None:
        if event.value not in named_studies():
            return
        text = (resources.files("realitygap.study") / "studies" / f"{event.value}.toml").read_text("utf-8")
        await self._take(text)

    def _rejected(self) -> None:
        notify(
            f"This is no study file: expected one that ends in .toml, of at most {LONGEST_TEXT:,} bytes.",
            type="negative",
        )

    async def _uploaded(self, event: events.UploadEventArguments) -> None:
        data = await event.file.read()
        try:
            text = data[: LONGEST_TEXT + 1].decode("utf-8")
        except UnicodeDecodeError:
            notify("This is not a text file in UTF-8. Expected a study file (.toml).", type="negative")
            return
        await self._take(text)

    async def _take(self, text: str) -> None:
        """Put the text of a file into the form; where it has mistakes it is shown as it is."""
        self._text.value = text
        found = await self._ask("read", text)
        if "data" not in found:
            self._said.text = found["mistakes"]
            return
        self._draft.data = found["data"]
        self._form.refresh()

    async def _turned(self, event: events.ValueChangeEventArguments[Any]) -> None:
        """Between form and file: each shows what the other has."""
        self._is_text = event.value == "File"
        if self._is_text:
            self._text.value = written_form(self._draft.data)
        else:
            await self._take(text_of(self._text))

    # the form

    def _show_form(self) -> None:
        for place, fields in form_sections().items():
            is_open = place == "study"
            with ui.expansion(TITLES[place], value=is_open).classes("lab-expansion"):
                for field in fields:
                    _input(field, self._draft.value(field.place), self._putter(field))
            if place == "study":
                with ui.expansion("Conditions", value=True).classes("lab-expansion"):
                    self._conditions()

    def _putter(self, field: Field) -> Any:
        return lambda value: self._draft.put(field.place, value)

    def _show_conditions(self) -> None:
        listed = self._draft.data.setdefault("condition", [])
        if not isinstance(listed, list):
            return
        for number, condition in enumerate(listed[:MOST_SHOWN]):
            if isinstance(condition, dict):
                self._show_condition(number, condition)
        if len(listed) > MOST_SHOWN:
            hint(
                f"The first {MOST_SHOWN} of {len(listed):,} conditions are shown. Change the others in the file."
            )
        ui.button("Add a condition", on_click=self._add_condition).props("outline no-caps")

    def _show_condition(self, number: int, condition: dict[str, Any]) -> None:
        with ui.card().classes("lab-card"):
            section(f"Condition {number + 1}")
            for field in condition_fields():
                key = field.place.partition(".")[2]

                def put(value: Any, key: str = key) -> None:
                    condition.pop(key, None) if value is None else condition.__setitem__(key, value)

                _input(field, condition.get(key), put)
            if more := [key for key, value in condition.items() if isinstance(value, dict)]:
                hint(f"It has settings of its own for {', '.join(more)}: see the file.")
            ui.button("Take this condition out", on_click=lambda: self._remove(number)).props("flat no-caps")

    def _add_condition(self) -> None:
        listed = self._draft.data["condition"]
        listed.append({"name": f"condition-{len(listed) + 1}"})
        self._conditions.refresh()

    def _remove(self, number: int) -> None:
        del self._draft.data["condition"][number]
        self._conditions.refresh()

    # done

    def _whole(self) -> str:
        return text_of(self._text) if self._is_text else written_form(self._draft.data)

    async def _ask(self, do: Literal["read", "check"], text: str) -> dict[str, Any]:
        """Have another process read or check the text, until it is done or canceled."""
        if self._check is not None:
            self._check.end()
        try:
            check = self._check = await run.io_bound(self._lab.checks.begin, do, text)
        except StudyError as error:
            return {"mistakes": str(error)}
        if check is None:
            return {"mistakes": "The lab is closing."}
        self._said.text = ""
        self._waiting.set_visibility(True)
        try:
            return await asyncio.wrap_future(check.found)
        finally:
            if self._check is check:
                self._check = None
                self._waiting.set_visibility(False)

    def _cancel(self) -> None:
        if self._check is not None:
            self._check.end()

    async def _checked(self) -> None:
        found = await self._ask("check", self._whole())
        self._said.text = found.get("mistakes") or "It can be started."

    async def _start(self) -> None:
        text = self._whole()
        found = await self._ask("check", text)
        self._said.text = found.get("mistakes", "")
        if "name" in found and await attempt(lambda: self._lab.start_new(found["name"], text)):
            ui.navigate.to("/")


def _input(field: Field, value: Any, put: Any) -> None:
    """The field of one setting, with what it means."""
    name = field.place.rpartition(".")[2].replace("_", " ")
    with ui.element("div").classes("lab-field").props(f'data-place="{field.place}"'):
        if field.kind in ("choice", "yes-no"):
            choices = field.choices or ("true", "false")
            shown = value if field.kind == "choice" or value is None else str(value).lower()
            if isinstance(shown, str) and shown not in choices:
                choices = (*choices, shown)
            chosen = ui.select(
                [*choices], label=name, value=shown if isinstance(shown, str) else None, clearable=True
            )
            chosen.props("outlined dense")
            chosen.on_value_change(lambda event: _enter(field, event.value, put))
        else:
            text = "" if value is None else _as_entered(field, value)
            default = field.default.strip('"') if field.kind == "text" else field.default
            ui.input(
                name, value=text, placeholder=default, on_change=lambda event: _enter(field, event.value, put)
            ).props("debounce=300 stack-label outlined dense")
        hint(
            f"{field.description} Default: {field.default}."
            if field.default not in ("", '""')
            else field.description
        )


def _as_entered(field: Field, value: Any) -> str:
    return value if field.kind == "text" and isinstance(value, str) else toml_value(value)


def _enter(field: Field, text: Any, put: Any) -> None:
    if not isinstance(text, str) or text == "":
        put(None)
    else:
        told(lambda: put(entered(field, text)))
