"""Dots with intervals: a row for each name, with single values, an estimate, and its interval."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from realitygap.drawing import Ink
from realitygap.report.charts.lines import draw_dots, draw_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_BINS = 120  # places along the axis within which dots are stacked
_STEP = 0.13  # between dots of a stack [rows]
_REACH = 0.36  # of a stack, above and below the middle of its row [rows]


@dataclass(frozen=True)
class Row:
    """Values of one name.

    Attributes:
        estimate: Mean or median; None for none.
        interval: Ends of its interval; None for none.
        values: (n,) single values, drawn as dots.
        offsets: (n,) distance of each dot from the middle of the row [rows], as of `stacked`.
        color: Color of the estimate and, unless it is a band, of the interval.
        dots: Color of the dots.
        band: True to draw the interval as a broad pale bar behind the estimate.
        scale: Scale of marks.
    """

    estimate: float | None
    interval: tuple[float, float] | None
    values: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    offsets: npt.NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    color: str = Ink.OURS
    dots: str = Ink.RUN
    band: bool = False
    scale: float = 1.0


def name_rows(axes: Axes, names: Sequence[str], *, grid: bool = True) -> None:
    """Make one row of each name, from the top; the limits of x are the caller's."""
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_yticks(range(len(names)), names)
    axes.tick_params(axis="y", length=0, pad=4)
    if grid:
        axes.spines["left"].set_visible(False)
        axes.grid(axis="x", color=Ink.RULE, linewidth=0.5)


def draw_row(axes: Axes, place: float, row: Row) -> None:
    """Draw the marks of one row, whose middle is at a place on the vertical axis."""
    # a piece of no length with a round end is a dot, in a fifth of the bytes of a marker
    if len(row.values):
        xs, ys = (
            np.column_stack([at, at, np.full(len(at), np.nan)]).ravel()
            for at in (row.values, place + row.offsets)
        )
        draw_line(
            axes,
            xs,
            ys,
            color=row.dots,
            alpha=0.55,
            linewidth=1.6 + row.scale,
            solid_capstyle="round",
            zorder=2,
        )
    if row.interval is not None:
        color, width, alpha = (Ink.BAND, 5.0, 0.85) if row.band else (row.color, 2.2, 1.0)
        draw_line(
            axes, row.interval, [place] * 2, color=color, linewidth=width * row.scale, alpha=alpha,
            solid_capstyle="butt", zorder=3,
        )  # fmt: skip
    if row.estimate is not None:
        draw_dots(axes, row.estimate, place, 2 + 3 * row.scale, color=row.color, zorder=5)


def stacked(values: npt.NDArray[np.float64], length: float) -> npt.NDArray[np.float64]:
    """Return (n,) how far each dot is from the middle of its row [rows], so that near values are stacked.

    Args:
        values: (n,) values.
        length: Length of the axis, in the unit of the values.
    """
    offsets = np.zeros(len(values))
    bins = np.floor(values / (length or 1.0) * _BINS + 1e-9)
    for number in np.unique(bins):
        stack = np.flatnonzero(bins == number)
        step = min(_STEP, 2 * _REACH / max(1, len(stack) - 1))
        # from the middle outwards, so that the first values are next to the estimate's mark
        places = (np.arange(len(stack)) - (len(stack) - 1) / 2) * step
        offsets[stack] = places[np.argsort(np.abs(places), kind="stable")]
    return offsets
