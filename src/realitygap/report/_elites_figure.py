"""The archive of a run with MAP-Elites: the fitness of the elite of each cell, as found and by fresh trials."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, NamedTuple
from urllib.parse import quote

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap._wording import counted
from realitygap.drawing import Ink
from realitygap.errors import TaskError
from realitygap.report._chosen_run import ChosenRun, choose_run
from realitygap.report._tally import Results, Tally, read_tally
from realitygap.report.charts.house import Drawing, draw_wide, shorten
from realitygap.report.charts.lines import area_key, draw_band, draw_line, head, pen_style
from realitygap.report.charts.marks import MOST_MARKS, Panel, Series
from realitygap.report.charts.sheet import IS_WIDE, Sheet
from realitygap.runs import (
    RETRIES,
    Condition,
    archive_progress,
    corrected_archive,
    elites_of,
    retry_elites,
)
from realitygap.settings import visible

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = npt.NDArray[np.float64]

_SHADES = 10
"""Number of shades of fitness."""

_FAINTEST = 0.1
"""Share of the full color of the worst elite, so that it differs from an empty cell."""

_MOST_SLICES = 6
"""Maximum number of maps side by side: of an archive with more dimensions the best of the hidden cells is shown."""

_COLUMNS = ("condition", "replicate", "generation", "individual", "fitness", "descriptor")


def _again(condition: Condition, elites: pl.DataFrame) -> pl.DataFrame:
    """Return the elites with the means of fresh trials.

    Raises:
        TaskError: A function of a Python file is not allowed, or fails.
    """
    for function in condition.functions:
        if not function.may_run:
            raise TaskError(
                f"that runs {visible(function.kind)} (SHA-256 {function.sha256[:12]}…), and you have not allowed this "
                "file. `realitygap report --allow-code` runs it."
            )
    return retry_elites(condition, elites)


class _Shown(NamedTuple):
    """An archive that is shown: its title, its elites, and the names of the columns with cells and fitness."""

    title: str
    elites: pl.DataFrame
    cell: str
    fitness: str


def draw_elites(
    folder: Results,
    condition: str | None = None,
    replicate: int | None = None,
    *,
    name: str = "elites",
    played: Collection[tuple[int, int]] = (),
) -> Drawing:
    """Draw the archive of a run with MAP-Elites, as found and corrected, and its growth in all runs.

    Args:
        folder: Results of a study, or the path to them. Elites are tried again, `RETRIES` times each, unless that runs
            a Python file that the user has not allowed.
        condition: Condition. Default: the first with selection map-elites.
        replicate: Run. Default: the typical one, as in `draw_paths`.
        name: First part of the ids in the drawing.
        played: Generation and individual of the trials that the page can play: a click on a cell plays the last trial
            of its elite.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
        ValueError: there is no such condition or run, or its selection is another one.
    """
    tally = read_tally(folder)
    run = choose_run(tally, _chosen(tally, condition), replicate)
    elites = elites_of(run.condition, run.rows)
    n_cells = run.condition.archive.n_cells
    shown = {"found": _Shown("as found", elites, "cell", "fitness")}
    summary = (
        f"{elites.height:,} of {n_cells:,} cells are filled, with a mean fitness per cell of "
        f"{float(elites['fitness'].sum()) / n_cells:.3f}"
    )
    try:
        again = _again(run.condition, elites)
    except TaskError as error:
        summary += f", which lucky trials raise. The archive is not corrected: {str(error).removesuffix('.')}"
    else:
        corrected = corrected_archive(again)
        shown["corrected"] = _Shown("corrected", corrected, "again_cell", "again_fitness")
        summary += (
            f". By {RETRIES} fresh trials of each elite, "
            f"{float((again['cell'] == again['again_cell']).to_numpy().mean()):.0%} of them belong in their cell, and "
            f"{corrected.height:,} cells with {float(corrected['again_fitness'].sum()) / n_cells:.3f} are left "
            "(corrected)"
        )
    progress = _progress(tally, run)
    n_runs = progress["replicate"].n_unique()
    caption = (
        f"Archive of {run.name}, run {run.replicate}: {summary}. Stronger colors mark fitter elites, and cells without "
        f"color are empty. {_hidden(run.condition)}{run.label}, n = 1 run. Below: mean fitness per cell (an empty one "
        f"counts 0) as found, by trials; line: mean of {counted(n_runs, 'run')}, area: the range."
    )
    alt = f"Archive of run {run.replicate} of {run.name}. {summary}."
    maps = [_map(run.condition, each.elites[each.cell], each.elites[each.fitness]) for each in shown.values()]
    marks = [
        panel
        for what, each in shown.items()
        for panel in _panels(what, run, each.elites, (each.cell, each.fitness), played)
    ]
    most = max(float(np.nanmax(each, initial=0.0)) for each in maps) or 1.0

    def draw(width: float) -> Sheet:
        names = [[f"{what} {k}" for k in range(len(maps[0]))] for what in shown]
        wide = width >= IS_WIDE
        if len(maps[0]) == 1:
            places = [[name for row in names for name in row]] if wide else names
        else:
            places = names if wide else [list(row) for row in zip(*names, strict=True)]
        heights: list[float | None] = [1.6 if wide else 1.3] * len(places)
        places.append(["curve"] * len(places[0]))
        sheet = Sheet(width, places, [*heights, 1.5], gap=0.2, pad=0.25)
        for (what, each), slices in zip(shown.items(), maps, strict=True):
            for k, shares in enumerate(slices):
                axes = sheet.panels[f"{what} {k}"]
                axes.set_gid(f"{what}-{k}")
                _draw_map(axes, run.condition, shares / most, is_first=k == 0 or not wide)
                head(axes, each.title, _slice(run.condition, k, len(slices)), stacked=True)
        _draw_curve(sheet.panels["curve"], progress)
        head(sheet.panels["curve"], shorten(run.name, 28), f"{run.label}, n = {n_runs}")
        keys = [
            area_key(f"{share * most:.2f}", Ink.OURS, _alpha(share)) for share in (0.0, 0.25, 0.5, 0.75, 1.0)
        ]
        sheet.key(keys)
        return sheet

    return draw_wide(draw, name, caption, alt, marks=tuple(marks))


def _chosen(tally: Tally, condition: str | None) -> str:
    """A condition that has archives and runs."""
    names = [each["name"] for each in tally.selecting_by("map-elites")]
    if condition is None and names:
        return names[0]
    if condition is None:
        raise ValueError("No condition with runs has selection map-elites, so there is no archive.")
    if tally.condition(condition)["name"] not in names:
        raise ValueError(
            f"Condition {condition!r} has another selection than map-elites, so it has no archive."
        )
    return condition


def _progress(tally: Tally, run: ChosenRun) -> pl.DataFrame:
    also = ("parents", "tries") if run.condition.retries_elites else ()
    frames = tally.folder.frames(run.name, columns=(*_COLUMNS, *also))
    return pl.concat([archive_progress(run.condition, frame) for frame in frames])


def _shape(condition: Condition) -> tuple[int, int, int]:
    """Return the number of maps, and of cells up and across: the first two descriptors and the third."""
    archive = condition.archive
    if archive.kind == "cvt":
        across = math.ceil(math.sqrt(archive.n_cells))
        return 1, -(-archive.n_cells // across), across
    across, up, slices, *_ = (*archive.cells, 1, 1)
    return (slices if slices <= _MOST_SLICES else 1), up, across


def _map(condition: Condition, cells: pl.Series, fitness: pl.Series) -> Floats:
    """Return the fitness of the elites of each map, (slices, up, across), NaN for empty cells.

    Cells that differ in other descriptors only share a place; the fittest is shown. Those of a CVT are in the order of
    their numbers.
    """
    shown = np.full(_shape(condition), np.nan)
    np.fmax.at(shown, _places(condition, cells), fitness.to_numpy())
    return shown


def _places(condition: Condition, cells: pl.Series) -> tuple[npt.NDArray[np.int64], ...]:
    """Return the map, the row, and the column of each cell."""
    slices, _, across = _shape(condition)
    numbers = cells.to_numpy().astype(np.int64)
    if condition.archive.kind == "cvt":
        return (np.zeros_like(numbers), *np.divmod(numbers, across))
    x, *others = np.unravel_index(numbers, condition.archive.cells)
    y, z, *_ = (*others, np.zeros_like(numbers), np.zeros_like(numbers))
    return z if slices > 1 else np.zeros_like(numbers), y, x


def _shown(condition: Condition, elites: pl.DataFrame, cell: str, fitness: str) -> pl.DataFrame:
    """Return the elites that maps show, the fittest of each place: its map, row, column, and value; the best first."""
    slices, rows, columns = _places(condition, elites[cell])
    placed = elites.select("generation", "individual", value=pl.col(fitness)).with_columns(
        slice=slices, row=rows, column=columns
    )
    best = placed.sort("value", descending=True, maintain_order=True)
    return best.unique(["slice", "row", "column"], keep="first", maintain_order=True)


class EliteMaps(NamedTuple):
    """The elites of an archive as found, to be chosen on maps.

    Attributes:
        title: Label, condition, and run.
        replicate: Number of the run.
        columns, rows: Number of places across and up.
        axes: Names of the descriptors across and up; none for a CVT.
        ranges: Lowest and highest value of these.
        slices: Title of each map.
        elites: Map, column, row, fitness, generation, and individual of each elite that is shown.
    """

    title: str
    replicate: int
    columns: int
    rows: int
    axes: tuple[str, ...]
    ranges: tuple[tuple[float, float], ...]
    slices: tuple[str, ...]
    elites: tuple[tuple[int, int, int, float, int, int], ...]


def elite_maps(folder: Results, condition: str) -> EliteMaps | None:
    """Return the elites of the typical run of a condition, the fittest of many; None if its selection is another one.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
        ValueError: there is no such condition.
    """
    tally = read_tally(folder)
    if condition not in [each["name"] for each in tally.selecting_by("map-elites")]:
        return None
    run = choose_run(tally, condition)
    shown = _shown(run.condition, elites_of(run.condition, run.rows), "cell", "fitness").head(MOST_MARKS)
    n_slices, rows, columns = _shape(run.condition)
    n_axes = 0 if run.condition.archive.kind == "cvt" else min(2, len(run.condition.archive.cells))
    return EliteMaps(
        f"{run.label}: {run.name}, run {run.replicate}",
        run.replicate,
        columns,
        rows,
        run.condition.archive.names[:n_axes],
        run.condition.archive.ranges(run.arena)[:n_axes],
        tuple(_slice(run.condition, k, n_slices) for k in range(n_slices)),
        tuple(shown.select("slice", "column", "row", "value", "generation", "individual").iter_rows()),
    )


def _panels(
    what: str,
    run: ChosenRun,
    elites: pl.DataFrame,
    columns: tuple[str, str],
    played: Collection[tuple[int, int]],
) -> list[Panel]:
    """Return the marks of the elites that maps show: the fittest of each place."""
    best = _shown(run.condition, elites, *columns).head(MOST_MARKS // 2)
    link = f"#replay={quote(run.name, safe='')}/{run.replicate}/"
    panels = []
    for k in range(_shape(run.condition)[0]):
        series = []
        for (value,), group in best.filter(slice=k).group_by("value", maintain_order=True):
            trials = list(group.select("generation", "individual").iter_rows())
            order = sorted(range(len(trials)), key=[each not in played for each in trials].__getitem__)
            points = group.select("column", "row").to_numpy()[order] + 0.5
            labels = tuple("/".join(map(str, trials[i])) for i in order)
            n_played = sum(each in played for each in trials)
            text = "Mean fitness {name}, generation and individual {label}"
            series.append(Series(text, points, f"{value:.3f}", labels, link if n_played else "", n_played))
        panels.append(Panel(f"{what}-{k}", tuple(series), (1, 1)))
    return panels


def _hidden(condition: Condition) -> str:
    """Say what a map does not tell apart."""
    archive, (slices, *_) = condition.archive, _shape(condition)
    if archive.kind == "cvt":
        return "Cells are in the order of their numbers, which has no meaning. "
    hidden = archive.names[3 if slices > 1 else 2 :]
    return (
        f"Cells that differ only in {', '.join(hidden)} share a place, and the fittest is shown. "
        if hidden
        else ""
    )


def _slice(condition: Condition, k: int, n_slices: int) -> str:
    """Name the part of the third descriptor that a map shows."""
    if n_slices == 1:
        return ""
    low, high = condition.archive.ranges(condition.placed_arena)[2]
    edges = [low + (high - low) * each / n_slices for each in (k, k + 1)]
    return f"{condition.archive.names[2]} {edges[0]:.2g}–{edges[1]:.2g}"


def _alpha(share: float) -> float:
    return round(_FAINTEST + (1.0 - _FAINTEST) * share, 3)


def _draw_map(axes: Axes, condition: Condition, shares: Floats, *, is_first: bool) -> None:
    """Shade the cells of a map, (up, across): one area for each shade, which is faster than one for each cell."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    up, across = shares.shape
    shades = np.rint(np.clip(shares, 0.0, 1.0) * (_SHADES - 1))
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]])
    for shade in np.unique(shades[np.isfinite(shades)]):
        rows, columns = np.nonzero(shades == shade)
        vertices = (np.column_stack([columns, rows])[:, None] + square).reshape(-1, 2).astype(float)
        codes = np.tile([Path.MOVETO, *[Path.LINETO] * 3, Path.CLOSEPOLY], len(rows))
        alpha = _alpha(float(shade) / (_SHADES - 1))
        axes.add_artist(
            PathPatch(Path(vertices, codes), linewidth=0, zorder=0, facecolor=Ink.OURS, alpha=alpha)
        )
    axes.set_xlim(0, across)
    axes.set_ylim(0, up)
    if condition.archive.kind == "cvt":
        axes.set_xticks([])
        axes.set_yticks([])
        return
    names, ranges = condition.archive.names, condition.archive.ranges(condition.placed_arena)
    _label(axes, "x", across, names[:1], ranges[:1])
    _label(axes, "y", up, names[1:2] if is_first else (), ranges[1:2])


