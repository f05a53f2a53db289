"""Figure 4, best coverage by generation, and the scores of other tasks: one panel per condition."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from realitygap._wording import within
from realitygap.drawing import Ink
from realitygap.errors import RealityGapError
from realitygap.records import ResultsFolder
from realitygap.report._tally import (
    DescribedCondition,
    DescribedStudy,
    Results,
    Tally,
    bests_of,
    label_of,
    labeled_conditions,
    read_tally,
    replicates_of,
    settings_of,
    task_of,
)
from realitygap.report.charts.house import Drawing, draw_wide, letters_in, wrap
from realitygap.report.charts.lines import area_key, draw_rings, head, hollow, line_key, mark_key, write
from realitygap.report.charts.marks import MOST_MARKS, Panel, Series, decimals_for
from realitygap.report.charts.sheet import IS_WIDE, Sheet, grid
from realitygap.runs import Condition
from realitygap.stats import MEDIAN_SMALLEST_N, median_interval, quartiles

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
class RunsPanel:
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
    panels = [_coverage_panel(tally, condition, points) for condition in tally.conditions]
    caption = _caption(tally, panels, points)
    alt = (
        f"Best coverage by generation in {len(panels)} panels, one per condition: a line for each run, the "
        "median with its interval, and the best of the runs. Their numbers are in the table of results."
    )
    return draw_wide(
        lambda width: _draw_panels(panels, width, _coverage_axis(panels)),
        "coverage",
        caption,
        alt,
        marks=_marks_of(panels, 3),
    )


def draw_best(folder: ResultsFolder | str | Path) -> Drawing:
    """Draw the best score by generation: coverage if the study has it, otherwise the first score of its tasks.

    Args:
        folder: Results of a study, or the path to them.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
    """
    folder = folder if isinstance(folder, ResultsFolder) else ResultsFolder.open(folder)
    other = draw_scores(folder)
    if other and all(_score_of(condition) is not None for condition in labeled_conditions(folder)):
        return other[0]
    return draw_coverage(folder)


def draw_scores(folder: ResultsFolder | str | Path) -> list[Drawing]:
    """Best score by generation, for conditions of other tasks than coverage.

    Args:
        folder: Results of a study, or the path to them.

    Returns:
        One figure for each score; none if all conditions are of coverage, or have no runs.

    Raises:
        RecordError: there is no such folder, or a file in it is damaged.
    """
    folder = folder if isinstance(folder, ResultsFolder) else ResultsFolder.open(folder)
    panels: dict[tuple[str, float, float], list[RunsPanel]] = {}
    labels: dict[tuple[str, float, float], set[str]] = {}
    for condition in labeled_conditions(folder):
        score = _score_of(condition)
        if score is not None and len(values := bests_of(folder, condition["name"])):
            labels.setdefault(score, set()).add(label_of(condition))
            replicates = replicates_of(folder, condition["name"])
            panels.setdefault(score, []).append(
                _panel(condition, values, values.max(axis=1), replicates, published=())
            )
    return [
        _draw_score(score, group, sorted(labels[score]), f"scores-{number}")
        for number, (score, group) in enumerate(panels.items())
    ]


def _score_of(condition: DescribedCondition) -> tuple[str, float, float] | None:
    """Name, least and greatest value of a condition's score; None for coverage."""
    settings, kind = settings_of(condition), task_of(condition)
    if kind == "coverage":
        return None
    try:
        task = Condition.from_settings(condition["name"], dict(settings)).task_of_trials
        return (task.score_name, *task.score_range)
    except RealityGapError:  # settings of another version
        return f"score of {kind}", -np.inf, np.inf


def _draw_score(
    of: tuple[str, float, float], panels: list[RunsPanel], labels: Sequence[str], name: str
) -> Drawing:
    score, least, greatest = of
    axis = _score_axis(score, panels, least, greatest)
    caption = (
        f"Best {score} by generation. {_say_runs(panels)} Blue: median{_say_interval(panels)}. Gray column: best of "
        f"whole runs, with median, interval, and quartiles. {' and '.join(labels)}, n in each panel."
    )
    alt = (
        f"Best {score} by generation in {len(panels)} panels, one per condition: a line for each run, the median with "
        "its interval, and the best of the runs. Their numbers are in the table of scores."
    )
    marks = _marks_of(panels, decimals_for(np.concatenate([panel.run_bests for panel in panels])))
    return draw_wide(lambda width: _draw_panels(panels, width, axis), name, caption, alt, marks=marks)


def _points_of(description: DescribedStudy) -> Points:
    points = (description.get("report") or {}).get("points")
    return "best-so-far" if points == "best-so-far" else "best-of-generation"


