"""Figures of a gap controller by controller: quality on both sides, and differences in order."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from realitygap.drawing import Ink
from realitygap.gap import GapSide
from realitygap.report._drawing import (
    Drawing,
    draw_dots,
    draw_line,
    draw_wide,
    mark_key,
    new_figure,
    place_axes,
    shorten,
)
from realitygap.report._marks import Panel, Series, decimals_for
from realitygap.study import GapStudy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_ACROSS = 4.4
"""Maximum width of the square of a scatter [in]."""


def draw_gap_pairs(gap: GapStudy) -> Drawing:
    """Draw the mean quality of each controller on both sides, with intervals and the line of no gap."""
    source, target = gap.source, gap.target
    order, score = _order_in_words(gap), gap.result.score
    caption = (
        f"Mean {score} of {source.n} controllers, {source.trials} trials each on {source.name} ({source.label}), "
        f"across, and {target.trials} on {target.name} ({target.label}), up, with intervals of 95 % of each mean by t. "
        f"On the line there is no gap. {order}"
    )
    alt = f"Scatter of {source.n} controllers: {score} on {source.name} against {score} on {target.name}. {order}"

    def draw(width: float) -> Figure:
        size = min(width - 0.75, _MOST_ACROSS)
        figure = new_figure(width, size + 0.6)
        axes = place_axes(figure, 0.55, 0.1, size, size)
        axes.set_gid("pairs")
        ends = _ends(source, target, *gap.task.score_range)
        axes.set_xlim(*ends)
        axes.set_ylim(*ends)
        draw_line(axes, ends, ends, color=Ink.RULE, linewidth=1.0, zorder=1)
        kinds: list[str] = [each.kind for each in gap.controllers]
        across, up = (np.column_stack(side.intervals()) for side in (source, target))
        for kind, color, marker in (("random", Ink.PUBLISHED, "s"), ("champion", Ink.OURS, "o")):
            rows = [k for k, each in enumerate(kinds) if each == kind]
            if rows:
                _draw_pairs(
                    axes, source.means[rows], target.means[rows], across[rows], up[rows], color, marker
                )
        axes.set_xlabel(f"{score} on {shorten(source.name, 24)} ({source.label})", labelpad=3)
        axes.set_ylabel(f"{score} on {shorten(target.name, 24)} ({target.label})", labelpad=3)
        _legend(axes, kinds)
        return figure

    return draw_wide(draw, "gap-pairs", caption, alt, marks=_marks_of_pairs(gap))


def _marks_of_pairs(gap: GapStudy) -> tuple[Panel, ...]:
    points = np.column_stack([gap.source.means, gap.target.means])
    decimals = decimals_for(points)
    series = []
    for kind in ("random", "champion"):
        rows = [k for k, each in enumerate(gap.controllers) if each.kind == kind]
        if rows:
            text = f"{{label}}: {{x}} on {gap.source.name}, {{y}} on {gap.target.name}"
            series.append(Series(text, points[rows], labels=tuple(gap.controllers[k].name for k in rows)))
    return (Panel("pairs", tuple(series), (decimals, decimals)),)


def _draw_pairs(axes: Axes, x: Any, y: Any, across: Any, up: Any, color: str, marker: str) -> None:
    for k in range(len(x)):
        draw_line(axes, across[k], [y[k], y[k]], color=color, linewidth=0.7, alpha=0.6)
        draw_line(axes, [x[k], x[k]], up[k], color=color, linewidth=0.7, alpha=0.6)
    draw_line(
        axes, x, y, color=color, marker=marker, linestyle="", markersize=4.2, markeredgewidth=0, zorder=5
    )


def _legend(axes: Axes, kinds: list[str]) -> None:

    shown = (("random", Ink.PUBLISHED, "s", "unrelated"), ("champion", Ink.OURS, "o", "champions"))
    handles = [
        mark_key(f"{name}, n = {kinds.count(kind)}", marker, 4.2, color)
        for kind, color, marker, name in shown
        if kind in kinds
    ]
    axes.legend(handles=handles, loc="upper left", frameon=False, fontsize=7.5, handlelength=1.0)


def _order_in_words(gap: GapStudy) -> str:
    raw, ceiling, without = gap.result.srcc, gap.result.noise_ceiling, gap.result.srcc_disattenuated
    if raw.value is None:
        return raw.refused
    words = f"Spearman’s correlation {raw}"
    if ceiling.value is not None:
        words += f"; noise allows at most {ceiling}"
    if without.value is not None:
        words += f"; without noise {without}"
    return words + "."


def draw_gap_differences(gap: GapStudy) -> Drawing:
    """The difference of means of each controller in order, with intervals, the level, and the margin."""
    source, target, level = gap.source, gap.target, gap.result.level
    score = gap.result.score
    differences = target.means - source.means
    lower, upper = _ends_of_differences(source, target)
    order = np.argsort(differences)
    margin = gap.result.equivalence.more.get("margin")
    band = f" The gray band is the margin of equivalence, ±{margin:g}." if margin else ""
    caption = (
        f"{score[0].upper()}{score[1:]} on {target.name} ({target.label}) less that on {source.name} ({source.label}) "
        f"of each of {source.n} controllers in order, {target.trials} and {source.trials} trials each, with intervals "
        f"of 95 % for each by itself. Blue: the level, {level}.{band}"
    )
    span = f"{differences.min():.2f} to {differences.max():.2f}"
    alt = f"Differences of {source.n} controllers from {span}; mean {level}."

    def draw(width: float) -> Figure:
        figure = new_figure(width, 2.6)
        axes = place_axes(figure, 0.6, 0.12, width - 0.68, 2.1)
        axes.set_gid("differences")
        n = source.n
        most = 1.08 * float(np.abs([lower, upper]).max())
        axes.set_xlim(-0.7, n - 0.3)
        axes.set_ylim(-max(most, 0.02), max(most, 0.02))
        if margin:
            axes.axhspan(-margin, margin, color=Ink.RULE, alpha=0.6, linewidth=0)
        axes.axhline(0, color=Ink.MUTED, linewidth=0.7)
        if level.low is not None and level.high is not None:
            axes.axhspan(level.low, level.high, color=Ink.BAND, alpha=0.5, linewidth=0)
        axes.axhline(level.value or 0.0, color=Ink.OURS, linewidth=1.2)
        for place, k in enumerate(order):
            draw_line(axes, [place, place], [lower[k], upper[k]], color=Ink.RUN, linewidth=0.8)
        draw_dots(axes, np.arange(n), differences[order], 3.4, color=Ink.TEXT)
        axes.set_xticks([])
        axes.set_xlabel("controllers in order", labelpad=3)
        axes.set_ylabel(f"difference in {score}", labelpad=3)
        return figure

    ordered = differences[order]
    decimals = decimals_for(differences)
    labels = tuple(
        f"{gap.controllers[k].name}: {differences[k]:.{decimals}f} [{lower[k]:.{decimals}f}, "
        f"{upper[k]:.{decimals}f}]"
        for k in order
    )
    series = Series("{label}", np.column_stack([np.arange(source.n), ordered]), labels=labels)
    panel = Panel("differences", (series,), (0, decimals))
    return draw_wide(draw, "gap-differences", caption, alt, marks=(panel,))


def _ends_of_differences(source: GapSide, target: GapSide) -> tuple[Any, Any]:
    """Return both ends of the interval of each difference, (c,), from those of both means.

    Source: Zou & Donner (2008), Statistics in Medicine 27(10), 1693-1702. No end leaves the range of differences.
    """
    (low, high), (low_there, high_there) = source.intervals(), target.intervals()
    differences = target.means - source.means
    lower = differences - np.hypot(target.means - low_there, high - source.means)
    return lower, differences + np.hypot(high_there - target.means, source.means - low)


def _ends(source: GapSide, target: GapSide, low: float, high: float) -> tuple[float, float]:
    """The ends of both axes: at tenths of the scale beyond the intervals, and within the score's range."""
    sides = [side.intervals() for side in (source, target)]
    least, most = min(float(each.min()) for each, _ in sides), max(float(each.max()) for _, each in sides)
    least = min(least, low if math.isfinite(low) else 0.0)
    tenth = 0.1 if high <= 1 else max(most - least, 1e-9) / 10
    return max(math.floor(least / tenth + 1e-9) * tenth, low), min(
        math.ceil(most / tenth + 0.2) * tenth, high
    )
