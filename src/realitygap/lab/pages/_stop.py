"""Stop robot: the button that every page shows while a robot is connected."""

from __future__ import annotations

from typing import NamedTuple

from nicegui import app, events, ui
from starlette.responses import PlainTextResponse, Response

from realitygap.lab._lab import Lab, Visitor

from ._notices import notify
from ._part import Part, watching

UNTOLD_S = 0.5
"""Time between two looks for what nothing reports [s]: a robot that is silent, and the end of the time after a stop."""
_LOST = "Connection lost. Use the robot's power switch."


def add_stop(lab: Lab) -> None:
    """Add the request that stops the robot without a page's websocket; `frame.js` sends it."""

    @app.post("/stop")
    async def stop() -> Response:  # in the event loop: it waits for no thread
        return PlainTextResponse("stopped" if lab.stop_robot() else "no robot")


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
                ui.label(_LOST).classes("lab-stop-lost")
            self._button.classes("lab-stop").props('unelevated no-caps aria-keyshortcuts="Escape"')
        ui.keyboard(on_key=self._key, repeating=False, ignore=[])
        part = Part(self._state, self._update)
        part.show()
        watching(self._lab, part.look)
        ui.timer(UNTOLD_S, part.look)

    def _state(self) -> _State:
        lab = self._lab
        if not (port := lab.robot_port):
            lost = lab.lost_port
            text = f"{_name_of(lost)}: link lost. If it moves, switch it off." if lost else ""
            return _State(text, "lost" if lost else "", lab.is_just_stopped)
        other = "" if lab.may_operate(self._visitor) else f"{lab.operator_name} is operating · "
        is_silent = lab.is_robot_silent
        silent = " · no readings" if is_silent else ""
        return _State(other + _name_of(port) + silent, "silent" if is_silent else "", lab.is_just_stopped)

    def _update(self, state: _State) -> None:
        self._bar.classes(**{"add" if state.text else "remove": "lab-connected"})
        for fault in ("silent", "lost"):
            self._bar.classes(**{"add" if state.fault == fault else "remove": f"lab-robot-{fault}"})
        self._chip.text = state.text
        self._button.text = "Robot stopped" if state.is_stopped else "Stop robot"

    def _press(self) -> None:
        if not self._lab.stop_robot():
            notify("No robot is connected.")

    def _key(self, event: events.KeyEventArguments) -> None:
        if event.action.keydown and event.key.escape:
            self._lab.stop_robot()


def _name_of(port: str) -> str:
    return "Emulated robot" if "emulator://" in port else f"Robot on {port}"
