"""Trials on a robot as they go: the question for the operator, or the robot that drives."""

from __future__ import annotations

from nicegui import ui

from realitygap._wording import counted
from realitygap.lab import _messages as messages
from realitygap.lab._counts import Counts
from realitygap.lab._study import StudyJob
from realitygap.trials import start_words

from ._elements import CellGrid, ink_of
from ._frame import hint
from ._notices import notify
from ._status import Silence

LIVE_S = 0.05
"""Time between two updates [s]. Another process drives the robot, even if no page is open."""


def show_question(job: StudyJob, question: messages.Question, counts: Counts, *, may: bool) -> None:
    """Show the question that a study waits for.

    Args:
        job: The study at work.
        question: The question.
        counts: Trials of the study.
        may: Whether this visitor may answer.
    """
    with ui.card().classes("lab-card lab-question").props(f'role="status" data-asked="{question.number}"'):
        _Shown(job, question.number, counts, may).show(question)


class _Shown:
    """A question on a page, and whether the visitor may answer it."""

    def __init__(self, job: StudyJob, number: int, counts: Counts, may: bool) -> None:
        self._job, self._number, self._counts, self._may = job, number, counts, may

    def show(self, question: messages.Question) -> None:
        """Show the question."""
        match question:
            case messages.MeetQuestion():
                ui.label("Place the robot on free floor").classes("lab-section")
                ui.label("During the pre-flight check, the robot turns on the spot for a moment.")
                self._button("Robot is in place")
            case messages.AcceptQuestion():
                ui.label("The pre-flight check found a problem").classes("lab-section")
                for problem in question.problems:
                    ui.label(problem).classes("lab-problem")
                with ui.row().classes("lab-row"):
                    self._button("Cancel", "no")
                    self._button("Drive anyway", "yes", is_main=False)
            case messages.PlaceQuestion():
                self._show_place(question)
            case messages.SettleQuestion():
                self._show_settle(question)
            case messages.ContinueQuestion():
                _title(question.card)
                ui.label(f"{_interrupted(question.problem)} It will be repeated.")
                self._button("Continue")
            case messages.ScoreQuestion():
                end = "The trial has ended. "
                if question.is_full:
                    end = "" if self._job.label == "EMULATED" else f"Sheet {question.sheet} is full. "
                with ui.row().classes("lab-row no-wrap"):
                    ui.label(f"{end}Score the trials, on this page or another. The study then continues.")
                    self._button("Later", is_main=False)
            case messages.CloseQuestion():
                self._show_close(question)

    def _show_place(self, question: messages.PlaceQuestion) -> None:
        card = question.card
        arena = self._counts.arena(self._counts.trial(card["trial"]).trial.condition)
        _title(card)
        with ui.row().classes("lab-row no-wrap"):
            ui.element("span").classes("lab-pen").style(f"background: {ink_of(card['pen'])}")
            paper = "" if question.is_placed else f"Pen: {card['pen']}. Sheet {card['sheet']}. "
            ui.label(f"{paper}{counted(card['n_left'], 'trial')} left in this generation.")
        if question.is_placed:
            ui.label("The emulated robot is placed at its start automatically.")
        else:
            ui.label(f"Put the robot at its start, pen down: {start_words(arena)}")
        CellGrid(arena, name=f"The start: {start_words(arena)}").classes("lab-sketch")
        self._button("Start trial")

    def _show_settle(self, question: messages.SettleQuestion) -> None:
        _title(question.card)
        ui.label(_interrupted(question.problem)).classes("lab-problem")
        step = self._job.step
        if step is not None:
            ui.label(f"Last recorded step: {step.step + 1} of {step.n_steps}.")
        ui.label("Void: the trial is repeated. Driven: it counts, with the line drawn so far.")
        with ui.row().classes("lab-row"):
            self._button("Void and repeat", "void")
            self._button("Count as driven", "driven", is_main=False)

    def _show_close(self, question: messages.CloseQuestion) -> None:
        ui.label("All trials of this generation are scored").classes("lab-section")
        ui.label(
            "The scores select the parents of the next generation. After closing, you can only add corrections."
        )
        for number in question.trials:
            trial = self._counts.trial(number)
            cells = counted(len(trial.trial.cells or ()), "cell")
            with ui.row().classes("lab-row"):
                ui.label(f"Trial {number}, {trial.pen}: {cells} by {trial.first}")
                undo = ui.button("Undo", on_click=lambda number=number: self._answer(trial=number))
                undo.props(f'flat dense no-caps aria-label="Undo the score of trial {number}"')
                undo.set_enabled(self._may)
        self._button("Close generation")

    def _button(self, text: str, choice: messages.Choice = "", *, is_main: bool = True) -> None:
        """Show a button that answers the question, if this visitor may."""
        if not self._may:
            return
        ui.button(text, on_click=lambda: self._answer(choice)).props(
            ("unelevated" if is_main else "outline") + " no-caps"
        ).classes("lab-primary" if is_main else "")

    def _answer(self, choice: messages.Choice = "", trial: int | None = None) -> None:
        if not self._job.answer(messages.Answer(self._number, choice, trial)):
            notify("Another page has answered this question.")


