"""New study: a form of all settings, or a study file."""

from __future__ import annotations

import asyncio
import contextlib
import re
import time
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any, Literal

from nicegui import events, run, ui
from starlette.requests import Request

from realitygap._wording import counted, duration
from realitygap.errors import StudyError
from realitygap.lab._checks import Check, TextResult
from realitygap.lab._choices import Choices, platform_choices
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
from realitygap.lab._messages import TextChecked, TextRead, TextRefused
from realitygap.study import named_studies

from ._fields import Form
from ._frame import framed, hint, section, text_of
from ._notices import WRONG

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
_EMPTY = "Two conditions"
CALIBRATED = r"sim:[A-Za-z0-9][A-Za-z0-9._-]{0,90}\.toml"
"""Platform of a calibration, as addresses of pages name it."""

MOST_SHOWN = 50
"""Number of conditions that the form shows."""
LOOK_S = 0.5
"""Time between two looks at what was entered [s]."""
PAUSE_S = 1.5
"""Time without a change after which the computing time of the study is estimated [s]."""
LEAST_S = 5.0
"""Shortest computing time that is told [s]: starting a process takes some seconds, too."""

_NONE: Mapping[str, str] = {}
_BASICS = {
    "study.name": "Name",
    "study.title": "Title",
    "study.replicates": "Runs per condition",
    "study.seed": "Seed",
}
_COLUMNS = {"name": "Name", "selection": "Search", "platform": "Platform", "noise": "Noise"}


class _Draft:
    """The study that is being made: the values of its file."""

    def __init__(self) -> None:
        self.data: dict[str, Any] = read_form(BEGINNING)

    def value(self, place: str) -> Any:
        """Return the value of a setting; None if it has none."""
        value: Any = self.data
        for key in place.split("."):
            value = value.get(key) if isinstance(value, dict) else None
        return value

    def put(self, place: str, value: Any) -> None:
        """Set a value; None removes it."""
        *above, key = place.split(".")
        table = self.data
        for name in above:
            if not isinstance(table.get(name), dict):
                table[name] = {}
            table = table[name]
        table.pop(key, None) if value is None else table.__setitem__(key, value)


def add_new(lab: Lab) -> None:
    """Add the page."""

    @ui.page("/new", response_timeout=30)
    async def new(request: Request) -> None:
        await run.io_bound(lab.checks.prepare)
        platforms = await run.io_bound(platform_choices, lab.root, "study") or {}
        draft = _Draft()
        platform = request.query_params.get("platform", "")
        if re.fullmatch(CALIBRATED, platform):
            for condition in draft.data["condition"]:
                condition["platform"] = platform
                condition.pop("noise", None)  # the calibrated robot has its own
        with framed(lab, "New study", "", above=[("Studies", "/")]):
            _Page(lab, draft, platforms).show()


