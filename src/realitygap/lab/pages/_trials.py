"""Trials: the page for the operator of the robot, and for scoring."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

from nicegui import run, ui
from starlette.exceptions import HTTPException
from starlette.requests import Request

from realitygap._wording import counted
from realitygap.errors import RealityGapError
from realitygap.lab import _messages as messages
from realitygap.lab._choices import port_choices
from realitygap.lab._control import Visitor
from realitygap.lab._counts import CountedTrial, Counts
from realitygap.lab._design import TOO_LATE
from realitygap.lab._lab import Lab
from realitygap.lab._mistakes import FormError, refuse_unnamed
from realitygap.lab._photos import Photos
from realitygap.lab._study import StudyJob, sitting_mistakes
from realitygap.report import measure_agreement
from realitygap.robot_families import default_family
from realitygap.robots import PortGuess, list_ports

from ._control import show_holder
from ._counting import Counting
from ._design import DesignFold
from ._fields import Form, needed
from ._frame import LONGEST_NAME, framed, hint, remember_who, text_of, visitor_of
from ._notices import WRONG, attempt, show_at_fields, try_now
from ._part import Part, watching
from ._photos import SheetPhotos
from ._sitting import Driving, show_question
from ._status import show_steps
from ._videos import Videos

_STEPS = ("Place", "Drive", "Score", "Close")
_STEP_OF: dict[type[messages.Question], str] = {
    messages.SettleQuestion: "Drive",
    messages.ContinueQuestion: "Drive",
    messages.ScoreQuestion: "Score",
    messages.CloseQuestion: "Close",
}
"""Steps of the questions that do not belong to placing the robot."""
_SCORERS = {
    "page": "A person, on this page",
    "camera": "The camera; without one, a person confirms",
    "witness": "The emulator; only for emulated robots",
}
_LOCK = (
    "Saves conditions, replicates, and rules with a hash before trial 1. All deviations from them are listed."
)
_WHEN = {"sheet": "When a sheet is full", "trial": "After each trial"}
_TO_GRID = "document.querySelector('[data-counting]')?.scrollIntoView({block: 'start'})"
"""Bring the grid into view; its section must be open, or the page is not long enough."""
_BADGE = """
<q-td :props="props">
  <span v-if="props.value" :class="'lab-badge lab-label-' + props.value.toLowerCase()">{{ props.value }}</span>
</q-td>
"""
_NUMBER = """
<q-td :props="props">
  <q-btn v-if="props.row.counts" outline dense no-caps padding="4px 12px" :label="String(props.value)"
         :aria-label="`Score trial ${props.value}`" @click="$parent.$emit('choose', props.value)" />
  <template v-else>{{ props.value }}</template>
