"""Robot: connect, look it over, drive it by hand."""

from __future__ import annotations

from typing import Any

from nicegui import events, run, ui
from nicegui.element import Element
from starlette.requests import Request

from realitygap.lab._hand import Hand
from realitygap.lab._lab import Lab, Visitor
from realitygap.platforms import emulated_robots
from realitygap.robots import list_ports
from realitygap.robots.scribbler import PortGuess

from ._frame import framed, hint, section, text_of, visitor_of
from ._grid import CellGrid
from ._handover import show_holder
from ._notices import attempt
from ._part import watching

LIVE_S = 0.05
"""Between two looks at the senses: 20 a second."""
EMULATED = "emulator://s2?fluke=2"


class DrivePad(Element, component="drive_pad.js"):
    """A handle that drives while it is held."""

    def __init__(self, *, name: str, is_off: bool, stops: int) -> None:
        super().__init__()
        self._props |= {"name": name, "disabled": is_off, "stops": stops}

    def know(self, stops: int) -> None:
        """Tell it how often somebody pressed stop: a press from now on is one after all of them."""
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

    def show(self) -> None:
        self._seen = self._stand()
        self._part = ui.refreshable(self._show)
        with ui.column().classes("lab-cards"):
            self._part()
        watching(self._lab, self._look)
        ui.timer(LIVE_S, self._live)

    def _stand(self) -> Any:
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
        now = self._stand()
        if now == self._seen:
            return
        before, self._seen = self._seen, now
        if self._is_same_robot(before, now):
            self._facts.refresh()
        else:
            self._ports = await run.io_bound(list_ports) or []
            self._part.refresh()

    def _is_same_robot(self, before: Any, now: Any) -> bool:
        """Whether only what is told of it has changed: whoever holds the pad goes on holding it."""
        one, other = before[0], now[0]
        return one is not None and other is not None and one[:3] == other[:3] and before[1:] == now[1:]

    def _show(self) -> None:
        self._pad = None
        hand, job = self._lab.hand, self._lab.robot_job
        if job is not None:
            ui.label(f"The study {job.name!r} has the robot.")
            ui.button("To its trials", on_click=lambda: ui.navigate.to(f"/trials/{job.name}")).props(
                "outline no-caps"
            )
            return
        if hand is not None and hand.outcome is not None:
            ui.label(hand.outcome).classes("lab-problem" if hand.is_failed else "").props('role="status"')
        if hand is None or hand.is_over:
            self._show_connecting()
            return
        if not hand.label:
            ui.label(f"Connecting to {hand.port} ...").props('role="status"')
            ui.button("Give up", on_click=hand.ask_to_end).props("outline no-caps")
            return
        self._show_robot(hand)

    def _show_connecting(self) -> None:
        found = self._ports
        likely = [guess.port for guess in found if guess.seems != "a serial port"]
        port = (
            ui.input(
                "Port",
                value=likely[0] if likely else EMULATED,
                autocomplete=[*(guess.port for guess in found), *emulated_robots()],
            )
            .props("outlined dense")
            .classes("lab-wide")
        )
        for guess in found:
            hint(f"{guess.port}: {guess.seems}")
        hint(f"Emulated robots in this program: {', '.join(emulated_robots())}.")
        witness = ui.input("Witness of an emulator in another program, HOST:PORT (else leave it empty)")
        witness.props("outlined dense").classes("lab-wide")

        def connect() -> None:
            self._lab.connect(text_of(port), text_of(witness), self._visitor)

        ui.button("Connect", on_click=lambda: attempt(connect)).props("unelevated no-caps")

    def _show_robot(self, hand: Hand) -> None:
        may = self._lab.may_operate(self._visitor)
        ui.label(f"{hand.label} at {hand.port}").classes("lab-section").props('role="status"')
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
                hint(
                    "Hold it and pull, or use the arrow keys. Let go, or close the page, and the robot stops."
                )
            with ui.column().classes("lab-cards"):
                section("Senses")
                self._bars = [
                    ui.linear_progress(0, show_value=False, size="14px").props(
                        f'aria-label="Obstacle reading {k + 1}"'
                    )
                    for k in range(len(hand.senses["raw"]) if hand.senses else 3)
                ]
                self._said = ui.label("")
                self._moves = ui.label("")
        self._grid = None
        if hand.arena is not None:
            section("Where it is")
            self._grid = CellGrid(hand.arena, ink="red", name="Where the emulated robot is").classes(
                "lab-sketch"
            )
            self._n_points = 0
        self._facts = ui.refreshable(lambda: self._show_facts(hand))
        self._facts()
        with ui.row().classes("lab-row"):
            for text, what in (("Pre-flight: turns on the spot", "preflight"), ("Take a picture", "picture")):
                ui.button(text, on_click=lambda what=what: hand.want(what)).props(
                    "outline no-caps"
                ).set_enabled(may)
            if hand.arena is not None:
                ui.button("Put it at the start", on_click=lambda: hand.want("place")).props(
                    "outline no-caps"
                ).set_enabled(may)
            ui.button("Let the robot go", on_click=hand.ask_to_end).props("flat no-caps").set_enabled(may)

    def _show_facts(self, hand: Hand) -> None:
        section("What it says of itself")
        about = ", ".join(f"{key} {value}" for key, value in hand.about.items() if value not in ("", "None"))
        ui.label(about)
        ui.label("Battery: not told" if hand.battery_v is None else f"Battery: {hand.battery_v:.2f} V")
        if hand.said:
            ui.label(hand.said).classes("lab-problem")
        if hand.preflight is not None:
            ui.label("Pre-flight").classes("lab-section")
            for name, value in hand.preflight["facts"].items():
                ui.label(f"{name}: {value}")
            for problem in hand.preflight["problems"]:
                ui.label(f"Against driving: {problem}").classes("lab-problem")
            if not hand.preflight["problems"]:
                ui.label("Nothing speaks against driving.")
        if hand.picture:
            ui.element("img").props(
                f'src="data:image/png;base64,{hand.picture}" alt="What the robot sees"'
            ).classes("lab-picture")

    def _live(self) -> None:
        hand = self._lab.hand
        if hand is not None and self._pad is not None:
            self._pad.know(hand.n_stops)
        if hand is None or hand.senses is None or hand.n_live == self._n_shown or not hasattr(self, "_bars"):
            return
        self._n_shown = hand.n_live
        senses = hand.senses
        for bar, reading in zip(self._bars, senses["readings"], strict=False):
            bar.value = round(reading, 3)
        seen = ", ".join(f"{value:.0f}" for value in senses["raw"])
        more = "".join(
            f"; {name} {', '.join(map(str, senses[name]))}" for name in ("light", "line") if name in senses
        )
        self._said.text = f"Obstacles {seen}{more}"
        self._moves.text = ("Driving" if senses["moves"] else "Standing") + (
            ", blocked" if senses["stalled"] else ""
        )
        if self._grid is not None and "pose" in senses:
            line = hand.line
            anew = len(line) < self._n_points or self._n_points == 0
            self._grid.follow(senses["pose"], line if anew else line[self._n_points :], anew=anew)
            self._n_points = len(line)

    def _drive(self, event: events.GenericEventArguments) -> None:
        hand = self._lab.hand
        given = event.args if isinstance(event.args, dict) else {}
        if hand is not None and self._lab.may_operate(self._visitor):
            hand.drive(given.get("move", 0), given.get("turn", 0), given.get("stops", -1))

    def _release(self, event: events.GenericEventArguments) -> None:
        hand = self._lab.hand
        if hand is not None and self._lab.may_operate(self._visitor):
            hand.release()
