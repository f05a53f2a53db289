"""Gap: the same controllers on two platforms, and the number of trials that detects a difference."""

from __future__ import annotations

import re
from typing import Any

from nicegui import app, run, ui
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response

from realitygap.lab._access import FOREIGN_HEADERS
from realitygap.lab._gap_job import GapJob
from realitygap.lab._lab import Lab, Visitor
from realitygap.platforms import emulated_robots

from ._fields import Form
from ._frame import framed, hint, section, visitor_of
from ._new import CALIBRATED
from ._part import Part, watching

_QUESTIONS = {
    "effect": "Detect a mean difference",
    "margin": "Show equivalence within a margin",
    "correlation": "Show a correlation above 0.5",
}


def add_gap(lab: Lab) -> None:
    """Add the page, and the reports."""

    @ui.page("/gap", response_timeout=30)
    async def gap(request: Request) -> None:
        reports = await run.io_bound(lab.gap_reports) or []
        sim = request.query_params.get("sim", "")
        with framed(lab, "Gap", "/gap", is_wide=True):
            _Page(lab, visitor_of(request), reports, sim if re.fullmatch(CALIBRATED, sim) else "sim").show()

    @app.get("/gaps/{name}")
    def report(name: str) -> Response:
        path = lab.gap_page(name)
        if path is None or not path.is_file() or path.is_symlink():
            return PlainTextResponse("There is no such report.", 404)
        headers = {**FOREIGN_HEADERS, "cache-control": "no-store"}
        return FileResponse(path, media_type="text/html", headers=headers)


