"""The archive of novelty search: what it remembers at the end of one run, and how novel generations are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap._wording import counted
from realitygap.drawing import Ink, line_pen
from realitygap.evolution import DISTANCES, Member, NoveltySettings, archive_members
from realitygap.report._drawing import (
    Drawing,
    draw_points,
    draw_wide,
    head_axes,
    new_figure,
    place_axes,
    shorten,
)
from realitygap.report._path_figure import (
    TracedPath,
    arena_extent,
    draw_arena,
    draw_visited,
    say_origin,
    trace_paths,
    typical_replicate,
)
from realitygap.report._structures import selection_of
from realitygap.report._tally import Results, Tally, label_of, read_tally, settings_of
from realitygap.runs import Condition
from realitygap.world import Arena, Body

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_PATHS = 16
"""Maximum number of drawn paths of archived individuals, because more would hide each other."""

_HEIGHT = 2.25
"""Height of the curves [in]."""


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
    chosen = _chosen(tally, condition)
    described = tally.condition(chosen)
    resolved = Condition.from_settings(chosen, dict(settings_of(described)))
    replicate = typical_replicate(tally, chosen) if replicate is None else replicate
    rows = tally.rows_of(chosen, replicate)
    members = _members(resolved, rows)
    different = list(dict.fromkeys(members))
    entered = [generation for generation, _ in members]
    paths, problem = trace_paths(
        tally, resolved, _rows_of(rows, different[-_MOST_PATHS:]), f"coverage_{tally.measure}"
    )
    novelty = _mean_novelty(tally, resolved.novelty)
    unit = DISTANCES[resolved.novelty.distance].unit
    drawn = f", of which {len(paths)} are drawn" if len(paths) < len(different) else ""
    caption = (
        f"Left (on a phone, above), condition {chosen}, run {replicate}: what the archive holds at its end, "
        f"{len(members)} behaviors, {len(different)} of them different{drawn}, from generations {min(entered)} to "
        f"{max(entered)}; a cell is the darker, the more of them visit it. {label_of(described)}, n = 1 run. "
        f"{say_origin(described, paths, problem)} Right (below), the mean novelty of the individuals of each "
        f"generation, over all runs that measure it alike. n = {counted(_n_runs(tally, novelty), 'run')}, no interval."
    )
    alt = (
        f"The archive of run {replicate} of {chosen} holds {len(members)} behaviors, of generations {min(entered)} to "
        f"{max(entered)}. Mean novelty in the last generation: "
        + ", ".join(f"{each} {values[-1]:.2f}" for each, values in novelty.items())
        + "."
    )
    arena, body, label = resolved.placed_arena, resolved.on.body, label_of(described)
    return draw_wide(
        lambda width: _draw(paths, novelty, arena, body, unit, label, width), "archive", caption, alt
    )


def _chosen(tally: Tally, condition: str | None) -> str:
    """A condition that selects by novelty and has runs."""
    there = set(tally.runs["condition"])
    novel = [
        str(each["name"])
        for each in tally.conditions
        if selection_of(each) == "novelty" and each["name"] in there
    ]
    if condition is None and novel:
        return novel[0]
    if condition is None:
        raise ValueError("No condition with runs selects by novelty, so there is no archive.")
    if tally.condition(condition)["name"] not in novel:
        raise ValueError(f"Condition {condition!r} does not select by novelty, so it has no archive.")
    return condition


def _members(condition: Condition, rows: pl.DataFrame) -> list[Member]:
    """Return the members of the archive at the end of a run."""
    by_position = DISTANCES[condition.novelty.distance].compares == "position"
    column = "behavior" if by_position else "cells"
    grid = condition.arena.arena().grid
    generations = [
        part.sort("individual")[column].to_list()
        for _, part in rows.sort("generation").group_by("generation", maintain_order=True)
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


def _n_runs(tally: Tally, novelty: dict[str, Any]) -> int:
    return tally.runs.filter(pl.col("condition").is_in(list(novelty))).height


# drawing


def _draw(
    paths: Sequence[TracedPath],
    novelty: dict[str, npt.NDArray[np.float64]],
    arena: Arena,
    body: Body,
    unit: str,
    label: str,
    width: float,
) -> Any:
    is_wide = width >= 6
    (left, right), (bottom, top) = arena_extent(arena)
    across = 0.48 * width if is_wide else width - 0.04
    up = across * (top - bottom) / (right - left)
    height = max(up, _HEIGHT) + 0.75 if is_wide else up + 0.4 + _HEIGHT + 0.75
    figure = new_figure(width, height)
    field = place_axes(figure, 0.02, 0.3, across, up)
    _draw_field(field, paths, arena, body)
    head_axes(field, "archived", f"{label}, n = {len(paths)}")
    curves = place_axes(
        figure,
        0.57 * width if is_wide else 0.5,
        0.3 if is_wide else up + 0.8,
        0.4 * width if is_wide else width - 0.6,
        _HEIGHT,
    )
    _draw_curves(curves, novelty, unit)
    return figure


def _draw_field(axes: Axes, paths: Sequence[TracedPath], arena: Arena, body: Body) -> None:
    """Cells by how many of the archived visit them, and their paths."""
    from matplotlib.patches import Rectangle

    grid = arena.grid
    draw_arena(axes, arena, *arena_extent(arena))
    counts = np.zeros(grid.n_cells)
    for path in paths:
        counts[list(set(path.cells))] += 1
    for cell in np.flatnonzero(counts).tolist():
        row, column = divmod(cell, grid.columns)
        corner = (grid.x + column * grid.cell, grid.y + row * grid.cell)
        share = 0.06 + 0.44 * counts[cell] / len(paths)
        axes.add_artist(
            Rectangle(corner, grid.cell, grid.cell, facecolor=Ink.PEN1, alpha=share, linewidth=0, zorder=0)
        )
    draw_visited(axes, (), arena, body)
    for k, path in enumerate(paths):
        color, dashes = line_pen(k)
        style: Any = (0, tuple(dashes)) if dashes else "solid"
        for poses, _ in path.tracks:
            draw_points(axes, poses, color=color, linestyle=style, linewidth=1.0, zorder=5)


def _draw_curves(axes: Axes, novelty: dict[str, npt.NDArray[np.float64]], unit: str) -> None:
    from matplotlib.ticker import MaxNLocator

    n = max(len(values) for values in novelty.values())
    for k, (name, values) in enumerate(novelty.items()):
        color, dashes = line_pen(k)
        style: Any = (0, tuple(dashes)) if dashes else "solid"
        axes.plot(
            np.arange(len(values)),
            values,
            color=color,
            linestyle=style,
            linewidth=1.4,
            label=shorten(name, 24),
        )
    axes.set_ylim(0, None)
    axes.set_xlim(-0.2, max(n - 1, 1) + 0.2)
    axes.grid(axis="y", color=Ink.RULE, linewidth=0.5)
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    axes.set_xlabel("generation", labelpad=2)
    axes.set_ylabel(f"mean novelty [{unit}]")
    axes.legend(frameon=False, fontsize=7.5, loc="lower right")
    head_axes(axes, "all runs", "")
