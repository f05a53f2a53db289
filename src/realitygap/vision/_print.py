"""A sheet as PDF at true scale: on one page, or tiled over pages to be cut and joined."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from realitygap.errors import VisionError, did_you_mean
from realitygap.world import INCH

from ._layout import Label, Mark, SheetLayout
from ._tags import Box

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAPERS = {"a4": (0.297, 0.210), "letter": (11 * INCH, 8.5 * INCH), "a3": (0.420, 0.297)}
"""Width and height of pages that lie across [m]."""

ONE_PAGE = "arena"
UNPRINTABLE = 0.010  # of a page's edge [m]
BLEED = 0.004  # beyond the line where a page is cut [m]
CROP = 0.005  # length of the marks that say where [m]
POINTS = 72 / INCH  # of type, a meter
CAPITAL = 0.72  # height of a capital in sizes of type


@dataclass(frozen=True)
class Tile:
    """A page of a tiled sheet: its part of the sheet, and its place among the others, from the lower left."""

    box: Box
    row: int
    column: int


def sheet_tiles(layout: SheetLayout, paper: str) -> list[Tile]:
    """Return the pages that make up a sheet, the upper left one first.

    Raises:
        VisionError: There is no such paper.
    """
    left, lower, right, upper = layout.paper
    if paper == ONE_PAGE:
        return [Tile(layout.paper, 0, 0)]
    if paper not in PAPERS:
        raise VisionError(f"Unknown paper {paper!r}. {did_you_mean(paper, [*PAPERS, ONE_PAGE])}")
    ways = [
        (math.ceil((right - left) / _usable(width)), math.ceil((upper - lower) / _usable(height)))
        for width, height in (PAPERS[paper], PAPERS[paper][::-1])
    ]
    n_columns, n_rows = min(ways, key=math.prod)
    across, up = (right - left) / n_columns, (upper - lower) / n_rows
    return [
        Tile(
            (left + k * across, lower + j * up, left + (k + 1) * across, lower + (j + 1) * up),
            row=j,
            column=k,
        )
        for j in reversed(range(n_rows))
        for k in range(n_columns)
    ]


def _usable(side: float) -> float:
    return side - 2 * (UNPRINTABLE + BLEED)


def sheet_pdf(layout: SheetLayout, paper: str = "a4") -> bytes:
    """Return the PDF of a sheet, to be printed at 100 %.

    Args:
        layout: Layout to print.
        paper: `a4`, `letter`, `a3`, or `arena` for one page as large as the sheet.

    Raises:
        VisionError: There is no such paper.
        MissingExtraError: OpenCV, which knows the tags, is not installed.
    """
    from matplotlib.backends.backend_pdf import PdfPages

    tiles = sheet_tiles(layout, paper)
    marks = [*layout.outer_marks(), *layout.thin_marks()]
    file = io.BytesIO()
    with PdfPages(file, metadata={"CreationDate": None, "Title": "Sheet for pen traces"}) as pages:
        for tile in tiles:
            pages.savefig(_page(layout, marks, tile, paper, tiles))
    return file.getvalue()


def blank_page(width: float, height: float, left: float = 0.0, lower: float = 0.0) -> tuple[Figure, Axes]:
    """Return a page of this size whose units are meters, from its lower left corner."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width / INCH, height / INCH))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(left, left + width)
    axes.set_ylim(lower, lower + height)
    axes.axis("off")
    return figure, axes


def _page(layout: SheetLayout, marks: list[Mark], tile: Tile, paper: str, tiles: list[Tile]) -> Figure:
    left, lower, right, upper = tile.box
    if paper == ONE_PAGE:
        width, height = right - left, upper - lower
        x, y = left, lower
    else:
        width, height = PAPERS[paper]
        if right - left > _usable(width) or upper - lower > _usable(height):
            width, height = height, width  # the page stands upright
        x, y = (left + right - width) / 2, (lower + upper - height) / 2
    figure, axes = blank_page(width, height, x, y)
    bleed = 0.0 if paper == ONE_PAGE else BLEED
    _draw(axes, marks, layout.labels(), (left - bleed, lower - bleed, right + bleed, upper + bleed))
    if paper != ONE_PAGE:
        _draw(axes, list(_crop_marks(tile.box)), [], None)
        _say_which(axes, tile, tiles, x + UNPRINTABLE, y + UNPRINTABLE)
    return figure


def _draw(axes: Axes, marks: list[Mark], labels: list[Label], box: Box | None) -> None:
    """Draw marks and labels, as far as they lie in a box."""
    from matplotlib.collections import LineCollection, PatchCollection
    from matplotlib.patches import Rectangle

    lines = [mark for mark in marks if mark.width]
    filled = [mark for mark in marks if not mark.width]
    strokes = LineCollection(
        [[(mark.x1, mark.y1), (mark.x2, mark.y2)] for mark in lines],
        colors=[str(mark.gray) for mark in lines],
        linewidths=[mark.width * POINTS for mark in lines],
        capstyle="butt",
    )
    squares = PatchCollection(
        [Rectangle((mark.x1, mark.y1), mark.x2 - mark.x1, mark.y2 - mark.y1) for mark in filled],
        facecolors=[str(mark.gray) for mark in filled],
        linewidths=0,
    )
    parts: list[Artist] = [axes.add_collection(strokes), axes.add_collection(squares)]
    for label in labels:
        parts.append(
            axes.text(
                label.x, label.y, label.text, fontsize=label.size / CAPITAL * POINTS, color=str(label.gray),
                parse_math=False,
            )
        )  # fmt: skip
    if box is not None:
        for part in parts:
            part.set_clip_path(
                Rectangle((box[0], box[1]), box[2] - box[0], box[3] - box[1], transform=axes.transData)
            )


def _crop_marks(box: Box) -> Iterator[Mark]:
    """Yield the marks for cutting a page: short lines outside its corners."""
    left, lower, right, upper = box
    for x, out_x in ((left, -1), (right, 1)):
        for y, out_y in ((lower, -1), (upper, 1)):
            yield Mark(x, y + out_y * BLEED, x, y + out_y * (BLEED + CROP), 0.0, 0.0003)
            yield Mark(x + out_x * BLEED, y, x + out_x * (BLEED + CROP), y, 0.0, 0.0003)


def _say_which(axes: Axes, tile: Tile, tiles: list[Tile], x: float, y: float) -> None:
    n_rows, n_columns = 1 + max(other.row for other in tiles), 1 + max(other.column for other in tiles)
    text = (
        f"row {n_rows - tile.row} of {n_rows} from the top, column {tile.column + 1} of {n_columns}; print at 100 %, "
        "cut at the marks, join edge to edge"
    )
    axes.text(x + 0.012, y + 0.001, text, fontsize=0.002 / CAPITAL * POINTS, color="0.4")
