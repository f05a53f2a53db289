"""A photograph of a sheet is read in its own process, which proposes cells for each trial."""

from __future__ import annotations

import io
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from realitygap._limits import read_file
from realitygap.errors import StudyError
from realitygap.records import LEDGER_NAME, Ledger, ResultsFolder, settings_of_condition, write_whole
from realitygap.runs import Condition
from realitygap.vision import (
    PEN_NAMES,
    SheetLayout,
    SheetScore,
    SheetTrials,
    TraceScore,
    photo_bytes,
    read_photo,
    score_sheet,
    trials_on_sheet,
)

from ._access import LARGEST_BODY
from ._channel import Channel, Message
from ._proposals import Proposal, keep_proposal

JUMP_M = 0.02
"""Points of a trace farther apart belong to two pieces of it."""
QUALITY = 80
"""Quality of the JPEG that the page shows."""

_SPOILED = (
    "This pen also drew trial {}, which is void. Where that line is still on the sheet, both look alike."
)


def work(channel: Channel, order: Message) -> None:
    """Read a photograph, keep what it proposes, and the sheet as it looks from straight above.

    Args:
        channel: To the server.
        order: `folder` of the study, `photo` and `picture`, the files to read and to write, `name` and `sha256` of the
            photograph, and `sheet`, the number of the sheet.
    """
    folder = Path(order["folder"])
    channel.say("stage", text="Looking for the sheet and its pens")
    image = read_photo(photo_bytes(read_file(Path(order["photo"]), LARGEST_BODY, plain=True)))
    with Ledger.open(folder / LEDGER_NAME, writable=False) as ledger:
        on_sheet = trials_on_sheet(ledger, sheet=int(order["sheet"]), role="second")
    layout = _layout(folder, on_sheet.waiting[0].condition)
    found = score_sheet(image, layout, on_sheet.pens)
    _keep_picture(found.picture, Path(order["picture"]), folder)
    _propose(folder, on_sheet, found, order)
    channel.say(
        "read",
        box=list(layout.paper),
        trials=[trial.trial for trial in on_sheet.waiting],
        untried=[trace.name for trace in found.traces if not trace.is_tried],
    )


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
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=QUALITY)
    write_whole(path, file.getvalue(), within=folder)


def _propose(folder: Path, on_sheet: SheetTrials, found: SheetScore, order: Message) -> None:
    traces = {trace.pen: trace for trace in found.traces}
    for trial in on_sheet.waiting:
        trace, spoiled = traces[trial.pen], on_sheet.spoiled.get(trial.pen)
        proposal = Proposal(
            kind="photo",
            mark=str(order["sha256"]),
            source=str(order["name"]),
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
