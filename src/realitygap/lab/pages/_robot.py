"""Robot: connect it, check it, and drive it by hand."""

from __future__ import annotations

import time
from typing import Any

from nicegui import events, run, ui
from nicegui.element import Element
from starlette.requests import Request

from realitygap.lab._hand import Hand
from realitygap.lab._lab import Lab, Visitor
from realitygap.platforms import emulated_robots
from realitygap.robots import list_ports
from realitygap.robots.scribbler import PortGuess

from ._fields import Form
from ._frame import framed, hint, section, visitor_of
from ._grid import CellGrid
from ._handover import show_holder
from ._notices import attempt
from ._part import watching

LIVE_S = 0.05
"""Time between two updates of the readings [s]."""
STALE_S = 1.0
"""Age from which readings are shown as old [s]."""
EMULATED = "emulator://s2?fluke=2"
_OBSTACLES = {
    3: (("Left obstacle", "0 to 6400"), ("Center obstacle", "0 to 6400"), ("Right obstacle", "0 to 6400")),
    2: (("Left infrared", "0 or 1"), ("Right infrared", "0 or 1")),
    7: tuple((f"Infrared {k}", "0 to 4505") for k in range(7)),
}
"""Names and ranges of the obstacle sensors, by their number."""


class DrivePad(Element, component="drive_pad.js"):
    """A pad that drives the robot while it is held."""

    def __init__(self, *, name: str, is_off: bool, stops: int) -> None:
        super().__init__()
        self._props |= {"name": name, "disabled": is_off, "stops": stops}

    def know(self, stops: int) -> None:
        """Set the number of stops so far: the pad drives only if it is pressed after all of them."""
        if self._props["stops"] != stops:
            self._props["stops"] = stops
            self.update()


def add_robot(lab: Lab) -> None:
    """Add the page."""

    @ui.page("/robot", response_timeout=30)
    async def robot(request: Request) -> None:
        ports = await run.io_bound(list_ports)
        with framed(lab, "Robot", "/robot"):
            _Page(lab, visitor_of(request), ports or []).show()


