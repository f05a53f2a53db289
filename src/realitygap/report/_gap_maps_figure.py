"""Maps of the cells that trials visit on both sides of a gap, or on one side only."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from realitygap._wording import p_equation
from realitygap.drawing import Ink
from realitygap.report._drawing import Drawing, draw_wide, new_figure, place_axes, shorten
from realitygap.report._marks import Panel, Series
from realitygap.report._path_figure import arena_extent, draw_arena
from realitygap.study import GapStudy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_FAINTEST = 0.02
"""Shares below are left white."""


def draw_gap_maps(gap: GapStudy) -> Drawing | None:
    """Draw the share of trials that cross each cell on both sides, and their difference; None if cells are unknown."""
    maps = gap.maps
    if maps is None:
        return None
    source, target, energy = gap.source, gap.target, gap.result.energy
    most = max(float(maps.source.max()), float(maps.target.max()), 0.01)
    apart = max(float(abs(maps.difference).max()), 0.01)
    p = energy.more.get("p")
    words = "" if p is None else f" ({p_equation(p)} by permutation within controllers)"
    caption = (
        f"Share of trials that cross each cell: {source.n} controllers, {source.trials} trials each on {source.name} "
        f"({source.label}) and {target.trials} on {target.name} ({target.label}); full color is {most:.2f}. Right: "
        f"where the target’s trials go more often (blue) or less often (orange); full color is {apart:.2f}. Energy "
        f"distance of visited cells {energy}{words}."
    )
    alt = f"Maps of visited cells on {source.name} and on {target.name}, and their difference of up to {apart:.2f}."
    panels: list[tuple[str, Any, float]] = [
        (f"{source.label} {shorten(source.name, 20)}", maps.source, most),
        (f"{target.label} {shorten(target.name, 20)}", maps.target, most),
        (f"{target.label} less {source.label}", maps.difference, apart),
    ]

    def draw(width: float) -> Figure:
        columns = 3 if width > 6 else 1
        x_range, y_range = arena_extent(gap.arena)
        across = (width - 0.06 - 0.25 * (columns - 1)) / columns
        up = across * (y_range[1] - y_range[0]) / (x_range[1] - x_range[0])
        figure = new_figure(width, (3 // columns) * (up + 0.3))
        for k, (title, values, full) in enumerate(panels):
            row, column = divmod(k, columns)
            axes = place_axes(figure, 0.03 + column * (across + 0.25), 0.25 + row * (up + 0.3), across, up)
            axes.set_gid(f"maps-{k}")
            draw_arena(axes, gap.arena, x_range, y_range)
            _draw_shares(axes, gap, values / full)
            axes.set_title(title, loc="left", fontsize=8.5, pad=3)
        return figure

    marks = tuple(
        Panel(f"maps-{k}", (_marks_of_cells(gap, title, values),), (3, 3))
        for k, (title, values, _) in enumerate(panels)
    )
    return draw_wide(draw, "gap-maps", caption, alt, marks=marks)


def _marks_of_cells(gap: GapStudy, title: str, values: Any) -> Series:
    grid = gap.arena.grid
    rows, columns = np.divmod(np.arange(len(values)), grid.columns)
    points = np.column_stack([grid.x + (columns + 0.5) * grid.cell, grid.y + (rows + 0.5) * grid.cell])
    labels = tuple(
        f"column {column + 1}, row {row + 1}: {value:.3f}"
        for row, column, value in zip(rows, columns, values, strict=True)
    )
    return Series("{name}, {label}", points, title, labels)


def _draw_shares(axes: Axes, gap: GapStudy, shares: Any) -> None:
    from matplotlib.patches import Rectangle

    grid = gap.arena.grid
    for cell, share in enumerate(shares):
        if abs(share) < _FAINTEST:
            continue
        row, column = divmod(cell, grid.columns)
        axes.add_artist(
            Rectangle(
                (grid.x + column * grid.cell, grid.y + row * grid.cell),
                grid.cell,
                grid.cell,
                facecolor=Ink.OURS if share > 0 else Ink.PUBLISHED,
                alpha=round(float(abs(share)), 3),
                linewidth=0,
                zorder=0,
            )
        )
