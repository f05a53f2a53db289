"""`realitygap print-sheet`: the sheet that traces are scored on."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import realitygap
from realitygap._terminal import echo
from realitygap.errors import RealityGapError

if TYPE_CHECKING:
    from realitygap.vision import SheetLayout
    from realitygap.world import Arena


def print_sheet(
    out: Annotated[Path, typer.Option("-o", "--out", metavar="FILE.pdf", help="PDF to write.")],
    arena: Annotated[str, typer.Option(metavar="NAME", help="Arena by name or file.")] = "paper",
    pens: Annotated[
        str | None,
        typer.Option(
            metavar="LIST", help="Names next to the boxes, such as black,red. [default: the eight of a study]"
        ),
    ] = None,
    study: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of results to take arena and pens from.")
    ] = None,
    paper: Annotated[
        str,
        typer.Option(
            metavar="a4|letter|a3|arena",
            help="Size of the pages to join, or arena for one page as large as the sheet.",
        ),
    ] = "a4",
) -> None:
    """Write the paper sheet of an arena (PDF, true scale).

    The sheet shows the grid, the start, four tags, and a box in which you try each pen.

    Print it at 100 %, cut the pages at their marks, and join them edge to edge. Lay tracing paper over the sheet, or
    draw directly on it. Before you take a photo, draw a line with each pen in its box. This shows its color in the
    light of the photo.

    Example: realitygap print-sheet --paper a3 -o sheet.pdf

    In Python: realitygap.vision.sheet_pdf(layout, "a3")
    """
    layout = sheet_layout(arena, pens, study)
    data = realitygap.vision.sheet_pdf(layout, paper)
    realitygap.records.write_whole(out, data)
    n_pages = len(realitygap.vision.sheet_tiles(layout, paper))
    left, lower, right, upper = layout.paper
    pages = "1 page" if n_pages == 1 else f"{n_pages} pages"
    echo(
        f"Written: {out} ({pages}; the sheet is {1000 * (right - left):.0f} x {1000 * (upper - lower):.0f} mm)"
    )


def sheet_layout(arena: str, pens: str | None, study: Path | None) -> SheetLayout:
    """Return the sheet of an arena, or of a study's.

    Raises:
        RealityGapError: There is no such arena or study, a sheet does not fit, or the pens are no list.
    """
    names = realitygap.vision.PEN_NAMES if pens is None else tuple(pen.strip() for pen in pens.split(","))
    if not all(names) or len(set(names)) < len(names):
        raise RealityGapError(f"--pens is {pens!r}, expected different names such as black,red,blue.")
    if study is None:
        where = realitygap.world.load_arena(arena)
    else:
        where, of_study = study_sheet(study)
        names = of_study if pens is None else names
    try:
        return realitygap.vision.SheetLayout.of(where, names)
    except ValueError as error:
        raise RealityGapError(f"{error}.") from error


def study_sheet(folder: Path, condition: str | None = None) -> tuple[Arena, tuple[str, ...]]:
    """Return the arena and pens of a study: of one condition, or of its first that a robot drives.

    Raises:
        RealityGapError: The folder holds no results.
    """
    description = realitygap.records.ResultsFolder.open(folder).description
    pens = tuple((description.get("trials") or {}).get("pens") or realitygap.vision.PEN_NAMES)
    conditions = [
        realitygap.runs.Condition.from_settings(each["name"], each["settings"])
        for each in description["conditions"]
        if condition in (None, each["name"])
    ]
    chosen = next((each for each in conditions if each.is_physical), conditions[0])
    return chosen.arena.arena(), pens
