"""Figure 6: the best path of each generation of one run, on the arena."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap.drawing import PENS, Ink
from realitygap.errors import RealityGapError
from realitygap.platforms import is_physical
from realitygap.playback import placed
from realitygap.report._drawing import (
    Drawing,
    draw_dots,
    draw_line,
    draw_points,
    draw_wide,
    head_axes,
    mark_key,
    new_figure,
    place_axes,
    shorten,
)
from realitygap.report._driven import driven_paths
from realitygap.report._tally import Results, Tally, label_of, read_tally, settings_of, task_of
from realitygap.runs import Condition, replay
from realitygap.world import Arena, Body

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_PANELS = 11
"""Generations shown at most, evenly spread; with the legend they fill rows of two and of three."""


Track = tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]
"""Poses (t + 1, 3), and whether each step was blocked (t + 1,)."""


@dataclass(frozen=True)
class TracedPath:
    """A trial that is drawn.

    Attributes:
        generation, individual: Identity of the trial.
        coverage: Coverage [0..1], by the tally's measure.
        cells: Cells along the line, columns * row + column.
        poses: (t + 1, 3) x, y [m], heading [rad]; None if the trial cannot be recomputed.
        stalled: (t + 1,) True if the step was blocked; None if the trial cannot be recomputed.
        others: Poses and blocked steps of the other robots of the trial.
    """

    generation: int
    individual: int
    coverage: float
    cells: tuple[int, ...]
    poses: npt.NDArray[np.float64] | None
    stalled: npt.NDArray[np.bool_] | None
    others: tuple[Track, ...] = ()

    @property
    def tracks(self) -> tuple[Track, ...]:
        """Return poses and blocked steps of all robots; none if the trial cannot be recomputed."""
        if self.poses is None or self.stalled is None:
            return ()
        return ((self.poses, self.stalled), *self.others)


def draw_paths(
    folder: Results,
    condition: str | None = None,
    replicate: int | None = None,
    *,
    name: str = "paths",
) -> Drawing:
    """The best path of each generation of one run, as the paper's Figure 6.

    Args:
        folder: Results of a study, or the path to them. The trials that are shown are recomputed.
        condition: Condition. Default: the first one.
        replicate: Run. Default: the typical one, whose best trial by the task is the median of its condition (the lower
            of the two middle ones, and the first of several equal ones).
        name: First part of the ids in the drawing.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
        ValueError: there is no such condition or run.
    """
    tally = read_tally(folder)
    condition = tally.name_of(condition)
    described = tally.condition(condition)
    resolved = Condition.from_settings(condition, dict(settings_of(described)))
    typical = replicate is None
    replicate = typical_replicate(tally, condition) if replicate is None else replicate
    paths, problem = _best_paths(tally, resolved, replicate)
    caption = _caption(tally, described, replicate, paths, typical=typical, problem=problem)
    alt = (
        f"Best path of each generation of run {replicate} of {condition}, in {len(paths)} panels. Coverage: "
        + ", ".join(f"generation {path.generation} {path.coverage:.3f}" for path in paths)
        + "."
    )
    arena, body, label = resolved.placed_arena, resolved.on.body, label_of(described)
    return draw_wide(lambda width: _draw(paths, arena, body, label, width), name, caption, alt)


def typical_replicate(tally: Tally, condition: str) -> int:
    """The run whose best trial by the task is the median: the lower middle one, and the first of several alike.

    Raises:
        ValueError: the condition has no runs.
    """
    bests = tally.run_scores(condition)
    if len(bests) == 0:
        raise ValueError(f"Condition {condition!r} has no runs yet.")
    middle = np.sort(bests)[(len(bests) - 1) // 2]
    return int(tally.replicates(condition)[np.argmax(bests == middle)])


def _best_paths(tally: Tally, condition: Condition, replicate: int) -> tuple[list[TracedPath], str]:
    """The best trial of each generation shown, and why trials could not be recomputed (empty: they could)."""
    column = tally.score_column(condition.name)
    rows = tally.rows_of(condition.name, replicate)
    best = rows.filter(pl.col(column) == pl.col(column).max().over("generation")).unique(
        "generation", keep="first", maintain_order=True
    )
    n_generations = best.height
    shown = np.unique(
        np.round(np.linspace(0, n_generations - 1, min(n_generations, _MOST_PANELS))).astype(int)
    )
    return trace_paths(tally, condition, best[shown], f"coverage_{tally.measure}")


def trace_paths(
    tally: Tally, condition: Condition, rows: pl.DataFrame, column: str
) -> tuple[list[TracedPath], str]:
    """The trials of these rows, and why some could not be recomputed (empty: they could)."""
    if condition.is_physical:
        return _driven_paths(tally, condition, rows, column), ""
    paths, problem = [], ""
    for row in rows.iter_rows(named=True):
        tracks: list[Track] = []
        try:
            tracks = [(robot.poses, robot.stalled) for robot in replay(condition, row).robots]
        except (RealityGapError, ValueError) as error:
            # another version's genome or numbers; the cells visited are in the row
            problem = str(error)
        poses, stalled = tracks[0] if tracks else (None, None)
        paths.append(
            TracedPath(
                row["generation"],
                row["individual"],
                row[column],
                tuple(row["cells"]),
                poses,
                stalled,
                tuple(tracks[1:]),
            )
        )
    return paths, problem


def _driven_paths(tally: Tally, condition: Condition, rows: pl.DataFrame, column: str) -> list[TracedPath]:
    """Return the trials of a robot: with the line if an emulator's witness recorded it, otherwise only with cells."""
    paths = []
    for (replicate,), part in rows.group_by("replicate", maintain_order=True):
        seen = driven_paths(tally.folder, condition.name, int(replicate))
        for row in part.iter_rows(named=True):
            poses = seen.get((row["generation"], row["individual"]))
            stalled = None if poses is None else np.zeros(len(poses), np.bool_)
            paths.append(
                TracedPath(
                    row["generation"], row["individual"], row[column], tuple(row["cells"]), poses, stalled
                )
            )
    return paths


