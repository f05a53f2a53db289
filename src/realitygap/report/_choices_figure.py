"""The effect of each changed choice on the result: conditions compared with their baseline."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from realitygap._wording import counted
from realitygap.drawing import Ink
from realitygap.report._drawing import (
    Drawing,
    draw_wide,
    mark_key,
    new_figure,
    place_axes,
    shorten,
    wrap,
    write,
)
from realitygap.report._marks import Panel, Series
from realitygap.report._tally import Results, Tally, label_of, read_tally, settings_of
from realitygap.stats import MEDIAN_SMALLEST_N, Ends, median_interval, quartiles

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Choice:
    """A condition with its median, compared with its baseline.

    Attributes:
        condition: Name of the condition.
        baseline: Name of the condition with which it is compared; its own for a baseline.
        change: Difference from the baseline, in the study's words.
        label: SIM, TWIN, EMULATED or REAL.
        n: Number of runs.
        median: Median of the best coverage of each run [0..1]; NaN without runs.
        interval: Interval of the median; None if n is too small.
        effect: Median minus the baseline's median [0..1].
        other_median: Median with the other way to count cells, if selection counts them so; otherwise None.
        published: Published best coverages, one for each published run [0..1].
    """

    condition: str
    baseline: str
    change: str
    label: str
    n: int
    median: float
    interval: Ends | None
    effect: float
    other_median: float | None
    published: tuple[float, ...]


def compare_choices(folder: Results) -> list[list[Choice]]:
    """Compare every condition that names a baseline with it: one list per baseline.

    Returns:
        Each baseline, followed by its variants from the largest increase of the median to the largest decrease. Empty
        if no condition names a baseline.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
    """
    tally = read_tally(folder)
    names = [condition["name"] for condition in tally.conditions]
    groups: list[list[Choice]] = []
    for baseline in names:
        variants = [
            condition
            for condition in tally.conditions
            if condition.get("baseline") == baseline != condition["name"]
        ]
        if not variants:
            continue
        reference = _choice(tally, tally.condition(baseline), baseline, math.nan)
        choices = [_choice(tally, condition, baseline, reference.median) for condition in variants]
        choices.sort(
            key=lambda choice: (math.isnan(choice.effect), -choice.effect, names.index(choice.condition))
        )
        groups.append([reference, *choices])
    return groups


def _choice(tally: Tally, condition: Mapping[str, Any], baseline: str, reference: float) -> Choice:
    name = condition["name"]
    values = tally.run_bests(name, tally.measure)
    median = quartiles(values).median if len(values) else math.nan
    selected_by = settings_of(condition).get("task", {}).get("cells", tally.measure)
    other = None
    if selected_by != tally.measure and selected_by in ("line", "ends") and len(values):
        other = quartiles(tally.run_bests(name, selected_by)).median
    is_baseline = name == baseline
    return Choice(
        condition=name,
        baseline=baseline,
        change=name if is_baseline else str(condition.get("change") or name),
        label=label_of(condition),
        n=len(values),
        median=median,
        interval=median_interval(values).ends,
        effect=0.0 if is_baseline else median - reference,
        other_median=other,
        published=tuple(condition.get("published") or ()),
    )


def draw_choices(folder: Results) -> Drawing:
    """Draw the effect of each changed choice on the median best coverage, sorted, with intervals.

    Args:
        folder: Results of a study whose conditions name a baseline, or the path to them.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
        ValueError: no condition of the study names a baseline.
    """
    tally = read_tally(folder)
    groups = compare_choices(tally)
    if not groups:
        raise ValueError("No condition of this study names a baseline, so there are no choices to compare.")
    caption, alt = _caption(tally, groups), _alt(groups)
    return draw_wide(
        lambda width: _draw(groups, width), "choices", caption, alt, marks=lambda width: _marks(groups, width)
    )


# drawing


@dataclass(frozen=True)
class _Layout:
    """The positions of all parts in a figure of a given width [in]."""

    width: float

    @property
    def is_wide(self) -> bool:
        return self.width >= 6

    @property
    def letters(self) -> int:
        return int(self.plot_left / 0.073) if self.is_wide else int(self.width / 0.076)

    @property
    def plot_left(self) -> float:
        return 0.34 * self.width if self.is_wide else 0.2

    @property
    def plot_right(self) -> float:
        return self.width - (1.75 if self.is_wide else 0.62)

    def row_height(self, n_lines: int) -> float:
        return 0.1 + 0.145 * n_lines + (0.0 if self.is_wide else 0.19)

    def texts(self, group: list[Choice]) -> list[str]:
        return [wrap(choice.change, self.letters, 2 if self.is_wide else 3) for choice in group]

    def heights(self, texts: list[str]) -> list[float]:
        return [self.row_height(text.count("\n") + 1) for text in texts]

    def y_of_marks(self, start: float, end: float) -> float:
        return (start + end) / 2 if self.is_wide else end - 0.14


def _marks(groups: list[list[Choice]], width: float) -> tuple[Panel, ...]:
    """Return the values of each row, whose place depends on the lines of its words."""
    layout = _Layout(width)
    return tuple(
        Panel(f"choices-{k}", tuple(_marks_of_group(group, layout)), (3, 3)) for k, group in enumerate(groups)
    )


def _marks_of_group(group: list[Choice], layout: _Layout) -> Iterator[Series]:
    ends = np.concatenate([[0.0], np.cumsum(layout.heights(layout.texts(group)))])
    for choice, start, end in zip(group, ends[:-1], ends[1:], strict=True):
        if math.isnan(choice.median):
            continue
        y = layout.y_of_marks(start, end)
        interval = choice.interval
        within = "" if interval is None else f" [{interval[0]:.3f}, {interval[1]:.3f}]"
        effect = "" if choice is group[0] else f", {choice.effect:+.3f} to the baseline".replace("-", "−")
        shown = [(choice.median, f"median {choice.median:.3f}{within}{effect}, n = {choice.n:,}")]
        if choice.other_median is not None:
            shown.append((choice.other_median, f"median as its selection counts {choice.other_median:.3f}"))
        shown += [(value, f"a run of the paper {value:.3f}") for value in choice.published]
        points = np.array([(value, y) for value, _ in shown])
        yield Series("{name}: {label}", points, choice.change, tuple(label for _, label in shown))


def _draw(groups: list[list[Choice]], width: float) -> Figure:
    layout = _Layout(width)
    texts = [layout.texts(group) for group in groups]
    heights = [layout.heights(words) for words in texts]
    head, foot, legend = 0.42, 0.5, 0.3 if layout.is_wide else 0.52
    total = sum(head + sum(rows) + foot for rows in heights) + legend
    figure = new_figure(width, total)
    low, high = _range_of(groups)
    top = head
    for k, (group, words, rows) in enumerate(zip(groups, texts, heights, strict=True)):
        axes = place_axes(figure, layout.plot_left, top, layout.plot_right - layout.plot_left, sum(rows))
        axes.set_gid(f"choices-{k}")
        axes.set_xlim(low, high)
        _draw_group(axes, group, words, rows, layout)
        top += sum(rows) + foot + head
    _draw_legend(figure, groups, total - legend, layout)
    return figure


def _range_of(groups: list[list[Choice]]) -> tuple[float, float]:
    """Ends of the common axis: whole twentieths around everything shown."""
    shown: list[float] = []
    for choice in (choice for group in groups for choice in group):
        shown += [
            choice.median,
            *choice.published,
            *([choice.other_median] if choice.other_median is not None else []),
        ]
        shown += list(choice.interval) if choice.interval else []
    finite = [value for value in shown if math.isfinite(value)] or [0.0, 1.0]
    return max(0.0, math.floor(min(finite) * 20 - 0.2) / 20), min(1.0, math.ceil(max(finite) * 20 + 0.2) / 20)


def _draw_group(
    axes: Axes, group: list[Choice], words: list[str], rows: list[float], layout: _Layout
) -> None:
    reference = group[0]
    below = np.concatenate([[0.0], np.cumsum(rows)])
    axes.set_ylim(below[-1], 0.0)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    _set_ticks(axes, layout)
    axes.grid(axis="x", color=Ink.RULE, linewidth=0.5)
    axes.set_xlabel("best coverage of a run", labelpad=2)
    x_words = (0.02 - layout.plot_left) * 72
    _head(axes, group, x_words, layout)
    for index, (choice, text) in enumerate(zip(group, words, strict=True)):
        start, end = below[index], below[index + 1]
        y = layout.y_of_marks(start, end)
        _draw_reference(
            axes, reference, start if layout.is_wide else end - 0.23, end - (0.0 if layout.is_wide else 0.04)
        )
        _draw_choice(axes, choice, y, reference.median)
        is_reference = index == 0
        write(
            axes,
            text,
            (0.0, y if layout.is_wide else start + 0.06),
            (x_words, 0.0),
            8.0,
            xycoords=("axes fraction", "data"),
            va="center" if layout.is_wide else "top",
            weight="bold" if is_reference else "normal",
            linespacing=1.15,
        )
        _write_numbers(axes, choice, y, layout, is_reference=is_reference)
        if index:
            _draw_rule(axes, start, layout)


def _set_ticks(axes: Axes, layout: _Layout) -> None:
    from matplotlib.ticker import MultipleLocator

    low, high = axes.get_xlim()
    room = high - low if layout.is_wide else 2 * (high - low)
    step = 0.05 if room <= 0.45 else 0.1 if room <= 0.9 else 0.2
    axes.xaxis.set_major_locator(MultipleLocator(step))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:.{2 if step == 0.05 else 1}f}")


def _head(axes: Axes, group: list[Choice], x_words: float, layout: _Layout) -> None:
    counts = sorted({choice.n for choice in group})
    n = f"n = {counts[0]}" if len(counts) == 1 else f"n = {counts[0]} to {counts[-1]}"
    labels = ", ".join(sorted({choice.label for choice in group}))
    title = f"Changes to “{shorten(group[0].condition, 30)}”"
    write(axes, title, (0.0, 1.0), (x_words, 9.0), 9.0, va="bottom", weight="bold")
    right = (layout.width - layout.plot_right) * 72
    write(
        axes,
        f"{labels}, {n}" + (" runs each" if layout.is_wide else ""),
        (1.0, 1.0),
        (right - 2, 9.0),
        7.5,
        ha="right",
        va="bottom",
        color=Ink.MUTED,
    )


def _draw_reference(axes: Axes, reference: Choice, start: float, end: float) -> None:
    """The baseline's interval and median, over the height of a row's marks; words stay clear of it."""
    if reference.interval is not None:
        band = list(reference.interval)
        axes.fill_between(band, start, end, color=Ink.BAND, alpha=0.45, linewidth=0)
    if not math.isnan(reference.median):
        axes.plot([reference.median] * 2, [start, end], color=Ink.OURS, linewidth=0.8, solid_capstyle="butt")


def _draw_rule(axes: Axes, y: float, layout: _Layout) -> None:
    plot_width = layout.plot_right - layout.plot_left
    ends = [(0.02 - layout.plot_left) / plot_width, (layout.width - layout.plot_left) / plot_width]
    axes.plot(
        ends, [y, y], transform=axes.get_yaxis_transform(), color=Ink.RULE, linewidth=0.4, clip_on=False
    )


def _draw_choice(axes: Axes, choice: Choice, y: float, reference: float) -> None:
    if math.isnan(choice.median):
        return
    axes.plot([reference, choice.median], [y, y], color=Ink.OURS, linewidth=0.8, linestyle=(0, (1.5, 1.5)))
    if choice.interval is not None:
        axes.plot(
            list(choice.interval),
            [y, y],
            color=Ink.OURS,
            linewidth=2.2,
            solid_capstyle="butt",
        )
    axes.plot([choice.median], [y], "o", color=Ink.OURS, markersize=5.2)
    if choice.other_median is not None:
        axes.plot(
            [choice.other_median],
            [y],
            "s",
            color=Ink.OURS,
            markerfacecolor=Ink.GROUND,
            markersize=4.4,
            markeredgewidth=1.1,
        )
    if choice.published:
        axes.plot(
            choice.published,
            [y] * len(choice.published),
            "D",
            color=Ink.PUBLISHED,
            markerfacecolor=Ink.GROUND,
            markersize=4.0,
            markeredgewidth=1.1,
        )


def _write_numbers(axes: Axes, choice: Choice, y: float, layout: _Layout, *, is_reference: bool) -> None:
    far = (layout.width - layout.plot_right) * 72
    if is_reference:
        effect = "median" if not layout.is_wide else ""
    elif math.isnan(choice.effect):
        effect = "no runs"
    else:
        effect = f"{choice.effect:+.3f}".replace("-", "−")
        effect = "±0.000" if effect in ("+0.000", "−0.000") else effect
    middle = "" if math.isnan(choice.median) else f"{choice.median:.3f}"
    if layout.is_wide and choice.interval is not None:
        middle += f" [{choice.interval[0]:.3f}, {choice.interval[1]:.3f}]"
    items = [(far - 2, effect, "bold")]
    if layout.is_wide:
        items.append((far - 44, middle, "normal"))
    elif is_reference:
        items = [(far - 2, middle, "normal")]
    for x, text, weight in items:
        write(
            axes,
            text,
            (1.0, y),
            (x, 0.0),
            8.0 if weight == "bold" else 7.5,
            xycoords=("axes fraction", "data"),
            ha="right",
            va="center",
            weight=weight,
            color=Ink.TEXT if weight == "bold" else Ink.MUTED,
        )


def _draw_legend(figure: Figure, groups: list[list[Choice]], top: float, layout: _Layout) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    choices = [choice for group in groups for choice in group]
    handles: list[Any] = [
        Line2D([], [], color=Ink.OURS, linewidth=0, marker="o", markersize=5.2, label="median")
    ]
    if any(choice.interval for choice in choices):
        handles += [
            Line2D([], [], color=Ink.OURS, linewidth=2.2, label="its 95 % interval"),
            Patch(facecolor=Ink.BAND, alpha=0.45, label="the baseline’s interval"),
        ]
    if any(choice.other_median is not None for choice in choices):
        handles.append(
            mark_key(
                "median as its selection counts",
                "s",
                4.4,
                Ink.OURS,
                markeredgewidth=1.1,
                hollow=True,
                linestyle="-",
                linewidth=0,
            )
        )
    if any(choice.published for choice in choices):
        handles.append(
            mark_key(
                "the paper’s runs",
                "D",
                4.0,
                Ink.PUBLISHED,
                markeredgewidth=1.1,
                hollow=True,
                linestyle="-",
                linewidth=0,
            )
        )
    height = float(figure.get_size_inches()[1])
    figure.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.02 / layout.width, 1.0 - top / height),
        ncols=len(handles) if layout.is_wide else 2,
        frameon=False,
        fontsize=8.0 if layout.is_wide else 7.5,
        borderaxespad=0.0,
        borderpad=0.0,
        handlelength=1.6,
        columnspacing=1.4 if layout.is_wide else 1.0,
    )


# words


def _alt(groups: list[list[Choice]]) -> str:
    parts = []
    for group in groups:
        effects = ", ".join(
            f"{choice.change} {choice.effect:+.3f}" for choice in group[1:] if not math.isnan(choice.effect)
        )
        parts.append(
            f"Changes of the median best coverage from {group[0].condition} ({group[0].median:.3f}): "
            f"{effects}."
        )
    return " ".join(parts)


def _caption(tally: Tally, groups: list[list[Choice]]) -> str:
    choices = [choice for group in groups for choice in group]
    cells = "along the line driven" if tally.measure == "line" else "at the ends of steps"
    labels = " and ".join(sorted({choice.label for choice in choices}))
    counts = sorted({choice.n for choice in choices})
    n = counted(counts[-1], "run") if len(counts) == 1 else f"{counts[0]} to {counted(counts[-1], 'run')}"
    parts = [
        "Each row changes one choice and leaves all others as in the baseline. Dot: the median over runs of "
        f"the best coverage of a run, counted {cells}. {labels}, n = {n} for each condition.",
        "Bar: its exact 95 % interval from order statistics. Band: the baseline’s. "
        if min(counts) >= MEDIAN_SMALLEST_N
        else f"No interval below {MEDIAN_SMALLEST_N} runs. ",
        "Right: the change of the median. Rows are sorted by it.",
    ]
    if any(choice.other_median is not None for choice in choices):
        parts.append("Square: the same runs with cells counted as the changed selection counts them.")
    parts.append(
        "Intervals of single medians, not tests of differences; with many rows some differ by chance."
    )
    return " ".join(part.strip() for part in parts)
