"""A map of cells: the more a cell has, the stronger its color."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from realitygap.drawing import Ink

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from realitygap.world import Grid

_FAINTEST = 0.02
"""Shares below are left white."""


def draw_shares(
    axes: Axes, grid: Grid, shares: npt.NDArray[np.float64], color: str = Ink.OURS, rim: float = 0.0
) -> None:
    """Shade each cell by its share.

    Args:
        axes: Axes in the unit of the grid.
        grid: Cells.
        shares: (cells,) share of the full color, -1 to 1; negative ones are orange. NaN for a cell without any.
        color: Color of positive shares.
        rim: Width of the space between cells [points].
    """
    from matplotlib.patches import Rectangle

    for cell in np.flatnonzero(np.abs(shares) >= _FAINTEST):
        row, column = divmod(int(cell), grid.columns)
        axes.add_artist(
            Rectangle(
                (grid.x + column * grid.cell, grid.y + row * grid.cell),
                grid.cell,
                grid.cell,
                facecolor=color if shares[cell] > 0 else Ink.PUBLISHED,
                alpha=round(float(min(abs(shares[cell]), 1.0)), 3),
                linewidth=rim,
                edgecolor=Ink.GROUND,
                zorder=0,
            )
        )
