"""Figure 4: best coverage by generation, one panel per condition."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from realitygap.drawing import Ink
from realitygap.report._drawing import (
    Drawing,
    draw_wide,
    mark_key,
    new_figure,
    place_axes,
    wrap,
    write,
)
from realitygap.report._marks import MOST_MARKS, Series
from realitygap.report._marks import Panel as MarkedPanel
from realitygap.report._tally import Results, Tally, label_of, read_tally, settings_of
from realitygap.stats import MEDIAN_SMALLEST_N, median_interval, quartiles

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Points = Literal["best-of-generation", "best-so-far"]

_MOST_SEGMENTS = 4000
"""Distinct pieces of lines in one panel; more would make the page heavy and the panel black."""

_SHADES = 12
"""Number of opacities that show how many runs share a piece of line."""


@dataclass(frozen=True)
class Axis:
    """The common vertical axis of all panels.

    Attributes:
        label: Name of the score, with its unit.
        low: Lower end.
        high: Upper end.
        ticks: Values with a line and a number.
        decimals: Number of decimals of these numbers.
    """

    label: str
    low: float
    high: float
    ticks: tuple[float, ...]
    decimals: int


@dataclass(frozen=True)
class Panel:
    """The runs of one condition.

    Attributes:
        title: Name of the condition.
        note: Label and number of runs.
        values: (n, g) score of each run by generation, NaN after a run's last generation.
        n_drawn: Number of runs, from the first, whose lines are drawn.
        run_bests: (n,) best score of each run.
        published: Published best scores, one for each published run.
        replicates: (n,) number of each run; a page shows them on hover.
    """

    title: str
    note: str
    values: npt.NDArray[np.float64]
    n_drawn: int
    run_bests: npt.NDArray[np.float64]
    published: tuple[float, ...]
    replicates: tuple[int, ...]


def draw_coverage(folder: Results, *, points: Points | None = None) -> Drawing:
    """Best coverage by generation, as the paper's Figure 4, with every condition and every run.

    Args:
        folder: Results of a study, or the path to them.
        points: Value of a run's line at each generation: the best of that generation, or the best so far. Default: the
            study's own choice.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
    """
    tally = read_tally(folder)
    points = points or _points_of(tally.description)
    panels = [_panel(tally, condition, points) for condition in tally.conditions]
    caption = _caption(tally, panels, points)
    alt = (
        f"Best coverage by generation in {len(panels)} panels, one per condition: a line for each run, the "
        "median with its interval, and the best of the runs. Their numbers are in the table of results."
    )
    return draw_wide(
        lambda width: draw_panels(panels, width, _coverage_axis(panels)),
        "coverage",
        caption,
        alt,
        marks=marks_of(panels, 3),
    )


def _points_of(description: Mapping[str, Any]) -> Points:
    points = (description.get("report") or {}).get("points")
    return "best-so-far" if points == "best-so-far" else "best-of-generation"


def _panel(tally: Tally, condition: Mapping[str, Any], points: Points) -> Panel:
    name = condition["name"]
    values = tally.generation_bests(name, tally.measure)
    if points == "best-so-far":
        values = (
            np.where(np.isnan(values), np.nan, np.fmax.accumulate(values, axis=1)) if values.size else values
        )
    return Panel(
        title=name,
        note=f"{label_of(condition)}, n = {len(values)}",
        values=values,
        n_drawn=count_drawable(values),
        run_bests=tally.run_bests(name, tally.measure),
        published=tuple(condition.get("published") or ()),
        replicates=tuple(int(run) for run in tally.replicates(name)),
    )


def count_drawable(values: npt.NDArray[np.float64]) -> int:
    """Number of runs, from the first, whose distinct pieces of lines are few enough; `values` is (n, g)."""
    n_drawn = len(values)
    while n_drawn > 1 and sum(len(counts) for _, counts in _segments(values[:n_drawn])) > _MOST_SEGMENTS:
        n_drawn = max(1, n_drawn // 2)
    return n_drawn


def _segments(values: npt.NDArray[np.float64]) -> list[tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]]:
    """Return distinct values in a generation and the next, (m, 2), with their numbers of runs, (m,), by generation."""
    found = []
    for left in range(values.shape[1] - 1):
        pairs = values[:, left : left + 2]
        pairs = pairs[np.isfinite(pairs).all(axis=1)]
        distinct, counts = np.unique(np.round(pairs, 9), axis=0, return_counts=True)
        found.append((distinct, counts))
    return found


def marks_of(panels: Sequence[Panel], decimals: int) -> tuple[MarkedPanel, ...]:
    """Return what a page shows on hover: the median with its interval, and the first runs of each panel."""
    n_marks = sum(panel.values.shape[1] for panel in panels)
    n_runs = max(1, MOST_MARKS // max(1, n_marks))
    return tuple(
        MarkedPanel(f"panel-{index}", _series(panel, n_runs, decimals), (0, decimals))
        for index, panel in enumerate(panels)
    )


def _series(panel: Panel, n_runs: int, decimals: int) -> tuple[Series, ...]:
    if not len(panel.values):
        return ()
    medians = []
    notes = []
    for values in panel.values.T:
        there = values[np.isfinite(values)]
        interval = median_interval(there).ends
        within = "" if interval is None else f" [{interval[0]:.{decimals}f}, {interval[1]:.{decimals}f}]"
        medians.append(float(np.median(there)))
        notes.append(f"{within}, n = {len(there):,}")
    text = f"{panel.title}, generation {{x}}: median {{y}}{{label}}"
    series = [Series(text, np.column_stack([np.arange(len(medians)), medians]), labels=tuple(notes))]
    for run, values in zip(panel.replicates[:n_runs], panel.values[:n_runs], strict=True):
        there = np.isfinite(values)
        points = np.column_stack([np.flatnonzero(there), values[there]])
        series.append(Series(f"{panel.title}, run {{name}}, generation {{x}}: {{y}}", points, str(run)))
    return tuple(series)


# drawing


def draw_panels(panels: list[Panel], width: float, axis: Axis) -> Figure:
    """Return a figure of this width [in] with a panel for each condition, and a legend."""
    n_columns = _columns(len(panels), width)
    n_rows = math.ceil(len(panels) / n_columns)
    left, right, gap = 0.56 + 0.07 * max(0, len(f"{axis.high:.{axis.decimals}f}") - 3), 0.06, 0.22
    panel_width = (width - left - right - gap * (n_columns - 1)) / n_columns
    panel_height = min(1.75, max(1.15, 0.55 * panel_width))
    letters = int(panel_width / 0.078)
    notes_below = any(len(panel.title) + len(panel.note) + 1 > letters for panel in panels)
    n_lines = max(wrap(panel.title, letters).count("\n") for panel in panels) + 1
    title_height = 0.2 + 0.145 * (n_lines + notes_below)
    tick_height, legend_height = 0.24, 0.62 if width >= 6 else 0.98
    height = n_rows * (title_height + panel_height + tick_height) + legend_height
    figure = new_figure(width, height)
    for index, panel in enumerate(panels):
        row, column = divmod(index, n_columns)
        x = left + column * (panel_width + gap)
        y = row * (title_height + panel_height + tick_height) + title_height
        axes = place_axes(figure, x, y, panel_width, panel_height)
        axes.set_gid(f"panel-{index}")
        _draw_panel(axes, panel, axis, first_column=column == 0)
        _write_title(axes, panel, letters, note_below=notes_below)
        if column == 0:
            axes.set_ylabel(wrap(axis.label, int(panel_height / 0.078)), labelpad=4)
        if index + n_columns >= len(panels):
            axes.set_xlabel("generation", labelpad=2)
    _draw_legend(figure, panels, left if width >= 6 else 0.1, height - legend_height + 0.3, width)
    return figure


def _columns(n_panels: int, width: float) -> int:
    if width < 6:
        return min(n_panels, 1 if n_panels <= 9 else 2)
    return min(n_panels, 3 if n_panels <= 9 else 4)


def _coverage_axis(panels: list[Panel]) -> Axis:
    """Set the axis from 0 to the next tenth above all values."""
    highest = max([0.1, *(float(p.run_bests.max()) for p in panels if len(p.run_bests))])
    highest = max([highest, *(value for panel in panels for value in panel.published)])
    top = min(1.0, math.ceil(highest * 10 + 0.2) / 10)
    ticks = np.arange(0.0, top + 1e-9, 0.1 if top <= 0.6 else 0.2)
    return Axis("coverage", 0.0, top, tuple(ticks.tolist()), 1)


def _draw_panel(axes: Axes, panel: Panel, axis: Axis, *, first_column: bool) -> None:
    n_generations = max(1, panel.values.shape[1])
    side = n_generations - 1 + _side_offset(n_generations)
    step = _side_offset(n_generations)
    axes.set_xlim(-0.25 * step, side + 0.6 * step)
    axes.set_ylim(axis.low, axis.high)
    axes.set_yticks(axis.ticks)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:.{axis.decimals}f}")
    axes.grid(axis="y", color=Ink.RULE, linewidth=0.5)
    axes.tick_params(axis="y", length=0, labelleft=first_column)
    axes.spines["left"].set_visible(False)
    ticks = _generation_ticks(n_generations)
    axes.set_xticks([*ticks, side], [*map(str, ticks), "run"])
    axes.axvspan(side - 0.55 * step, side + 0.6 * step, color=Ink.RULE, alpha=0.35, linewidth=0)
    if len(panel.values):
        _draw_runs(axes, panel.values[: panel.n_drawn])
        _draw_median(axes, panel.values)
        _draw_best_of_runs(axes, panel.run_bests, side - 0.3 * step)
    else:
        axes.text(0.45, 0.5, "no runs yet", transform=axes.transAxes, ha="center", color=Ink.MUTED)
    if panel.published:
        # side by side in the order of the paper's runs, since two of them may be equal
        x = np.linspace(side, side + 0.42 * step, len(panel.published))
        axes.plot(
            x,
            panel.published,
            "D",
            markersize=4.0,
            color=Ink.PUBLISHED,
            markerfacecolor=Ink.GROUND,
            markeredgewidth=1.1,
            clip_on=False,
        )


def _write_title(axes: Axes, panel: Panel, letters: int, *, note_below: bool) -> None:
    title = wrap(panel.title, letters)
    axes.set_title(
        title, loc="left", fontsize=8.5, weight="bold", linespacing=1.1, pad=17 if note_below else 5
    )
    write(
        axes,
        panel.note,
        (0.0 if note_below else 1.0, 1.0),
        (0.0, 5.0),
        7.5,
        ha="left" if note_below else "right",
        va="bottom",
        color=Ink.MUTED,
    )


def _side_offset(n_generations: int) -> float:
    """Return the distance from the last generation to the mark of the run's best on its right [generations]."""
    return max(1.0, 0.2 * n_generations)


