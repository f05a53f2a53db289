"""The score of a photograph of a sheet: for each pen, the cells that its trace crosses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import VisionError

from ._cells import cell_features, probabilities
from ._find import Sheet, find_sheet, rectify
from ._ink import ink_density
from ._layout import SheetLayout
from ._path import trace_path
from ._pens import separate_pens
from ._photo import is_gray
from ._trace import follow_traces

PX_PER_M = 2000.0
"""Resolution of the rectified sheet: a pen's line is three pixels wide."""

SURE = 0.9
"""Confidence below which a person should check a cell."""


@dataclass(frozen=True)
class TraceScore:
    """The score of a pen's trace.

    Attributes:
        pen: Number of the pen in the layout.
        name: The pen's.
        is_tried: True if its color was seen in its box, and False if it is a guess from its name.
        probability: (c,) probability that the trace crosses each cell of the grid.
        features: (c, f) features of the cells, in the order of `realitygap.vision._cells.FEATURES`.
        path: (k, 2) a line through the trace from the start on, in an order in which it may have been drawn [m].
    """

    pen: int
    name: str
    is_tried: bool
    probability: NDArray[np.float64]
    features: NDArray[np.float64]
    path: NDArray[np.float64]

    @property
    def cells(self) -> tuple[int, ...]:
        """Cells that the trace crosses with a probability of at least 0.5, ascending, columns * row + column."""
        return tuple(np.flatnonzero(self.probability >= 0.5).tolist())

    @property
    def confidence(self) -> NDArray[np.float64]:
        """Confidence of the decision on each cell, 0.5 to 1, (c,)."""
        return np.maximum(self.probability, 1 - self.probability)

    @property
    def doubtful(self) -> tuple[int, ...]:
        """Cells of which it is less than 90 % sure, crossed or not."""
        return tuple(np.flatnonzero(self.confidence < SURE).tolist())


@dataclass(frozen=True)
class SheetScore:
    """A photograph of a sheet, scored.

    Attributes:
        sheet: Sheet on the photograph.
        picture: (h, w, 3) uint8 the sheet from straight above, `PX_PER_M` pixels a meter.
        traces: Score of each pen's trace.
    """

    sheet: Sheet
    picture: NDArray[np.uint8]
    traces: tuple[TraceScore, ...]


def score_sheet(
    image: NDArray[np.uint8], layout: SheetLayout, drawn: Sequence[int] | None = None
) -> SheetScore:
    """Find a sheet on a photograph, tell its pens apart, follow their traces and say which cells they cross.

    Args:
        image: (h, w, 3) RGB.
        layout: Printed layout.
        drawn: Pens of the layout that drew. Default: all.

    Raises:
        VisionError: The sheet is not found, the picture is gray and of several pens, or a pen's color is not known.
    """
    numbers = list(range(len(layout.pens))) if drawn is None else list(drawn)
    sheet = find_sheet(image, layout)
    if len(numbers) > 1 and is_gray(image):
        raise VisionError(
            f"The picture is gray, and its {len(numbers)} pens are identified by color. Take a photo in color."
        )
    picture = rectify(image, sheet, PX_PER_M)
    maps = separate_pens(ink_density(picture, layout, PX_PER_M), layout, PX_PER_M, numbers)
    start = layout.start.x, layout.start.y
    traces = []
    for k, (number, trace) in enumerate(zip(numbers, follow_traces(maps, start), strict=True)):
        features = cell_features(trace, layout.grid)
        traces.append(
            TraceScore(
                number, layout.pens[number], bool(maps.is_tried[k]),
                probabilities(features), features, trace_path(trace, start),
            )
        )  # fmt: skip
    return SheetScore(sheet, picture, tuple(traces))
