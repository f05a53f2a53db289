"""Questions for the operator, with the buttons that answer them."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from realitygap._wording import counted
from realitygap.lab._counts import Counts
from realitygap.lab._study_job import StudyJob
from realitygap.trials import start_words

from ._frame import hint
from ._grid import CellGrid, ink_of
from ._notices import notify


def show_question(job: StudyJob, ask: dict[str, Any], counts: Counts, *, may: bool) -> None:
    """Show the question that a study waits for.

    Args:
        job: The study at work.
        ask: What it asks.
        counts: Its trials.
        may: Whether this visitor may answer.
    """
    with ui.card().classes("lab-card lab-question").props(f'role="status" data-asked="{ask["number"]}"'):
        show = {
            "meet": _meet,
            "accept": _accept,
            "settle": _settle,
            "go on": _go_on,
            "place": _place,
            "score": _score,
            "close": _close,
        }[ask["question"]]
        show(_Asked(job, ask, counts, may))


class _Asked:
    """A question, and who is asked."""

    def __init__(self, job: StudyJob, ask: dict[str, Any], counts: Counts, may: bool) -> None:
        self.job, self.ask, self.counts, self.may = job, ask, counts, may

    @property
    def card(self) -> dict[str, Any]:
        """Card of the trial in question."""
        found: dict[str, Any] = self.ask["card"]
        return found

    def answer(self, **values: Any) -> None:
        """Answer the question."""
        if not self.job.answer(self.ask["number"], **values):
            notify("Another page has answered this question.")

    def button(self, text: str, *, is_main: bool = True, **values: Any) -> None:
        """Show a button that answers the question."""
        ui.button(text, on_click=lambda: self.answer(**values)).props(
            ("unelevated" if is_main else "outline") + " no-caps"
        ).classes("lab-primary" if is_main else "").set_enabled(self.may)


def _meet(asked: _Asked) -> None:
    ui.label("Place the robot on free floor").classes("lab-section")
    ui.label("During the pre-flight check, the robot turns on the spot for a moment.")
    asked.button("Robot is in place")


def _accept(asked: _Asked) -> None:
    ui.label("The pre-flight check found a problem").classes("lab-section")
    for problem in asked.ask["problems"]:
        ui.label(problem).classes("lab-problem")
    with ui.row().classes("lab-row"):
        asked.button("Cancel", yes=False)
        asked.button("Drive anyway", yes=True, is_main=False)


def _settle(asked: _Asked) -> None:
    _title(asked.card)
    ui.label(_interrupted(asked.ask["problem"])).classes("lab-problem")
    step = asked.job.step
    if step is not None:
        ui.label(f"Last recorded step: {step['step'] + 1} of {step['n_steps']}.")
    ui.label("Void: the trial is repeated. Driven: it counts, with the line drawn so far.")
    with ui.row().classes("lab-row"):
        asked.button("Void and repeat", verdict="void")
        asked.button("Count as driven", verdict="driven", is_main=False)


def _interrupted(problem: str) -> str:
    """Return why a trial was interrupted, as a sentence; a problem may be one already."""
    return f"The trial was interrupted: {problem}" + ("" if problem.endswith((".", "?")) else ".")


def _go_on(asked: _Asked) -> None:
    _title(asked.card)
    ui.label(f"{_interrupted(asked.ask['problem'])} It will be repeated.")
    asked.button("Continue")


def _place(asked: _Asked) -> None:
    card = asked.card
    arena = asked.counts.arena(asked.counts.trial(card["trial"]).trial.condition)
    _title(card)
    with ui.row().classes("lab-row no-wrap"):
        ui.element("span").classes("lab-pen").style(f"background: {ink_of(card['pen'])}")
        ui.label(f"Pen: {card['pen']}. Sheet {card['sheet']}. {card['n_left']} left in this generation.")
    if asked.ask["is_placed"]:
        ui.label("The emulated robot is placed at its start automatically.")
    else:
        ui.label(f"Put the robot at its start, pen down: {start_words(arena)}")
    CellGrid(arena, name=f"The start: {start_words(arena)}").classes("lab-sketch")
    asked.button("Start trial")


def _score(asked: _Asked) -> None:
    what = f"Sheet {asked.ask['sheet']} is full." if asked.ask["is_full"] else "The trial has ended."
    with ui.row().classes("lab-row no-wrap"):
        ui.label(f"{what} Score its trials, on this page or another. The study then continues.")
        asked.button("Later", is_main=False)


def _close(asked: _Asked) -> None:
    ui.label("All trials of this generation are scored").classes("lab-section")
    ui.label(
        "The scores select the parents of the next generation. After closing, you can only add corrections."
    )
    for number in asked.ask["trials"]:
        each = asked.counts.trial(number)
        with ui.row().classes("lab-row"):
            ui.label(
                f"Trial {number}, {each.pen}: {counted(len(each.trial.cells or ()), 'cell')} by {each.first}"
            )
            ui.button("Undo", on_click=lambda number=number: asked.answer(undo=number)).props(
                f'flat dense no-caps aria-label="Undo the score of trial {number}"'
            ).set_enabled(asked.may)
    asked.button("Close generation")


def _title(card: dict[str, Any]) -> None:
    ui.label(f"Trial {card['trial']}").classes("lab-section").props(f'data-trial="{card["trial"]}"')
    hint(card["title"])