class _Page:
    def __init__(self, lab: Lab, visitor: Visitor, ports: list[PortGuess]) -> None:
        self._lab = lab
        self._visitor = visitor
        self._ports = ports
        self._n_shown = -1
        self._n_points = 0
        self._pad: DrivePad | None = None
        self._gauges: list[_Gauge] = []
        self._last_s = time.monotonic()

    def show(self) -> None:
        self._seen = self._state()
        self._part = ui.refreshable(self._show)
        with ui.column().classes("lab-cards"):
            self._part()
        watching(self._lab, self._look)
        ui.timer(LIVE_S, self._live)

    def _state(self) -> Any:
        hand = self._lab.hand
        shown = None
        if hand is not None:
            shown = (
                id(hand),
                hand.label,
                hand.outcome,
                hand.preflight,
                hand.said,
                len(hand.picture),
                hand.battery_v,
            )
        return shown, self._lab.operator, self._lab.robot_job

    async def _look(self) -> None:
        now = self._state()
        if now == self._seen:
            return
        before, self._seen = self._seen, now
        if self._is_same_robot(before, now):
            self._facts.refresh()
        else:
            self._ports = await run.io_bound(list_ports) or []
            self._part.refresh()

    def _is_same_robot(self, before: Any, now: Any) -> bool:
        """Whether only facts about the robot have changed: a drive pad that is held must stay on the page."""
        old, new = before[0], now[0]
        return old is not None and new is not None and old[:3] == new[:3] and before[1:] == now[1:]

    def _show(self) -> None:
        self._pad, self._gauges = None, []
        hand, job = self._lab.hand, self._lab.robot_job
        if job is not None:
            ui.label(f"The study {job.name!r} uses the robot.").props('role="status"')
            ui.button("Open trials", on_click=lambda: ui.navigate.to(f"/study/{job.name}/trials")).props(
                "outline no-caps"
            )
            return
        if hand is None or hand.is_over:
            self._show_connecting(hand)
            return
        if not hand.label:
            ui.label(f"Connecting to {hand.port}…").props('role="status"')
            ui.button("Cancel", on_click=hand.ask_to_end).props("outline no-caps")
            return
        self._show_robot(hand)

    # before a robot is connected

    def _show_connecting(self, last: Hand | None) -> None:
        message = "No robot connected." if last is None or last.outcome is None else last.outcome
        is_failed = last is not None and last.is_failed
        ui.label(message).classes("lab-problem lab-lines" if is_failed else "").props('role="status"')
        with ui.row().classes("lab-row"):
            if last is not None and is_failed:
                ui.button("Retry", on_click=lambda: attempt(lambda: self._connect(last.port))).props(
                    "unelevated no-caps"
                )
            ui.button(
                "Use an emulated robot", on_click=lambda: attempt(lambda: self._connect(EMULATED))
            ).props(f"{'outline' if is_failed else 'unelevated'} no-caps")
        hint("The emulated robot drives in a simulated arena. It needs no hardware.")
        if self._ports:
            section("Ports of this computer")
        for guess in self._ports:
            with ui.row().classes("lab-row"):
                ui.button(
                    f"Connect {guess.port}",
                    on_click=lambda port=guess.port: attempt(lambda: self._connect(port)),
                ).props("outline no-caps")
                ui.label(guess.seems)
        with ui.expansion("Another port").classes("lab-expansion"), ui.element("div").classes("lab-form"):
            form = Form()
            form.summary()
            form.text(
                "port",
                "Port",
                explanation="For example /dev/rfcomm0, COM3, socket://HOST:PORT, or thymio:/dev/ttyACM0. Emulated "
                f"robots: {', '.join(emulated_robots())}.",
                is_needed=True,
            )
            form.text(
                "witness",
                "Witness",
                explanation="HOST:PORT of the witness of an emulator in another program. Leave it empty for a robot.",
            )

            def connect(values: dict[str, Any]) -> None:
                self._connect(values["port"], values["witness"])

            ui.button("Connect", on_click=lambda: form.submit(connect)).props("unelevated no-caps")

    def _connect(self, port: str, witness: str = "") -> None:
        self._lab.connect(port, witness, self._visitor)

    # a robot that is connected

    def _show_robot(self, hand: Hand) -> None:
        may = self._lab.may_operate(self._visitor)
        with ui.row().classes("lab-row"):
            ui.label(hand.label).classes(f"lab-label-{hand.label.lower()} lab-badge")
            ui.label(f"Connected to {hand.port}").props('role="status"')
        if not may:
            show_holder(self._lab, self._visitor)
        with ui.element("div").classes("lab-two"):
            with ui.column().classes("lab-cards"):
                section("Drive")
                self._pad = DrivePad(
                    name="Drive: hold and pull, or the arrow keys", is_off=not may, stops=hand.n_stops
                )
                self._pad.on("drive", self._drive)
                self._pad.on("release", self._release)
                hint("Hold and pull the pad, or use the arrow keys. The robot stops when you let go.")
            with ui.column().classes("lab-cards lab-senses") as self._senses:
                section("Sensors")
                n_obstacles = len(hand.senses["raw"]) if hand.senses else 3
                self._gauges = [_Gauge(name, unit) for name, unit in _OBSTACLES.get(n_obstacles, ())]
                self._light, self._line = ui.label("Light"), ui.label("Line")
                self._motion = ui.label("Standing").props('role="status"')
        self._grid = None
        if hand.arena is not None:
            section("Position")
            self._grid = CellGrid(hand.arena, ink="red", name="Position of the emulated robot").classes(
                "lab-sketch"
            )
            self._n_points = 0
        self._facts = ui.refreshable(lambda: self._show_facts(hand))
        self._facts()
        with ui.row().classes("lab-row"):
            actions = [("Run pre-flight", "preflight"), ("Take picture", "picture")]
            if hand.arena is not None:
                actions.append(("Put at start", "place"))
            for text, what in actions:
                ui.button(text, on_click=lambda what=what: hand.want(what)).props(
                    "outline no-caps"
                ).set_enabled(may)
            ui.button("Disconnect", on_click=hand.ask_to_end).props("flat no-caps").set_enabled(may)
        hint("During the pre-flight, the robot turns on the spot.")

    def _show_facts(self, hand: Hand) -> None:
        section("Robot")
        battery = "unknown" if hand.battery_v is None else f"{hand.battery_v:.2f} V"
        facts = {"battery": battery, **hand.about}
        with ui.element("dl").classes("lab-facts"):
            for key, value in facts.items():
                if value not in ("", "None"):
                    with ui.element("dt"):
                        ui.label(key.replace("_", " ").capitalize())
                    with ui.element("dd"):
                        ui.label(value)
        if hand.said:
            ui.label(hand.said).classes("lab-problem")
        if hand.preflight is not None:
            section("Pre-flight check")
            for problem in hand.preflight["problems"]:
                ui.label(problem).classes("lab-problem")
            if not hand.preflight["problems"]:
                ui.label("Pre-flight check passed.").classes("lab-ok")
            with ui.element("dl").classes("lab-facts"):
                for name, value in hand.preflight["facts"].items():
                    with ui.element("dt"):
                        ui.label(name)
                    with ui.element("dd"):
                        ui.label(str(value))
        if hand.picture:
            ui.element("img").props(
                f'src="data:image/png;base64,{hand.picture}" alt="Picture of the robot\'s camera"'
            ).classes("lab-picture")

    def _live(self) -> None:
        hand = self._lab.hand
        if hand is None or self._pad is None:
            return
        self._pad.know(hand.n_stops)
        if hand.senses is None:
            return
        if hand.n_live == self._n_shown:
            self._show_age()
            return
        self._n_shown, self._last_s = hand.n_live, time.monotonic()
        self._senses.classes(remove="lab-stale")
        senses = hand.senses
        for gauge, reading, raw in zip(self._gauges, senses["readings"], senses["raw"], strict=False):
            gauge.put(reading, raw)
        for name, label in (("light", self._light), ("line", self._line)):
            label.text = f"{name.capitalize()}: {', '.join(map(str, senses[name]))}" if name in senses else ""
        self._motion.text = ("Driving" if senses["moves"] else "Standing") + (
            ", blocked" if senses["stalled"] else ""
        )
        if self._grid is not None and "pose" in senses:
            line = hand.line
            anew = len(line) < self._n_points or self._n_points == 0
            self._grid.follow(senses["pose"], line if anew else line[self._n_points :], anew=anew)
            self._n_points = len(line)

    def _show_age(self) -> None:
        """Gray out readings that are old."""
        age = time.monotonic() - self._last_s
        if age > STALE_S:
            self._senses.classes(add="lab-stale")
            self._motion.text = f"No reading for {age:.0f} s"

    def _drive(self, event: events.GenericEventArguments) -> None:
        hand = self._lab.hand
        given = event.args if isinstance(event.args, dict) else {}
        if hand is not None and self._lab.may_operate(self._visitor):
            hand.drive(given.get("move", 0), given.get("turn", 0), given.get("stops", -1))

    def _release(self, event: events.GenericEventArguments) -> None:
        hand = self._lab.hand
        if hand is not None and self._lab.may_operate(self._visitor):
            hand.release()


class _Gauge:
    """A reading with its name, its range, and a bar."""

    def __init__(self, name: str, unit: str) -> None:
        with ui.row().classes("lab-gauge"):
            ui.label(f"{name} ({unit})")
            self._text = ui.label("").classes("lab-value")
        self._bar = ui.linear_progress(0, show_value=False, size="14px").props(f'aria-label="{name}"')

    def put(self, reading: float, raw: float) -> None:
        """Show a reading, 0 to 1, and its raw value."""
        self._bar.value = round(reading, 3)
        self._text.text = f"{raw:.0f}"