class _Page:
    def __init__(self, lab: Lab, draft: _Draft, platforms: Choices) -> None:
        self._lab = lab
        self._platforms = platforms
        self._draft = draft
        self._check: Check | None = None
        self._estimate: Check | None = None
        self._summary = _Summary()
        self._boxes: list[tuple[str, ui.element]] = []
        self._is_open = False
        # entered texts that are no values, by field: the draft cannot hold them
        self._unread: dict[str, str] = {}
        self._read_text = ""
        self._is_read = True  # False while the draft lacks what the file has
        self._n_takes = 0

    def show(self) -> None:
        with ui.row().classes("lab-row"):
            ui.label("Template").props('aria-hidden="true"')
            ui.select([_EMPTY, *named_studies()], value=_EMPTY, on_change=self._choose).props(
                'outlined dense aria-label="Template"'
            ).classes("lab-wide")
            upload = ui.upload(on_upload=self._take_upload, auto_upload=True, max_file_size=LONGEST_TEXT)
            upload.props('accept=".toml"').classes("lab-hidden")  # its own buttons have no names
            upload.on("rejected", self._reject)
            ui.button("Upload .toml file").props("outline no-caps").on(
                "click", js_handler=f"() => getElement({upload.id}).pickFiles()"
            )
        with ui.tabs().props("no-caps align=left") as tabs:
            form_tab, file_tab = ui.tab("Form"), ui.tab("File")
        self._show_summary()
        self._form_part = ui.refreshable(self._show_form)
        self._panels = ui.tab_panels(tabs, value=form_tab, on_change=self._turn).classes("lab-panels")
        with self._panels:
            with ui.tab_panel(form_tab), ui.element("div") as self._form_box:
                self._form_part()
            with ui.tab_panel(file_tab):
                self._discard = ui.button("Discard the changes of the file", on_click=self._discard_text)
                self._discard.props("outline no-caps").set_visibility(False)
                self._text = (
                    ui.textarea(value=written_form(self._draft.data))
                    .classes("lab-file")
                    .props(
                        'outlined spellcheck=false aria-label="Study file" '
                        "input-style='font-family: monospace; min-height: 24rem'"
                    )
                )
        self._is_text = False
        with ui.element("div").classes("lab-actions"):
            with ui.row().classes("lab-row") as self._waiting:
                ui.spinner()
                self._waiting_for = ui.label("").props('role="status"')
                ui.button("Cancel", on_click=self._cancel).props("flat no-caps")
            self._waiting.set_visibility(False)
            self._size = ui.label("").props('role="status"')
            with ui.row().classes("lab-row"):
                check = ui.button("Check", on_click=self._check_only).props("outline no-caps")
                start = ui.button("Start study", on_click=self._start).props("unelevated no-caps")
        self._buttons = (check, start)
        ui.timer(LOOK_S, self._look_at_size)

    def _show_summary(self) -> None:
        """Show the place for mistakes, above form and file."""
        self._form = Form()
        self._form.summary()

    # templates and files

    async def _choose(self, event: events.ValueChangeEventArguments[Any]) -> None:
        if event.value in named_studies():
            file = resources.files("realitygap.study") / "studies" / f"{event.value}.toml"
            await self._take(file.read_text("utf-8"))
        elif event.value == _EMPTY:
            await self._take(BEGINNING)

    def _reject(self) -> None:
        self._form.show_problems(
            {"": f"Choose a study file that ends in .toml and has at most {LONGEST_TEXT:,} bytes."}
        )

    async def _take_upload(self, event: events.UploadEventArguments) -> None:
        data = await event.file.read()
        try:
            text = data[: LONGEST_TEXT + 1].decode("utf-8")
        except UnicodeDecodeError:
            self._form.show_problems({"": "This is not a text file in UTF-8. Choose a study file (.toml)."})
            return
        await self._take(text)

    async def _take(self, text: str) -> None:
        """Show the text of a file in the form; a text with mistakes stays in the tab File.

        The form is hidden until the text is read: what is entered in the meantime would be lost.
        """
        self._n_takes += 1
        take = self._n_takes
        self._text.value = text
        self._is_read = False
        self._show_reading(is_reading=True)
        found = await self._ask("read", text)
        if take != self._n_takes:  # another text was chosen
            return
        self._show_reading(is_reading=False)
        if not isinstance(found, TextRead):
            self._discard.set_visibility(True)
            self._is_text = True
            self._panels.value = "File"
            self._show_mistakes(found)
            return
        self._unread.clear()
        self._form.show_problems({})
        self._draft.data = found.data
        self._is_read, self._read_text = True, text.strip()
        await self._form_part.refresh()
        self._discard.set_visibility(False)
        self._form_box.set_visibility(not self._is_text)

    def _show_reading(self, *, is_reading: bool) -> None:
        self._form_box.set_visibility(False)
        for button in self._buttons:
            button.set_enabled(not is_reading)

    def _discard_text(self) -> None:
        """Show what the form has in place of a text with mistakes."""
        self._is_read = True
        self._discard.set_visibility(False)
        self._form.show_problems({})
        self._text.value = written_form(self._draft.data)
        self._read_text = text_of(self._text)

    async def _turn(self, event: events.ValueChangeEventArguments[Any]) -> None:
        """Turn between form and file, which show the same study."""
        self._is_text = event.value == "File"
        if self._is_text:
            self._form_box.set_visibility(False)  # until it is known whether the file has changed
            if self._is_read:
                self._text.value = written_form(self._draft.data)
                self._read_text = text_of(self._text)
        elif (text := text_of(self._text)) != self._read_text or not self._is_read:
            await self._take(text)
        else:
            self._form_box.set_visibility(True)

    # the form

    def _show_form(self) -> None:
        self._form.clear()
        self._boxes = []
        sections = form_sections()
        known = {field.place: field for fields in sections.values() for field in fields}
        with ui.element("div").classes("lab-form"):
            for place, label in _BASICS.items():
                self._input(known[place], place, label, self._draft.value(place), self._putter(known[place]))
        section("Conditions")
        with ui.expansion("Meaning of the columns").classes("lab-expansion"):
            for field in condition_fields():
                hint(f"{_COLUMNS[field.place.partition('.')[2]]}: {field.description}")
        self._show_conditions()
        self._advanced = ui.expansion("Advanced", value=self._is_open, on_value_change=self._open)
        with self._advanced.classes("lab-expansion"):
            ui.input(placeholder="Filter settings by name or meaning", on_change=self._search).props(
                'outlined dense clearable debounce=200 aria-label="Filter settings"'
            ).classes("lab-wide")
            for name, fields in sections.items():
                rest = [field for field in fields if field.place not in _BASICS]
                with ui.expansion(TITLES[name]).classes("lab-expansion") as box:
                    for field in rest:
                        label = field.place.rpartition(".")[2].replace("_", " ").capitalize()
                        value = self._draft.value(field.place)
                        with ui.element("div").classes("lab-form") as one:
                            self._input(field, field.place, label, value, self._putter(field))
                        self._boxes.append((f"{field.place} {label} {field.description}".lower(), one))
                self._boxes.append((" ".join(f"{f.place} {f.description}" for f in rest).lower(), box))

    def _open(self, event: events.ValueChangeEventArguments[bool]) -> None:
        """Remember whether advanced settings are shown, for the next time that the form is drawn.

        A press of a section that was just drawn again counts for the new one.
        """
        self._is_open = self._advanced.value = event.value

    def _search(self, event: events.ValueChangeEventArguments[str | None]) -> None:
        wanted = (event.value or "").lower()
        for text, box in self._boxes:
            box.set_visibility(wanted in text)
            if isinstance(box, ui.expansion):
                box.value = bool(wanted) and wanted in text

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
            hint(f"The form shows {MOST_SHOWN} of {len(listed):,} conditions. Change the others in the file.")
        ui.button("Add condition", on_click=self._add_condition).props("outline no-caps")

    def _show_condition(self, number: int, condition: dict[str, Any]) -> None:
        label = f"Condition {number + 1}"
        names: dict[int, Any] = {}
        with ui.element("div").classes("lab-condition").props(f'role="group" aria-label="{label}"'):
            for field in condition_fields():
                key = field.place.partition(".")[2]

                def put(value: Any, key: str = key) -> None:
                    name = self._own_name(condition)
                    condition.pop(key, None) if value is None else condition.__setitem__(key, value)
                    if name is not None and key != "name" and (renamed := _usual_name(condition)):
                        names[number].set_value(renamed)

                place = f"condition[{number + 1}].{key}"
                entry = self._input(field, place, _COLUMNS[key], condition.get(key), put, is_short=True)
                if key == "name":
                    names[number] = entry
            ui.button("Remove", on_click=lambda: self._remove(number)).props(
                f'flat no-caps aria-label="Remove condition {number + 1}"'
            )
        if more := [key for key, value in condition.items() if isinstance(value, dict)]:
            hint(f"{label} has its own settings for {', '.join(more)}. See the file.")

    def _input(
        self, field: Field, key: str, label: str, value: Any, put: Any, *, is_short: bool = False
    ) -> Any:
        """Add the field of one setting, and return it."""
        has_default = field.default not in ("", '""')
        default = f" Default: {field.default}." if has_default and not is_short else ""
        explanation = "" if is_short else f"{field.description}{default}"
        if field.kind in ("choice", "yes-no"):
            choices = field.choices or ("true", "false")
            shown = value if field.kind == "choice" or value is None else str(value).lower()
            if isinstance(shown, str) and shown not in choices:
                choices = (*choices, shown)
            chosen = self._form.choice(
                key, label, [*choices], shown if isinstance(shown, str) else None, explanation
            )
            chosen.props("clearable")
            chosen.on_value_change(lambda event: self._enter(field, key, event.value, put))
            return chosen
        text = self._unread.get(key, "" if value is None else _as_entered(field, value))
        placeholder = field.default.strip('"') if field.kind == "text" else field.default
        written = self._form.text(
            key,
            label,
            text,
            explanation=explanation,
            placeholder=placeholder,
            choices={"Default": {"": f"Default: {placeholder}"}} | dict(self._platforms)
            if field.place == "condition.platform"
            else None,
            parse=lambda text: _parsed(field, text),
        )
        written.props("debounce=300")
        written.on_value_change(lambda event: self._enter(field, key, event.value, put))
        return written

    def _enter(self, field: Field, key: str, text: Any, put: Any) -> None:
        """Put what was entered into the draft; a text that is no value stays in the field, which is marked."""
        self._unread.pop(key, None)
        if not isinstance(text, str) or text == "":
            put(None)
            return
        try:
            put(entered(field, text))
        except ValueError:
            self._unread[key] = text

    def _own_name(self, condition: dict[str, Any]) -> str | None:
        """Return the name of a condition if it only describes its settings, and nothing else in the file uses it."""
        name = condition.get("name")
        is_own = name is not None and name == _usual_name(condition)
        return name if is_own and written_form(self._draft.data).count(f'"{name}"') == 1 else None

    def _add_condition(self) -> None:
        listed = self._draft.data["condition"]
        listed.append({"name": f"condition-{len(listed) + 1}"})
        self._form_part.refresh()

    def _remove(self, number: int) -> None:
        del self._draft.data["condition"][number]
        rest = {key: text for key, text in self._unread.items() if _of(key) != number + 1}
        self._unread = {_moved_up(key, number + 1): text for key, text in rest.items()}
        self._form_part.refresh()

    # check and start

    def _whole(self) -> str:
        return text_of(self._text) if self._is_text else written_form(self._draft.data)

    async def _ask(self, do: Literal["read", "check"], text: str) -> TextResult:
        """Have another process read or check the text, until it is done or canceled."""
        if self._check is not None:
            self._check.end()
        try:
            check = self._check = await run.io_bound(self._lab.checks.begin, do, text)
        except StudyError as error:
            return TextRefused(str(error))
        if check is None:
            return TextRefused("The lab is closing.")
        self._waiting_for.text = f"{'Reading' if do == 'read' else 'Checking'} the study file…"
        self._waiting.set_visibility(True)
        try:
            found = await asyncio.wrap_future(check.found)
        finally:
            if self._check is check:
                self._check = None
                self._waiting.set_visibility(False)
        if isinstance(found, TextChecked) and text == self._summary.text:
            self._end_estimate()
            self._estimate = check
            self._read_estimate(check)
        return found

    def _cancel(self) -> None:
        if self._check is not None:
            self._check.end()

    async def _checked(self) -> tuple[TextChecked, str] | None:
        """Check what was entered, and return its text, too; None if there are mistakes, which are shown."""
        problems = await self._problems_of_form()
        text = self._whole()
        summary = self._summary_of("" if self._has_unread else text)
        found = await self._ask("check", text)
        if not isinstance(found, TextChecked) or problems:
            self._show_mistakes(found, problems)
            return None
        self._form.show_problems({})
        summary.is_checked, summary.is_due = True, False
        self._size.text = self._summary.words
        return found, text

    async def _problems_of_form(self) -> dict[str, str]:
        """Return what is wrong in fields by themselves, and in the name if a study has it."""
        if self._is_text:
            return {}
        problems = self._form.problems()
        name = self._draft.value("study.name")
        if "study.name" not in problems and isinstance(name, str) and name:
            taken = await run.io_bound(self._lab.name_mistakes, name)
            problems |= {} if taken is None else taken.problems
        return problems

    def _show_mistakes(self, found: TextResult, problems: Mapping[str, str] = _NONE) -> None:
        """Show the mistakes in the study, and those in fields of the form: each text that is no value."""
        text, places = (found.text, found.places) if isinstance(found, TextRefused) else ("", [])
        if text and (self._is_text or not places):
            self._form.show_problems({"": text, **problems})
            return
        self._form.show_problems({**dict(_problem_of(mistake) for mistake in places), **problems})

    async def _check_only(self) -> None:
        await self._checked()

    # the size of the study and its computing time, which are always in view

    async def _look_at_size(self) -> None:
        """Show the size; some time after the last change, have the computing time estimated."""
        text = "" if self._has_unread else self._whole()
        summary = self._summary_of(text)
        is_due = text and summary.is_due and time.monotonic() - summary.changed_s > PAUSE_S
        if self._estimate is not None:
            self._read_estimate(self._estimate)
        elif is_due and self._check is None and self._lab.checks.is_idle:
            summary.is_due = False
            with contextlib.suppress(StudyError):
                check = await run.io_bound(self._lab.checks.begin, "check", text)
                if check is not None and self._summary is summary and self._estimate is None:
                    self._estimate = check
                elif check is not None:  # something was entered in the meantime
                    check.end()
        self._size.text = self._summary.words

    @property
    def _has_unread(self) -> bool:
        """True if a field of the form has a text that is no value."""
        return bool(self._unread) and not self._is_text

    def _summary_of(self, text: str) -> _Summary:
        """Return the summary of this text; a new one if the text has changed."""
        if text != self._summary.text:
            self._end_estimate()
            self._summary = _Summary(text, time.monotonic(), *self._size_of_draft())
        return self._summary

    def _size_of_draft(self) -> tuple[int, int]:
        """Return the numbers of conditions and of runs of each; 0 where that is not known."""
        listed, replicates = self._draft.data.get("condition"), self._draft.value("study.replicates")
        if self._is_text or self._has_unread or not isinstance(listed, list):
            return 0, 0
        return len(listed), replicates if isinstance(replicates, int) else 0

    def _read_estimate(self, check: Check) -> None:
        """Take what the check has found so far."""
        summary = self._summary
        if check.found.done() and isinstance(found := check.found.result(), TextChecked):
            summary.n_conditions, summary.replicates = found.n_conditions, found.replicates
            summary.n_trials = found.n_trials
            summary.is_estimating = not check.seconds.done()
        if check.seconds.done():
            summary.seconds = check.seconds.result()
            self._estimate = None

    def _end_estimate(self) -> None:
        if self._estimate is not None:
            self._estimate.end()
            self._estimate = None

    async def _start(self) -> None:
        checked = await self._checked()
        if checked is None:
            return
        found, text = checked
        try:
            await run.io_bound(self._lab.start_new, found.name, text)
        except WRONG as error:
            self._form.show_problems({"" if self._is_text else "study.name": str(error)})
        else:
            ui.navigate.to(f"/study/{found.name}")


