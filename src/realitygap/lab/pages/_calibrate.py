"""Calibrate: a robot measured step by step, with a plot that grows as readings come in."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import ui
from starlette.requests import Request

from realitygap.lab._calibration_job import CalibrationJob
from realitygap.lab._lab import Lab, Visitor
from realitygap.platforms import class_of
from realitygap.world import load_arena

from ._frame import framed, hint, section, text_of, visitor_of, whole_of
from ._grid import CellGrid
from ._handover import show_holder
from ._notices import attempt, notify
from ._part import Part, watching

_KINDS = {
    "path": "path: the paper's, five full steps ahead and five turning",
    "sensors": "sensors: fifty readings at each distance from a wall",
    "motion": "motion: motors and drift",
    "contact": "contact: what happens at walls",
    "all": "all: everything at once",
}
_INKS = ("#1f5c99", "#b3161b", "#1e6b34", "#6a3d9a")


def add_calibrate(lab: Lab) -> None:
    """Add the page."""

    @ui.page("/calibrate", response_timeout=30)
    def calibrate(request: Request) -> None:
        with framed(lab, "Calibrate", "/calibrate"):
            _Page(lab, visitor_of(request)).show()


class _Page:
    def __init__(self, lab: Lab, visitor: Visitor) -> None:
        self._lab = lab
        self._visitor = visitor
        self._chart: ui.echart | None = None

    def show(self) -> None:
        hint(
            "A robot is measured, and a simulated one fitted to it. Emulators, twins and sim are measured by "
            "themselves; beside a robot you are asked step by step. Trials are kept as they end: the same name goes on "
            "with them."
        )
        self._show_form()
        self._work, self._plot, self._made = (
            ui.refreshable(show) for show in (self._show_work, self._show_plot, self._show_made)
        )
        self._asked = Part(self._asked_stand, _show_question)
        self._seen = self._stand()
        with ui.column().classes("lab-cards"):
            self._work()
            self._asked.show()
            self._plot()
            self._made()
        watching(self._lab, self._look)

    def _stand(self) -> Any:
        job = self._lab.calibration
        if job is None:
            return None
        return id(job), job.n_done, job.n_trials, job.outcome, self._lab.operator, len(job.readings)

    def _asked_stand(self) -> tuple[CalibrationJob, dict[str, Any]] | None:
        """What it asks this visitor."""
        job = self._lab.calibration
        ask = None if job is None or job.is_over else job.ask
        return None if job is None or ask is None or not self._may(job) else (job, ask)

    def _may(self, job: CalibrationJob) -> bool:
        return not job.has_robot or self._lab.may_operate(self._visitor)

    def _look(self) -> None:
        self._asked.look()
        before, now, job = self._seen, self._stand(), self._lab.calibration
        if now == before or job is None:
            return
        self._seen = now
        if before is None or before[:-1] != now[:-1]:
            self._work.refresh()
        if self._chart is None or before is None or before[0] != now[0]:
            self._plot.refresh()
        elif before[-1] != now[-1]:
            _grow(self._chart, job)
        self._made.refresh()

    def _show_form(self) -> None:
        with ui.row().classes("lab-row"):
            name = ui.input("Name", value="my-robot")
            kind = ui.select(_KINDS, value="sensors", label="What")
            platform = ui.input(
                "Platform: scribbler:PORT, thymio:PORT, twin:FILE, sim or sim:FILE", value="sim"
            )
            observe = ui.select(["cells", "encoders", "track"], value="cells", label="What is seen of it")
            base = ui.input("Robot, or its file, on whose numbers the fit builds (else that of the platform)")
            budget = ui.number("Trials in all (else what it takes)", min=1, precision=0)
            witness = ui.input("Witness of an emulator, HOST:PORT")
            for each in (name, kind, platform, observe, base, budget, witness):
                each.props("outlined dense").classes("lab-wide")

        def begin() -> None:
            self._lab.calibrate(
                text_of(name),
                {
                    "kind": kind.value,
                    "platform": text_of(platform),
                    "observe": observe.value,
                    "base": text_of(base) or class_of(text_of(platform)).base_robot,
                    "budget": whole_of(budget),
                    "witness": text_of(witness),
                },
                self._visitor,
            )

        ui.button("Calibrate", on_click=lambda: attempt(begin)).props("unelevated no-caps")

    def _show_work(self) -> None:
        job = self._lab.calibration
        if job is None:
            return
        section(f"{job.name}: {job.kind}")
        if job.outcome is not None:
            ui.label(job.outcome).classes("lab-problem lab-lines" if job.is_failed else "").props(
                'role="status"'
            )
        share = job.n_done / max(job.n_trials, 1)
        ui.linear_progress(share, show_value=False).props(f'aria-label="{100 * share:.0f} % of the trials"')
        ui.label(f"{job.n_done} of {job.n_trials} trials" if job.n_trials else "Getting ready ...")
        may = self._may(job)
        if not may:
            show_holder(self._lab, self._visitor)
        if not job.is_over:
            ui.button("Stop for now", on_click=job.ask_to_end).props("outline no-caps").set_enabled(may)

    def _show_plot(self) -> None:
        """What each sensor read on average, against the distance of the wall or the number of the trial."""
        job, self._chart = self._lab.calibration, None
        if job is not None and any(each["means"] for each in job.readings):
            self._chart = ui.echart({}).classes("lab-plot").props('role="img"')
            _grow(self._chart, job)

    def _show_made(self) -> None:
        job = self._lab.calibration
        if job is not None and job.made is not None:
            _show_fit(job.made)


def _show_question(asked: tuple[CalibrationJob, dict[str, Any]] | None) -> None:
    if asked is None:
        return
    job, ask = asked

    def answer(**values: Any) -> None:
        if not job.answer(ask["number"], **values):
            notify("That has been answered already.")

    with ui.card().classes("lab-card lab-question").props('role="status"'):
        if ask["question"] == "place":
            ui.label(f"Trial {ask['trial'] + 1} of {ask['n']}").classes("lab-section")
            ui.label(ask["text"][:1].upper() + ask["text"][1:])
            with ui.row().classes("lab-row"):
                ui.button("It stands there", on_click=lambda: answer(answer="go")).props("unelevated no-caps")
                ui.button("Take the one before back", on_click=lambda: answer(answer="redo")).props(
                    "outline no-caps"
                ).set_enabled(ask["trial"] > 0)
        elif ask["question"] == "measure":
            fields = {key: ui.input(text).props("outlined dense") for key, text in ask["questions"].items()}
            ui.label(ask["said"]).classes("lab-problem")
            with ui.row().classes("lab-row"):
                ui.button(
                    "Enter", on_click=lambda: answer(**{key: text_of(each) for key, each in fields.items()})
                ).props("unelevated no-caps")
                ui.button("Drive it again", on_click=lambda: answer(redo=True)).props("outline no-caps")
        else:
            _ask_cells(answer)


def _ask_cells(answer: Callable[..., None]) -> None:
    found: list[int] = []
    ui.label("Which cells does its line cross?").classes("lab-section")
    CellGrid(
        load_arena("paper"), name="Cells crossed", change=lambda cells: found.__setitem__(slice(None), cells)
    )
    ui.button("Enter this count", on_click=lambda: answer(cells=list(found))).props("unelevated no-caps")


def _grow(chart: ui.echart, job: CalibrationJob) -> None:
    """Put what has been read into the plot."""
    stands = [each for each in job.readings if each["purpose"] == "sensors"]
    points = stands or job.readings
    across = "distance from the wall [in]" if stands else "trial"
    chart.options.update(_options(points, across))
    chart.props(
        f'aria-label="Mean reading of each sensor against the {across}, of {len(points)} '
        f'{"trial" if len(points) == 1 else "trials"}"'
    )
    chart.update()


def _options(points: list[dict[str, Any]], across: str) -> dict[str, Any]:
    """Of the plot, as its library has them."""
    n = max(len(each["means"]) for each in points)
    return {
        "animation": False,
        "grid": {"left": 50, "right": 16, "top": 36, "bottom": 44},
        "legend": {"data": [f"sensor {k + 1}" for k in range(n)]},
        "xAxis": {"type": "value", "name": across, "nameLocation": "middle", "nameGap": 28},
        "yAxis": {"type": "value", "name": "reading", "min": 0},
        "series": [
            {
                "name": f"sensor {k + 1}",
                "type": "scatter",
                "symbolSize": 9,
                "itemStyle": {"color": _INKS[k % len(_INKS)]},
                "data": [[each["at"], each["means"][k]] for each in points if k < len(each["means"])],
            }
            for k in range(n)
        ],
    }


def _show_fit(made: dict[str, Any]) -> None:
    section("Fitted, with intervals of 90 %")
    with ui.element("table").classes("lab-plain"):
        for each in made["fitted"]:
            with ui.element("tr"):
                ends = f"{each['low']:.4g} to {each['high']:.4g} {each['unit']}"
                for cell in (
                    each["name"],
                    f"{each['estimate']:.4g}",
                    ends,
                    "" if each["identified"] else "not identified",
                ):
                    with ui.element("td"):
                        ui.label(cell)
    for note in made["notes"]:
        hint(note)
    if made["misspecified"]:
        ui.label("The simulator cannot make what was observed: this is the nearest that it can do.").classes(
            "lab-problem"
        )
