"""The stop for the robot, at the foot of every page."""

from __future__ import annotations

from nicegui import app, events, ui
from starlette.responses import PlainTextResponse, Response

from realitygap.lab._lab import Lab

from ._notices import notify

_LOST = "Connection lost. Use the robot's power switch."


def add_stop(lab: Lab) -> None:
    """Add what stops the robot without a page's websocket: `frame.js` asks for it."""

    @app.post("/stop")
    async def stop() -> Response:  # in the event loop: it waits for no thread
        return PlainTextResponse("stopped" if lab.stop_robot() else "no robot")


class Stop:
    """The button, and the key Escape.

    Args:
        lab: Whose robot it stops.
    """

    def __init__(self, lab: Lab) -> None:
        self._lab = lab

    def show(self) -> None:
        """Show it."""
        ui.label(_LOST).classes("lab-stop-lost").props('role="alert"')
        self._button = (
            ui.button("Stop the robot", on_click=self._press, color=None)
            .classes("lab-stop")
            .props('unelevated no-caps aria-keyshortcuts="Escape"')
        )
        ui.keyboard(on_key=self._key, repeating=False, ignore=[])
        self.look()

    def look(self) -> None:
        """Show it in red while there is a robot to stop."""
        self._button.classes(**{"add" if self._lab.has_robot else "remove": "lab-stop-ready"})

    def _press(self) -> None:
        if self._lab.stop_robot():
            notify("The robot was told to stop.", type="warning")
        else:
            notify("No robot is in use here.")

    def _key(self, event: events.KeyEventArguments) -> None:
        if event.action.keydown and event.key.escape and self._lab.stop_robot():
            notify("The robot was told to stop.", type="warning")
