"""Pages for addresses without a page, for unknown studies, and for mistakes in realitygap."""

from __future__ import annotations

from nicegui import Client, app, ui
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

from realitygap.lab._lab import Lab
from realitygap.settings import shown

from ._frame import framed

_STUDY = "/study/"


def add_error_pages(lab: Lab) -> None:
    """Answer requests that have no page or whose page fails: in the frame, with status 404 or 500."""

    @app.exception_handler(404)
    async def not_found(request: Request, error: Exception) -> Response:
        if not _is_page(request):
            return PlainTextResponse("There is nothing at this address.", 404)
        name = error.detail if isinstance(error, HTTPException) else ""
        is_study = request.url.path.startswith(_STUDY) and bool(name)
        with Client(ui.page(""), request=request) as client, framed(lab, "Not found", ""):
            if is_study:
                ui.label(f"There is no study named {shown(name)} in this folder.")
                nearest = lab.studies.nearest(name)
            else:
                ui.label("There is no page here.")
                nearest = []
            for each in nearest:
                ui.link(each, f"{_STUDY}{each}")
            ui.link("All studies", "/")
        return client.build_response(request, 404)

    @app.exception_handler(Exception)
    async def failed(request: Request, error: Exception) -> Response:
        if not _is_page(request):
            return PlainTextResponse("This is a mistake in realitygap.", 500)
        with Client(ui.page(""), request=request) as client, framed(lab, "Error", ""):
            ui.label(f"This page cannot be shown: {shown(error)}.").classes("lab-problem").props(
                'role="alert"'
            )
            ui.label("This is a mistake in realitygap. Nothing that was saved is lost.")
            with ui.row().classes("lab-row"):
                ui.button("Retry", on_click=ui.navigate.reload).props("unelevated no-caps")
                ui.link("All studies", "/")
        return client.build_response(request, 500)


def _is_page(request: Request) -> bool:
    """Return whether a browser asks for a page, and not for a file."""
    return "text/html" in request.headers.get("accept", "")
