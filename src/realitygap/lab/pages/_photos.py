"""Photographs of sheets: uploaded, read, checked, and saved as scores."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import app, run, ui
from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, PlainTextResponse, Response

from realitygap._wording import counted
from realitygap.errors import RealityGapError
from realitygap.lab._access import FOREIGN_HEADERS, LARGEST_BODY
from realitygap.lab._counts import CountedTrial, Counts
from realitygap.lab._lab import Lab
from realitygap.lab._photos import Photos, SheetPhoto
from realitygap.lab._scoring_files import Draft

from ._elements import PhotoInput
from ._frame import hint
from ._notices import attempt


def add_photos(lab: Lab) -> None:
    """Add the addresses that receive photographs and show them."""

    @app.post("/photos/{name}")
    async def take(name: str, request: Request) -> Response:
        try:
            sheet = int(request.query_params.get("sheet", ""))
            photos = await run.io_bound(lab.photos, name)
            data = await _body(request)
            if photos is not None:
                await run.io_bound(photos.add, data, request.query_params.get("name", ""), sheet)
        except ValueError:
            return PlainTextResponse("Which sheet does the photo show? Expected its number.", 400)
        except RealityGapError as error:
            return PlainTextResponse(str(error), 400)
        return PlainTextResponse("")

    @app.get("/photos/{name}/{mark}.jpg")
    def picture(name: str, mark: str) -> Response:
        try:
            path = lab.photos(name).picture(mark)
        except RealityGapError as error:
            return PlainTextResponse(str(error), 404)
        if path is None or not path.is_file():
            return PlainTextResponse("There is no such picture.", 404)
        headers = {**FOREIGN_HEADERS, "cache-control": "no-cache"}
        return FileResponse(path, media_type="image/jpeg", headers=headers)


async def _body(request: Request) -> bytes:
    """Yield the upload up to the limit; the receiver refuses longer files."""
    parts, size = [], 0
    try:
        async for part in request.stream():
            parts.append(part)
            size += len(part)
            if size > LARGEST_BODY:
                break
    except ClientDisconnect:
        return b""
    return b"".join(parts)


class SheetPhotos:
    """Photographs of the sheets that wait to be counted.

    Args:
        lab: Whose page it is.
        counts: The trials of the study.
        photos: Those of its sheets.
        who: The name of who counts.
        jump: Shows a trial to be counted.
    """

    def __init__(
        self,
        lab: Lab,
        counts: Counts,
        photos: Photos,
        who: Callable[[], str],
        jump: Callable[[int], Any],
    ) -> None:
        self._lab, self._counts, self._photos, self._who, self._jump = lab, counts, photos, who, jump
        self._sheet: int | None = None
        self._drafts: dict[int, Draft] = {}

    def stand(self) -> Any:
        """Return a value that changes with the content of the section."""
        sheets = tuple(self.sheets())
        states = tuple((each.mark, each.state, each.said) for each in self._photos.photos())
        trials = self._counts.trials()
        proposed = tuple(each.mark for trial in trials for each in self._counts.proposals(trial.number))
        return sheets, states, proposed, tuple(each.trial.state for each in trials)

    async def load(self) -> None:
        """Read what was tapped so far of the trials that wait."""
        waiting = [each.number for each in self._counts.trials() if each.trial.state == "driven"]
        who = self._who()

        def read() -> dict[int, Draft]:
            return {number: self._counts.draft(number, who, "score") for number in waiting}

        self._drafts = await run.io_bound(read) or {}

    @property
    def has_photos(self) -> bool:
        """True if a sheet with trials to score has a photo."""
        waiting = {each.trial.sheet for each in self._counts.trials() if each.trial.state == "driven"}
        return any(photo.sheet in waiting for photo in self._photos.photos())

    def sheets(self) -> list[int]:
        """Return the sheets with lines that may be counted, once or twice."""
        found = {
            each.trial.sheet
            for each in self._counts.trials()
            if each.trial.state == "driven" or (each.trial.state == "scored" and not each.trial.is_closed)
        }
        return sorted(found)

    def show(self) -> None:
        """Show the section; show nothing if no sheet has a line."""
        sheets = self.sheets()
        if not sheets:
            return
        if self._sheet not in sheets:
            self._sheet = next((each for each in sheets if self._waiting(each)), sheets[-1])
        if len(sheets) > 1:
            ui.select(sheets, value=self._sheet, label="Sheet", on_change=self._chosen).props(
                "outlined dense"
            ).classes("lab-number")
        hint(
            f"A photo of the whole of sheet {self._sheet} proposes its cells. Check them, correct them, and "
            "save them. Print sheets with realitygap print-sheet."
        )
        PhotoInput(f"/photos/{self._counts.name}?sheet={self._sheet}", f"sheet {self._sheet}")
        last = self._photos.of_sheet(self._sheet)
        for photo in self._photos.photos():
            if photo.sheet == self._sheet and (photo.state != "read" or photo is last):
                self._show_photo(photo)

    # inside

    def _waiting(self, sheet: int) -> list[CountedTrial]:
        return [
            each
            for each in self._counts.trials()
            if each.trial.sheet == sheet and each.trial.state == "driven"
        ]

    def _chosen(self, event: Any) -> None:
        self._sheet = event.value
        self._lab.changed()

    def _show_photo(self, photo: SheetPhoto) -> None:
        with ui.card().classes("lab-card").props(f'data-photo="{photo.state}"'):
            with ui.row().classes("lab-row"):
                ui.label(photo.name).props('role="heading" aria-level="2"')
                ui.label(photo.state).classes("lab-state")
            if photo.state in ("waiting", "reading"):
                ui.linear_progress(show_value=False).props(f'indeterminate aria-label="{photo.said}"')
                ui.label(f"{photo.said}… You can leave this page.").props('role="status"')
            elif photo.state == "refused":
                ui.label(photo.said).classes("lab-problem").props('role="alert"')
                ui.button(
                    "Remove photo", on_click=lambda: attempt(lambda: self._photos.forget(photo.mark))
                ).props("outline no-caps")
            else:
                self._show_read(photo)

    def _show_read(self, photo: SheetPhoto) -> None:
        if photo.said:
            ui.label(photo.said)
        waiting = [each for each in self._waiting(photo.sheet) if self._seen(each, photo)]
        if not waiting:
            ui.label("All trials of this sheet are scored.")
            return
        for each in waiting:
            with ui.row().classes("lab-row"):
                ui.button(
                    f"Check trial {each.number}, {each.pen}",
                    on_click=lambda number=each.number: self._jump(number),
                ).props("outline no-caps")
                ui.label(self._told(each, photo))
        ready = [each for each in waiting if self._draft(each, photo) is not None]
        if len(ready) > 1:
            ui.button(f"Save {counted(len(ready), 'trial')}", on_click=lambda: self._enter(photo)).props(
                "unelevated no-caps"
            )

    def _seen(self, each: CountedTrial, photo: SheetPhoto) -> bool:
        return any(found.mark == photo.mark for found in self._counts.proposals(each.number))

    def _told(self, each: CountedTrial, photo: SheetPhoto) -> str:
        found = next(one for one in self._counts.proposals(each.number) if one.mark == photo.mark)
        doubt = f", {len(found.doubtful)} to check" if found.doubtful else ""
        return f"{counted(len(found.cells), 'cell')}{doubt}. {found.said}"

    def _draft(self, each: CountedTrial, photo: SheetPhoto) -> Draft | None:
        """Return the draft that began with this photo, with its corrections."""
        draft = self._drafts.get(each.number)
        return draft if draft is not None and draft.cells and draft.proposal == photo.mark else None

    async def _enter(self, photo: SheetPhoto) -> None:
        with ui.context.client:  # the button that was pressed may be gone by then
            await self.load()
            found = {each.number: self._draft(each, photo) for each in self._waiting(photo.sheet)}
            drafts = {number: draft for number, draft in found.items() if draft is not None}
            said = f"{counted(len(drafts), 'trial')} saved."
            await attempt(lambda: self._counts.score_all(drafts, self._who()), said, type="positive")
        self._lab.changed()
