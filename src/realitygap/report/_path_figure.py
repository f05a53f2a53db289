"""Figure 6: the best path of each generation of one run, on the arena."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from realitygap.report._chosen_run import ChosenRun, TracedPath, choose_run
from realitygap.report._tally import Results, task_of
from realitygap.report.charts.arena import arena_keys, arena_panels, draw_cells, draw_start, draw_tracks
from realitygap.report.charts.house import Drawing, draw_wide, shorten
from realitygap.report.charts.lines import head, panel_key
from realitygap.report.charts.sheet import Sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_PANELS = 11
"""Generations shown at most, evenly spread; with the legend they fill rows of two and of three."""


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
    run = choose_run(folder, condition, replicate)
    paths, origin = run.trace(_best_of_generations(run))
    alt = (
        f"Best path of each generation of run {run.replicate} of {run.name}, in {len(paths)} panels. Coverage: "
        + ", ".join(f"generation {path.generation} {path.coverage:.3f}" for path in paths)
        + "."
    )
    return draw_wide(lambda width: _draw(run, paths, width), name, _caption(run, paths, origin), alt)


def _best_of_generations(run: ChosenRun) -> pl.DataFrame:
    """Return the rows of the best trial of each generation shown."""
    column = run.tally.score_column(run.name)
    best = run.rows.filter(pl.col(column) == pl.col(column).max().over("generation")).unique(
        "generation", keep="first", maintain_order=True
    )
    n_shown = min(best.height, _MOST_PANELS)
    return best[np.unique(np.round(np.linspace(0, best.height - 1, n_shown)).astype(int))]


# drawing


def _draw(run: ChosenRun, paths: list[TracedPath], width: float) -> Sheet:
    arena, label = run.arena, shorten(run.label, 12)
    sheet, panels, key = arena_panels(width, len(paths), arena)
    n_cells = arena.grid.n_cells
    for path, axes in zip(paths, panels, strict=True):
        draw_path(axes, path, run)
        coverage = f"{path.coverage:.3f} ({round(path.coverage * n_cells)} of {n_cells})"
        note = f"{label}, coverage {coverage}" if sheet.is_wide else f"{path.coverage:.3f} {label}"
        head(axes, f"generation {path.generation}", note, below=True)
    path_key(key, paths, is_wide=sheet.is_wide)
    return sheet


def draw_path(axes: Axes, path: TracedPath, run: ChosenRun) -> None:
    """Draw one trial: cells, path, start, end, and the places where it was blocked."""
    draw_cells(axes, path.cells, run.arena)
    draw_start(axes, run.arena, run.condition.on.body)
    draw_tracks(axes, path.tracks)


def path_key(axes: Axes, paths: Sequence[TracedPath], *, is_wide: bool) -> None:
    """Draw the legend for the marks of `draw_path`."""
    keys = arena_keys(paths=any(path.tracks for path in paths))
    panel_key(axes, keys, columns=2 if is_wide else 1, size=8.0 if is_wide else 7.0)


# words


def _caption(run: ChosenRun, paths: list[TracedPath], origin: str) -> str:
    is_coverage = task_of(run.described) == "coverage"
    best = run.tally.run_scores(run.name)[list(run.tally.replicates(run.name)).index(run.replicate)]
    n_generations = run.tally.generation_bests(run.name, run.tally.measure).shape[1]
    when = (
        "each generation" if len(paths) == n_generations else f"{len(paths)} of {n_generations} generations"
    )
    worth = "coverage" if is_coverage else "score"
    return (
        f"Path of {'highest' if is_coverage else 'best'} {worth} in {when}, {run.name}, run {run.replicate}{run.which} "
        f"(its best {worth}: {best:.3f}). Coverage counts cells {run.tally.counted}. {run.label}, n = 1 run. {origin}"
    )