def say_origin(condition: Mapping[str, Any], paths: Sequence[TracedPath], problem: str) -> str:
    """Describe the source of the drawn lines, or the reason why there are none."""
    if is_physical(settings_of(condition)):
        if all(path.poses is not None for path in paths):
            return "The paths are what the emulator’s witness saw; where the robot was blocked is not marked."
        return "Only the cells were entered, which are shaded; the lines themselves are on paper."
    if problem:
        return f"Some paths are missing: the trials could not be recomputed. {problem}"
    several = " Each color is a robot." if any(path.others for path in paths) else ""
    return f"The paths were recomputed from the records and visit the cells recorded.{several}"


# drawing


def _draw(paths: list[TracedPath], arena: Arena, body: Body, label: str, width: float) -> Figure:
    figure, places = panels_of(len(paths) + 1, arena, width)
    for path, axes in zip(paths, places, strict=False):
        draw_arena(axes, arena, *arena_extent(arena))
        draw_path(axes, path, arena, body)
        _write_below(axes, path, arena, label)
    draw_path_legend(places[-1], paths, small=width < 6)
    return figure


def panels_of(n: int, arena: Arena, width: float) -> tuple[Figure, list[Axes]]:
    """A figure with room for n panels in rows of two or three, with a line of text below each."""
    n_columns = 3 if width >= 6 else 2
    x_range, y_range = arena_extent(arena)
    gap, text_height = 0.2, 0.36
    panel_width = (width - 0.04 - gap * (n_columns - 1)) / n_columns
    panel_height = panel_width * (y_range[1] - y_range[0]) / (x_range[1] - x_range[0])
    figure = new_figure(width, math.ceil(n / n_columns) * (panel_height + text_height))
    places = []
    for index in range(n):
        row, column = divmod(index, n_columns)
        x = 0.02 + column * (panel_width + gap)
        places.append(
            place_axes(figure, x, row * (panel_height + text_height) + 0.04, panel_width, panel_height)
        )
    return figure, places


