"""Gap: two platforms side by side, and how many trials it takes to tell them apart."""

from __future__ import annotations

from typing import Any

from nicegui import app, ui
from starlette.responses import FileResponse, PlainTextResponse, Response

from realitygap.lab._access import FOREIGN_HEADERS
from realitygap.lab._gap_job import GapJob
from realitygap.lab._lab import Lab

from ._frame import framed, hint, number_of, section, text_of, whole_of
from ._notices import attempt
from ._part import watching

_QUESTIONS = {
    "effect": "to find a mean difference of (coverage)",
    "margin": "to show equivalence within (coverage)",
    "correlation": "to show that a correlation is above 0.5, where it is",
}


def add_gap(lab: Lab) -> None:
    """Add the page, and the reports."""

    @ui.page("/gap", response_timeout=30)
    def gap() -> None:
        with framed(lab, "Gap", "/gap"):
            _Page(lab).show()

    @app.get("/gaps/{name}")
    def report(name: str) -> Response:
        path = lab.gap_page(name)
        if path is None or not path.is_file() or path.is_symlink():
            return PlainTextResponse("There is no such report.", 404)
        headers = {**FOREIGN_HEADERS, "cache-control": "no-store"}
        return FileResponse(path, media_type="text/html", headers=headers)


class _Page:
    def __init__(self, lab: Lab) -> None:
        self._lab = lab

    def show(self) -> None:
        section("Measure")
        hint(
            "The same controllers are tried on a simulator and on a target, again and again. The report is written "
            "after 2, 4, 8 and so on trials of each, and grows until all are done. The trials of the target are kept: "
            "the same name goes on with them."
        )
        self._show_form()
        self._work = ui.refreshable(self._show_work)
        with ui.column().classes("lab-cards"):
            self._work()
        section("Plan the number of trials")
        self._show_plan_form()
        self._plan = ui.refreshable(self._show_plan)
        self._plan()
        watching(self._lab, lambda: (self._work.refresh(), self._plan.refresh()))

    # measuring

    def _show_form(self) -> None:
        with ui.row().classes("lab-row"):
            name = _text("Name", "gap")
            sim = _text("Simulator: sim, sim:FILE or jyro", "sim")
            target = _text("Target: jyro, twin:FILE, scribbler:PORT, thymio:PORT ...", "jyro")
            controllers = _text("Controllers: random, or a study or folder", "random")
            n = ui.number("Controllers", value=10, min=2, max=1024, precision=0)
            trials = ui.number("Trials of each", value=10, min=1, max=4096, precision=0)
            margin = ui.number("Margin of equivalence", value=None, min=0, step=0.01)
            for each in (n, trials, margin):
                each.props("outlined dense").classes("lab-number")
            seen = ui.select(
                ["cells", "encoders", "track"], value="cells", label="What is seen of the target"
            )
            seen.props("outlined dense").classes("lab-wide")
            witness = _text("Witness of an emulator, HOST:PORT", "")

        def begin() -> None:
            values: dict[str, Any] = {
                "sim": text_of(sim),
                "target": text_of(target),
                "controllers": text_of(controllers) or "random",
                "n_controllers": whole_of(n) or 0,
                "trials": whole_of(trials) or 0,
                "observe": seen.value,
            }
            if given := number_of(margin):
                values["margin"] = given
            if text_of(witness):
                values["witness"] = text_of(witness)
            self._lab.measure_gap(text_of(name), values)

        ui.button("Measure the gap", on_click=lambda: attempt(begin)).props("unelevated no-caps")

    def _show_work(self) -> None:
        job = self._lab.gap
        if job is None or job.plan is not None or not job.name:
            return
        self._show_state(job)
        for platform, (done, total) in job.trials.items():
            ui.label(f"{platform}: {done:,} of {total:,} trials")
            ui.linear_progress(done / max(total, 1), show_value=False).props(
                f'aria-label="Trials on {platform}"'
            )
        if job.verdict:
            ui.label(job.verdict).classes("lab-section").props('role="status"')
            address = f"/gaps/{job.name}?v={job.n_reports}"
            ui.link("The report by itself", address, new_tab=True)
            ui.element("iframe").props(f'src="{address}" title="Report of the gap"').classes("lab-report")

    def _show_state(self, job: GapJob) -> None:
        if job.outcome is not None:
            ui.label(job.outcome).classes("lab-problem lab-lines" if job.is_failed else "").props(
                'role="status"'
            )
        else:
            ui.button("Stop measuring", on_click=job.ask_to_end).props("outline no-caps")

    # planning

    def _show_plan_form(self) -> None:
        with ui.row().classes("lab-row"):
            question = ui.select(_QUESTIONS, value="effect", label="Controllers that it takes")
            question.props("outlined dense").classes("lab-wide")
            value = ui.number("which is", value=0.05, min=0.001, max=1, step=0.01)
            value.props("outlined dense").classes("lab-number")
        ui.button(
            "Plan",
            on_click=lambda: attempt(
                lambda: self._lab.plan_gap(question.value or "effect", number_of(value) or 0.0)
            ),
        ).props("outline no-caps")

    def _show_plan(self) -> None:
        job = self._lab.gap
        if job is None or job.name:
            return
        if job.plan is None:
            self._show_state(job)
            return
        hint(
            f"Trials of one controller vary by {job.plan['noise']:.3f} ({job.plan['origin']}). Each row is found in 80 "
            "of 100 studies."
        )
        with ui.element("table").classes("lab-plain"):
            with ui.element("tr"):
                for head in ("Trials of each", "Controllers", "Trials on the target"):
                    with ui.element("th"):
                        ui.label(head)
            for row in job.plan["rows"]:
                some = row["controllers"] is not None
                cells = (
                    row["trials"],
                    row["controllers"] if some else "over 100,000",
                    row["on_target"] if some else "",
                )
                with ui.element("tr"):
                    for cell in cells:
                        with ui.element("td"):
                            ui.label(f"{cell:,}" if isinstance(cell, int) else cell)


def _text(label: str, value: str) -> ui.input:
    return ui.input(label, value=value).props("outlined dense").classes("lab-wide")