@dataclass
class _Summary:
    """The size of a study, and its computing time.

    Attributes:
        text: Its file.
        changed_s: When this was entered [s].
        n_conditions, replicates: Its size; 0 if unknown.
        n_trials: Trials that a robot drives.
        is_checked: Whether a visitor had it checked, without a mistake.
        is_due: Whether its computing time is still to be estimated.
        is_estimating: Whether that is being done.
        seconds: Computing time [s]; None if unknown.
    """

    text: str = ""
    changed_s: float = 0.0
    n_conditions: int = 0
    replicates: int = 0
    n_trials: int = 0
    is_checked: bool = False
    is_due: bool = True
    is_estimating: bool = False
    seconds: float | None = None

    @property
    def words(self) -> str:
        """The summary in words; empty if the size is unknown."""
        n, replicates = self.n_conditions, self.replicates
        if n <= 0 or replicates <= 0:
            return ""
        parts = [
            f"{counted(n, 'condition')} × {counted(replicates, 'run')} = {counted(n * replicates, 'run')}"
        ]
        if self.n_trials:
            parts.append(f"{counted(self.n_trials, 'trial')} on the robot")
        if self.is_estimating:
            parts.append("estimating the time…")
        elif self.seconds is not None and self.seconds < LEAST_S:
            parts.append(f"less than {LEAST_S:.0f} s on this machine")
        elif self.seconds is not None:
            parts.append(f"about {duration(self.seconds)} on this machine")
        return ("No mistakes. " if self.is_checked else "") + " · ".join(parts)


