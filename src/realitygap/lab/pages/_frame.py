"""What all pages have: the way to the others, and a stop for the robot."""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Iterator
from typing import Any
from urllib.parse import unquote

from nicegui import ui
from starlette.requests import Request

from realitygap.lab._access import VISITOR
from realitygap.lab._lab import Lab, Visitor
from realitygap.settings import shown

from ._handover import show_request
from ._notices import notify
from ._part import watching
from ._stop import Stop

WHO = "realitygap_who"
"""The cookie with the name of who counts."""
LONGEST_NAME = 60

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
    ui.add_head_html('<script src="/lab-files/frame.js"></script>')
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
        asked = ui.element("div")
        yield
    # After the content: once a page has a timer, it is sent as far as it is done.
    with asked:
        show_request(lab, visitor_of(ui.context.client.request))
    with ui.footer(elevated=False).classes("lab-footer"):
        stop = Stop(lab)
        stop.show()
        watching(lab, stop.look)


def _said_wrong(error: Exception) -> None:
    notify(
        f"This is a mistake in realitygap, and nothing that was written is lost: {shown(error)}.",
        type="negative",
    )


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
