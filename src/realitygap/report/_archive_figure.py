"""The archive of novelty search: what it remembers at the end of one run, and how novel generations are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap._wording import counted
from realitygap.drawing import Ink
from realitygap.evolution import DISTANCES, Member, NoveltySettings, archive_members
from realitygap.report._chosen_run import ChosenRun, TracedPath, choose_run
from realitygap.report._tally import Results, Tally, read_tally, settings_of
from realitygap.report.charts.arena import draw_arena, draw_shares, draw_start
from realitygap.report.charts.house import Drawing, draw_wide, shorten
from realitygap.report.charts.lines import draw_line, generation_axis, head, pen_style
from realitygap.report.charts.sheet import IS_WIDE, Sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_PATHS = 16
"""Maximum number of drawn paths of archived individuals, because more would hide each other."""

_HEIGHT = 2.25
"""Height of the curves on a phone [in]."""


def draw_archive(folder: Results, condition: str | None = None, replicate: int | None = None) -> Drawing:
    """Draw the behaviors in the novelty archive at the end of one run, and the novelty of generations in all runs.

    Args:
        folder: Results of a study, or the path to them. The trials that are shown are recomputed.
        condition: Condition. Default: the first that selects by novelty.
        replicate: Run. Default: the typical one, as in `draw_paths`.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
        ValueError: there is no such condition or run, or it has no archive.
    """
    tally = read_tally(folder)
    run = choose_run(tally, _chosen(tally, condition), replicate)
    members = _members(run)
    different = list(dict.fromkeys(members))
    entered = [generation for generation, _ in members]
    paths, origin = run.trace(_rows_of(run.rows, different[-_MOST_PATHS:]))
    novelty = _mean_novelty(tally, run.condition.novelty)
    unit = DISTANCES[run.condition.novelty.distance].unit
    drawn = f", of which {len(paths)} are drawn" if len(paths) < len(different) else ""
    caption = (
        f"Left (on a phone, above): archive at the end of {run.name}, run {run.replicate}: {len(members)} behaviors, "
        f"{len(different)} of them different{drawn}, from generations {min(entered)} to {max(entered)}. "
        f"Darker cells are visited by more of them. {run.label}, n = 1 run. {origin} Right (below): mean novelty by "
        f"generation, over all runs that measure it in the same way. n = {counted(_n_runs(tally, novelty), 'run')}."
    )
    alt = (
        f"The archive of run {run.replicate} of {run.name} holds {len(members)} behaviors, of generations "
        f"{min(entered)} to {max(entered)}. Mean novelty in the last generation: "
        + ", ".join(f"{each} {values[-1]:.2f}" for each, values in novelty.items())
        + "."
    )

    def draw(width: float) -> Sheet:
        if width >= IS_WIDE:
            sheet = Sheet(width, [["field", "curves"]], [None], widths=[0.53, 0.47], gap=0.4)
        else:
            sheet = Sheet(width, [["field"], ["curves"]], [None, _HEIGHT])
        _draw_field(sheet.panels["field"], paths, run)
        head(sheet.panels["field"], "archived", f"{run.label}, n = {len(paths)}")
        _draw_curves(sheet.panels["curves"], novelty, unit)
        return sheet

    return draw_wide(draw, "archive", caption, alt)


def _chosen(tally: Tally, condition: str | None) -> str:
    """A condition that selects by novelty and has runs."""
    novel = [each["name"] for each in tally.selecting_by("novelty")]
    if condition is None and novel:
        return novel[0]
    if condition is None:
        raise ValueError("No condition with runs selects by novelty, so there is no archive.")
    if tally.condition(condition)["name"] not in novel:
        raise ValueError(f"Condition {condition!r} does not select by novelty, so it has no archive.")
    return condition


def _members(run: ChosenRun) -> list[Member]:
    """Return the members of the archive at the end of a run."""
    condition = run.condition
    by_position = DISTANCES[condition.novelty.distance].compares == "position"
    column = "behavior" if by_position else "cells"
    grid = condition.arena.arena().grid
    generations = [
        part.sort("individual")[column].to_list()
        for _, part in run.rows.sort("generation").group_by("generation", maintain_order=True)
    ]
    return archive_members(generations, condition.novelty, columns=grid.columns, rows=grid.rows)[-1]


def _rows_of(rows: pl.DataFrame, members: Sequence[Member]) -> pl.DataFrame:
    wanted = pl.DataFrame(members, schema=["generation", "individual"], orient="row")
    keys = [pl.col("generation").cast(pl.Int64), pl.col("individual").cast(pl.Int64)]
    return rows.with_columns(*keys).join(wanted, on=["generation", "individual"], how="semi")


def _mean_novelty(tally: Tally, settings: NoveltySettings) -> dict[str, npt.NDArray[np.float64]]:
    """Return the mean novelty of each condition with the same measure of novelty, (g,)."""
    alike = [
        str(each["name"])
        for each in tally.conditions
        if _measured(settings_of(each).get("novelty") or {}) == (settings.kind, settings.distance)
    ]
    columns = ["condition", "generation", "novelty"]
    parts = [frame.select(columns) for frame in tally.folder.frames(columns=columns)]
    means = (
        pl.concat(parts)
        .filter(pl.col("condition").is_in(alike))
        .drop_nulls("novelty")
        .group_by("condition", "generation", maintain_order=True)
        .agg(pl.col("novelty").mean())
        .sort("generation")
    )
    return {
        str(key[0]): part["novelty"].to_numpy()
        for key, part in means.group_by("condition", maintain_order=True)
    }


def _measured(novelty: Mapping[str, Any]) -> tuple[str, str]:
    """Kind and distance, as resolved settings have them: the paper's distance is not named there."""
    return str(novelty.get("kind", "paper")), str(novelty.get("distance", "paper"))


def _n_runs(tally: Tally, novelty: Mapping[str, object]) -> int:
    return tally.runs.filter(pl.col("condition").is_in(list(novelty))).height


# drawing


def _draw_field(axes: Axes, paths: Sequence[TracedPath], run: ChosenRun) -> None:
    """Cells by how many of the archived visit them, and their paths."""
    arena = run.arena
    draw_arena(axes, arena)
    counts = np.zeros(arena.grid.n_cells)
    for path in paths:
        counts[list(set(path.cells))] += 1
    draw_shares(
        axes, arena.grid, np.where(counts > 0, 0.06 + 0.44 * counts / max(len(paths), 1), 0.0), Ink.PEN1
    )
    draw_start(axes, arena, run.condition.on.body)
    for k, path in enumerate(paths):
        for poses, _ in path.tracks:
            draw_line(axes, *poses.T[:2], **pen_style(k, 1.0))


def _draw_curves(axes: Axes, novelty: Mapping[str, npt.NDArray[np.float64]], unit: str) -> None:
    n = max(len(values) for values in novelty.values())
    for k, (name, values) in enumerate(novelty.items()):
        axes.plot(np.arange(len(values)), values, label=shorten(name, 24), **pen_style(k, 1.4))
    axes.set_ylim(0, None)
    axes.set_xlim(-0.2, max(n - 1, 1) + 0.2)
    axes.grid(axis="y", color=Ink.RULE, linewidth=0.5)
    generation_axis(axes, f"mean novelty [{unit}]")
    axes.legend(frameon=False, fontsize=7.5, loc="lower right")
    head(axes, "all runs")