def _generation_ticks(n_generations: int) -> list[int]:
    step = next(step for step in (1, 2, 5, 10, 20, 50, 100, 10**9) if n_generations <= 8 * step)
    return list(range(0, n_generations, step))


def _draw_runs(axes: Axes, values: npt.NDArray[np.float64]) -> None:
    """A faint line for each run: a piece that k runs share is as dark as k translucent lines."""
    single = min(0.45, max(0.035, 9.0 / len(values)))
    if values.shape[1] == 1:
        distinct, counts = np.unique(np.round(values[:, 0], 9), return_counts=True)
        for value, count in zip(distinct, counts, strict=True):
            axes.plot([0], [value], "_", markersize=14, color=Ink.RUN, alpha=_opacity(single, count))
        return
    shades: dict[float, list[npt.NDArray[np.float64]]] = {}
    for left, (distinct, counts) in enumerate(_segments(values)):
        for pair, count in zip(distinct, counts, strict=True):
            piece = np.array([[left, pair[0]], [left + 1, pair[1]]])
            shades.setdefault(_opacity(single, count), []).append(piece)
    for opacity, pieces in sorted(shades.items()):
        # one path for all pieces of a shade, with gaps between them
        gap = np.full((1, 2), np.nan)
        line = np.concatenate([part for piece in pieces for part in (piece, gap)])
        axes.plot(line[:, 0], line[:, 1], color=Ink.RUN, alpha=opacity, linewidth=0.8, solid_capstyle="round")


