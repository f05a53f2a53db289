"""Home: the studies that are there, and how far each is."""

from __future__ import annotations

from nicegui import run, ui

from realitygap.lab._lab import Lab
from realitygap.lab._studies import StudyState
from realitygap.lab._study_job import StudyJob

from ._frame import framed, hint
from ._notices import attempt
from ._part import watching

DISK_S = 2.0
"""How often the studies' folders are looked at [s]: other programs may work in them."""

MOST_CARDS = 30
"""Studies that are shown at first, the last ones changed: each costs a page time."""


def add_home(lab: Lab) -> None:
    """Add the page."""

    @ui.page("/", response_timeout=30)
    async def home() -> None:
        states = list(await run.io_bound(lab.studies.states) or ())
        n_shown = MOST_CARDS
        with framed(lab, "Studies", "/"):
            hint(f"In the folder {lab.root.name}.").tooltip(str(lab.root))
            ui.button("Start a new study", on_click=lambda: ui.navigate.to("/new")).props(
                "unelevated no-caps"
            )

            @ui.refreshable
            def cards() -> None:
                if not states:
                    ui.label("No study is here yet.")
                for state in states[:n_shown]:
                    _card(lab, state)
                if len(states) > n_shown:
                    ui.button(f"Show {len(states) - n_shown:,} more", on_click=show_more).props(
                        "outline no-caps"
                    )

            def show_more() -> None:
                nonlocal n_shown
                n_shown += MOST_CARDS
                cards.refresh()

            with ui.column().classes("lab-cards").props('aria-live="polite"'):
                cards()

            async def look() -> None:
                found = await run.io_bound(lab.studies.states)
                if found is not None and found != states:
                    states[:] = found
                    cards.refresh()

            watching(lab, cards.refresh)
            ui.timer(DISK_S, look)


def _card(lab: Lab, state: StudyState) -> None:
    job = lab.jobs.get(state.name)
    with ui.card().classes("lab-card").props(f'data-study="{state.name}"'):
        with ui.row().classes("lab-row"):
            ui.label(state.title or state.name).props('role="heading" aria-level="2"').classes("lab-section")
            ui.label(_word(state, job)).classes("lab-state")
        if state.title != state.name:
            hint(state.name)
        if state.problem:
            ui.label(state.problem).classes("lab-problem")
            return
        share = _share(state, job)
        ui.linear_progress(share, show_value=False).props(f'aria-label="{100 * share:.0f} % done"')
        for line in _lines(state, job):
            ui.label(line)
        if job is not None and job.outcome is not None:
            ui.label(job.outcome).classes("lab-problem" if job.is_failed else "lab-hint")
        _buttons(lab, state, job)


def _share(state: StudyState, job: StudyJob | None) -> float:
    if job is not None and not job.is_over and job.progress and not state.has_robot:
        return float(job.progress["n_done"] / max(job.progress["n_runs"], 1))
    return state.share


def _word(state: StudyState, job: StudyJob | None) -> str:
    if state.problem:
        return "cannot be read"
    if job is not None and not job.is_over:
        if job.ask is not None:
            return "waits for you"
        return "a robot is driving" if job.is_driving else "running"
    if state.used_by:
        return "in use by another program"
    if state.is_complete:
        return "complete"
    return "waits for a robot" if state.has_robot and state.n_done == state.n_runs else "stopped"


def _lines(state: StudyState, job: StudyJob | None) -> list[str]:
    lines = []
    if state.n_runs:
        n_done = state.n_done
        if job is not None and not job.is_over and job.progress:
            n_done = max(n_done, job.progress["n_done"])
        lines.append(f"{n_done:,} of {state.n_runs:,} simulated runs")
    if state.n_driven_runs:
        lines.append(f"{state.n_driven_done} of {state.n_driven_runs} runs on a robot")
    if state.trials:
        lines.append("Trials: " + ", ".join(f"{n} {name}" for name, n in sorted(state.trials.items())))
    return lines


def _buttons(lab: Lab, state: StudyState, job: StudyJob | None) -> None:
    with ui.row().classes("lab-row"):
        if job is not None and not job.is_over:
            ui.button("Pause", on_click=job.ask_to_end).props("outline no-caps")
        ui.button("Watch", on_click=lambda: ui.navigate.to(f"/watch/{state.name}")).props("outline no-caps")
        if state.has_robot:
            ui.button("Trials", on_click=lambda: ui.navigate.to(f"/trials/{state.name}")).props(
                "unelevated no-caps"
            )
        if (job is None or job.is_over) and state.n_done < state.n_runs and not state.used_by:
            ui.button("Go on", on_click=lambda: attempt(lambda: lab.go_on(state.name))).props(
                "unelevated no-caps"
            )
