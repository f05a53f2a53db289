"""The effect of each changed choice on the result: conditions compared with their baseline."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from realitygap._wording import count_range, counted_range, signed, within
from realitygap.drawing import Ink
from realitygap.report._tally import DescribedCondition, Results, Tally, label_of, read_tally, settings_of
from realitygap.report.charts.house import Drawing, draw_wide, shorten, wrap
from realitygap.report.charts.lines import (
    Dash,
    TextStyle,
    area_key,
    draw_line,
    draw_rings,
    head,
    hollow,
    line_key,
    mark_key,
    write,
)
from realitygap.report.charts.marks import Panel, Series
from realitygap.report.charts.rows import Row, draw_row
from realitygap.report.charts.sheet import IS_WIDE, Sheet
from realitygap.stats import MEDIAN_SMALLEST_N, Ends, median_interval, quartiles

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes


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


def _choice(tally: Tally, condition: DescribedCondition, baseline: str, reference: float) -> Choice:
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

_BESIDE = ("axes fraction", "data")
_LINE = 0.145  # height of a line of words [in]


@dataclass(frozen=True)
class _Group:
    """The rows of a baseline and its variants in a figure of a width: words, and places from the top [in]."""

    choices: list[Choice]
    is_wide: bool

    @property
    def words(self) -> list[str]:
        return [
            wrap(choice.change, 44 if self.is_wide else 48, 2 if self.is_wide else 3)
            for choice in self.choices
        ]

    @property
    def edges(self) -> npt.NDArray[np.float64]:
        """(n + 1,) upper and lower edges of the rows."""
        above = 0.1 if self.is_wide else 0.29
        return np.cumsum([0.0, *(above + _LINE * (words.count("\n") + 1) for words in self.words)])

    @property
    def places(self) -> list[float]:
        """Heights of the marks: in the middle of a row, or under its words."""
        return [
            float((start + end) / 2 if self.is_wide else end - 0.14)
            for start, end in itertools.pairwise(self.edges)
        ]


def _marks(groups: list[list[Choice]], width: float) -> tuple[Panel, ...]:
    """Return the values of each row, whose place depends on the lines of its words."""
    return tuple(
        Panel(f"choices-{k}", tuple(_marks_of_group(_Group(group, width >= IS_WIDE))), (3, 3))
        for k, group in enumerate(groups)
    )


def _marks_of_group(group: _Group) -> Iterator[Series]:
    for choice, y in zip(group.choices, group.places, strict=True):
        if math.isnan(choice.median):
            continue
        effect = (
            "" if choice is group.choices[0] else f", {choice.effect:+.3f} to the baseline".replace("-", "−")
        )
        shown = [
            (choice.median, f"median {choice.median:.3f}{within(choice.interval)}{effect}, n = {choice.n:,}")
        ]
        if choice.other_median is not None:
            shown.append((choice.other_median, f"median as its selection counts {choice.other_median:.3f}"))
        shown += [(value, f"a run of the paper {value:.3f}") for value in choice.published]
        points = np.array([(value, y) for value, _ in shown])
        yield Series("{name}: {label}", points, choice.change, tuple(label for _, label in shown))


def _draw(groups: list[list[Choice]], width: float) -> Sheet:
    rows = [_Group(choices, width >= IS_WIDE) for choices in groups]
    sheet = Sheet(
        width, [[str(k)] for k in range(len(rows))], [float(each.edges[-1]) for each in rows], pad=0.24
    )
    ends = _range_of(groups)
    for k, group in enumerate(rows):
        axes = sheet.panels[str(k)]
        axes.set_gid(f"choices-{k}")
        axes.set_xlim(*ends)
        _draw_group(axes, group)
    sheet.key(_key(groups))
    sheet.settle()
    for k, group in enumerate(rows):
        _draw_rules(sheet.panels[str(k)], group)
    return sheet


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


def _draw_group(axes: Axes, group: _Group) -> None:
    from matplotlib.ticker import MultipleLocator

    low, high = axes.get_xlim()
    room = (high - low) * (1 if group.is_wide else 2)
    step = 0.05 if room <= 0.45 else 0.1 if room <= 0.9 else 0.2
    axes.xaxis.set_major_locator(MultipleLocator(step))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:.{2 if step == 0.05 else 1}f}")
    axes.grid(axis="x", color=Ink.RULE, linewidth=0.5)
    axes.set_ylim(group.edges[-1], 0.0)
    axes.set_xlabel("best coverage of a run", labelpad=2)
    axes.spines["left"].set_visible(False)
    axes.set_yticks(group.places, group.words if group.is_wide else [""] * len(group.words))
    axes.tick_params(axis="y", length=0, pad=4)
    if group.is_wide:
        axes.get_yticklabels()[0].set_fontweight("bold")
    for k, (choice, y) in enumerate(zip(group.choices, group.places, strict=True)):
        start, end = group.edges[k : k + 2]
        reach = (start, end) if group.is_wide else (end - 0.23, end - 0.04)  # words stay clear of the band
        _draw_choice(axes, choice, y, group.choices[0], reach)
        for text, x, style in _numbers(choice, group):
            write(axes, text, (1.0, y), (x, 0), 7.5, units=_BESIDE, **style)
        if not group.is_wide:
            words: TextStyle = {"va": "top", "linespacing": 1.15, "weight": "normal" if k else "bold"}
            write(axes, group.words[k], (0, start + 0.06), (0, 0), 8, units=_BESIDE, **words)
    counts = sorted({choice.n for choice in group.choices})
    labels = ", ".join(sorted({choice.label for choice in group.choices}))
    title = f"Changes to “{shorten(group.choices[0].condition, 30)}”"
    head(axes, title, f"{labels}, n = {count_range(counts)}" + (" runs each" if group.is_wide else ""))


def _draw_rules(axes: Axes, group: _Group) -> None:
    """Draw the lines between rows, as wide as the figure."""
    box = axes.get_position()
    ends = [-box.x0 / box.width, (1 - box.x0) / box.width]
    for y in group.edges[1:-1]:
        axes.plot(
            ends, [y, y], transform=axes.get_yaxis_transform(), color=Ink.RULE, linewidth=0.4, clip_on=False
        )


def _draw_choice(axes: Axes, choice: Choice, y: float, reference: Choice, reach: tuple[float, float]) -> None:
    """Draw the marks of a row over the baseline's interval and median."""
    if reference.interval is not None:
        axes.fill_between(reference.interval, *reach, color=Ink.BAND, alpha=0.45, linewidth=0)
    if not math.isnan(reference.median):
        draw_line(axes, [reference.median] * 2, reach, color=Ink.OURS, linewidth=0.8, solid_capstyle="butt")
    if math.isnan(choice.median):
        return
    dots: Dash = (0, (1.5, 1.5))
    draw_line(axes, [reference.median, choice.median], [y, y], color=Ink.OURS, linewidth=0.8, linestyle=dots)
    draw_row(axes, y, Row(choice.median, choice.interval))
    if choice.other_median is not None:
        draw_rings(axes, choice.other_median, y, 4.4, Ink.OURS, marker="s", zorder=5)
    if choice.published:
        ys = [y] * len(choice.published)
        draw_rings(axes, choice.published, ys, 4.0, Ink.PUBLISHED, marker="D", zorder=5)


