"""The frame that all pages share: navigation, control of the robot, and the button that stops it."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Sequence
from typing import Any
from urllib.parse import unquote

from nicegui import ui
from starlette.requests import Request

from realitygap.errors import RealityGapError
from realitygap.lab._access import VISITOR
from realitygap.lab._control import Visitor
from realitygap.lab._lab import Lab
from realitygap.settings import shown

from ._control import Stop, show_request
from ._late_presses import serve_late_presses
from ._notices import show_error

WHO = "realitygap_who"
"""The cookie with the name of the person who counts."""
LONGEST_NAME = 60

_PAGES = {"/": "Studies", "/robot": "Robot", "/calibrate": "Calibrate", "/gap": "Gap"}


@contextlib.contextmanager
def framed(
    lab: Lab, title: str, here: str, *, above: Sequence[tuple[str, str]] = (), is_wide: bool = False
) -> Iterator[None]:
    """Show a page in the frame that all pages share.

    Args:
        lab: The lab.
        title: Title of the page.
        here: Path of the page, as the navigation has it; empty for a page that is not in it.
        above: Name and path of each page above this one, such as the list of studies.
        is_wide: Whether the page is a dashboard, which is wider than a form.
    """
    ui.on_exception(_show_mistake)
    serve_late_presses(ui.context.client)
    ui.page_title(f"{title} – realitygap lab")
    for sheet in ("lab-tokens/tokens.css", "lab-files/lab.css", "lab-player/player.css"):
        ui.add_head_html(f'<link rel="stylesheet" href="/{sheet}">')
    ui.add_head_html('<script>document.documentElement.lang = "en-US"</script>')
    ui.add_head_html('<script src="/lab-files/frame.js"></script>')
    ui.colors(
        primary="var(--accent)",
        negative="var(--danger)",
        positive="var(--ok)",
        secondary="var(--muted)",
        dark_page="var(--ground)",
        dark="var(--card)",
    )
    with ui.header(elevated=False).classes("lab-header"):
        ui.link("realitygap lab", "/").classes("lab-brand")
        with ui.element("nav").props('aria-label="Pages"'):
            pages = _PAGES if lab.classroom is None else {**_PAGES, "/class/board": "Class"}
            for path, name in pages.items():
                link = ui.link(name, path)
                if path == here:
                    link.props('aria-current="page"')
        ui.label("Reconnecting…").classes("lab-link").props('role="status"')
    with ui.column().classes("lab-main lab-dashboard" if is_wide else "lab-main"):
        if above:
            with ui.element("nav").classes("lab-trail").props('aria-label="Path"'):
                for name, path in above:
                    ui.link(name, path)
                    ui.label("›").props('aria-hidden="true"')
                ui.label(title)
        ui.label(title).props('role="heading" aria-level="1"').classes("lab-title")
        asked = ui.element("div").classes("lab-requests")
        yield
    visitor = visitor_of(ui.context.client.request)
    # After the content: once a page has a timer, it is sent as far as it is done.
    with asked:
        show_request(lab, visitor)
    Stop(lab, visitor).show()


def _show_mistake(error: Exception) -> None:
    show_error(
        RealityGapError(
            f"This is a mistake in realitygap, and nothing that was written is lost: {shown(error)}."
        )
    )


def text_of(field: Any) -> str:
    """Return the entered text without space around it; empty for other values."""
    value = field.value
    return value.strip() if isinstance(value, str) else ""


def visitor_of(request: Request) -> Visitor:
    """Return the visitor who sent a request."""
    who = unquote(request.cookies.get(WHO, ""))[:LONGEST_NAME].strip()
    return Visitor(request.cookies.get(VISITOR, ""), who)


def remember_who(name: str) -> None:
    """Store the visitor's name in a cookie."""
    kept = f"{WHO}=' + encodeURIComponent({_js(name)}) + '; path=/; max-age=31536000; SameSite=Lax"
    ui.run_javascript(f"document.cookie = '{kept}'")


def _js(text: str) -> str:
    return json.dumps(text).replace("<", "\\u003c")


def section(text: str) -> ui.label:
    """Show a heading within a page."""
    return ui.label(text).props('role="heading" aria-level="2"').classes("lab-section")


def hint(text: str) -> ui.label:
    """Show a remark below its subject."""
    return ui.label(text).classes("lab-hint")
