"""All individuals of each generation of one run, as the paper's Figures 5 and 8."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap.drawing import PENS, Ink
from realitygap.report._chosen_run import ChosenRun, TracedPath, choose_run
from realitygap.report._tally import Results
from realitygap.report.charts.arena import arena_extent, arena_panels, draw_cells, draw_start
from realitygap.report.charts.house import Drawing, draw_wide, shorten
from realitygap.report.charts.lines import (
    LineStyle,
    TextStyle,
    area_key,
    draw_dots,
    draw_line,
    draw_rings,
    head,
    line_key,
    mark_key,
    panel_key,
    write,
)
from realitygap.report.charts.sheet import Sheet
from realitygap.world import Arena

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_PANELS = 11
"""Generations shown at most, evenly spread; with the legend they fill rows of two and of three."""

_MOST_PATHS = 16
"""Individuals drawn in a panel at most; more would hide each other."""


def draw_individuals(
    folder: Results,
    condition: str | None = None,
    replicate: int | None = None,
    *,
    name: str = "individuals",
) -> Drawing:
    """All individuals of each generation of one run, a pen each, as the paper's Figures 5 and 8.

    Args:
        folder: Results of a study, or the path to them. The trials that are shown are recomputed.
        condition: Condition. Default: the first one.
        replicate: Run. Default: the typical one, as in `draw_paths`.
        name: First part of the ids in the drawing.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
        ValueError: there is no such condition or run.
    """
    run = choose_run(folder, condition, replicate)
    rows = run.rows
    n_generations, population = int(rows["generation"].n_unique()), int(rows["individual"].n_unique())
    shown = np.linspace(0, n_generations - 1, min(n_generations, _MOST_PANELS)).round().astype(int).tolist()
    rows = rows.filter(pl.col("generation").is_in(shown), pl.col("individual") < _MOST_PATHS)
    paths, origin = run.trace(rows)
    panels = [list(group) for _, group in itertools.groupby(paths, key=lambda path: path.generation)]
    caption = _individuals_caption(run, panels, (n_generations, population), origin)
    alt = (
        f"Paths of all individuals of each generation of run {run.replicate} of {run.name}, in {len(panels)} panels. "
        "Best coverage: "
        + ", ".join(
            f"generation {panel[0].generation} {max(path.coverage for path in panel):.3f}" for panel in panels
        )
        + "."
    )
    return draw_wide(lambda width: _draw_generations(run, panels, width), name, caption, alt)


# drawing


def _draw_generations(run: ChosenRun, panels: list[list[TracedPath]], width: float) -> Sheet:
    arena = run.arena
    sheet, places, key = arena_panels(width, len(panels), arena)
    small = not sheet.is_wide
    for panel, axes in zip(panels, places, strict=True):
        best = max(panel, key=lambda path: path.coverage)
        note = (
            f"best {best.coverage:.3f}"
            if small
            else f"{shorten(run.label, 12)}, best: {best.individual}, coverage {best.coverage:.3f}"
        )
        head(axes, f"generation {best.generation}", note, below=True)
    n_pens = max((path.individual for panel in panels for path in panel), default=0) + 1
    _draw_pen_key(key, n_pens, small=small)
    sheet.settle()  # so that panels have the size in which numbers are moved apart
    for panel, axes in zip(panels, places, strict=True):
        _draw_pens(axes, panel, run, small=small)
    return sheet


def _draw_pens(axes: Axes, paths: list[TracedPath], run: ChosenRun, *, small: bool) -> None:
    arena = run.arena
    draw_cells(axes, sorted({cell for path in paths for cell in path.cells}), arena)
    draw_start(axes, arena, run.condition.on.body)
    for path in paths:
        for poses, _ in path.tracks:
            draw_line(axes, poses[:, 0], poses[:, 1], **_pen(path.individual, small=small))
        if not path.tracks:
            _dot_cells(axes, path, arena, small=small)
    if drawn := [path for path in paths if path.tracks]:
        _number_ends(axes, drawn, arena, small=small)


def _dot_cells(axes: Axes, path: TracedPath, arena: Arena, *, small: bool) -> None:
    """Draw a dot in each visited cell; each pen has a separate place within the cell."""
    grid, pen = arena.grid, path.individual % len(PENS)
    across, up = divmod(pen if pen < 4 else pen + 1, 3)  # eight places around the middle
    cells = np.array(path.cells)
    xs = grid.x + (cells % grid.columns + (across + 1) / 4) * grid.cell
    ys = grid.y + (cells // grid.columns + (up + 1) / 4) * grid.cell
    size = 1.6 if small else 2.6
    draw_dots(axes, xs, ys, size, color=PENS[pen][0], zorder=5)


def _pen(individual: int, *, small: bool) -> LineStyle:
    """Return the line style of a pen. The first pens are broad, so that they show under those drawn over them."""
    pen = individual % len(PENS)
    color, dash = PENS[pen]
    width = (2.7 - 0.25 * pen) * (0.75 if small else 1.0)
    scaled = tuple(part * (0.7 if small else 0.9) * 1.6 / width for part in dash)
    return {
        "color": color,
        "linewidth": width,
        "linestyle": (0, scaled) if scaled else "solid",
        "dash_capstyle": "butt",
        "solid_joinstyle": "round",
        "zorder": 5,
    }


def _number_ends(axes: Axes, paths: list[TracedPath], arena: Arena, *, small: bool) -> None:
    """The individual's number at the end of each path; those that would overlap are moved apart."""
    radius = 3.5 if small else 4.6
    (left, right), (bottom, top) = arena_extent(arena)
    points = axes.bbox.width * 72 / axes.figure.dpi / (right - left)
    ends = np.array([path.end for path in paths])
    places = _moved_apart(ends, 2 * radius / points + 0.4 / points)
    places[:, 0] = places[:, 0].clip(left + radius / points, right - radius / points)
    places[:, 1] = places[:, 1].clip(bottom + radius / points, top - radius / points)
    for path, end, place in zip(paths, ends, places, strict=True):
        color = PENS[path.individual % len(PENS)][0]
        if math.dist(end, place) * points > radius:
            draw_line(axes, [end[0], place[0]], [end[1], place[1]], color=color, linewidth=0.6, zorder=8)
            draw_dots(axes, end[0], end[1], 2.0, color=color, zorder=8)
        draw_rings(axes, place[0], place[1], 2 * radius - 0.8, color, markeredgewidth=0.9, zorder=9)
        style: TextStyle = {
            "ha": "center",
            "va": "center_baseline",
            "weight": "bold",
            "color": color,
            "zorder": 10,
        }
        size = 5.6 if small else 6.8
        write(axes, str(path.individual), place, (0, -0.15), size, units=("data", "data"), **style)