def _interrupted(problem: str) -> str:
    """Return why a trial was interrupted, as a sentence; a problem may be one already."""
    return f"The trial was interrupted: {problem}" + ("" if problem.endswith((".", "?")) else ".")


def _title(card: messages.TrialCard) -> None:
    ui.label(f"Trial {card['trial']}").classes("lab-section").props(f'data-trial="{card["trial"]}"')
    hint(card["title"])


class Driving:
    """Shows a trial while it is driven; the abort is for everyone.

    Args:
        job: The study at work.
        card: Of the trial.
        counts: The study's trials.
    """

    def __init__(self, job: StudyJob, card: messages.TrialCard, counts: Counts) -> None:
        self._job, self._card, self._counts = job, card, counts
        self._n_shown = -1

    def show(self) -> None:
        """Show it."""
        card = self._card
        condition = self._counts.trial(card["trial"]).trial.condition
        arena, outlines = self._counts.arena(condition), self._counts.outlines(condition)
        with ui.card().classes("lab-card lab-question"):
            ui.label(f"Trial {card['trial']} is being driven").classes("lab-section").props('role="status"')
            hint(card["title"] if self._job.label == "EMULATED" else f"{card['title']}. Pen: {card['pen']}.")
            self._bar = ui.linear_progress(0, show_value=False).props('aria-label="Steps driven"')
            self._step_words = ui.label("")
            self._silence = Silence()
            self._grid = CellGrid(arena, ink=card["pen"], outlines=outlines, name="Position of the robot")
            self._grid.classes("lab-sketch")
            self._cells = ui.label("").classes("lab-value")
            ui.button("Abort trial", on_click=self._job.stop_robot, color=None).classes("lab-pad-stop").props(
                "unelevated no-caps"
            )
        ui.timer(LIVE_S, self._look)

    def _look(self) -> None:
        job = self._job
        self._silence.look(job.silent_s)
        if job.n_live == self._n_shown or job.card is not self._card:
            return
        self._n_shown = job.n_live
        step = job.step
        if step is not None:
            self._bar.value = (step.step + 1) / step.n_steps
            seen = ", ".join(f"{reading:.0f}" for reading in step.raw)
            stalled = " · blocked" if step.stalled else ""
            motion = f"forward {step.move:+.2f} · turn {step.turn:+.2f}".replace("-", "−")
            self._step_words.text = (
                f"Step {step.step + 1} of {step.n_steps} · readings {seen} · {motion}{stalled}"
            )
        if job.pose is not None:
            self._cells.text = f"Entered: {self._grid.follow(job.pose, job.line, job.cells)}"