def arena_extent(arena: Arena) -> tuple[tuple[float, float], tuple[float, float]]:
    """Left and right, lower and upper end of what is drawn of an arena [m]."""
    walls = np.array(arena.walls)
    margin = 0.012
    xs, ys = walls[:, [0, 2]], walls[:, [1, 3]]
    return (xs.min() - margin, xs.max() + margin), (ys.min() - margin, ys.max() + margin)


def draw_arena(axes: Axes, arena: Arena, x_range: tuple[float, float], y_range: tuple[float, float]) -> None:
    """Walls, reachable cells and their border."""
    axes.set_axis_off()
    axes.set_xlim(*x_range)
    axes.set_ylim(*y_range)
    grid = arena.grid
    right, top = grid.x + grid.columns * grid.cell, grid.y + grid.rows * grid.cell
    lines: list[float] = []
    ends: list[float] = []
    for column in range(1, grid.columns):
        x = grid.x + column * grid.cell
        lines += [x, x, math.nan]
        ends += [grid.y, top, math.nan]
    for row in range(1, grid.rows):
        y = grid.y + row * grid.cell
        lines += [grid.x, right, math.nan]
        ends += [y, y, math.nan]
    draw_line(axes, lines, ends, color=Ink.RULE, linewidth=0.4, zorder=1)
    draw_line(
        axes,
        [grid.x, right, right, grid.x, grid.x],
        [grid.y, grid.y, top, top, grid.y],
        color=Ink.REACH,
        linewidth=0.9,
        zorder=2,
    )
    walls = np.array([[x1, y1, x2, y2, math.nan, math.nan] for x1, y1, x2, y2 in arena.walls]).reshape(-1, 2)
    draw_points(axes, walls, color=Ink.TEXT, linewidth=1.8, solid_capstyle="projecting", zorder=3)
    for obstacle in arena.obstacles:
        xs, ys = zip(*obstacle.outline(), strict=True)
        axes.fill(xs, ys, facecolor=Ink.RULE, edgecolor=Ink.TEXT, linewidth=1.2, zorder=3)


def draw_cells(axes: Axes, cells: Iterable[int], arena: Arena, **style: Any) -> None:
    """Cells as one area, which takes a tenth of the time that a rectangle for each would."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    grid = arena.grid
    rows, columns = np.divmod(np.array(list(cells), dtype=int), grid.columns)
    if not len(rows):
        return
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]])
    places = np.column_stack([columns, rows])[:, None] + corners
    vertices = np.array([grid.x, grid.y]) + grid.cell * places.reshape(-1, 2)
    codes = np.tile([Path.MOVETO, *[Path.LINETO] * 3, Path.CLOSEPOLY], len(rows))
    axes.add_artist(PathPatch(Path(vertices, codes), linewidth=0, zorder=0, **style))


def draw_visited(axes: Axes, cells: Iterable[int], arena: Arena, body: Body) -> None:
    """Draw the background of paths: visited cells, the robot's outline at the start, and the start."""
    draw_cells(axes, cells, arena, facecolor=Ink.VISITED)
    for start in arena.starts:
        outline = placed([*body.corners, body.corners[0]], start)
        draw_line(axes, outline[:, 0], outline[:, 1], color=Ink.BODY, linewidth=0.8, zorder=4)
        draw_dots(axes, [start.x], [start.y], 3.4, color=Ink.TEXT, zorder=7)


def draw_path(axes: Axes, path: TracedPath, arena: Arena, body: Body) -> None:
    """Draw one trial: cells, path, start, end, and the places where it was blocked."""
    draw_visited(axes, path.cells, arena, body)
    for robot, (poses, stalled) in enumerate(path.tracks):
        _draw_track(axes, poses, stalled, PENS[(robot + 1) % len(PENS)][0] if robot else Ink.OURS)