def _opacity(single: float, count: int) -> float:
    """Return the combined opacity of `count` lines of opacity `single`, rounded up to one of a few steps."""
    opacity = 1.0 - (1.0 - single) ** int(count)
    return math.ceil(opacity * _SHADES) / _SHADES


def _draw_median(axes: Axes, values: npt.NDArray[np.float64]) -> None:
    generations, medians, bands = [], [], []
    for generation in range(values.shape[1]):
        there = values[:, generation][np.isfinite(values[:, generation])]
        generations.append(generation)
        medians.append(float(np.median(there)))
        interval = median_interval(there).ends
        bands.append(interval or (np.nan, np.nan))
    low, high = np.array(bands).T
    if len(generations) == 1:
        axes.plot([0, 0], [low[0], high[0]], color=Ink.BAND, linewidth=7, solid_capstyle="butt", alpha=0.75)
        axes.plot(generations, medians, "o", color=Ink.OURS, markersize=4.5)
        return
    if np.isfinite(low).any():
        axes.fill_between(generations, low, high, color=Ink.BAND, alpha=0.75, linewidth=0)
    many = len(generations) > 30
    axes.plot(generations, medians, color=Ink.OURS, linewidth=1.7, marker="" if many else "o", markersize=3.4)


def _draw_best_of_runs(axes: Axes, bests: npt.NDArray[np.float64], x: float) -> None:
    """Quartiles as a thin bar, the median's interval as a thick one, the median as a dot."""
    middle = quartiles(bests)
    interval = median_interval(bests).ends
    if len(bests) > 1:
        axes.plot([x, x], [middle.q25, middle.q75], color=Ink.OURS, linewidth=1.0, solid_capstyle="butt")
    if interval is not None:
        axes.plot([x, x], interval, color=Ink.BAND, linewidth=6, solid_capstyle="butt")
    axes.plot([x], [middle.median], "o", color=Ink.OURS, markersize=4.2)


