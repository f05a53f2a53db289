"""Calibrate: a robot is measured trial by trial, and a simulated one is fitted to it."""

from __future__ import annotations

import re
from functools import partial
from typing import Any

from nicegui import run, ui
from starlette.requests import Request

from realitygap.drawing import Ink, themed_color
from realitygap.lab import _messages as messages
from realitygap.lab._calibration import CalibrationJob, calibration_mistakes
from realitygap.lab._choices import Choices, model_choices, platform_choices
from realitygap.lab._control import Visitor
from realitygap.lab._gap import PLACING_S
from realitygap.lab._lab import Lab
from realitygap.orders import CalibrateOrder
from realitygap.robot_families import default_family
from realitygap.robots import list_ports, split_port
from realitygap.world import Fitted, load_arena

from ._control import show_holder
from ._elements import CellGrid
from ._fields import Form, needed
from ._frame import framed, hint, section, text_of, visitor_of
from ._notices import attempt, notify
from ._part import LOOK_S, Part, watching
from ._status import Silence, show_steps

_KINDS = {
    "path": ("Path", "The paper's method: five full steps ahead, and five that turn.", 10, 4),
    "sensors": ("Sensors", "The paper's method: fifty readings at each distance from a wall.", 18, 14),
    "motion": ("Motion", "Motors and drift.", 10, 12),
    "contact": ("Contact", "Effect of walls on the motion.", 10, 12),
    "all": ("All", "Motion, sensors, and contact together.", 20, 15),
}
"""Name, meaning, trials on a robot of the default family, and their time [min] of each kind of calibration."""
_FIELDS = {field.name: field for field in CalibrateOrder.fields() if field.face.label}
_OF_ROBOT = ("robot", "name")
"""Fields of the first step."""
_STEPS = ("Robot", "Part", "Run", "Result")
_BAR = """
<q-td :props="props"><svg viewBox="0 0 100 12" width="120" height="14" aria-hidden="true" preserveAspectRatio="none">
  <rect x="0" y="5" width="100" height="2" class="lab-bar-prior" />
  <rect :x="props.value[0]" y="3" :width="props.value[1]" height="6" class="lab-bar-interval" />
  <rect :x="props.value[2] - 0.8" y="0" width="1.6" height="12" class="lab-bar-estimate" />
</svg></q-td>
"""
"""An interval as a bar within the range of its prior."""
_STATE = """
<q-td :props="props">
  <span :class="props.value === 'Identified' ? 'lab-ok' : 'lab-warning'">{{ props.value }}</span>
  <div v-if="props.row.advice" class="lab-hint">{{ props.row.advice }}</div>
</q-td>
"""
_INKS = tuple(themed_color(color) for color in (Ink.PEN1, Ink.PEN2, Ink.PEN3, Ink.PEN4))


def add_calibrate(lab: Lab) -> None:
    """Add the page."""

    @ui.page("/calibrate", response_timeout=30)
    async def calibrate(request: Request) -> None:
        choices = await run.io_bound(_choices_of, lab) or {}
        with framed(lab, "Calibrate", "/calibrate"):
            _Page(lab, visitor_of(request), choices).show()


def _choices_of(lab: Lab) -> dict[str, Choices]:
    """Return what the fields of the form offer, by field."""
    ports = [guess._replace(port=_platform_at(guess.port)) for guess in list_ports()]
    return {"robot": platform_choices(lab.root, "robot", ports), "base": model_choices(lab.root)}


def _platform_at(port: str) -> str:
    """Return the platform of the robot at a port."""
    return port if split_port(port)[0] else default_family().named(port)