def _coverage_panel(tally: Tally, condition: DescribedCondition, points: Points) -> RunsPanel:
    name = condition["name"]
    values = tally.generation_bests(name, tally.measure)
    if points == "best-so-far":
        values = (
            np.where(np.isnan(values), np.nan, np.fmax.accumulate(values, axis=1)) if values.size else values
        )
    replicates = tuple(int(run) for run in tally.replicates(name))
    bests = tally.run_bests(name, tally.measure)
    return _panel(condition, values, bests, replicates, tuple(condition.get("published") or ()))


def _panel(
    condition: DescribedCondition,
    values: npt.NDArray[np.float64],
    run_bests: npt.NDArray[np.float64],
    replicates: tuple[int, ...],
    published: tuple[float, ...],
) -> RunsPanel:
    note = f"{label_of(condition)}, n = {len(values)}"
    n_drawn = _count_drawable(values)
    return RunsPanel(condition["name"], note, values, n_drawn, run_bests, published, replicates)


def _count_drawable(values: npt.NDArray[np.float64]) -> int:
    """Number of runs, from the first, whose distinct pieces of lines are few enough; `values` is (n, g)."""
    n_drawn = len(values)
    while n_drawn > 1 and sum(len(counts) for _, counts in _segments(values[:n_drawn])) > _MOST_SEGMENTS:
        n_drawn = max(1, n_drawn // 2)
    return n_drawn


def _segments(values: npt.NDArray[np.float64]) -> list[tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]]:
    """Return distinct values in a generation and the next, (m, 2), with their numbers of runs, (m,), by generation."""
    panels = []
    for left in range(values.shape[1] - 1):
        pairs = values[:, left : left + 2]
        pairs = pairs[np.isfinite(pairs).all(axis=1)]
        distinct, counts = np.unique(np.round(pairs, 9), axis=0, return_counts=True)
        panels.append((distinct, counts))
    return panels


def _marks_of(panels: Sequence[RunsPanel], decimals: int) -> tuple[Panel, ...]:
    """Return what a page shows on hover: the median with its interval, and the first runs of each panel."""
    n_marks = sum(panel.values.shape[1] for panel in panels)
    n_runs = max(1, MOST_MARKS // max(1, n_marks))
    return tuple(
        Panel(f"panel-{index}", _series(panel, n_runs, decimals), (0, decimals))
        for index, panel in enumerate(panels)
    )


def _series(panel: RunsPanel, n_runs: int, decimals: int) -> tuple[Series, ...]:
    if not len(panel.values):
        return ()
    medians = []
    notes = []
    for values in panel.values.T:
        known = values[np.isfinite(values)]
        medians.append(float(np.median(known)))
        notes.append(f"{within(median_interval(known).ends, decimals)}, n = {len(known):,}")
    text = f"{panel.title}, generation {{x}}: median {{y}}{{label}}"
    series = [Series(text, np.column_stack([np.arange(len(medians)), medians]), labels=tuple(notes))]
    for run, values in zip(panel.replicates[:n_runs], panel.values[:n_runs], strict=True):
        known = np.isfinite(values)
        points = np.column_stack([np.flatnonzero(known), values[known]])
        series.append(Series(f"{panel.title}, run {{name}}, generation {{x}}: {{y}}", points, str(run)))
    return tuple(series)


# drawing


def _draw_panels(panels: list[RunsPanel], width: float, axis: Axis) -> Sheet:
    """Return a figure of this width [in] with a panel for each condition, and a legend."""
    n_columns = min(len(panels), 2 if width < IS_WIDE else 3 if len(panels) <= 9 else 4)
    sheet, places = grid(
        width, len(panels), n_columns, min(1.75, max(1.15, 0.55 * width / n_columns - 0.3)), gap=0.2
    )
    letters = letters_in((width - 0.6) / n_columns)
    stacked = any(len(panel.title) + len(panel.note) + 1 > letters for panel in panels)
    for index, (panel, axes) in enumerate(zip(panels, places, strict=True)):
        axes.set_gid(f"panel-{index}")
        _draw_panel(axes, panel, axis)
        head(axes, wrap(panel.title, letters), panel.note, stacked=stacked)
        if index % n_columns == 0:
            axes.set_ylabel(wrap(axis.label, 20), labelpad=4)
        else:
            axes.tick_params(labelleft=False)
        if index + n_columns >= len(panels):
            axes.set_xlabel("generation", labelpad=2)
    handles = [
        line_key("one run", color=Ink.RUN, linewidth=0.8, alpha=0.7),
        line_key("median", color=Ink.OURS, linewidth=1.7, marker="o", markersize=3.4),
    ]
    if any(len(panel.values) >= MEDIAN_SMALLEST_N for panel in panels):
        handles.append(area_key("95 % interval of the median", Ink.BAND))
    if any(len(panel.values) > 1 for panel in panels):
        handles.append(line_key("quartiles, best of run", color=Ink.OURS, linewidth=1.0))
    if any(panel.published for panel in panels):
        handles.append(mark_key("the paper’s runs", "D", 4.2, **hollow(Ink.PUBLISHED)))
    sheet.key(handles)
    return sheet


def _coverage_axis(panels: list[RunsPanel]) -> Axis:
    """Set the axis from 0 to the next tenth above all values."""
    highest = max([0.1, *(float(p.run_bests.max()) for p in panels if len(p.run_bests))])
    highest = max([highest, *(value for panel in panels for value in panel.published)])
    top = min(1.0, math.ceil(highest * 10 + 0.2) / 10)
    ticks = np.arange(0.0, top + 1e-9, 0.1 if top <= 0.6 else 0.2)
    return Axis("coverage", 0.0, top, tuple(ticks.tolist()), 1)


def _score_axis(score: str, panels: Sequence[RunsPanel], least: float, greatest: float) -> Axis:
    """An axis with round numbers around everything shown, and no value that a score cannot have."""
    from matplotlib.ticker import MaxNLocator

    shown = np.concatenate([panel.values.ravel() for panel in panels])
    low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
    if high - low < 1e-9:
        low, high = max(low - 0.5, least), min(high + 0.5, greatest)
    ticks = np.asarray(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high))
    step = float(ticks[1] - ticks[0])
    decimals = next(d for d in range(12) if abs(round(step, d) - step) < 1e-9 * step)
    ticks = ticks[(ticks >= least - 1e-9) & (ticks <= greatest + 1e-9)]
    return Axis(
        score, min(low, float(ticks[0])), max(high, float(ticks[-1])), tuple(ticks.tolist()), decimals
    )