def _draw_legend(figure: Figure, panels: list[Panel], left: float, top: float, width: float) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = [
        Line2D([], [], color=Ink.RUN, linewidth=0.8, alpha=0.7, label="one run"),
        Line2D([], [], color=Ink.OURS, linewidth=1.7, marker="o", markersize=3.4, label="median"),
    ]
    if any(len(panel.values) >= MEDIAN_SMALLEST_N for panel in panels):
        handles.append(Patch(facecolor=Ink.BAND, label="95 % interval of the median"))
    if any(len(panel.values) > 1 for panel in panels):
        handles.append(Line2D([], [], color=Ink.OURS, linewidth=1.0, label="quartiles, best of run"))
    if any(panel.published for panel in panels):
        handles.append(
            mark_key("the paper’s runs", "D", 4.2, Ink.PUBLISHED, markeredgewidth=1.1, hollow=True)
        )
    height = float(figure.get_size_inches()[1])
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(left / width, 1.0 - top / height),
        ncols=len(handles) if width >= 6 else 2,
        frameon=False,
        fontsize=8.0,
        borderaxespad=0.0,
        borderpad=0.0,
        handlelength=1.6,
        columnspacing=1.4,
    )


# words


def _caption(tally: Tally, panels: list[Panel], points: Points) -> str:
    labels = sorted({label_of(condition) for condition in tally.conditions})
    each = "Best coverage of each generation" if points == "best-of-generation" else "Best coverage so far"
    counted = "along the line driven" if tally.measure == "line" else "at the ends of steps"
    parts = [
        f"{each}, counted {counted}, by generation (from 0). {' and '.join(labels)}.",
        say_runs(panels),
        f"Blue: the median over the runs{say_interval(panels)}.",
        "Gray column, “run”: the best of whole runs, with its median, interval and quartiles"
        + (", beside the values that the paper prints." if any(panel.published for panel in panels) else "."),
    ]
    cells = {settings_of(condition).get("task", {}).get("cells") for condition in tally.conditions}
    if len(cells - {None}) > 1:
        parts.append("All panels count cells in this one way, also where selection counts them in the other.")
    return " ".join(parts)


def say_runs(panels: list[Panel]) -> str:
    """Return a sentence on which lines are runs, and whether some are left out."""
    cut = [panel for panel in panels if panel.n_drawn < len(panel.values)]
    if cut:
        drawn = ", ".join(f"{panel.n_drawn} of {len(panel.values)} in {panel.title}" for panel in cut)
        return (
            f"Gray: one line a run; only the first runs are drawn where all would be too many ({drawn}); "
            "medians and intervals are of all runs."
        )
    return "Gray: every run; a piece of line that several runs share is stronger."


def say_interval(panels: list[Panel]) -> str:
    """Return a sentence on the intervals of the medians."""
    counts = [len(panel.values) for panel in panels]
    if max(counts) < MEDIAN_SMALLEST_N:
        return f" (no interval: fewer than {MEDIAN_SMALLEST_N} runs cannot give one of 95 %)"
    missing = f", not drawn below {MEDIAN_SMALLEST_N} runs" if min(counts) < MEDIAN_SMALLEST_N else ""
    return f" with its exact 95 % interval from order statistics{missing}"