class _Page:
    def __init__(self, lab: Lab, visitor: Visitor, choices: dict[str, Choices]) -> None:
        self._lab, self._choices = lab, choices
        self._mistakes = partial(calibration_mistakes, lab.root)
        self._visitor = visitor
        self._chart: ui.echart | None = None
        self._is_new = False
        self._chosen = "sensors"
        self._stage = "Robot"

    def show(self) -> None:
        hint(
            "Measures a robot and fits a simulated one to it. Emulated robots, twins, and sim need no operator. For a "
            "robot, the page tells you where to place it. Trials are saved: calibrate again under the same name to "
            "continue."
        )
        self._steps = Part(self._step, lambda step: show_steps(_STEPS, step))
        self._steps.show()
        # above the form, which fills a screen
        self._unfinished = Part(self._unfinished_state, self._show_unfinished)
        with ui.column().classes("lab-cards"):
            self._unfinished.show()
        self._form_box = ui.element("div").classes("lab-form")
        with self._form_box:
            self._show_form()
        self._work = Part(self._work_state, self._show_work)
        self._plot, self._made = (ui.refreshable(show) for show in (self._show_plot, self._show_made))
        self._asked = Part(self._asked_stand, _show_question)
        self._seen = self._stand()
        with ui.column().classes("lab-cards"):
            self._work.show()
            silence = Silence()
            self._asked.show()
            self._made()
            self._plot()
        ui.link("Saved trials", "/saved")
        self._again = ui.button("New calibration", on_click=self._begin_again).props("outline no-caps")
        self._fold_form()
        watching(self._lab, self._look)
        ui.timer(LOOK_S, lambda: silence.look(self._silent_s()))

    def _silent_s(self) -> float:
        job = self._lab.calibration
        return 0.0 if job is None else job.silent_s

    def _stand(self) -> Any:
        job = self._lab.calibration
        if job is None:
            return None
        return id(job), job.n_done, job.n_trials, job.outcome, self._lab.robot.operator, len(job.readings)

    def _asked_stand(self) -> tuple[CalibrationJob, messages.Question] | None:
        """The question that this visitor can answer, with its job."""
        job = self._lab.calibration
        ask = None if job is None or job.is_over else job.ask
        return None if job is None or ask is None or not self._may(job) else (job, ask)

    def _may(self, job: CalibrationJob) -> bool:
        return not job.has_robot or self._lab.robot.may_operate(self._visitor)

    def _step(self) -> str:
        job = self._lab.calibration
        if self._is_new or job is None:
            return self._stage
        if not job.is_over:
            return "Run"
        return "Result" if job.made is not None else self._stage

    def _begin_again(self) -> None:
        self._is_new = True
        self._show_stage("Robot")
        self._fold_form()
        self._steps.look()

    def _fold_form(self) -> None:
        """Show the form unless a calibration runs or its result is shown."""
        step = self._step()
        self._form_box.set_visibility(step in ("Robot", "Part"))
        self._again.set_visibility(step == "Result")

    def _look(self) -> None:
        job = self._lab.calibration
        if job is not None and not job.is_over:
            self._is_new = False
        self._fold_form()
        self._steps.look()
        self._asked.look()
        for part in (self._unfinished, self._work):
            part.look()
        before, now, job = self._seen, self._stand(), self._lab.calibration
        if now == before or job is None:
            return
        self._seen = now
        if self._chart is None or before is None or before[0] != now[0]:
            self._plot.refresh()
        elif before[-1] != now[-1]:
            _grow(self._chart, job)
        self._made.refresh()

    def _show_form(self) -> None:
        self._form = form = Form()
        form.summary()
        with ui.element("div").classes("lab-form") as self._robot_box:
            form.text_of(
                _FIELDS["robot"],
                "sim",
                self._choices.get("robot"),
                is_needed=True,
                explanation="A robot at a port needs a person next to it.",
            )
            form.text("name", "Name", "my-robot", parse=needed, explanation="Name of the calibration file.")
            ui.button("Next", on_click=self._go_to_kinds).props("unelevated no-caps")
        with ui.element("div").classes("lab-form") as self._kind_box:
            section("Part to calibrate")
            with (
                ui.element("div")
                .classes("lab-kinds")
                .props('role="radiogroup" aria-label="Part to calibrate"')
            ):
                self._cards = {kind: self._show_card(kind) for kind in _KINDS}
            hint(
                f"Minutes are for a {default_family().noun}, with {PLACING_S:.0f} s to place it before each trial. "
                "Simulated robots take less."
            )
            with ui.expansion("Advanced").classes("lab-expansion"):
                for key, field in _FIELDS.items():
                    if key != "robot":
                        form.field_of(field, self._choices.get(key))

        async def start() -> None:
            if not await form.submit(begin, self._mistakes) and any(
                self._form.is_wrong(key) for key in _OF_ROBOT
            ):
                self._show_stage("Robot")

        def begin(values: dict[str, Any]) -> None:
            name = values.pop("name")
            self._lab.calibrate(name, {**values, "what": self._chosen}, self._visitor)

        with self._kind_box, ui.row().classes("lab-row"):
            ui.button("Calibrate", on_click=start).props("unelevated no-caps")
            ui.button("Back", on_click=lambda: self._show_stage("Robot")).props("flat no-caps")
        self._show_stage("Robot")

    async def _go_to_kinds(self) -> None:
        """Go on to the kinds of calibration if the robot and the name can be used."""
        found = await self._form.all_problems(self._mistakes)
        problems = {key: text for key, text in found.items() if key in _OF_ROBOT}
        self._form.show_problems(problems)
        if not problems:
            self._show_stage("Part")

    def _show_stage(self, stage: str) -> None:
        self._stage = stage
        self._robot_box.set_visibility(stage == "Robot")
        self._kind_box.set_visibility(stage == "Part")
        self._steps.look()

    def _show_card(self, kind: str) -> ui.element:
        """Show one of the cards as a radio button: arrow keys and Space choose it."""
        name, meaning, n_trials, minutes = _KINDS[kind]
        with ui.element("div").classes("lab-kind").props(f'role="radio" data-kind="{kind}"') as card:
            ui.label(name).classes("lab-label")
            hint(meaning)
            ui.label(f"{n_trials} trials · {minutes} min").classes("lab-value")
        card.on("click", lambda: self._choose(kind))
        card.on("keydown.space.prevent", lambda: self._choose(kind))
        card.on("keydown.enter.prevent", lambda: self._choose(kind))
        for key, turn in {"down": 1, "right": 1, "up": -1, "left": -1}.items():
            card.on(f"keydown.{key}.prevent", lambda turn=turn: self._turn(kind, turn))
        self._mark(card, is_chosen=kind == self._chosen)
        return card

    def _choose(self, kind: str) -> None:
        self._chosen = kind
        for name, card in self._cards.items():
            self._mark(card, is_chosen=name == kind)

    def _turn(self, kind: str, turn: int) -> None:
        """Choose the next card or the one before, and move the focus there."""
        kinds = list(_KINDS)
        chosen = kinds[(kinds.index(kind) + turn) % len(kinds)]
        self._choose(chosen)
        ui.run_javascript(f"getHtmlElement({self._cards[chosen].id}).focus()")

    @staticmethod
    def _mark(card: ui.element, *, is_chosen: bool) -> None:
        """Mark a card; Tab reaches the one that is chosen."""
        card.props(f'aria-checked="{"true" if is_chosen else "false"}" tabindex="{0 if is_chosen else -1}"')

    def _work_state(self) -> tuple[Any, ...] | None:
        job = self._lab.calibration
        if job is None:
            return None
        return (
            id(job),
            job.progress,
            job.is_over,
            job.is_failed,
            job.n_done,
            self._may(job),
            self._lab.robot.operator,
        )

    def _unfinished_state(self) -> tuple[Any, ...] | None:
        job = self._lab.calibration
        return self._work_state() if job is not None and job.can_resume else None

    def _show_unfinished(self, state: tuple[Any, ...] | None) -> None:
        if state is not None and self._lab.calibration is not None:
            self._show_progress(self._lab.calibration)

    def _show_work(self, state: tuple[Any, ...] | None) -> None:
        job = self._lab.calibration
        if job is None or state is None:
            ui.label("No calibrations yet.")
        elif not job.can_resume:
            self._show_progress(job)

    def _show_progress(self, job: CalibrationJob) -> None:
        section(f"{job.name}: {job.kind}")
        ui.label(job.progress).classes("lab-problem lab-lines" if job.is_failed else "").props(
            'role="status"'
        )
        share = job.n_done / max(job.n_trials, 1)
        ui.linear_progress(share, show_value=False).props(f'aria-label="{100 * share:.0f} % of the trials"')
        may = self._may(job)
        if not may:
            show_holder(self._lab, self._visitor)
        if not job.is_over:
            ui.button("Stop calibration", on_click=job.ask_to_end).props("outline no-caps").set_enabled(may)
        elif job.can_resume:
            ui.button("Resume", on_click=lambda: attempt(lambda: self._resume(job))).props("outline no-caps")

    def _resume(self, job: CalibrationJob) -> None:
        values = job.order.model_dump(exclude={"out"})
        self._lab.calibrate(job.name, values, self._visitor)

    def _show_plot(self) -> None:
        """Show the mean reading of each sensor by distance from the wall, or by trial."""
        job, self._chart = self._lab.calibration, None
        if job is not None and any(point["means"] for point in job.readings):
            self._chart = ui.echart({}, renderer="svg").classes("lab-plot").props('role="img"')
            _grow(self._chart, job)

    def _show_made(self) -> None:
        job = self._lab.calibration
        if job is not None and job.made is not None:
            _show_fit(job.made, job.name)


