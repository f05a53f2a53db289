"""Photographs of a study's sheets: saved next to its ledger, and read one by one.

`Photos` is what pages see; `read` runs in a process of its own.
"""

from __future__ import annotations

import contextlib
import io
import re
import threading
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from realitygap._limits import read_file
from realitygap.errors import StudyError
from realitygap.records import (
    LEDGER_NAME,
    Ledger,
    ResultsFolder,
    refuse_links,
    settings_of_condition,
    write_whole,
)
from realitygap.runs import Condition
from realitygap.vision import (
    PEN_NAMES,
    SheetLayout,
    SheetScore,
    SheetTrials,
    TraceScore,
    photo_bytes,
    photo_hash,
    read_photo,
    score_sheet,
    trials_on_sheet,
)

from ._access import LARGEST_BODY
from ._channel import Channel
from ._child import Child
from ._messages import Ended, Failure, Message, PhotoRead, PhotoStage, PhotoWork
from ._scoring_files import FOLDER, Proposal, keep_proposal, read_json, write_json

MOST_WAITING = 8
"""Photographs that may wait to be read."""
LONGEST_NAME = 80
JUMP_M = 0.02
"""Points of a trace farther apart belong to two pieces of it."""
QUALITY = 80
"""Quality of the JPEG that the page shows."""
_SPOILED = (
    "This pen also drew trial {}, which is void. Where that line is still on the sheet, both look alike."
)
_MARK = re.compile(r"[0-9a-f]{64}")

PhotoState = Literal["waiting", "reading", "read", "refused"]


@dataclass(frozen=True)
class SheetPhoto:
    """A photograph of a sheet.

    Attributes:
        mark: The SHA-256 of its file.
        name: Of the file, as it was sent.
        sheet: Which sheet it shows, as the ledger numbers them.
        time: When it came [s since 1970].
        state: How far it is.
        said: What is done with it, or why it cannot be read.
        box: Left, lower, right, upper end of what `picture` shows [m].
        trials: On the sheet.
    """

    mark: str
    name: str
    sheet: int
    time: float
    state: PhotoState = "waiting"
    said: str = ""
    box: list[float] = field(default_factory=list)
    trials: list[int] = field(default_factory=list)


class Photos:
    """Photographs of a study's sheets; those that wait are read after a restart of the lab.

    Args:
        folder: Of the study.
        root: Where the process that reads them works.
        changed: Called after each change, from another thread.
    """

    def __init__(self, folder: Path, root: Path, changed: Callable[[], None]) -> None:
        self._folder, self._root, self._changed = folder, root, changed
        self._place = folder / FOLDER / "photos"
        self._lock = threading.RLock()
        self._child: Child | None = None
        self._reading = ""
        self._photos = {each.mark: each for each in _kept(self._place)}
        self._go_on()

    def photos(self) -> list[SheetPhoto]:
        """All of them, the last one first; without the lock, which may be held while a disk is at work."""
        return sorted([*self._photos.values()], key=lambda each: each.time, reverse=True)

    def of_sheet(self, sheet: int) -> SheetPhoto | None:
        """Return the last photograph of a sheet that was read; None before the first."""
        return next((each for each in self.photos() if each.sheet == sheet and each.state == "read"), None)

    def photo(self, mark: str) -> SheetPhoto | None:
        """A photograph by its mark."""
        return self._photos.get(mark)

    def picture(self, mark: str) -> Path | None:
        """The picture of a sheet from straight above; None before it is read."""
        known = self._photos.get(mark)
        return self._place / f"{mark}.jpg" if known is not None and known.state == "read" else None

    def add(self, data: bytes, name: str, sheet: int) -> SheetPhoto:
        """Take a photograph, to be read when its turn comes.

        Args:
            data: Its file.
            name: Of the file.
            sheet: Which sheet it shows.

        Raises:
            StudyError: It is empty or too large, or too many wait.
        """
        if not data:
            raise StudyError("The file is empty. Expected a photograph of the sheet.")
        if len(data) > LARGEST_BODY:
            raise StudyError(f"The file is too large. Expected at most {LARGEST_BODY >> 20} MB.")
        mark = photo_hash(data)
        with self._lock:
            known = self._photos.get(mark)
            if known is not None and known.state in ("waiting", "reading") and known.sheet == sheet:
                return known
            if mark == self._reading:
                raise StudyError(f"This photo is being read, for sheet {known.sheet if known else sheet}.")
            if sum(each.state in ("waiting", "reading") for each in self._photos.values()) >= MOST_WAITING:
                raise StudyError(f"{MOST_WAITING} photographs wait to be read. Wait until one is done.")
            photo = SheetPhoto(mark, _plain(name), sheet, time.time(), said="Waits to be read")
            refuse_links(self._folder, self._place)
            self._place.mkdir(parents=True, exist_ok=True)
            write_whole(self._file(mark), data, within=self._folder)
            self._put(photo)
            self._go_on()
        return photo

    def forget(self, mark: str) -> None:
        """Leave out one that could not be read."""
        with self._lock:
            if mark in self._photos and self._photos[mark].state == "refused":
                del self._photos[mark]
        self._changed()

    def end(self) -> None:
        """End the process that reads."""
        with self._lock:
            child, self._child = self._child, None
        if child is not None:
            child.end()

    # inside

    def _file(self, mark: str) -> Path:
        return self._place / f"{mark}.photo"

    def _put(self, photo: SheetPhoto) -> None:
        """Remember it; on disk as what it is after a restart."""
        self._photos[photo.mark] = photo
        place = self._place / f"{photo.mark}.json"
        if photo.state == "refused":
            for path in (place, self._file(photo.mark)):
                with contextlib.suppress(OSError):
                    path.unlink(missing_ok=True)
        else:
            write_json(self._folder, place, asdict(photo))
        self._changed()

    def _go_on(self) -> None:
        """Read the next one."""
        with self._lock:
            waiting = [each for each in reversed(self.photos()) if each.state == "waiting"]
            if self._reading or not waiting:
                return
            photo = waiting[0]
            self._reading = photo.mark
            self._photos[photo.mark] = replace(photo, state="reading", said="Opening it")
            work = PhotoWork(
                folder=str(self._folder),
                photo=str(self._file(photo.mark)),
                picture=str(self._place / f"{photo.mark}.jpg"),
                name=photo.name,
                sha256=photo.mark,
                sheet=photo.sheet,
            )
            self._child = Child(work, self._root, self._hear)

    def _hear(self, message: Message) -> None:
        with self._lock:
            photo = self._photos.get(self._reading)
            if photo is None:
                return
            match message:
                case PhotoStage():
                    self._photos[photo.mark] = replace(photo, said=message.text)
                    self._changed()
                case PhotoRead():
                    self._put(_read(photo, message))
                case Failure():
                    self._put(replace(photo, state="refused", said=message.text))
                case Ended():
                    self._ended(photo)

    def _ended(self, photo: SheetPhoto) -> None:
        self._reading = ""
        if self._child is None:  # the lab is being closed: it is read when the lab is there again
            return
        if photo.state == "reading":
            self._put(replace(photo, state="refused", said="The process that read it ended. Send it again."))
        self._go_on()


