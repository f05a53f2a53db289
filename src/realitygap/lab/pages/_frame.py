"""What all pages have: the way to the others, and a stop for the robot."""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import unquote

from nicegui import events, ui
from starlette.requests import Request

from realitygap.errors import RealityGapError
from realitygap.lab._access import VISITOR
from realitygap.lab._lab import Lab, Visitor
from realitygap.settings import shown

WHO = "realitygap_who"
"""The cookie with the name of who counts."""
LONGEST_NAME = 60
LOOK_S = 0.25
"""How often a page looks whether something has changed [s]."""

_PAGES = {"/": "Studies", "/new": "New study", "/robot": "Robot", "/calibrate": "Calibrate", "/gap": "Gap"}


@contextlib.contextmanager
def framed(lab: Lab, title: str, here: str) -> Iterator[None]:
    """A page within its frame.

    Args:
        lab: Whose.
        title: Of the page.
        here: Its path, as the way to the others has it.
    """
    ui.on_exception(_said_wrong)
    ui.page_title(f"{title} – realitygap lab")
    for sheet in ("lab-files/lab.css", "lab-player/player.css"):
        ui.add_head_html(f'<link rel="stylesheet" href="/{sheet}">')
    ui.add_head_html('<script>document.documentElement.lang = "en-US"</script>')
    ui.colors(
        primary="#1f5c99", negative="#b3161b", positive="#1e6b34", secondary="#4a5560", accent="#6a3d9a"
    )
    with ui.header(elevated=False).classes("lab-header"), ui.element("nav").props('aria-label="Pages"'):
        for path, name in _PAGES.items():
            link = ui.link(name, path)
            if path == here:
                link.props('aria-current="page"')
    with ui.column().classes("lab-main"):
        ui.label(title).props('role="heading" aria-level="1"').classes("lab-title")
        yield
    with ui.footer(elevated=False).classes("lab-footer"):
        button = (
            ui.button("Stop the robot", on_click=lambda: _stop(lab), color=None)
            .classes("lab-stop")
            .props('unelevated no-caps aria-keyshortcuts="Escape"')
        )
        _as_needed(lab, button)
        watching(lab, lambda: _as_needed(lab, button))
    ui.keyboard(on_key=lambda event: _pressed(lab, event), repeating=False)


def _as_needed(lab: Lab, button: ui.button) -> None:
    """Red while there is a robot to stop."""
    button.classes(add="lab-stop-ready") if lab.has_robot else button.classes(remove="lab-stop-ready")


def _stop(lab: Lab) -> None:
    if lab.stop_robot():
        ui.notify("The robot was told to stop.", type="warning")
    else:
        ui.notify("No robot is in use here.")


def _pressed(lab: Lab, event: events.KeyEventArguments) -> None:
    if event.action.keydown and event.key.escape and lab.stop_robot():
        ui.notify("The robot was told to stop.", type="warning")


def _said_wrong(error: Exception) -> None:
    ui.notify(
        f"This is a mistake in realitygap, and nothing that was written is lost: {shown(error)}.",
        type="negative",
    )


def watching(lab: Lab, show: Callable[[], Any]) -> None:
    """Show something anew whenever the lab has changed."""
    seen = lab.version

    def look() -> None:
        nonlocal seen
        if lab.version != seen:
            seen = lab.version
            show()

    ui.timer(LOOK_S, look)


def text_of(field: Any) -> str:
    """What was entered, without space around it; empty where it is no text."""
    value = field.value
    return value.strip() if isinstance(value, str) else ""


def number_of(field: Any) -> float | None:
    """What was entered; None where nothing was.

    Raises:
        ValueError: It is no number.
    """
    value = field.value
    if value is None or value == "":
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{field.label}: expected a number, came {shown(value)}.")
    return value


def whole_of(field: Any) -> int | None:
    """What was entered; None where nothing was.

    Raises:
        ValueError: It is no whole number.
    """
    value = number_of(field)
    if value is not None and value != int(value):
        raise ValueError(f"{field.label}: expected a whole number, came {shown(value)}.")
    return None if value is None else int(value)


def told(act: Callable[[], Any]) -> bool:
    """Do something; what is wrong with it is shown. Whether it was done."""
    try:
        act()
    except (RealityGapError, ValueError, TypeError, OSError) as error:
        ui.notify(str(error), type="negative", multi_line=True, timeout=8000, close_button="Close")
        return False
    return True


def visitor_of(request: Request) -> Visitor:
    """Who sits at the page."""
    who = unquote(request.cookies.get(WHO, ""))[:LONGEST_NAME].strip()
    return Visitor(request.cookies.get(VISITOR, ""), who)


def remember_who(name: str) -> None:
    """Have the browser keep the name."""
    kept = f"{WHO}=' + encodeURIComponent({_js(name)}) + '; path=/; max-age=31536000; SameSite=Lax"
    ui.run_javascript(f"document.cookie = '{kept}'")


def _js(text: str) -> str:
    return json.dumps(text).replace("<", "\\u003c")


def section(text: str) -> ui.label:
    """A heading within a page."""
    return ui.label(text).props('role="heading" aria-level="2"').classes("lab-section")


def hint(text: str) -> ui.label:
    """A remark below what it is about."""
    return ui.label(text).classes("lab-hint")