def _problem_of(mistake: str) -> tuple[str, str]:
    """Return the key of a field and what is wrong there, from PLACE: MESSAGE of a study file."""
    match = re.fullmatch(r"(condition\[\d+\])?(?: '[^']*')?([\w.-]*): (.*)", mistake, re.DOTALL)
    if match is None:
        return mistake, mistake
    key, text = f"{match[1] or ''}{match[2]}", match[3]
    if text.startswith("missing,"):
        return key, "This field is empty. Enter a value."
    asked = re.fullmatch(r"expected (.*), (?:came|got) (.*)\.", text, re.DOTALL)
    return key, text if asked is None else f"Enter {asked[1]}. You entered {asked[2]}."


def _parsed(field: Field, text: str) -> Any:
    try:
        return None if text == "" else entered(field, text)
    except ValueError as error:
        raise ValueError(_problem_of(str(error))[1]) from error


def _as_entered(field: Field, value: Any) -> str:
    return value if field.kind == "text" and isinstance(value, str) else toml_value(value)


def _usual_name(condition: dict[str, Any]) -> str | None:
    """Return a name such as coverage-10, of the search and the noise [%]; None if one of them is missing."""
    selection, noise = condition.get("selection"), condition.get("noise")
    return (
        f"{selection}-{100 * noise:g}"
        if isinstance(selection, str) and isinstance(noise, float | int) and 0 <= noise <= 10
        else None
    )


def _of(key: str) -> int:
    """Return the number of the condition that a field belongs to; 0 if it belongs to none."""
    match = re.match(r"condition\[(\d+)\]", key)
    return int(match[1]) if match is not None else 0


def _moved_up(key: str, removed: int) -> str:
    """Return the key of a field once a condition before it was removed."""
    number = _of(key)
    return key.replace(f"[{number}]", f"[{number - 1}]", 1) if number > removed else key
