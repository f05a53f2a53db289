"""A trial that is being driven, as it goes."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from realitygap.lab._counts import Counts
from realitygap.lab._study_job import StudyJob

from ._frame import hint
from ._grid import CellGrid
from ._status import Silence

LIVE_S = 0.05
"""Time between two updates [s]. Another process drives the robot, even if no page is open."""


class Driving:
    """Shows a trial while it is driven; the abort is for everyone.

    Args:
        job: The study at work.
        card: Of the trial.
        counts: The study's trials.
    """

    def __init__(self, job: StudyJob, card: dict[str, Any], counts: Counts) -> None:
        self._job, self._card, self._counts = job, card, counts
        self._n_shown = -1
        self._n_points = 0

    def show(self) -> None:
        """Show it."""
        card = self._card
        arena = self._counts.arena(self._counts.trial(card["trial"]).trial.condition)
        with ui.card().classes("lab-card lab-question"):
            ui.label(f"Trial {card['trial']} is being driven").classes("lab-section").props('role="status"')
            hint(f"{card['title']}. Pen: {card['pen']}.")
            self._bar = ui.linear_progress(0, show_value=False).props('aria-label="Steps driven"')
            self._step_words = ui.label("")
            self._silence = Silence()
            self._grid = CellGrid(arena, ink=card["pen"], name="Position of the robot").classes("lab-sketch")
            ui.button("Abort trial", on_click=self._job.stop_robot, color="negative").props(
                "unelevated no-caps"
            ).classes("lab-primary")
        ui.timer(LIVE_S, self._look)

    def _look(self) -> None:
        job = self._job
        self._silence.look(job.silent_s)
        if job.n_live == self._n_shown or job.card is not self._card:
            return
        self._n_shown = job.n_live
        step = job.step
        if step is not None:
            self._bar.value = (step["step"] + 1) / step["n_steps"]
            seen = ", ".join(f"{value:.0f}" for value in step["raw"])
            stalled = ", blocked" if step["stalled"] else ""
            self._step_words.text = (
                f"Step {step['step'] + 1} of {step['n_steps']}: sees {seen}{stalled}; "
                f"move {step['move']:+.2f}, turn {step['turn']:+.2f}"
            )
        line = job.line
        anew = len(line) < self._n_points or self._n_points == 0
        points = line if anew else line[self._n_points :]
        self._n_points = len(line)
        if job.pose is not None:
            self._grid.follow(job.pose, points, anew=anew)