def _label(
    axes: Axes, which: str, n: int, names: Sequence[str], ranges: Sequence[tuple[float, float]]
) -> None:
    """Name a descriptor at its axis, and write the ends and the middle of its range."""
    axis = axes.xaxis if which == "x" else axes.yaxis
    if not names:
        axis.set_ticks([])
        return
    low, high = ranges[0]
    axis.set_ticks([0, n / 2, n], [f"{value:.3g}" for value in (low, (low + high) / 2, high)])
    axis.set_label_text(names[0])


def _draw_curve(axes: Axes, progress: pl.DataFrame) -> None:
    of_runs = (
        progress.group_by("trials")
        .agg(
            pl.col("qd_score").mean().alias("mean"),
            pl.col("qd_score").min().alias("low"),
            pl.col("qd_score").max().alias("high"),
        )
        .sort("trials")
    )
    trials = of_runs["trials"].to_numpy()
    axes.set_xlim(0, float(trials.max()))
    axes.set_ylim(0, float(of_runs["high"].to_numpy().max()) * 1.1 or 1.0)
    draw_band(axes, trials, of_runs["low"].to_numpy(), of_runs["high"].to_numpy())
    draw_line(axes, trials, of_runs["mean"].to_numpy(), **pen_style(1, 1.6))
    axes.set_xlabel("trials", labelpad=2)
    axes.set_ylabel("fitness per cell")
