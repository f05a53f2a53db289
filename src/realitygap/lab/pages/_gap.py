"""Gap: the same controllers on two platforms, and the differences that their trials can detect."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import partial
from typing import Any

from nicegui import app, run, ui
from nicegui.elements.mixins.value_element import ValueElement
from starlette.requests import Request
from starlette.responses import FileResponse, PlainTextResponse, Response

from realitygap.lab._access import FOREIGN_HEADERS
from realitygap.lab._choices import Choices, controller_choices, platform_choices
from realitygap.lab._control import Visitor
from realitygap.lab._gap import GapJob, free_name, gap_mistakes, plan_words
from realitygap.lab._lab import Lab
from realitygap.lab._messages import ScorePairs
from realitygap.orders import GapOrder

from ._elements import Scatter
from ._fields import Form, needed
from ._frame import framed, hint, section, text_of, visitor_of
from ._new import CALIBRATED
from ._notices import attempt
from ._part import LOOK_S, Part, watching
from ._status import Silence

_FIELDS = {field.name: field for field in GapOrder.fields() if field.face.label}
_NUMBERS = ("n_controllers", "trials")


def add_gap(lab: Lab) -> None:
    """Add the page, and the reports."""

    @ui.page("/gap", response_timeout=30)
    async def gap(request: Request) -> None:
        reports = await run.io_bound(lab.gap_reports) or []
        choices = await run.io_bound(_choices_of, lab) or {}
        sim = request.query_params.get("sim", "")
        with framed(lab, "Gap", "/gap", is_wide=True):
            sim = sim if re.fullmatch(CALIBRATED, sim) else "sim"
            _Page(lab, visitor_of(request), reports, sim, choices).show()

    @app.get("/gaps/{name}")
    def report(name: str) -> Response:
        path = lab.gap_page(name)
        if path is None or not path.is_file() or path.is_symlink():
            return PlainTextResponse("There is no such report.", 404)
        headers = {**FOREIGN_HEADERS, "cache-control": "no-store"}
        return FileResponse(path, media_type="text/html", headers=headers)


def _choices_of(lab: Lab) -> dict[str, Choices]:
    """Return what the fields of the form offer, by field."""
    return {
        "sim": platform_choices(lab.root, "simulator"),
        "target": platform_choices(lab.root, "target"),
        "controllers": controller_choices(lab.studies.names()),
    }


@dataclass(frozen=True)
class _Work:
    """A gap that is measured, or was last, at one moment."""

    job: GapJob
    progress: str
    is_over: bool
    is_failed: bool
    share: float

    @property
    def can_resume(self) -> bool:
        """True if it has ended before all trials were done, and not by an error before them that no robot caused."""
        has_begun = any(self.job.trials.values()) or self.job.is_link_lost
        return self.is_over and not self.job.is_complete and (has_begun or not self.is_failed)


class _Page:
    def __init__(
        self, lab: Lab, visitor: Visitor, reports: list[str], sim: str, choices: dict[str, Choices]
    ) -> None:
        self._lab, self._visitor, self._reports, self._sim = lab, visitor, reports, sim
        self._choices = choices

    def show(self) -> None:
        hint(
            "Runs the same controllers on a simulator and on a target, and measures how much the two differ. "
            "The trials of the target are saved: enter the name of an existing gap to continue it."
        )
        unfinished = Part(self._unfinished, self._show_unfinished)  # above the form, which fills a screen
        with ui.column().classes("lab-cards"):
            unfinished.show()
        with ui.element("div").classes("lab-form") as self._form_box:
            self._show_form()
        parts: list[Part[Any]] = [
            Part(self._order, self._show_order),
            Part(self._work, self._show_work),
        ]
        for part in parts:
            with ui.column().classes("lab-cards"):
                part.show()
        silence = Silence()
        parts.append(Part(self._result, self._show_result))
        with ui.column().classes("lab-cards"):
            parts[-1].show()
        parts.append(unfinished)
        ui.link("Saved trials", "/saved")
        parts.append(Part(lambda: self._reports, self._show_reports))
        with ui.column().classes("lab-cards"):
            parts[-1].show()

        async def look() -> None:
            self._reports = await run.io_bound(self._lab.gap_reports) or []
            for part in parts:
                part.look()

        watching(self._lab, look)
        ui.timer(LOOK_S, lambda: silence.look(0.0 if self._lab.gap is None else self._lab.gap.silent_s))

    def _show_reports(self, reports: list[str]) -> None:
        if reports:
            section("Saved reports")
        for name in reports:
            ui.link(name, f"/gaps/{name}", new_tab=True)

    # form

    def _show_form(self) -> None:
        self._form = form = Form()
        form.summary()
        simulator = form.text_of(
            _FIELDS["sim"],
            self._sim,
            self._choices.get("sim"),
            explanation="Simulator whose predictions are checked.",
        )
        self._target = form.text_of(
            _FIELDS["target"],
            "jyro",
            self._choices.get("target"),
            explanation="Robot, twin, or simulator that counts as reality. For an emulator in another program, also "
            "enter its witness in Advanced.",
        )
        self._platforms = (simulator, self._target)
        self._free_name = free_name(self._lab.root, *map(text_of, self._platforms))
        self._name = form.text(
            "name",
            "Name",
            self._free_name,
            parse=needed,
            explanation="Name of the report and of the saved trials.",
        )
        with ui.element("div").classes("lab-fields"):
            self._numbers = {key: form.number_of(_FIELDS[key]) for key in _NUMBERS}
        with ui.expansion("Advanced").classes("lab-expansion"):
            self._margin = form.number_of(_FIELDS["margin"])
            for key, field in _FIELDS.items():
                if key not in ("sim", "target", "margin", "why", *_NUMBERS):
                    form.field_of(field, self._choices.get(key))
        self._plan = ui.label("").classes("lab-plan").props('role="status"')
        hint(
            "Detectable: 80 of 100 measurements find the difference, if controllers vary as in simulation. The command "
            "realitygap plan also plans correlations."
        )
        elements: list[ValueElement[Any]] = [*self._numbers.values(), self._target, self._margin]
        for element in elements:
            element.on_value_change(self._show_plan)
        for platform in self._platforms:
            platform.on_value_change(self._propose_name)
        self._show_plan()
        self._button = ui.button("Measure the gap", on_click=self._submit).props("unelevated no-caps")

    def _propose_name(self) -> None:
        """Propose a name that no file has, unless the visitor entered another one."""
        if text_of(self._name) == self._free_name:
            self._free_name = free_name(self._lab.root, *map(text_of, self._platforms))
            self._name.value = self._free_name

    def _show_plan(self) -> None:
        """State what the entered numbers need; nothing while one of them cannot be used."""
        if any(self._form.problem_of(key) for key in (*self._numbers, "margin")):
            self._plan.text = ""
            return
        n, trials = (int(field.value) for field in self._numbers.values())
        margin = self._margin.value
        self._plan.text = plan_words(n, trials, text_of(self._target), float(margin) if margin else None)

    async def _submit(self) -> None:
        self._button.disable()  # a second press would only find that the first one has begun
        await self._form.submit(self._measure, partial(gap_mistakes, self._lab.root))
        self._button.enable()

    def _measure(self, entered: dict[str, Any]) -> None:
        values = {key: value for key, value in entered.items() if key != "name"}
        self._lab.measure_gap(entered["name"], values, self._visitor)

    def _order(self) -> str:
        """Settings of the gap that is being measured, in one line; empty if none is."""
        job = self._lab.gap
        if job is None or job.is_over:
            return ""
        order = job.order
        return f"{order.sim} → {order.target} · {order.n_controllers:,} controllers · {order.trials:,} trials each"

    def _show_order(self, order: str) -> None:
        """Show the form as one line while a gap is measured."""
        self._form_box.set_visibility(not order)
        if order:
            ui.label(order)
        else:
            self._propose_name()

    # work and result

    def _work(self) -> _Work | None:
        job = self._lab.gap
        if job is None:
            return None
        return _Work(job, job.progress, job.is_over, job.is_failed, job.share)

    def _unfinished(self) -> _Work | None:
        work = self._work()
        return work if work is not None and work.can_resume else None

    def _show_unfinished(self, work: _Work | None) -> None:
        if work is not None:
            self._show_progress(work)

    def _show_work(self, work: _Work | None) -> None:
        if work is None:
            if not self._reports:
                ui.label("No gaps measured yet.")
        elif not work.can_resume:
            self._show_progress(work)

    def _show_progress(self, work: _Work) -> None:
        job = work.job
        with ui.row().classes("lab-row"):
            ui.label(f"Gap {job.name}").classes("lab-section")
            ui.label(work.progress).classes("lab-problem lab-lines" if work.is_failed else "").props(
                'role="status"'
            )
            if not work.is_over:
                ui.button("Stop", on_click=job.ask_to_end).props("outline no-caps")
            elif work.can_resume:
                ui.button("Resume", on_click=lambda: attempt(lambda: self._resume(job))).props(
                    "outline no-caps"
                )
            elif not job.closes:
                if job.can_close:
                    ui.button("Close the gap", on_click=lambda: attempt(lambda: self._close(job))).props(
                        "outline no-caps"
                    )
                if job.can_explain:
                    ui.button("Explain the gap", on_click=lambda: attempt(lambda: self._explain(job))).props(
                        "outline no-caps"
                    )
        if not work.is_over:
            ui.linear_progress(work.share, show_value=False).props(
                f'aria-label="{100 * work.share:.0f} % of the trials"'
            )

    def _resume(self, job: GapJob) -> None:
        values = job.order.model_dump(exclude={"results"})
        self._lab.measure_gap(job.name, values, self._visitor, closes=job.closes)

    def _explain(self, job: GapJob) -> None:
        values = job.order.model_dump(exclude={"results"}) | {"why": True}
        self._lab.measure_gap(job.name, values, self._visitor)

    def _close(self, job: GapJob) -> None:
        values = job.order.model_dump(exclude={"results"})
        self._lab.measure_gap(f"{job.name}-closed", values, self._visitor, closes=True)

    def _result(self) -> tuple[GapJob, ScorePairs, int] | None:
        job = self._lab.gap
        return None if job is None or job.pairs is None else (job, job.pairs, job.n_reports)

    def _show_result(self, result: tuple[GapJob, ScorePairs, int] | None) -> None:
        if result is None:
            return
        job, pairs, n_reports = result
        ui.label(job.verdict).classes("lab-finding").props('role="status"')
        with ui.element("dl").classes("lab-facts"):
            for title, words in job.measures:
                with ui.element("dt"):
                    ui.label(title)
                with ui.element("dd"):
                    ui.label(words)
        with ui.element("div").classes("lab-panels-two"):
            titles: dict[str, tuple[ScorePairs, ScorePairs | None]] = {
                "Controllers on both platforms": (pairs, None)
            }
            if job.before is not None:
                titles = {
                    "Before the calibration": (job.before, pairs),
                    "After the calibration": (pairs, job.before),
                }
            for title, both in titles.items():
                with ui.column().classes("lab-panel"):
                    section(title)
                    Scatter(*both)
                    hint(
                        "Crosses are 95 % intervals of the means. Circles are champions, squares random networks. "
                        "On the line there is no gap."
                    )
            if len(job.intervals) > 1:
                with ui.column().classes("lab-panel"):
                    _show_intervals(job.intervals)
        address = f"/gaps/{job.name}?v={n_reports}"
        ui.link("Open report", address, new_tab=True)
        ui.element("iframe").props(f'src="{address}" title="Report of the gap"').classes("lab-report")


def _show_intervals(intervals: list[tuple[int, float, float, float]]) -> None:
    """Show how the interval of the RMS gap narrows with the trials, as bars with their numbers."""
    section("RMS gap by trials per controller")
    widest = max(high for *_, high in intervals)
    with ui.element("dl").classes("lab-facts"):
        for trials, estimate, low, high in intervals:
            with ui.element("dt"):
                ui.label(f"{trials:,} trials")
            with ui.element("dd").classes("lab-row lab-interval"):
                left, middle, right = (100 * value / widest for value in (low, estimate, high))
                width = max(right - left, 1.0)
                ui.html(
                    '<svg viewBox="0 0 100 12" height="14" aria-hidden="true" preserveAspectRatio="none">'
                    '<rect x="0" y="5" width="100" height="2" class="lab-bar-prior"/>'
                    f'<rect x="{left:.1f}" y="3" width="{width:.1f}" height="6" class="lab-bar-interval"/>'
                    f'<rect x="{middle - 0.4:.1f}" y="0" width="0.8" height="12" class="lab-bar-estimate"/></svg>',
                    sanitize=False,
                )
                ui.label(f"{estimate:.3f} [{low:.3f}, {high:.3f}], width {high - low:.3f}").classes(
                    "lab-value"
                )
    hint("Bars are 95 % intervals; the mark is the estimate. The last row uses all trials so far.")
