"""Robot: connect it, check it, and drive it by hand."""

from __future__ import annotations

from typing import Any

from nicegui import run, ui
from starlette.requests import Request

from realitygap._wording import duration
from realitygap.lab._control import RobotControl, Visitor
from realitygap.lab._hand import Hand
from realitygap.lab._lab import Lab
from realitygap.lab._messages import Activity, Senses
from realitygap.platforms import platform_class
from realitygap.playback import RobotShape
from realitygap.robot_families import (
    Reading,
    RobotFamily,
    default_family,
    find_family,
    ports_in_words,
    robot_families,
)
from realitygap.robots import PortGuess, is_in_this_program, list_ports, split_port

from ._control import show_holder
from ._elements import CellGrid, DrivePad, Pull
from ._fields import Form, needed
from ._frame import framed, hint, section, visitor_of
from ._notices import attempt
from ._part import Part, watching

LIVE_S = 0.05
"""Time between two updates of the readings [s]."""
_DOING: dict[Activity | None, str] = {  # shown meanwhile: over Bluetooth, a picture takes seconds
    "preflight": "Running the pre-flight…",
    "picture": "Taking a picture…",
    "place": "Putting the robot at its start…",
}


def add_robot(lab: Lab) -> None:
    """Add the page."""

    @ui.page("/robot", response_timeout=30)
    async def robot(request: Request) -> None:
        ports = await run.io_bound(list_ports)
        families = await run.io_bound(_emulated_families)
        with framed(lab, "Robot", "/robot", is_wide=True):
            _Page(lab, visitor_of(request), ports or [], families or []).show()


def _emulated_families() -> list[RobotFamily]:
    """Return the families with an emulated robot that can be started here; the default one first."""
    return [family for family in robot_families() if not family.lack()]