</q-td>
"""
"""The number of a trial in the table: who can count it taps it."""


def add_trials(lab: Lab) -> None:
    """Add the page."""

    @ui.page("/study/{name}/trials", response_timeout=30)
    async def trials(name: str, request: Request) -> None:
        def open_study() -> tuple[Counts, Photos]:
            counts = lab.counts(name)
            counts.look()
            return counts, lab.photos(name)

        if not await run.io_bound(lab.studies.has, name):
            raise HTTPException(404, name)
        above = [("Studies", "/"), (name, f"/study/{name}")]
        try:
            found = await run.io_bound(open_study)
        except RealityGapError as error:
            with framed(lab, "Trials", "", above=above):
                ui.label(str(error)).classes("lab-problem")
            return
        if found is not None:
            with framed(lab, "Trials", "", above=above):
                await _Page(lab, name, *found, visitor_of(request)).show()


class _Page:
    def __init__(self, lab: Lab, name: str, counts: Counts, photos: Photos, visitor: Visitor) -> None:
        self._lab = lab
        self._name = name
        self._counts = counts
        self._visitor = visitor
        self._counting = Counting(lab, counts, photos, lambda: self._visitor.who)
        self._videos = Videos(lab, counts, self._look_at)
        self._sheets = SheetPhotos(lab, counts, photos, lambda: self._visitor.who, self._look_at)
        self._is_looking = self._is_shown = False
        self._current_fold: ui.expansion | None = None
        self._can_begin: _Beginning | None = None
        self._agreement = self._looks = ""
        self._emulated = counts.emulated_robot or default_family().emulated

    async def show(self) -> None:
        await self._load()
        self._seen: Any = None
        self._robot = Part(self._robot_stand, self._show_robot)
        self._asked = Part(self._asked_stand, self._show_asked)
        self._ending = Part(self._may_end, self._show_ending)
        self._stepped = Part(lambda: (self._step(), self._n_waiting()), self._show_steps)
        self._steps = Part(lambda: (self._step(), self._job() is None), self._turn_to)
        with ui.element("div").classes("lab-steps-bar"):
            self._stepped.show()
            self._steps.show()
        with ui.element("div").classes("lab-wide") as self._name_box:
            self._show_name()
        self._name_box.set_visibility(not self._visitor.who)
        self._holder = Part(lambda: self._robot_stand().operator, self._show_holder)
        self._holder.show()
        with ui.element("section").props('aria-label="Current step"').classes("lab-current"):
            self._asked.show()
        with self._fold("Score") as self._score_fold:
            # Before the wait, in which the page may be sent: an element that gets a listener later is drawn again.
            self._score_fold.on("after-show", js_handler=f"() => {_TO_GRID}")
            await self._counting.show()
        with self._fold("Robot") as self._robot_fold:
            for part in (self._robot, self._ending):
                part.show()
        self._design = DesignFold(
            lambda: self._lab.studies.path(self._name),
            lambda: self._counts.design,
            lambda: self._visitor.who,
            lambda: self._job() is None or self._may(),
            self._look,
        )
        self._design.show()
        self._pictured, self._tracked = self._sheets.stand(), self._videos.stand()
        self._listed = self._counts.trials()
        self._photos, self._filmed = ui.refreshable(self._sheets.show), ui.refreshable(self._videos.show)
        with self._fold("Score from photo or video") as self._photo_fold:
            self._photos()
            self._filmed()
        self._table = ui.refreshable(self._show_table)
        with self._fold("All trials") as self._table_fold:
            self._table()
        self._known = Part(lambda: self._visitor.who, self._show_known)
        with self._fold("Notes"):
            self._known.show()
            self._show_note()
        self._name_folds()
        self._open_step(self._step())
        self._is_shown = True
        watching(self._lab, self._look)
        ui.timer(1.0, self._look)  # another program may write to the ledger

    def _fold(self, title: str) -> ui.expansion:
        """A section that is open during its step, or if the visitor opens it."""
        return (
            ui.expansion(title).classes("lab-expansion").props(f'header-class="lab-fold" data-fold="{title}"')
        )

    def _show_name(self) -> None:
        form = Form()
        name = form.text(
            "who",
            "Your name",
            self._visitor.who,
            explanation="Your name is saved with each score. Two people who score the same trials need two names.",
        )
        name.props(f"debounce=400 maxlength={LONGEST_NAME}")
        name.on_value_change(lambda event: self._named(text_of(event)))

        def refuse(error: FormError) -> bool:
            self._name_box.set_visibility(True)
            return form.refuse(error)

        show_at_fields(refuse)

    def _show_known(self, who: str) -> None:
        if who:
            with ui.row().classes("lab-row"):
                ui.label(f"Scores are saved as {who}.")
                ui.button("Change name", on_click=lambda: self._name_box.set_visibility(True)).props(
                    "flat no-caps"
                )

    def _name_folds(self) -> None:
        """Put the number of trials into the titles of the sections."""
        trials = self._counts.trials()
        n_waiting = self._n_waiting()
        titles = {
            self._score_fold: f"Score: {n_waiting} to score" if n_waiting else "Score",
            self._table_fold: f"All trials: {len(trials)}" if trials else "All trials",
            self._robot_fold: "Connect a robot" if self._job() is None else "Robot",
        }
        for fold, title in titles.items():
            if fold.text != title:
                fold.text = title
        self._photo_fold.set_visibility(bool(self._sheets.sheets()) or self._videos.has_job)

    def _n_waiting(self) -> int:
        """Number of trials that wait to be scored."""
        return sum(each.trial.state == "driven" for each in self._counts.trials())

    def _show_steps(self, at: tuple[str, int]) -> None:
        """Show the steps, and how many trials wait to be scored in whatever step."""
        step, n_waiting = at
        show_steps(_STEPS, step, {"Score": f"Score: {n_waiting}"} if n_waiting else {})

    def _turn_to(self, at: tuple[str, bool]) -> None:
        """Open the section of the current step and close that of the step before."""
        step, _ = at
        if self._is_shown:
            was_open = self._score_fold.value
            self._name_box.set_visibility(not self._visitor.who)
            self._open_step(step)
            if step != "Score":
                ui.run_javascript("scrollTo(0, 0)")
            elif was_open:
                ui.run_javascript(_TO_GRID)

    def _open_step(self, step: str) -> None:
        """Open the section of a step. A section that the visitor opened stays: a hand may be on a button in it."""
        current = None
        if step == "Score":
            current = self._score_fold
        elif step == "Place" and self._job() is None:
            current = self._robot_fold
        for fold in (self._score_fold, self._robot_fold):
            if fold is current:
                fold.value = True
            elif fold is self._current_fold:
                fold.value = False
            fold.classes(**{"add" if fold is current else "remove": "lab-current"})
        self._current_fold = current
        if step == "Score" and self._sheets.has_photos:
            self._photo_fold.value = True

    async def _load(self) -> None:
        """Read what the disk has for this page."""
        await run.io_bound(self._counts.look)
        await self._sheets.load()
        await self._videos.load()
        if self._job() is None:
            self._can_begin = await run.io_bound(self._beginning)
        if any(each.second for each in self._counts.trials()):
            self._agreement = await run.io_bound(self._agree) or ""
        self._looks = await run.io_bound(self._counts.looks) or ""

    async def _look(self) -> None:
        """Update the parts that have changed; a grid in use stays."""
        if self._is_looking:  # the disk takes its time
            return
        self._is_looking = True
        try:
            await run.io_bound(self._counts.look)
            stand = self._robot_stand(), self._sheets.stand(), self._videos.stand(), self._counts.trials()
            if stand != self._seen:
                self._seen = stand
                await self._load()
            await self._show_changes()
        finally:
            self._is_looking = False

    async def _show_changes(self) -> None:
        for part in (
            self._robot, self._asked, self._ending, self._stepped, self._steps, self._known, self._holder,
            self._design,
        ):  # fmt: skip
            part.look()
        if self._counts.trials() is not self._listed:
            self._listed = self._counts.trials()
            await self._counting.refresh()
            self._table.refresh()
        self._name_folds()
        await self._counting.look()
        if self._pictured != (now := self._sheets.stand()):
            self._pictured = now
            self._photos.refresh()
            if self._sheets.has_photos:
                self._photo_fold.value = True
        if self._tracked != (now := self._videos.stand()):
            self._tracked = now
            self._filmed.refresh()

    async def _look_at(self, number: int) -> None:
        """Show the grid of this trial."""
        with ui.context.client:  # the button that was pressed may be gone by then
            await self._counting.choose(number)
            if self._score_fold.value:
                ui.run_javascript(_TO_GRID)
            self._score_fold.value = True

    async def _named(self, who: str) -> None:
        self._visitor = Visitor(self._visitor.key, who.strip()[:LONGEST_NAME])
        remember_who(self._visitor.who)
        self._lab.robot.rename(self._visitor)
        await self._sheets.load()
        await self._counting.refresh()
        self._table.refresh()

    # the robot

    def _job(self) -> StudyJob | None:
        """Job of this study that uses a robot."""
        job = self._lab.job(self._name)
        return job if job is not None and job.port else None

    def _may(self) -> bool:
        return self._lab.robot.may_operate(self._visitor)

    def _robot_stand(self) -> _RobotStand:
        job, last = self._job(), self._lab.jobs.get(self._name)
        if last is not None and not last.port:  # of simulated runs: the study page shows how they ended
            last = None
        return _RobotStand(
            job,
            outcome="" if last is None else last.outcome or "",
            is_failed=last is not None and last.is_failed,
            label="" if job is None else job.label,
            preflight=None if job is None else job.preflight,
            camera_note="" if job is None else job.camera_note,
            operator="" if job is None or self._may() else self._lab.robot.operator_name,
            may_lock=None
            if job is not None or self._counts.design is not None
            else not self._counts.has_begun,
        )

    def _show_robot(self, now: _RobotStand) -> None:
        """Show the robot in use and its operator, or the form that connects one."""
        job = now.job
        if job is None:
            if now.outcome:
                ui.label(now.outcome).classes("lab-problem" if now.is_failed else "").props('role="status"')
            self._show_beginning(now.may_lock)
            return
        with ui.row().classes("lab-row"):
            if now.label:
                ui.label(now.label).classes(f"lab-label-{now.label.lower()} lab-badge")
            ui.label(f"Connected to {job.port}" if now.label else f"Connecting to {job.port}…")
        if now.preflight is not None:
            _show_preflight(now.preflight)
        if now.camera_note:
            ui.label(now.camera_note).classes("lab-problem").props('role="status"')

    def _show_holder(self, operator: str) -> None:
        if operator:
            show_holder(self._lab, self._visitor)

    def _asked_stand(self) -> _AskedStand:
        job = self._job()
        if job is None:
            is_complete = self._can_begin is not None and self._can_begin.is_complete
            return _AskedStand(None, n_trials=len(self._counts.trials()), is_complete=is_complete)
        ask = job.ask
        return _AskedStand(job, ask, None if ask is not None else job.card, self._may())

    def _step(self) -> str:
        """The step that the study is at; empty if all trials are complete."""
        state = self._asked_stand()
        if state.ask is not None:
            return _STEP_OF.get(type(state.ask), "Place")
        if state.job is not None:
            return "Drive" if state.card is not None else "Place"
        if any(each.trial.state == "driven" for each in self._counts.trials()):
            return "Score"
        return "" if self._can_begin is None or self._can_begin.is_complete else "Place"

    def _show_asked(self, now: _AskedStand) -> None:
        """Show the question, or the trial that is being driven."""
        if now.job is None:
            self._show_rest()
        elif now.ask is not None:
            show_question(now.job, now.ask, self._counts, may=now.may)
        elif now.card is not None:
            Driving(now.job, now.card, self._counts).show()
        else:
            ui.label("Preparing the next trial…").props('role="status"')

    def _show_rest(self) -> None:
        """Show the progress of the trials while no robot is connected."""
        if self._can_begin is not None and self._can_begin.is_complete:
            n_scored = sum(each.trial.state == "scored" for each in self._counts.trials())
            with ui.row().classes("lab-row"):
                ui.label(
                    "The trial is scored." if n_scored == 1 else f"All {n_scored:,} trials scored."
                ).props('role="status"')
                ui.button("Open results", on_click=lambda: ui.navigate.to(f"/study/{self._name}")).props(
                    "unelevated no-caps"
                )
        elif not self._counts.trials():
            ui.label(f"No trials yet. Connect a robot to drive {counted(self._counts.n_planned, 'trial')}.")

    def _may_end(self) -> _AskedStand:
        return _AskedStand(self._job(), may=self._may())

    def _show_ending(self, now: _AskedStand) -> None:
        if now.job is not None:
            ui.button("Disconnect", on_click=now.job.ask_to_end).props("flat no-caps").set_enabled(now.may)

    def _show_beginning(self, may_lock: bool | None) -> None:
        """Show the form that connects a robot."""
        if self._can_begin is None:
            return
        if self._can_begin.is_complete:
            return
        found = self._can_begin.ports
        last = self._lab.jobs.get(self._name)
        is_lost = last is not None and last.is_failed and bool(last.port)
        # a camera that did not open is not proposed again
        before = last.work if last is not None and last.is_lost else messages.StudyWork("")
        likely = [guess.port for guess in found if guess.seems != "a serial port"]
        self._form = form = Form()
        form.summary()

        def begin(values: dict[str, Any]) -> None:
            self._lab.go_on(self._name, who=self._visitor.who, **values)
            self._lab.robot.take(self._visitor)

        async def connect() -> None:
            if may_lock and lock.value and not try_now(lambda: refuse_unnamed(self._visitor.who)):
                return
            await form.submit(begin, partial(sitting_mistakes, self._lab.root))

        async def emulate() -> None:
            port.value = self._emulated
            await connect()

        with ui.element("div").classes("lab-form"):
            port = form.text(
                "port",
                "Port",
                last.port if last is not None and is_lost else likely[0] if likely else "",
                choices=port_choices(found),
                parse=needed,
                placeholder="/dev/rfcomm0 or COM3",
                explanation="Place the robot on free floor first.",
            )
            if may_lock is not None:
                lock = form.switch(
                    "lock", "Lock design", explanation=_LOCK if may_lock else TOO_LATE, is_enabled=may_lock
                )
            with ui.row().classes("lab-row"):
                text = "Reconnect" if is_lost else "Connect robot"
                ui.button(text, on_click=connect).props("unelevated no-caps").classes("lab-primary")
            with ui.expansion("Advanced").classes("lab-expansion"):
                form.choice("counts", "Scored by", _SCORERS, before.counts or "page")
                form.choice("when", "When to score", _WHEN, before.when)
                form.text(
                    "witness",
                    "Witness",
                    before.witness,
                    explanation="HOST:PORT of the witness of an emulator in another program.",
                )
                form.text(
                    "camera",
                    "Camera",
                    before.camera,
                    explanation="Number and options of an overhead camera: 0?tag=10.",
                )
            with ui.row().classes("lab-row"):
                ui.button("Use an emulated robot", on_click=emulate).props("outline no-caps")
                hint("Drives the trials without hardware. Their label is EMULATED.")

    def _beginning(self) -> _Beginning | None:
        try:
            state = self._lab.studies.state(self._name)
        except RealityGapError:
            return None
        return _Beginning(state.is_complete, tuple(list_ports()))

    # what there is

    def _agree(self) -> str:
        try:
            return measure_agreement(self._lab.studies.path(self._name)).sentence
        except WRONG as error:
            return str(error)

    def _show_table(self) -> None:
        found = self._counts.trials()
        if not found:
            ui.label("No trials yet.")
            return
        if self._agreement:
            ui.label(self._agreement)
        if self._looks:
            ui.label(self._looks)
        rows = [
            {
                "number": each.number,
                "counts": each.role_of(self._visitor.who) is not None,
                "label": each.label,
                "code": each.trial.code,
                "sheet": each.trial.sheet,
                "pen": each.pen,
                "state": each.trial.state,
                "cells": self._n_cells(each),
                "said": "; ".join(filter(None, (each.trial.reason or each.trial.problem or "", *each.notes))),
            }
            for each in found
        ]
        has_paper = any(each.label != "EMULATED" for each in found)
        columns = [
            {"name": name, "label": label, "field": name, "align": "left"}
            for name, label in (
                ("number", "Trial"),
                ("label", "Label"),
                ("code", "Code"),
                *((("sheet", "Sheet"), ("pen", "Pen")) if has_paper else ()),
                ("state", "State"),
                ("cells", "Cells"),
                ("said", "Notes"),
            )
        ]
        table = ui.table(rows=rows, columns=columns, row_key="number", pagination=20)
        table.classes("lab-table").props("flat bordered dense wrap-cells")
        table.add_slot("body-cell-number", _NUMBER)
        table.add_slot("body-cell-label", _BADGE)
        table.on("choose", lambda event: self._choose(event.args))

    async def _choose(self, number: Any) -> None:
        if type(number) is int:
            await self._look_at(number)

    def _show_note(self) -> None:
        note = Form().text("note", "Note on the study", explanation="Press Enter to save the note.")
        note.on("keydown.enter", lambda event: self._note(event.sender))

    def _n_cells(self, trial: CountedTrial) -> str:
        """Return the number of cells; hidden from a visitor who can still score a second time."""
        if trial.trial.cells is None:
            return ""
        is_seen = trial.trial.is_closed or trial.second or trial.first == self._visitor.who
        return str(len(trial.trial.cells)) if is_seen else "counted"

    async def _note(self, field: Any) -> None:
        if await attempt(lambda: self._counts.note(None, text_of(field), self._visitor.who), "Note saved."):
            field.value = ""


@dataclass(frozen=True)
class _Beginning:
    """Facts that are needed before a robot drives."""

    is_complete: bool
    ports: tuple[PortGuess, ...]


@dataclass(frozen=True)
class _RobotStand:
    """The robot of a study, or the outcome of the last session."""

    job: StudyJob | None
    outcome: str
    is_failed: bool
    label: str
    preflight: messages.PreflightResult | None
    camera_note: str
    operator: str
    may_lock: bool | None


@dataclass(frozen=True)
class _AskedStand:
    """A question of a study, or the trial that is driven, and whether this visitor may answer."""

    job: StudyJob | None
    ask: messages.Question | None = None
    card: messages.TrialCard | None = None
    may: bool = False
    n_trials: int = 0
    is_complete: bool = False


def _show_preflight(result: messages.PreflightResult) -> None:
    n_problems = len(result.problems)
    words = counted(n_problems, "problem") if n_problems else "passed"
    with ui.expansion(f"Pre-flight check: {words}").classes("lab-expansion"):
        for name, value in result.facts.items():
            ui.label(f"{name}: {value}")
        for problem in result.problems:
            ui.label(problem).classes("lab-problem")
