"""A scored sheet as a picture, for a check by eye."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

from ._score import SheetScore, TraceScore

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CROSSED = "#0a4f8f"
DOUBTFUL = "#c94f00"
WIDTH_IN = 7.0  # of a panel


def overlay_png(score: SheetScore, titles: dict[int, str] | None = None) -> bytes:
    """Return a PNG picture: the sheet from straight above, and a panel for each pen with its trace and cells.

    Cells that a trace crosses are shaded; those less than 90 % sure, crossed or not, have a thick border and their
    probability.

    Args:
        score: Score of the sheet.
        titles: Title of the trace of each pen, by its number. Default: its name.
    """
    from matplotlib.figure import Figure

    traces = score.traces
    layout = score.sheet.layout
    left, lower, right, upper = layout.paper
    n_rows = (len(traces) + 2) // 2
    aspect = (upper - lower) / (right - left)
    figure = Figure(
        figsize=(2 * WIDTH_IN, n_rows * (WIDTH_IN * aspect + 0.35)), dpi=100, layout="constrained"
    )
    grid = figure.subplots(n_rows, 2, squeeze=False).ravel()
    for axes in grid:
        axes.axis("off")
        axes.set_xlim(left, right)
        axes.set_ylim(lower, upper)
        axes.set_aspect("equal")
    _show_sheet(grid[0], score, faded=False)
    grid[0].set_title("the sheet, from straight above", loc="left", fontsize=10)
    for axes, trace in zip(grid[1:], traces, strict=False):
        _show_sheet(axes, score, faded=True)
        _show_trace(axes, score, trace)
        name = (titles or {}).get(trace.pen, trace.name)
        doubt = f", {len(trace.doubtful)} to look at" if trace.doubtful else ""
        axes.set_title(f"{name}: {len(trace.cells)} cells{doubt}", loc="left", fontsize=10)
    file = io.BytesIO()
    figure.savefig(file, format="png", metadata={"Software": None})
    return file.getvalue()


def _show_sheet(axes: Axes, score: SheetScore, *, faded: bool) -> None:
    left, lower, right, upper = score.sheet.layout.paper
    picture = score.picture[::2, ::2]
    if faded:
        picture = (255 - (255 - picture.astype(np.int32)) // 2).astype(np.uint8)
    axes.imshow(picture, extent=(left, right, lower, upper), interpolation="antialiased", aspect="equal")


def _show_trace(axes: Axes, score: SheetScore, trace: TraceScore) -> None:
    from matplotlib.patches import Rectangle

    grid = score.sheet.layout.grid
    crossed, doubtful = set(trace.cells), set(trace.doubtful)
    for cell in sorted(crossed | doubtful):
        corner = grid.corners(cell)[0]
        if cell in crossed:
            axes.add_patch(
                Rectangle(corner, grid.cell, grid.cell, facecolor=CROSSED, alpha=0.25, linewidth=0)
            )
        if cell in doubtful:
            axes.add_patch(
                Rectangle(corner, grid.cell, grid.cell, fill=False, edgecolor=DOUBTFUL, linewidth=2)
            )
            axes.text(
                corner[0] + 0.05 * grid.cell, corner[1] + 0.08 * grid.cell, f"{trace.probability[cell]:.2f}",
                fontsize=7, color=DOUBTFUL,
            )  # fmt: skip
    if len(trace.path):
        jumps = np.hypot(*np.diff(trace.path, axis=0).T) > 0.02
        shown = np.insert(trace.path, np.flatnonzero(jumps) + 1, np.nan, axis=0)
        axes.plot(shown[:, 0], shown[:, 1], color=CROSSED, linewidth=0.8)