def _read(photo: SheetPhoto, message: PhotoRead) -> SheetPhoto:
    untried = ", ".join(message.untried)
    said = (
        f"Not tried in their boxes, so their colors are guessed from their names: {untried}."
        if untried
        else ""
    )
    return replace(photo, state="read", said=said, box=message.box, trials=message.trials)


def _kept(place: Path) -> list[SheetPhoto]:
    """Return the photographs on the disk; those that were being read wait again."""
    found = []
    for path in sorted(place.glob("*.json")):
        values = read_json(path)
        with contextlib.suppress(TypeError, KeyError):
            photo = SheetPhoto(**values)
            if _MARK.fullmatch(photo.mark) and (place / f"{photo.mark}.photo").is_file():
                is_read = photo.state == "read" and (place / f"{photo.mark}.jpg").is_file()
                found.append(photo if is_read else replace(photo, state="waiting", said="Waits to be read"))
    return found


def _plain(name: str) -> str:
    """A file's name without a folder or anything that cannot be printed."""
    last = re.split(r"[/\\]", name)[-1]
    return "".join(letter for letter in last if letter.isprintable())[-LONGEST_NAME:].strip() or "photo"


# in a process


def read(channel: Channel, work: PhotoWork) -> None:
    """Read a photograph, keep what it proposes, and the sheet as it looks from straight above."""
    folder = Path(work.folder)
    channel.say(PhotoStage("Looking for the sheet and its pens"))
    image = read_photo(photo_bytes(read_file(Path(work.photo), LARGEST_BODY, plain=True)))
    with Ledger.open(folder / LEDGER_NAME, writable=False) as ledger:
        on_sheet = trials_on_sheet(ledger, sheet=work.sheet, role="second")
    layout = _layout(folder, on_sheet.waiting[0].condition)
    found = score_sheet(image, layout, on_sheet.pens)
    _keep_picture(found.picture, Path(work.picture), folder)
    _propose(folder, on_sheet, found, work)
    trials = [trial.trial for trial in on_sheet.waiting]
    untried = [trace.name for trace in found.traces if not trace.is_tried]
    channel.say(PhotoRead(list(layout.paper), trials, untried))


def _layout(folder: Path, name: str) -> SheetLayout:
    """Return the layout of a condition's sheet."""
    description = ResultsFolder.open(folder).description
    settings = settings_of_condition(description, name)
    pens = tuple((description.get("trials") or {}).get("pens") or PEN_NAMES)
    try:
        return SheetLayout.of(Condition.from_settings(name, settings).arena.arena(), pens)
    except ValueError as error:
        raise StudyError(f"There is no sheet to print for this study: {error}.") from error


def _keep_picture(picture: NDArray[np.uint8], path: Path, folder: Path) -> None:
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=QUALITY)
    write_whole(path, file.getvalue(), within=folder)


def _propose(folder: Path, on_sheet: SheetTrials, found: SheetScore, work: PhotoWork) -> None:
    traces = {trace.pen: trace for trace in found.traces}
    for trial in on_sheet.waiting:
        trace, spoiled = traces[trial.pen], on_sheet.spoiled.get(trial.pen)
        proposal = Proposal(
            kind="photo",
            mark=work.sha256,
            source=work.name,
            time=time.time(),
            cells=list(trace.cells),
            sure=np.round(trace.confidence, 4).tolist(),
            doubtful=list(trace.doubtful),
            lines=pieces(trace),
            said="" if spoiled is None else _SPOILED.format(spoiled.trial),
            is_spoiled=spoiled is not None,
        )
        keep_proposal(folder, trial.trial, proposal)


def pieces(trace: TraceScore) -> list[list[list[float]]]:
    """The line through a trace where it is seen, (x, y) [m]."""
    path = np.round(trace.path, 4)
    if len(path) < 2:
        return []
    cuts = np.flatnonzero(np.hypot(*np.diff(path, axis=0).T) > JUMP_M) + 1
    return [part.tolist() for part in np.split(path, cuts) if len(part) > 1]