def _moved_apart(ends: npt.NDArray[np.float64], least: float) -> npt.NDArray[np.float64]:
    """Return places near the ends, in their unit, of which no two are much nearer than `least`, (n, 2)."""
    places = ends.copy()
    angles = 2.4 * np.arange(len(ends))  # the golden angle: where many ends are one, they leave all around
    places += 0.02 * least * np.column_stack([np.cos(angles), np.sin(angles)])
    for _ in range(120):
        apart = places[:, None] - places[None]
        distance = np.hypot(apart[..., 0], apart[..., 1])
        np.fill_diagonal(distance, np.inf)
        push = (least - distance).clip(min=0.0) / 2 / distance.clip(min=1e-9)
        if not push.any():
            break
        places += (push[..., None] * apart).sum(axis=1) * 0.6
    return places


def _draw_pen_key(axes: Axes, n_pens: int, *, small: bool) -> None:
    handles = []
    for pen in range(min(n_pens, len(PENS))):
        same = ", ".join(str(individual) for individual in range(pen, n_pens, len(PENS)))
        handles.append(line_key(f"individual {same}", **_pen(pen, small=small)))
    handles.append(mark_key("start", "s", 6, color=Ink.BODY, markerfacecolor="none"))
    handles.append(area_key("visited cell" if small else "cell that one visits", Ink.VISITED))
    panel_key(axes, handles, columns=2, size=6.0 if small else 8.0, length=2.2 if small else 3.6)


# words


def _individuals_caption(
    run: ChosenRun, panels: list[list[TracedPath]], sizes: tuple[int, int], origin: str
) -> str:
    if run.condition.is_physical and not all(path.tracks for panel in panels for path in panel):
        origin += " A dot in the color of an individual marks each cell that it visits."
    n_generations, population = sizes
    n_drawn = max(len(panel) for panel in panels)
    who = (
        f"all {population} individuals"
        if n_drawn == population
        else f"the first {n_drawn} of {population} individuals"
    )
    when = (
        "every generation"
        if len(panels) == n_generations
        else f"{len(panels)} of {n_generations} generations"
    )
    return (
        f"Paths of {who} of {when}, {run.name}, run {run.replicate}{run.which}. Numbers mark the ends of paths. "
        f"Coverage counts cells {run.tally.counted}. {run.label}, n = 1 run. {origin}"
    )
