"""An arena from above: its walls and cells, the share of each cell, and the paths of robots."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from realitygap.drawing import PENS, Ink
from realitygap.playback import placed
from realitygap.report.charts.lines import (
    area_key,
    draw_dots,
    draw_line,
    draw_rings,
    hollow,
    line_key,
    mark_key,
)
from realitygap.report.charts.sheet import IS_WIDE, Sheet, grid
from realitygap.world import Arena, Body, Grid

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

Track = tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]
"""Poses (t + 1, 3), and whether each step was blocked (t + 1,)."""


_FAINTEST = 0.02
"""Shares below are left white."""


def arena_extent(arena: Arena) -> tuple[tuple[float, float], tuple[float, float]]:
    """Left and right, lower and upper end of what is drawn of an arena [m]."""
    walls = np.array(arena.walls)
    margin = 0.012
    xs, ys = walls[:, [0, 2]], walls[:, [1, 3]]
    return (xs.min() - margin, xs.max() + margin), (ys.min() - margin, ys.max() + margin)


def arena_panels(width: float, n: int, arena: Arena) -> tuple[Sheet, list[Axes], Axes]:
    """Panels with an arena, in rows of two or three, and one more for their legend."""
    sheet, panels = grid(width, n + 1, 3 if width >= IS_WIDE else 2, None, gap=0.2)
    for axes in panels:
        axes.set_axis_off()
        _show(axes, arena)
    for axes in panels[:-1]:
        draw_arena(axes, arena)
    return sheet, panels[:-1], panels[-1]


def _show(axes: Axes, arena: Arena) -> None:
    (left, right), (bottom, top) = arena_extent(arena)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)


def draw_arena(axes: Axes, arena: Arena) -> None:
    """Walls, reachable cells and their border, in axes that show nothing else."""
    axes.set_axis_off()
    _show(axes, arena)
    cells = arena.grid
    right, top = cells.right_end, cells.upper_end
    xs = cells.x + cells.cell * np.arange(1, cells.columns)
    ys = cells.y + cells.cell * np.arange(1, cells.rows)
    lines = [[x, cells.y, x, top] for x in xs] + [[cells.x, y, right, y] for y in ys]
    _draw_pieces(axes, lines, Ink.RULE, 0.4, 1)
    corners = [cells.x, right, right, cells.x, cells.x], [cells.y, cells.y, top, top, cells.y]
    draw_line(axes, *corners, color=Ink.REACH, linewidth=0.9, zorder=2)
    _draw_pieces(axes, arena.walls, Ink.TEXT, 1.8, 3)
    for obstacle in arena.obstacles:
        across, up = zip(*obstacle.outline(), strict=True)
        axes.fill(across, up, facecolor=Ink.RULE, edgecolor=Ink.TEXT, linewidth=1.2, zorder=3)


def _draw_pieces(
    axes: Axes, pieces: Iterable[Sequence[float]], color: str, width: float, order: float
) -> None:
    """Draw straight pieces, (n, 4) x and y of both ends, as one line with gaps."""
    points = np.array([[*piece, math.nan, math.nan] for piece in pieces]).reshape(-1, 2)
    draw_line(axes, *points.T, color=color, linewidth=width, solid_capstyle="projecting", zorder=order)


def draw_cells(axes: Axes, cells: Iterable[int], arena: Arena) -> None:
    """Visited cells as one area, which takes a tenth of the time that a rectangle for each would."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    rows, columns = np.divmod(np.array(list(cells), dtype=int), arena.grid.columns)
    if not len(rows):
        return
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]])
    places = np.column_stack([columns, rows])[:, None] + corners
    vertices = np.array([arena.grid.x, arena.grid.y]) + arena.grid.cell * places.reshape(-1, 2)
    codes = np.tile([Path.MOVETO, *[Path.LINETO] * 3, Path.CLOSEPOLY], len(rows))
    axes.add_artist(PathPatch(Path(vertices, codes), linewidth=0, zorder=0, facecolor=Ink.VISITED))


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
        axes.add_artist(
            Rectangle(
                grid.corners(int(cell))[0],
                grid.cell,
                grid.cell,
                facecolor=color if shares[cell] > 0 else Ink.PUBLISHED,
                alpha=round(float(min(abs(shares[cell]), 1.0)), 3),
                linewidth=rim,
                edgecolor=Ink.GROUND,
                zorder=0,
            )
        )


def draw_start(axes: Axes, arena: Arena, body: Body) -> None:
    """The robot's outline at each start of an arena, and the start."""
    for start in arena.starts:
        outline = placed([*body.corners, body.corners[0]], start)
        draw_line(axes, outline[:, 0], outline[:, 1], color=Ink.BODY, linewidth=0.8, zorder=4)
        draw_dots(axes, start.x, start.y, 3.4, color=Ink.TEXT, zorder=7)


def draw_tracks(axes: Axes, tracks: Iterable[Track]) -> None:
    """Each robot's path in its color, its end, and the places where it was blocked."""
    for robot, (poses, stalled) in enumerate(tracks):
        color = PENS[(robot + 1) % len(PENS)][0] if robot else Ink.OURS
        draw_line(axes, *poses.T[:2], color=color, linewidth=1.3, solid_joinstyle="round", zorder=5)
        blocked = np.unique(np.round(poses[stalled, :2], 6), axis=0)
        if len(blocked):
            draw_dots(
                axes,
                blocked[:, 0],
                blocked[:, 1],
                4.0,
                marker="x",
                color=Ink.REACH,
                markeredgewidth=1.1,
                zorder=6,
            )
        draw_rings(axes, poses[-1, 0], poses[-1, 1], 4.4, color, markeredgewidth=1.2, zorder=6)


def arena_keys(*, paths: bool = True) -> list[Artist]:
    """Keys of the marks of the functions above; those of paths only if there are some."""
    keys = [
        mark_key("robot at the start", "s", 7, color=Ink.BODY, markerfacecolor="none"),
        mark_key("start", "o", 3.4, color=Ink.TEXT),
    ]
    if paths:
        keys += [
            line_key("path of its center", color=Ink.OURS, linewidth=1.3),
            mark_key("end", "o", 4.4, **hollow(Ink.OURS, 1.2)),
            mark_key("blocked here", "x", 4.0, color=Ink.REACH, markeredgewidth=1.1),
        ]
    return [
        *keys,
        area_key("cell visited", Ink.VISITED),
        line_key("reachable cells", color=Ink.REACH, linewidth=0.9),
        line_key("wall", color=Ink.TEXT, linewidth=1.8),
    ]