def _draw_track(
    axes: Axes, poses: npt.NDArray[np.float64], stalled: npt.NDArray[np.bool_], color: str
) -> None:
    """Draw one robot: its path, its end, and the places where it was blocked."""
    draw_points(axes, poses, color=color, linewidth=1.3, solid_joinstyle="round", zorder=5)
    blocked = np.unique(np.round(poses[stalled, :2], 6), axis=0)
    if len(blocked):
        draw_points(
            axes,
            blocked,
            marker="x",
            linestyle="",
            color=Ink.REACH,
            markersize=4.0,
            markeredgewidth=1.1,
            zorder=6,
        )
    draw_dots(
        axes,
        poses[-1:, 0],
        poses[-1:, 1],
        4.4,
        color=color,
        markerfacecolor=Ink.GROUND,
        markeredgewidth=1.2,
        zorder=6,
    )


def _write_below(axes: Axes, path: TracedPath, arena: Arena, label: str) -> None:
    n_cells = arena.grid.n_cells
    figure_text = f"{path.coverage:.3f} ({round(path.coverage * n_cells)} of {n_cells})"
    if axes.bbox.width > 2.5 * axes.figure.dpi:
        figure_text = f"{shorten(label, 12)}, coverage {figure_text}"
    else:
        figure_text = f"{path.coverage:.3f} {shorten(label, 12)}"
    head_axes(axes, f"generation {path.generation}", figure_text, y=0.0, shift=(1.0, -4.0))


def draw_path_legend(axes: Axes, paths: list[TracedPath], *, small: bool) -> None:
    """Draw the legend for the marks of `draw_path`."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    axes.set_axis_off()
    handles: list[Any] = [
        mark_key("robot at the start", "s", 7, Ink.BODY, markerfacecolor="none"),
        Line2D([], [], color=Ink.TEXT, marker="o", linestyle="", markersize=3.4, label="start"),
    ]
    if any(path.poses is not None for path in paths):
        handles += [
            Line2D([], [], color=Ink.OURS, linewidth=1.3, label="path of its center"),
            mark_key("end", "o", 4.4, Ink.OURS, markeredgewidth=1.2, hollow=True),
            mark_key("blocked here", "x", 4.0, Ink.REACH, markeredgewidth=1.1),
        ]
    handles += [
        Patch(facecolor=Ink.VISITED, label="cell visited"),
        Line2D([], [], color=Ink.REACH, linewidth=0.9, label="reachable cells"),
        Line2D([], [], color=Ink.TEXT, linewidth=1.8, label="wall"),
    ]
    axes.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=1 if small else 2,
        frameon=False,
        fontsize=7.0 if small else 8.0,
        handlelength=1.4,
        borderaxespad=0.0,
        labelspacing=0.25 if small else 0.8,
    )


# words


def _caption(
    tally: Tally,
    condition: Mapping[str, Any],
    replicate: int,
    paths: list[TracedPath],
    *,
    typical: bool,
    problem: str,
) -> str:
    name = condition["name"]
    bests = tally.run_scores(name)
    is_coverage = task_of(condition) == "coverage"
    worth = "coverage" if is_coverage else "score"
    best = bests[list(tally.replicates(name)).index(replicate)]
    counted = "along the line driven" if tally.measure == "line" else "at the ends of steps"
    n_generations = tally.generation_bests(name, tally.measure).shape[1]
    which = (
        "every generation" if len(paths) == n_generations else f"{len(paths)} of {n_generations} generations"
    )
    why = (
        f"It is the typical run and not a picked one: its best {worth}, {best:.3f}, is the median of the "
        f"{len(bests)} runs (the lower middle one, the first of several alike)."
        if typical
        else f"The run was chosen by number; its best {worth} is {best:.3f}."
    )
    parts = [
        f"Condition {name}, run {replicate}: the individual of {'highest' if is_coverage else 'best'} {worth} in "
        f"{which}, coverage counted {counted}. {label_of(condition)}, n = 1 run, no interval.",
        why if len(bests) > 1 else "It is the only run.",
        say_origin(condition, paths, problem),
    ]
    return " ".join(parts)
