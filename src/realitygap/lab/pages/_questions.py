"""What the operator is asked, and the buttons that answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import ui

from realitygap.lab._counts import Counts
from realitygap.lab._study_job import StudyJob
from realitygap.trials import start_words

from ._frame import hint
from ._grid import CellGrid, ink_of
from ._notices import notify


def show_question(
    job: StudyJob, ask: dict[str, Any], counts: Counts, *, may: bool, jump: Callable[[int], Any]
) -> None:
    """Show what a study waits for.

    Args:
        job: The study at work.
        ask: What it asks.
        counts: Its trials.
        may: Whether this visitor may answer.
        jump: Shows a trial to be counted.
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
        show(_Asked(job, ask, counts, may, jump))


class _Asked:
    """A question, and who is asked."""

    def __init__(
        self, job: StudyJob, ask: dict[str, Any], counts: Counts, may: bool, jump: Callable[[int], Any]
    ) -> None:
        self.job, self.ask, self.counts, self.may, self.jump = job, ask, counts, may, jump

    @property
    def card(self) -> dict[str, Any]:
        """Of the trial that it is about."""
        found: dict[str, Any] = self.ask["card"]
        return found

    def answer(self, **values: Any) -> None:
        """Answer it."""
        if not self.job.answer(self.ask["number"], **values):
            notify("That has been answered already.")

    def button(self, text: str, *, is_main: bool = True, **values: Any) -> None:
        """One that answers."""
        ui.button(text, on_click=lambda: self.answer(**values)).props(
            ("unelevated" if is_main else "outline") + " no-caps"
        ).set_enabled(self.may)


def _meet(asked: _Asked) -> None:
    ui.label("The robot answers. For its pre-flight it turns on the spot for a moment.").classes(
        "lab-section"
    )
    ui.label("Stand it free.")
    asked.button("It stands free")


def _accept(asked: _Asked) -> None:
    ui.label("The pre-flight found something against driving").classes("lab-section")
    for problem in asked.ask["problems"]:
        ui.label(problem).classes("lab-problem")
    with ui.row().classes("lab-row"):
        asked.button("Do not drive", yes=False)
        asked.button("Drive all the same", yes=True, is_main=False)


def _settle(asked: _Asked) -> None:
    _title(asked.card)
    ui.label(f"It was cut off: {asked.ask['problem']}.").classes("lab-problem")
    ui.label("Void: it is driven again. Driven: it counts, with what it has drawn so far.")
    with ui.row().classes("lab-row"):
        asked.button("Void, drive it again", verdict="void")
        asked.button("Driven, count it", verdict="driven", is_main=False)


def _go_on(asked: _Asked) -> None:
    _title(asked.card)
    ui.label(f"It was cut off: {asked.ask['problem']}. It will be driven again.")
    asked.button("Go on")


def _place(asked: _Asked) -> None:
    card = asked.card
    arena = asked.counts.arena(asked.counts.trial(card["trial"]).trial.condition)
    _title(card)
    with ui.row().classes("lab-row"):
        ui.element("span").classes("lab-pen").style(f"background: {ink_of(card['pen'])}")
        ui.label(f"Pen: {card['pen']}. Sheet {card['sheet']}. {card['n_left']} left in this generation.")
    if asked.ask["is_placed"]:
        ui.label("The emulated robot is put at its start by itself.")
    else:
        ui.label(f"Put the robot at its start, pen in: {start_words(arena)}")
    CellGrid(arena, name=f"The start: {start_words(arena)}").classes("lab-sketch")
    asked.button("Start the trial")


def _score(asked: _Asked) -> None:
    trials = asked.ask["trials"]
    ui.label("Which cells do the lines cross?").classes("lab-section")
    what = f"Sheet {asked.ask['sheet']} is full." if asked.ask["is_full"] else "The trial is driven."
    ui.label(f"{what} Count below, at this page or at any other; it goes on by itself once all are counted.")
    with ui.row().classes("lab-row"):
        for number in trials:
            ui.button(f"Trial {number}", on_click=lambda number=number: asked.jump(number)).props(
                "outline no-caps"
            )
    asked.button("Later", is_main=False)


def _close(asked: _Asked) -> None:
    ui.label("All trials of this generation are counted").classes("lab-section")
    ui.label(
        "Once it is closed, these scores breed the next generation and stay; later there are corrections alone."
    )
    for number in asked.ask["trials"]:
        each = asked.counts.trial(number)
        with ui.row().classes("lab-row"):
            ui.label(f"Trial {number}, {each.pen}: {len(each.trial.cells or ())} cells by {each.first}")
            ui.button("Take back", on_click=lambda number=number: asked.answer(undo=number)).props(
                f'flat dense no-caps aria-label="Take back the score of trial {number}"'
            ).set_enabled(asked.may)
    asked.button("Close the generation")


def _title(card: dict[str, Any]) -> None:
    ui.label(f"Trial {card['trial']}").classes("lab-section").props(f'data-trial="{card["trial"]}"')
    hint(card["title"])