class _Page:
    def __init__(
        self, lab: Lab, visitor: Visitor, ports: list[PortGuess], families: list[RobotFamily]
    ) -> None:
        self._lab = lab
        self._visitor = visitor
        self._ports = ports
        self._families = families
        self._n_shown = -1
        self._pad: DrivePad | None = None
        self._gauges: dict[str, list[_Gauge]] = {}
        self._replies: dict[str, ui.label] = {}

    def show(self) -> None:
        self._seen = self._state()
        self._part = ui.refreshable(self._show)
        with ui.column().classes("lab-cards"):
            self._part()
        watching(self._lab, self._look)
        ui.timer(LIVE_S, self._live)

    @property
    def _robot(self) -> RobotControl:
        """The visitor's emulated robot, or the lab's robot."""
        return self._lab.robot_of(self._visitor)

    def _state(self) -> Any:
        hand = self._robot.hand
        shown = None
        if hand is not None:
            facts = (hand.preflight, hand.refusal, hand.doing, hand.picture, hand.battery_v)
            shown = (id(hand), hand.label, hand.outcome, *facts)
        return shown, self._robot.operator, self._robot.study_job

    async def _look(self) -> None:
        now = self._state()
        for port, reply in self._replies.items():  # the button that was pressed keeps the focus
            reply.text = self._lab.robot.reply_on(port)
        if now == self._seen:
            return
        before, self._seen = self._seen, now
        if self._is_same_robot(before, now):
            self._doing.text = _DOING.get(self._robot.hand.doing, "") if self._robot.hand is not None else ""
            for part in (self._facts, self._picture):
                part.look()
        else:
            self._ports = await run.io_bound(list_ports) or []
            self._part.refresh()

    def _is_same_robot(self, before: Any, now: Any) -> bool:
        """Return True if only facts about the robot have changed: a drive pad that is held must stay on the page."""
        old, new = before[0], now[0]
        return old is not None and new is not None and old[:3] == new[:3] and before[1:] == now[1:]

    def _show(self) -> None:
        self._pad, self._gauges, self._n_shown, self._replies = None, {}, -1, {}
        hand, job = self._robot.hand, self._robot.study_job
        if job is not None:
            ui.label(f"The study {job.name!r} uses the robot.").props('role="status"')
            ui.button("Open trials", on_click=lambda: ui.navigate.to(f"/study/{job.name}/trials")).props(
                "outline no-caps"
            )
            self._show_own()
            return
        if hand is None or hand.is_over:
            self._show_connecting(hand)
            if hand is not None and hand.is_lost:
                section("Last readings")
                self._show_panels(hand)
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
            for family in self._families:
                self._show_emulated(family, is_failed=is_failed)
        hint(f"The emulated robot is a {default_family().noun} in a simulated arena. It needs no hardware.")
        section("Ports of this computer")
        if not self._ports:
            hint("No serial ports found. Plug in or pair the robot, then reload the page.")
        else:
            hint(
                "Identify sends a few bytes to the device and shows which robot answers. Other devices may react to "
                "them, so use it only for a port that may be your robot's."
            )
        for guess in self._ports:
            self._show_port(guess)
        with ui.expansion("Another port").classes("lab-expansion"), ui.element("div").classes("lab-form"):
            form = Form()
            form.summary()
            form.text(
                "port",
                "Port",
                explanation=f"For example {ports_in_words()}.",
                parse=needed,
            )
            form.text(
                "witness",
                "Witness",
                explanation="HOST:PORT that an emulator in another program printed. Leave it empty for a robot.",
            )

            def connect(values: dict[str, Any]) -> None:
                self._connect(values["port"], values["witness"])

            ui.button("Connect", on_click=lambda: form.submit(connect)).props("unelevated no-caps")

    def _show_emulated(self, family: RobotFamily, *, is_failed: bool) -> None:
        """Show the button that connects to an emulated robot of a family."""
        noun = "robot" if family.is_default else family.noun
        port = family.as_typed(family.emulated)
        look = "unelevated" if family.is_default and not is_failed else "outline"
        ui.button(f"Use an emulated {noun}", on_click=lambda: attempt(lambda: self._connect(port))).props(
            f"{look} no-caps"
        )

    def _show_own(self) -> None:
        """Show how to drive an emulated robot while the lab's robot is in use."""
        with ui.row().classes("lab-row"):
            for family in self._families:
                if is_in_this_program(family.emulated):
                    self._show_emulated(family, is_failed=True)

    def _show_port(self, guess: PortGuess) -> None:
        port = guess.port
        with ui.row().classes("lab-row"):
            ui.button(f"Connect {port}", on_click=lambda: attempt(lambda: self._connect(port))).props(
                "outline no-caps"
            )
            ui.button("Identify", on_click=lambda: attempt(lambda: self._lab.robot.identify(port))).props(
                f'flat no-caps aria-label="Identify the robot on {port}"'
            )
            ui.label(guess.seems)
            self._replies[port] = ui.label(self._lab.robot.reply_on(port)).props('role="status"')

    def _connect(self, port: str, witness: str = "") -> None:
        self._lab.connect(port, witness, self._visitor)

    # a robot that is connected

    def _show_robot(self, hand: Hand) -> None:
        may = self._robot.may_operate(self._visitor)
        with ui.row().classes("lab-row"):
            ui.label(hand.label).classes(f"lab-label-{hand.label.lower()} lab-badge")
            ui.label(f"Connected to {hand.port}").props('role="status"')
        if not may:
            show_holder(self._lab, self._visitor)
            self._show_own()
        self._show_panels(hand)
        facts = ui.column().classes("lab-cards")
        self._facts = Part(
            lambda: (hand.preflight, hand.refusal, hand.battery_v), lambda _: self._show_facts(hand)
        )
        with facts:
            self._facts.show()

    def _show_panels(self, hand: Hand) -> None:
        """Show the position, the pad, the actions, and the readings."""
        self._grid: CellGrid | None = None
        family = find_family(split_port(hand.port)[0]) or default_family()
        with ui.element("div").classes("lab-drive"):
            with ui.column().classes("lab-cards lab-drive-where"):
                if hand.arena is not None:
                    section("Position")
                    self._grid = CellGrid(
                        hand.arena,
                        ink="var(--accent)",
                        outlines=RobotShape.of(platform_class(family.name)()).outlines,
                        name="Position of the emulated robot",
                    ).classes("lab-sketch")
                self._clock = ui.label("").classes("lab-value lab-finding")
            with ui.column().classes("lab-cards lab-drive-pad"):
                section("Drive")
                self._show_pad(hand)
            if not hand.is_over:
                with ui.column().classes("lab-cards lab-drive-actions"):
                    self._show_actions(hand)
            with ui.column().classes("lab-cards lab-senses") as self._senses:
                section("Sensors")
                self._motion = ui.label("Standing").props('role="status"')
                kinds: dict[str, tuple[Reading, ...]] = {
                    "range": family.range_readings.get(hand.n_sensors, ())
                }
                kinds |= {kind: family.channel_readings[kind] for kind in hand.kinds}
                for kind, sensors in kinds.items():
                    with ui.element("div").classes("lab-gauges"):
                        self._gauges[kind] = [_Gauge(*sensor) for sensor in sensors]
                self._picture = Part(lambda: hand.picture, _show_picture)
                self._picture.show()

    def _show_pad(self, hand: Hand) -> None:
        self._pad = DrivePad(
            "Drive: hold and pull, or the arrow keys",
            is_off=self._is_off(hand),
            stops=hand.n_stops,
            drive=self._drive,
            release=self._release,
        )
        if hand.is_over:
            return
        ui.button("Stop", on_click=lambda: self._lab.stop_robots(self._visitor), color=None).classes(
            "lab-pad-stop"
        ).props("unelevated no-caps")
        hint("Hold and pull the pad, or use the arrow keys. The robot stops when you let go.")

    def _show_actions(self, hand: Hand) -> None:
        may = self._robot.may_operate(self._visitor)
        actions: list[tuple[str, Activity]] = [("Run pre-flight", "preflight")]
        if hand.has_camera:
            actions.append(("Take picture", "picture"))
        if hand.arena is not None:
            actions.append(("Put at start", "place"))
        with ui.row().classes("lab-row"):
            for text, what in actions:
                ui.button(text, on_click=lambda what=what: hand.want(what)).props(
                    "outline no-caps"
                ).set_enabled(may)
            ui.button("Disconnect", on_click=hand.ask_to_end).props("flat no-caps").set_enabled(may)
        self._doing = ui.label(_DOING.get(hand.doing, "")).props('role="status"')
        hint("During the pre-flight, the robot turns on the spot.")

    def _show_facts(self, hand: Hand) -> None:
        section("Details")
        facts = dict(hand.about)
        if hand.has_battery:
            facts["battery"] = "unknown" if hand.battery_v is None else f"{hand.battery_v:.2f} V"
        _show_list(facts)
        if hand.refusal:
            ui.label(hand.refusal).classes("lab-problem")
        if hand.preflight is not None:
            section("Pre-flight check")
            for problem in hand.preflight.problems:
                ui.label(problem).classes("lab-problem")
            if not hand.preflight.problems:
                ui.label("Pre-flight check passed.").classes("lab-ok")
            known = hand.about
            _show_list({key: value for key, value in hand.preflight.facts.items() if key not in known})

    def _is_off(self, hand: Hand) -> bool:
        """Return True if the pad is off: the robot is lost, does not answer, or is another visitor's."""
        return hand.is_over or hand.silent_s > 0 or not self._robot.may_operate(self._visitor)

    def _live(self) -> None:
        hand = self._robot.hand
        if hand is None or self._pad is None:
            return
        self._pad.know(hand.n_stops, is_off=self._is_off(hand))
        if hand.senses is None:
            return
        is_old = hand.is_over or hand.silent_s > 0
        self._senses.classes(**{"add" if is_old else "remove": "lab-stale"})
        if hand.n_live != self._n_shown:
            self._n_shown = hand.n_live
            self._show_senses(hand, hand.senses)
        if is_old:
            self._motion.text = f"Last reading {duration(hand.age_s)} ago"

    def _show_senses(self, hand: Hand, senses: Senses) -> None:
        for kind, gauges in self._gauges.items():
            for gauge, value in zip(gauges, senses.readings.get(kind, ()), strict=False):
                gauge.put(value)
        self._motion.text = ("Driving" if senses.moves else "Standing") + (
            ", blocked" if senses.stalled else ""
        )
        self._clock.text = f"Driven for {hand.driven_s:.1f} s"
        if self._grid is not None and senses.pose is not None:
            self._clock.text += f" · {self._grid.follow(senses.pose, hand.line, senses.cells)}"

    def _drive(self, pull: Pull) -> None:
        hand = self._robot.hand
        if hand is not None and self._robot.may_operate(self._visitor):
            hand.drive(pull["move"], pull["turn"], pull["stops"])

    def _release(self) -> None:
        hand = self._robot.hand
        if hand is not None and self._robot.may_operate(self._visitor):
            hand.release()


class _Gauge:
    """A reading with its name, its range, and a bar."""

    def __init__(self, name: str, unit: str, most: float) -> None:
        self._most = most
        with ui.element("div"):
            with ui.row().classes("lab-gauge"):
                ui.label(f"{name} ({unit})")
                self._text = ui.label("").classes("lab-value")
            self._bar = ui.linear_progress(0, show_value=False, size="14px").props(f'aria-label="{name}"')

    def put(self, reading: float) -> None:
        """Show a raw reading."""
        self._bar.value = round(min(max(reading / self._most, 0.0), 1.0), 3)
        self._text.text = f"{reading:,.0f}"


def _show_picture(picture: str) -> None:
    if picture:
        section("Camera")
        ui.element("img").props(
            f'src="data:image/png;base64,{picture}" alt="Picture of the robot\'s camera"'
        ).classes("lab-picture")


def _show_list(facts: dict[str, Any]) -> None:
    """Show names and values as a definition list; empty values are left out."""
    with ui.element("dl").classes("lab-facts"):
        for name, value in facts.items():
            if str(value) not in ("", "None"):
                with ui.element("dt"):
                    ui.label(name.replace("_", " ").capitalize())
                with ui.element("dd"):
                    ui.label(str(value))
