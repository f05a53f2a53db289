"""Presses of controls that were drawn again before the press arrived."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any, NamedTuple

from nicegui import Client
from nicegui.element import Element

LATE_S = 15.0
"""Time for which a removed control still serves a press [s]; `frame.js` keeps it on the page for up to 10 s."""
TWICE_S = 2.0
"""Time after a press during which a removed control doesn't serve the same press again [s]."""


class _Removed(NamedTuple):
    element: Element
    listeners: dict[str, Any]
    at_s: float


def serve_late_presses(client: Client) -> None:
    """Serve the presses that a browser sends before it learns that the server has drawn the control again.

    NiceGUI drops events of removed elements, so such a press would be lost. The visitor pressed what the page showed,
    and the action is checked as it is for two visitors who press the same button. The second press of a double-click
    stays dropped: it must not act on what the first one has changed.

    While a control is pressed, `frame.js` keeps it on the page.

    Args:
        client: The page.
    """
    handle, remove = client.handle_event, client.remove_elements
    removed: dict[int, _Removed] = {}
    served: dict[str, float] = {}

    def remove_elements(elements: Iterable[Element]) -> None:
        gone, now = list(elements), time.monotonic()
        for key in [key for key, each in removed.items() if now - each.at_s > LATE_S]:
            del removed[key]
        for listener in [listener for listener, at_s in served.items() if now - at_s > TWICE_S]:
            del served[listener]
        for element in gone:  # with its listeners, which NiceGUI clears
            if element._event_listeners:
                removed[element.id] = _Removed(element, dict(element._event_listeners), now)
        remove(gone)

    def handle_event(message: dict[str, Any]) -> None:
        key, listener, now = message["id"], str(message.get("listener_id")), time.monotonic()
        is_again = now - served.get(listener, -TWICE_S) < TWICE_S
        served[listener] = now
        if key in client.elements:
            handle(message)
            return
        late = removed.get(key)
        if late is None or listener not in late.listeners or is_again or now - late.at_s > LATE_S:
            return
        late.element._event_listeners.update(late.listeners)
        late.element.parent_slot = client.content.default_slot  # what the action shows must be on the page
        client.elements[key] = late.element
        try:
            handle(message)
        finally:
            del client.elements[key]

    def forget() -> None:
        for name in ("handle_event", "remove_elements"):
            vars(client).pop(name, None)

    vars(client).update(handle_event=handle_event, remove_elements=remove_elements)
    client.on_delete(forget)