def _show_question(asked: tuple[CalibrationJob, messages.Question] | None) -> None:
    if asked is None:
        return
    job, question = asked

    def answer(
        choice: messages.Choice = "", *, cells: list[int] | None = None, lengths: dict[str, str] | None = None
    ) -> None:
        if not job.answer(messages.Answer(question.number, choice, cells=cells or [], lengths=lengths or {})):
            notify("Another page has answered this question.")

    def button(text: str, choice: messages.Choice, look: str = "outline") -> ui.button:
        return ui.button(text, on_click=lambda: answer(choice)).props(f"{look} no-caps")

    with ui.card().classes("lab-card lab-question").props('role="status"'):
        match question:
            case messages.StartQuestion():
                ui.label(f"Trial {question.trial + 1} of {question.n}").classes("lab-section")
                ui.label(question.text[:1].upper() + question.text[1:])
                with ui.row().classes("lab-row"):
                    button("Robot is in place", "go", "unelevated")
                    button("Undo last trial", "redo").set_enabled(question.trial > 0)
            case messages.RepeatQuestion():
                ui.label(question.problem)
                with ui.row().classes("lab-row"):
                    if question.can_count:
                        button("Use this trial", "driven", "unelevated")
                    button("Repeat trial", "void")
            case messages.LengthsQuestion():
                fields = {
                    key: ui.input(text).props("outlined dense") for key, text in question.labels.items()
                }
                ui.label(question.problem).classes("lab-problem")
                with ui.row().classes("lab-row"):
                    ui.button(
                        "Save",
                        on_click=lambda: answer(
                            lengths={key: text_of(field) for key, field in fields.items()}
                        ),
                    ).props("unelevated no-caps")
                    button("Repeat trial", "redo")
            case messages.CellsQuestion():
                cells: list[int] = []
                ui.label("Mark the cells that the line crosses").classes("lab-section")
                CellGrid(
                    load_arena("paper"),
                    name="Cells crossed",
                    change=lambda marked: cells.__setitem__(slice(None), marked),
                )
                ui.button("Save score", on_click=lambda: answer(cells=list(cells))).props(
                    "unelevated no-caps"
                )