class _Page:
    def __init__(self, lab: Lab, visitor: Visitor, reports: list[str], sim: str) -> None:
        self._lab, self._visitor, self._reports, self._sim = lab, visitor, reports, sim

    def show(self) -> None:
        hint(
            "Runs the same controllers on a simulator and on a target, and measures how much the two differ. "
            "The trials of the target are saved: measure again under the same name to continue."
        )
        self._form_box = ui.element("div").classes("lab-form")
        parts: list[Part[Any]] = [
            Part(self._work_state, self._show_work),
            Part(self._result_state, self._show_result),
            Part(self._plan_state, self._show_plan),
        ]
        with self._form_box:
            self._show_form()
        with ui.column().classes("lab-cards"):
            parts[0].show()
        with ui.column().classes("lab-cards"):
            parts[1].show()
        with ui.expansion("How many trials do I need?").classes("lab-expansion"):
            with ui.element("div").classes("lab-form"):
                self._show_plan_form()
            parts[2].show()
        if self._reports:
            section("Saved reports")
        for name in self._reports:
            ui.link(name, f"/gaps/{name}", new_tab=True)

        def look() -> None:
            for part in parts:
                part.look()

        watching(self._lab, look)

    # measure

    def _show_form(self) -> None:
        self._form = form = Form()
        form.summary()
        sim = ["sim", "jyro"]
        form.text(
            "sim", "Simulator", self._sim, options=sim, is_needed=True, explanation="sim, sim:FILE, or jyro."
        )
        form.text(
            "target",
            "Target",
            "jyro",
            is_needed=True,
            explanation="jyro, twin:FILE, scribbler:PORT, or thymio:PORT. Emulated robots: "
            f"{', '.join(emulated_robots())}.",
        )
        n = form.number("n_controllers", "Controllers", 10, 2, 1024)
        trials = form.number("trials", "Trials per controller", 10, 1, 4096)
        needed = hint("")

        def count() -> None:
            numbers = [each.value for each in (n, trials)]
            if all(isinstance(each, int | float) for each in numbers):
                needed.text = f"Needs {numbers[0] * numbers[1]:,.0f} trials on the target."

        for each in (n, trials):
            each.on_value_change(count)
        count()
        with ui.expansion("Advanced").classes("lab-expansion"):
            form.text(
                "name", "Name", "gap", is_needed=True, explanation="Name of the report and the saved trials."
            )
            form.text(
                "controllers",
                "Controllers from",
                "random",
                explanation="random, or a study whose best controllers to use.",
            )
            form.number(
                "margin",
                "Margin of equivalence",
                None,
                0.0001,
                1.0,
                is_whole=False,
                explanation="Largest difference in coverage that counts as equivalent.",
            )
            form.choice("observe", "Observation level", ["cells", "encoders", "track"], "cells")
            form.text(
                "witness",
                "Witness",
                explanation="HOST:PORT of the witness of an emulator in another program.",
            )
        ui.button("Measure the gap", on_click=lambda: form.submit(self._measure)).props("unelevated no-caps")

    def _measure(self, entered: dict[str, Any]) -> None:
        values = {key: value for key, value in entered.items() if key != "name" and value not in (None, "")}
        self._lab.measure_gap(entered["name"], {"controllers": "random", **values}, self._visitor)

    def _job(self) -> GapJob | None:
        """The gap that is measured, or was last."""
        job = self._lab.gap
        return job if job is not None and job.name else None

    def _work_state(self) -> tuple[str, str, bool, bool, float] | None:
        job = self._job()
        if job is None:
            return None
        share = sum(job.trials.values()) / max(2 * job.n_trials, 1)
        return job.name, job.progress, job.is_over, job.is_failed, share

    def _show_work(self, state: tuple[str, str, bool, bool, float] | None) -> None:
        self._form_box.set_visibility(state is None or state[2])
        if state is None:
            if not self._reports:
                ui.label("No gaps measured yet.")
            return
        name, progress, is_over, is_failed, share = state
        job = self._job()
        with ui.row().classes("lab-row"):
            ui.label(f"Gap {name}").classes("lab-section")
            ui.label(progress).classes("lab-problem lab-lines" if is_failed else "").props('role="status"')
            if not is_over and job is not None:
                ui.button("Stop", on_click=job.ask_to_end).props("outline no-caps")
        if not is_over:
            ui.linear_progress(share, show_value=False).props(
                f'aria-label="{100 * share:.0f} % of the trials"'
            )

    def _result_state(self) -> tuple[str, int] | None:
        job = self._job()
        return None if job is None or not job.verdict else (job.name, job.n_reports)

    def _show_result(self, state: tuple[str, int] | None) -> None:
        job = self._job()
        if state is None or job is None:
            return
        name, n_reports = state
        ui.label(job.verdict).classes("lab-finding").props('role="status"')
        with ui.element("dl").classes("lab-facts"):
            for title, words in job.measures:
                with ui.element("dt"):
                    ui.label(title)
                with ui.element("dd"):
                    ui.label(words)
        address = f"/gaps/{name}?v={n_reports}"
        ui.link("Open report", address, new_tab=True)
        ui.element("iframe").props(f'src="{address}" title="Report of the gap"').classes("lab-report")

    # plan

    def _show_plan_form(self) -> None:
        form = Form()
        form.summary()
        form.choice("question", "Goal", _QUESTIONS, "effect")
        form.number(
            "value",
            "Difference in coverage",
            0.05,
            0.001,
            1.0,
            is_whole=False,
            explanation="Difference, margin, or correlation from 0.001 to 1.",
        )

        def plan(values: dict[str, Any]) -> None:
            self._lab.plan_gap(values["question"] or "effect", values["value"])

        ui.button("Plan", on_click=lambda: form.submit(plan)).props("outline no-caps")

    def _plan_state(self) -> tuple[str, bool, Any] | None:
        job = self._lab.gap
        return None if job is None or job.name else (job.progress, job.is_failed, job.plan)

    def _show_plan(self, state: tuple[str, bool, Any] | None) -> None:
        if state is None:
            return
        progress, is_failed, plan = state
        if plan is None:
            ui.label(progress).classes("lab-problem lab-lines" if is_failed else "").props('role="status"')
            return
        hint(
            f"The standard deviation of trials of one controller is {plan['noise']:.3f} ({plan['origin']}). With each "
            "row, 80 of 100 studies reach the goal."
        )
        columns = [
            {"name": name, "label": label, "field": name, "align": "right"}
            for name, label in (
                ("trials", "Trials per controller"),
                ("controllers", "Controllers"),
                ("on_target", "Trials on the target"),
            )
        ]
        rows = [
            {
                "trials": f"{row['trials']:,}",
                "controllers": "over 100,000" if row["controllers"] is None else f"{row['controllers']:,}",
                "on_target": "" if row["controllers"] is None else f"{row['on_target']:,}",
            }
            for row in plan["rows"]
        ]
        ui.table(rows=rows, columns=columns, row_key="trials").classes("lab-plan").props(
            "flat bordered dense"
        )
