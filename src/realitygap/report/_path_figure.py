"""Figure 6: the best path of each generation of one run, on the arena."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap.errors import RealityGapError
from realitygap.platforms import is_physical
from realitygap.report._driven import driven_paths
from realitygap.report._tally import (
    DescribedCondition,
    Results,
    Tally,
    label_of,
    read_tally,
    settings_of,
    task_of,
)
from realitygap.report.charts.arena import (
    Track,
    arena_keys,
    arena_panels,
    draw_cells,
    draw_start,
    draw_tracks,
)
from realitygap.report.charts.house import Drawing, draw_wide, shorten
from realitygap.report.charts.lines import head, panel_key
from realitygap.report.charts.sheet import Sheet
from realitygap.runs import Condition, replay
from realitygap.world import Arena, Body

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_PANELS = 11
"""Generations shown at most, evenly spread; with the legend they fill rows of two and of three."""


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


def say_origin(condition: DescribedCondition, paths: Sequence[TracedPath], problem: str) -> str:
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


def _draw(paths: list[TracedPath], arena: Arena, body: Body, label: str, width: float) -> Sheet:
    sheet, panels, key = arena_panels(width, len(paths), arena)
    n_cells = arena.grid.n_cells
    for path, axes in zip(paths, panels, strict=True):
        draw_path(axes, path, arena, body)
        coverage = f"{path.coverage:.3f} ({round(path.coverage * n_cells)} of {n_cells})"
        note = (
            f"{shorten(label, 12)}, coverage {coverage}"
            if sheet.is_wide
            else f"{path.coverage:.3f} {shorten(label, 12)}"
        )
        head(axes, f"generation {path.generation}", note, below=True)
    path_key(key, paths, is_wide=sheet.is_wide)
    return sheet


def draw_path(axes: Axes, path: TracedPath, arena: Arena, body: Body) -> None:
    """Draw one trial: cells, path, start, end, and the places where it was blocked."""
    draw_cells(axes, path.cells, arena)
    draw_start(axes, arena, body)
    draw_tracks(axes, path.tracks)


def path_key(axes: Axes, paths: Sequence[TracedPath], *, is_wide: bool) -> None:
    """Draw the legend for the marks of `draw_path`."""
    keys = arena_keys(paths=any(path.poses is not None for path in paths))
    panel_key(axes, keys, columns=2 if is_wide else 1, size=8.0 if is_wide else 7.0)


# words


def _caption(
    tally: Tally,
    condition: DescribedCondition,
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
        f"This is the typical run: its best {worth}, {best:.3f}, is the median of the "
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
