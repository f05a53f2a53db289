"""A figure as panels in rows: the panels have their sizes, and the texts around them get the room that they need."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

IS_WIDE = 6.0
"""Width of a figure [in] from which on panels are side by side."""

_ROOM = 1.2
"""Height for the texts of a row in the first layout [in]; at the end they have what they need."""


class Sheet:
    """Panels in rows and columns, by matplotlib's constrained layout.

    Constrained layout fits panels into a figure of a given height. Here the height of the figure follows from those of
    the panels: `settle` lays out once, and then moves the rows.

    Attributes:
        figure: The figure. Call everything under `house_style`.
        panels: Axes by the name of their place.
        is_wide: True on a desktop's page, False on a phone's.
    """

    def __init__(
        self,
        width: float,
        places: Sequence[Sequence[str]],
        heights: Sequence[float | None],
        *,
        widths: Sequence[float] | None = None,
        gap: float = 0.12,
        pad: float = 0.08,
    ) -> None:
        """Make empty panels.

        Args:
            width: Width of the figure [in].
            places: (rows, columns) name of the panel at each place; one name several times is one large panel, "."
                leaves a place empty.
            heights: Height of the panels of each row [in]. None for one whose first panel has a unit as long up as
                across.
            widths: Relative widths of the columns. Default: equal.
            gap, pad: Space between columns and between rows, half of it at the edges [in].
        """
        from matplotlib.figure import Figure
        from matplotlib.layout_engine import ConstrainedLayoutEngine

        self.is_wide = width >= IS_WIDE
        self._heights = tuple(heights)
        self._engine = ConstrainedLayoutEngine(w_pad=gap / 2, h_pad=pad / 2, wspace=0.0, hspace=0.0)
        size = (width, _ROOM + sum(_ROOM + (each or width / len(places[0])) for each in heights))
        self.figure = Figure(figsize=size, layout=self._engine)
        self.panels: dict[str, Axes] = self.figure.subplot_mosaic(
            [list(row) for row in places], width_ratios=widths
        )
        self._is_settled = False

    def key(
        self, handles: Sequence[Artist], *, place: Literal["lower left", "upper right"] = "lower left"
    ) -> None:
        """A legend above or below all panels, in as few lines as its width allows."""
        n = len(handles)
        for n_columns in dict.fromkeys([n, *(-(-n // lines) for lines in range(2, n + 1))]):
            legend = self.figure.legend(
                handles=handles,
                loc="outside lower left" if place == "lower left" else "outside upper right",
                ncols=n_columns,
                frameon=False,
                fontsize=8.0 if self.is_wide else 7.5,
                handlelength=1.6,
                columnspacing=1.4,
                borderpad=0.2,
            )
            if n_columns == 1 or legend.get_window_extent().width <= self.figure.bbox.width:
                return
            legend.remove()

    def settle(self) -> None:
        """Give panels and texts their places. Content that panels get later does not move them."""
        if self._is_settled:
            return
        self._is_settled = True
        self._engine.execute(self.figure)
        self.figure.set_layout_engine(None)  # saving a figure that has one, "none" included, draws it twice
        width, height = self.figure.get_size_inches()
        boxes = {axes: axes.get_position() for axes in self.panels.values()}
        rows = {axes: _rows_of(axes) for axes in boxes}
        tops = {first: (1 - boxes[axes].y1) * height for axes, (first, _) in rows.items()}
        bottoms = {last: (1 - boxes[axes].y0) * height for axes, (_, last) in rows.items()}
        growths = [0.0] * len(self._heights)
        for row, wanted in enumerate(self._heights):
            if wanted is not None:
                growths[row] = wanted - (bottoms[row] - tops[row])
        for axes, (first, last) in reversed(rows.items()):
            if self._heights[first] is None:
                box = boxes[axes]
                growth = box.width * width * axes.get_data_ratio() - box.height * height
                growths[first : last + 1] = [growth / (last + 1 - first)] * (last + 1 - first)
        moves = [0.0, *accumulate(growths)]
        total = height + moves[-1]
        self.figure.set_size_inches(width, total)
        for axes, (first, last) in rows.items():
            box = boxes[axes]
            top, bottom = (1 - box.y1) * height + moves[first], (1 - box.y0) * height + moves[last + 1]
            axes.set_position((box.x0, 1 - bottom / total, box.width, (bottom - top) / total))
            if not axes.axison:  # a picture, which keeps its proportions in a wider place
                axes.set_aspect("equal", adjustable="box")


def grid(
    width: float, n: int, columns: int, height: float | None, *, gap: float = 0.12, pad: float = 0.08
) -> tuple[Sheet, list[Axes]]:
    """Panels of one height, row by row from the upper left; arguments as those of `Sheet`."""
    columns = min(n, columns)
    names = [str(k) if k < n else "." for k in range(-(-n // columns) * columns)]
    places = [names[k : k + columns] for k in range(0, len(names), columns)]
    sheet = Sheet(width, places, [height] * len(places), gap=gap, pad=pad)
    return sheet, [sheet.panels[str(k)] for k in range(n)]


def _rows_of(axes: Axes) -> tuple[int, int]:
    """The first and the last row of a panel."""
    spec = axes.get_subplotspec()
    rows = range(1) if spec is None else spec.rowspan
    return rows.start, rows.stop - 1