def _draw_panel(axes: Axes, panel: RunsPanel, axis: Axis) -> None:
    n_generations = max(1, panel.values.shape[1])
    step = max(1.0, 0.2 * n_generations)
    side = n_generations - 1 + step  # the place of the best of whole runs
    axes.set_xlim(-0.25 * step, side + 0.6 * step)
    axes.set_ylim(axis.low, axis.high)
    axes.set_yticks(axis.ticks)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:.{axis.decimals}f}")
    axes.grid(axis="y", color=Ink.RULE, linewidth=0.5)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    between = next(each for each in (1, 2, 5, 10, 20, 50, 100, 10**9) if n_generations <= 8 * each)
    ticks = range(0, n_generations, between)
    axes.set_xticks([*ticks, side], [*map(str, ticks), "run"])
    axes.axvspan(side - 0.55 * step, side + 0.6 * step, color=Ink.RULE, alpha=0.35, linewidth=0)
    if len(panel.values):
        _draw_runs(axes, panel.values[: panel.n_drawn])
        _draw_median(axes, panel.values)
        _draw_best_of_runs(axes, panel.run_bests, side - 0.3 * step)
    else:
        write(axes, "no runs yet", (0.45, 0.5), (0, 0), 8.0, ha="center", color=Ink.MUTED)
    # side by side in the order of the paper's runs, since two of them may be equal
    xs = np.linspace(side, side + 0.42 * step, len(panel.published))
    draw_rings(axes, xs, panel.published, 4.0, Ink.PUBLISHED, marker="D", clip_on=False)


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
        known = values[:, generation][np.isfinite(values[:, generation])]
        generations.append(generation)
        medians.append(float(np.median(known)))
        interval = median_interval(known).ends
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


# words


def _caption(tally: Tally, panels: list[RunsPanel], points: Points) -> str:
    each = "Best coverage" if points == "best-of-generation" else "Best coverage so far"
    parts = [
        f"{each} by generation (cells {tally.counted}).",
        _say_runs(panels),
        f"Blue: median{_say_interval(panels)}. Gray column: best of whole runs, with median, interval, and quartiles.",
        f"{' and '.join(tally.labels)}, n in each panel.",
    ]
    cells = {settings_of(condition).get("task", {}).get("cells") for condition in tally.conditions}
    if len(cells - {None}) > 1:
        parts.append("All panels count cells in this way, whichever way selection counts them.")
    return " ".join(parts)


def _say_runs(panels: list[RunsPanel]) -> str:
    """Return a sentence on which lines are runs, and whether some are left out."""
    cut = [panel for panel in panels if panel.n_drawn < len(panel.values)]
    if cut:
        drawn = ", ".join(f"{panel.n_drawn} of {len(panel.values)} in {panel.title}" for panel in cut)
        return f"Gray: the first runs ({drawn}); medians and intervals use all runs."
    return "Gray: every run. Darker segments are shared by several runs."


def _say_interval(panels: list[RunsPanel]) -> str:
    """Return a sentence on the intervals of the medians."""
    counts = [len(panel.values) for panel in panels]
    if max(counts) < MEDIAN_SMALLEST_N:
        return f" (a 95 % interval needs {MEDIAN_SMALLEST_N} runs)"
    missing = f", from {MEDIAN_SMALLEST_N} runs on" if min(counts) < MEDIAN_SMALLEST_N else ""
    return f" with its exact 95 % interval{missing}"
