"""Control of the robot on every page: the button that stops it, its operator, and visitors who request control."""

from __future__ import annotations

from typing import NamedTuple

from nicegui import app, events, ui
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

from realitygap.lab._access import VISITOR
from realitygap.lab._control import HANDOVER_S, RobotRequest, Visitor
from realitygap.lab._lab import Lab

from ._notices import notify, try_now
from ._part import Part, watching

UNTOLD_S = 0.5
"""Time between two looks for what nothing reports [s]: a robot that is silent, and the end of the time after a stop."""
_EMULATED = "Emulated robot"
_LOST = "Connection lost. If a robot moves, use its power switch."


def add_stop(lab: Lab) -> None:
    """Add the request that stops the robot without a page's websocket; `frame.js` sends it."""

    @app.post("/stop")
    async def stop(request: Request) -> Response:  # in the event loop: it waits for no thread
        visitor = Visitor(request.cookies.get(VISITOR, ""))
        return PlainTextResponse("stopped" if lab.stop_robots(visitor) else "no robot")


class _State(NamedTuple):
    """Text of the chip, fault of the link ("silent", "lost", or none), and whether the robot was stopped just now."""

    text: str
    fault: str
    is_stopped: bool


class Stop:
    """The robot that is connected, the button that stops it, and the key Escape.

    The browser also shows the button while it has no connection to the lab, because the state is unknown then.

    Args:
        lab: The lab whose robot it stops.
        visitor: The visitor at the page.
    """

    def __init__(self, lab: Lab, visitor: Visitor) -> None:
        self._lab, self._visitor = lab, visitor

    def show(self) -> None:
        """Show it."""
        with (
            ui.element("div")
            .classes("lab-stop-bar")
            .props('role="region" aria-label="Robot in use" aria-live="assertive"') as self._bar
        ):
            self._chip = ui.label("").classes("lab-chip").props('role="status"')
            # One button for the whole life of the page: a press is never lost because the button was drawn again.
            with ui.button("Stop robot", on_click=self._press, color=None) as self._button:
                self._lost = ui.label(_LOST).classes("lab-stop-lost")
            self._button.classes("lab-stop").props('unelevated no-caps aria-keyshortcuts="Escape"')
        ui.keyboard(on_key=self._key, repeating=False, ignore=[])
        part = Part(self._state, self._update)
        part.show()
        watching(self._lab, part.look)
        ui.timer(UNTOLD_S, part.look)

    def _state(self) -> _State:
        robot = self._lab.robot if self._lab.robot.port else self._lab.robot_of(self._visitor)
        if not (port := robot.port):
            lost = robot.lost_port
            text = f"{_name_of(lost)}: link lost. If it moves, switch it off." if lost else ""
            return _State(text, "lost" if lost else "", robot.is_just_stopped)
        other = "" if robot.may_operate(self._visitor) else f"{robot.operator_name} is operating · "
        is_silent = robot.is_silent
        silent = " · no readings" if is_silent else ""
        return _State(other + _name_of(port) + silent, "silent" if is_silent else "", robot.is_just_stopped)

    def _update(self, state: _State) -> None:
        self._bar.classes(**{"add" if state.text else "remove": "lab-connected"})
        for fault in ("silent", "lost"):
            self._bar.classes(**{"add" if state.fault == fault else "remove": f"lab-robot-{fault}"})
        self._chip.text = state.text
        self._lost.text = "Connection lost." if _EMULATED in state.text else _LOST
        self._button.text = "Robot stopped" if state.is_stopped else "Stop robot"

    def _press(self) -> None:
        if not self._lab.stop_robots(self._visitor):
            notify("No robot is connected.")

    def _key(self, event: events.KeyEventArguments) -> None:
        if event.action.keydown and event.key.escape:
            self._lab.stop_robots(self._visitor)


def _name_of(port: str) -> str:
    return _EMULATED if "emulator://" in port else f"Robot on {port}"


def show_holder(lab: Lab, visitor: Visitor) -> None:
    """Show a visitor who watches which visitor operates the robot, and how to request control."""

    def show(request: RobotRequest | None) -> None:
        own = request if request is not None and request.visitor.key == visitor.key else None
        with ui.row().classes("lab-row"):
            ui.label(f"{lab.robot.operator_name} is operating the robot. You are watching.")
            if own is not None and own.state == "asked":
                ui.label(
                    f"You requested control. {lab.robot.operator_name} has {HANDOVER_S:.0f} s to answer."
                ).props('role="status"')
                return
            if own is not None and own.state == "unanswered":
                ui.label(f"{lab.robot.operator_name} did not answer.").props('role="status"')
                ui.button("Take control anyway", on_click=lambda: _confirm(lab, visitor)).props(
                    "outline no-caps"
                )
                return
            if own is not None:
                ui.label(f"{lab.robot.operator_name} keeps the robot.").props('role="status"')
            ui.button("Request control", on_click=lambda: try_now(lambda: lab.robot.ask(visitor))).props(
                "outline no-caps"
            )

    _show_part(lab, Part(lambda: lab.robot.request, show))


def show_request(lab: Lab, visitor: Visitor) -> None:
    """Show the operator, on every page, which visitor requests control."""

    def show(request: RobotRequest | None) -> None:
        if request is None or request.state == "kept" or request.operator.key != visitor.key:
            return
        with ui.row().classes("lab-row lab-question lab-request").props('role="alert"'):
            ui.label(f"{request.visitor.who or 'Another visitor'} requests control of the robot.")
            for text, yes in (("Hand over", True), ("Keep", False)):
                button = ui.button(text, on_click=lambda yes=yes: _answer(lab, visitor, yes=yes))
                button.props("outline no-caps")

    _show_part(lab, Part(lambda: lab.robot.request, show))


def _show_part(lab: Lab, part: Part[RobotRequest | None]) -> None:
    part.show()
    watching(lab, part.look)


def _confirm(lab: Lab, visitor: Visitor) -> None:
    """Show what the robot is doing before the visitor takes control without consent."""
    with ui.dialog(value=True).props('aria-label="Take control"') as dialog, ui.card():
        state = ui.label("").props('role="status"')
        ui.label(f"{lab.robot.operator_name} did not answer, and may have a hand on the robot.")

        def take() -> None:
            if try_now(lambda: lab.robot.take_over(visitor)):
                dialog.close()

        with ui.row().classes("lab-row"):
            button = ui.button("Take control", on_click=take).props("unelevated no-caps")
            ui.button("Cancel", on_click=dialog.close).props("flat no-caps")

        def look() -> None:
            state.text = lab.robot.action or "The robot is standing still."
            button.set_enabled(not lab.robot.action)

        look()
        ui.timer(0.2, look)


def _answer(lab: Lab, operator: Visitor, *, yes: bool) -> None:
    try_now(lambda: lab.robot.answer_request(operator, yes=yes))
