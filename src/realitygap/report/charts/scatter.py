"""A scatter with the line of equality: one quantity measured in two ways."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from realitygap.drawing import Ink
from realitygap.report.charts.lines import draw_dots, draw_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Ends = npt.NDArray[np.float64]
"""(n, 2) lower and upper end of an interval of each point."""


def draw_equality(axes: Axes, low: float, high: float, color: str = Ink.RULE) -> None:
    """Give both axes the same limits, and draw the line on which both values are equal."""
    axes.set_xlim(low, high)
    axes.set_ylim(low, high)
    draw_line(axes, [low, high], [low, high], color=color, linewidth=0.8, zorder=1)


def draw_crosses(
    axes: Axes,
    xs: npt.NDArray[np.float64],
    ys: npt.NDArray[np.float64],
    ends: tuple[Ends, Ends],
    color: str,
    marker: str = "o",
) -> None:
    """Draw points (n,) with their intervals across and up."""
    across, up = ends
    for x, y, x_ends, y_ends in zip(xs, ys, across, up, strict=True):
        draw_line(axes, x_ends, [y, y], color=color, linewidth=0.7, alpha=0.6)
        draw_line(axes, [x, x], y_ends, color=color, linewidth=0.7, alpha=0.6)
    draw_dots(axes, xs, ys, 4.2, color=color, marker=marker, markeredgewidth=0, zorder=5)