def _grow(chart: ui.echart, job: CalibrationJob) -> None:
    """Put what has been read into the plot."""
    stands = [point for point in job.readings if point["purpose"] == "sensors"]
    points = stands or job.readings
    across = "distance from the wall [in]" if stands else "trial"
    chart.options.update(_options(points, across))
    chart.props(
        f'aria-label="Mean reading of each sensor against the {across}, of {len(points)} '
        f'{"trial" if len(points) == 1 else "trials"}"'
    )
    chart.update()


def _options(points: list[messages.ReadingPoint], across: str) -> dict[str, Any]:
    """Return the options of the plot."""
    n = max(len(point["means"]) for point in points)
    text, rule = {"color": "var(--text)"}, {"lineStyle": {"color": "var(--ink-rule)"}}
    axis = {"type": "value", "nameTextStyle": text, "axisLabel": text, "axisLine": rule, "splitLine": rule}
    return {
        "animation": False,
        "grid": {"left": 50, "right": 16, "top": 36, "bottom": 44},
        "legend": {"data": [f"sensor {k + 1}" for k in range(n)], "top": 4, "left": 80, "textStyle": text},
        "xAxis": axis | {"name": across, "nameLocation": "middle", "nameGap": 28},
        "yAxis": axis | {"name": "reading", "min": 0},
        "series": [
            {
                "name": f"sensor {k + 1}",
                "type": "scatter",
                "symbolSize": 9,
                "itemStyle": {"color": _INKS[k % len(_INKS)]},
                "data": [[point["at"], point["means"][k]] for point in points if k < len(point["means"])],
            }
            for k in range(n)
        ],
    }