def _numbers(choice: Choice, group: _Group) -> list[tuple[str, float, TextStyle]]:
    """The numbers on the right of a row: each with its distance from the axes [points] and its style."""
    effect = "no runs" if math.isnan(choice.effect) else signed(choice.effect)
    middle = "" if math.isnan(choice.median) else f"{choice.median:.3f}"
    if group.is_wide:
        middle += within(choice.interval)
    shown: list[tuple[str, float, TextStyle]] = []
    if group.is_wide or choice is group.choices[0]:
        shown.append((middle, 6.0, {"va": "center", "color": Ink.MUTED}))
    if choice is not group.choices[0]:
        shown.append((effect, 110.0 if group.is_wide else 6.0, {"va": "center", "weight": "bold"}))
    return shown


def _key(groups: list[list[Choice]]) -> list[Artist]:
    choices = [choice for group in groups for choice in group]
    handles = [mark_key("median", "o", 5.2, color=Ink.OURS)]
    if any(choice.interval for choice in choices):
        handles.append(line_key("its 95 % interval", color=Ink.OURS, linewidth=2.2))
        handles.append(area_key("the baseline’s interval", Ink.BAND, 0.45))
    if any(choice.other_median is not None for choice in choices):
        handles.append(mark_key("median as its selection counts", "s", 4.4, **hollow(Ink.OURS)))
    if any(choice.published for choice in choices):
        handles.append(mark_key("the paper’s runs", "D", 4.0, **hollow(Ink.PUBLISHED)))
    return handles


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
    labels = " and ".join(sorted({choice.label for choice in choices}))
    counts = sorted({choice.n for choice in choices})
    parts = [
        f"Median best coverage of a run by choice (cells {tally.counted}).",
        "Each row changes one choice of the baseline.",
        "Bar: exact 95 % interval. Band: the baseline’s."
        if min(counts) >= MEDIAN_SMALLEST_N
        else f"Intervals need {MEDIAN_SMALLEST_N} runs.",
        "Right: change of the median, by which rows are sorted.",
    ]
    if any(choice.other_median is not None for choice in choices):
        parts.append("Square: the same runs with cells counted as the changed selection counts them.")
    parts.append(f"{labels}, n = {counted_range(counts, 'run')} per condition.")
    return " ".join(parts)
