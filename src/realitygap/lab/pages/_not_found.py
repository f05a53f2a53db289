"""Addresses without a page, and studies that there are not."""

from __future__ import annotations

from nicegui import Client, app, ui
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

from realitygap.lab._lab import Lab
from realitygap.settings import shown

from ._frame import framed

_STUDY = "/study/"


def add_not_found(lab: Lab) -> None:
    """Answer requests for pages that there are not: in the frame, with status 404."""

    @app.exception_handler(404)
    async def not_found(request: Request, error: Exception) -> Response:
        if "text/html" not in request.headers.get("accept", ""):
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