def _show_fit(made: messages.CalibrationMade, name: str) -> None:
    if made.misspecified:
        p = f" (p = {made.p:.2g})" if made.p < 1 else ""
        ui.label(
            f"Rejected: the simulator can't reproduce this robot{p}. Don't use this calibration for conclusions."
        ).classes("lab-rejected").props('role="alert"')
    with ui.row().classes("lab-row"):
        target = f"sim:{name}.toml"
        ui.button("Use in a study", on_click=lambda: ui.navigate.to(f"/new?platform={target}")).props(
            "unelevated no-caps"
        )
        ui.button("Measure the gap", on_click=lambda: ui.navigate.to(f"/gap?sim={target}")).props(
            "outline no-caps"
        )
    section("Parameters with 90 % intervals")
    fitted = [Fitted(**values) for values in made.fitted]
    n_identified = sum(number.identified for number in fitted)
    ui.label(f"{n_identified} of {len(fitted)} parameters are identified.")
    columns: list[dict[str, Any]] = [
        {"name": name, "label": label, "field": name, "align": "left"}
        | ({"classes": "lab-not-on-phones", "headerClasses": "lab-not-on-phones"} if name == "bar" else {})
        for name, label in (
            ("name", "Parameter"),
            ("estimate", "Estimate"),
            ("interval", "Interval"),
            ("bar", "Within the prior"),
            ("state", "Identified"),
        )
    ]
    rows = [
        {
            "name": number.name,
            "estimate": _with_minus(f"{number.shown[0]} {number.unit}"),
            "interval": _with_minus(number.shown[1]),
            "bar": _bar(number),
            "state": "Identified" if number.identified else "Not identified",
            "advice": number.advice,
        }
        for number in fitted
    ]
    table = ui.table(rows=rows, columns=columns, row_key="name").classes("lab-table lab-fitted")
    table.props("flat bordered dense wrap-cells")
    table.add_slot("body-cell-bar", _BAR)
    table.add_slot("body-cell-state", _STATE)
    for note in made.notes:
        hint(note)


def _with_minus(text: str) -> str:
    """Return numbers in a text with a minus sign, which a hyphen in front of them stands for."""
    return re.sub(r"(?<![\w-])-(?=[\d.])", "−", text)


def _bar(number: Fitted) -> list[float]:
    """Left end, width, and estimate of an interval within its prior [%]."""
    low, high = number.prior_low, number.prior_high
    width = high - low if high > low else 1.0
    ends = [
        min(max(100 * (end - low) / width, 0.0), 100.0) for end in (number.low, number.high, number.estimate)
    ]
    return [round(ends[0], 1), round(max(ends[1] - ends[0], 1.0), 1), round(ends[2], 1)]
