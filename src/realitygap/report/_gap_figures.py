"""Figures of a gap: quality on both sides, differences in order, visited cells, replay, and the parts of the model."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np
import numpy.typing as npt

from realitygap._wording import counted, p_equation
from realitygap.drawing import Ink
from realitygap.gap import GapSide, ScoreGap, Why, difference_ends
from realitygap.report.charts.arena import draw_arena, draw_shares
from realitygap.report.charts.house import Drawing, draw_wide, shorten
from realitygap.report.charts.lines import Dash, draw_band, draw_dots, draw_line, head, mark_key
from realitygap.report.charts.marks import Panel, Series, decimals_for
from realitygap.report.charts.rows import Row, draw_row, name_rows
from realitygap.report.charts.scatter import draw_crosses, draw_equality
from realitygap.report.charts.sheet import Sheet, grid
from realitygap.study import GapStudy

_MOST_ACROSS = 4.95
"""Maximum width of a scatter with its label [in]."""

_KINDS = (
    ("random", Ink.PUBLISHED, "s", "random networks"),
    ("champion", Ink.OURS, "o", "champions"),
    ("table", Ink.OURS, "o", "controllers"),
)
"""Kinds of controllers: color, mark, and name of each."""

_DASHED: Dash = (0, (5, 1.5))


class _Controller(Protocol):
    """A controller of any gap."""

    @property
    def name(self) -> str: ...

    @property
    def kind(self) -> str: ...


# quality on both sides


def draw_gap_pairs(
    gap: GapStudy | ScoreGap, before: GapStudy | None = None, name: str = "gap-pairs"
) -> Drawing:
    """Draw the mean quality of each controller on both sides, with intervals and the line of no gap.

    Args:
        gap: The gap.
        before: The gap before a calibration, whose controllers are hollow marks.
        name: First part of the ids in the drawing.
    """
    source, target = gap.source, gap.target
    score, names = gap.result.score, _names(source, target)
    crosses = "" if source.are_means and target.are_means else " Crosses are 95 % intervals of each mean."
    caption = (
        f"Mean {score} on {names[0]} and on {names[1]}: {counted(source.n, 'controller')}, {_trials(source, target)}."
        f"{crosses} On the line there is no gap."
    ) + ("" if before is None else " Gray: the same controllers before the calibration.")
    alt = f"Scatter of {source.n} controllers: {score} on {names[0]} against {score} on {names[1]}."
    controllers: Sequence[_Controller] = gap.controllers
    rows = {
        kind: np.array([k for k, each in enumerate(controllers) if each.kind == kind], int)
        for kind, *_ in _KINDS
    }

    def draw(width: float) -> Sheet:
        size = min(width, _MOST_ACROSS)
        is_whole = size == width
        sheet = Sheet(
            width,
            [["pairs"] if is_whole else ["pairs", "."]],
            [None],
            widths=None if is_whole else [size, width - size],
        )
        axes = sheet.panels["pairs"]
        axes.set_gid("pairs")
        sides = [source, target] if before is None else [source, target, before.source]
        draw_equality(axes, *_ends(sides, *source.score_range))
        if before is not None:
            draw_dots(axes, before.source.means, target.means, 3.4, color=Ink.RUN, alpha=0.6)
        across, up = (np.column_stack(side.intervals()) for side in (source, target))
        handles = []
        for kind, color, marker, plural in _KINDS:
            k = rows[kind]
            if len(k):
                draw_crosses(axes, source.means[k], target.means[k], (across[k], up[k]), color, marker)
                handles.append(mark_key(f"{plural}, n = {len(k)}", marker, 4.2, color=color))
        if before is not None:
            handles.append(mark_key("before the calibration", "o", 3.4, color=Ink.RUN))
        gray = "" if before is None else f"; gray: on {shorten(_names(before.source, target)[0], 20)}"
        axes.set_xlabel(f"{score} on {shorten(names[0], 34)}{gray}", labelpad=3)
        axes.set_ylabel(f"{score} on {shorten(names[1], 34)}", labelpad=3)
        axes.legend(handles=handles, loc="upper left", frameon=False, fontsize=7.5, handlelength=1.0)
        return sheet

    points = np.column_stack([source.means, target.means])
    decimals = decimals_for(points)
    text = f"{{label}}: {{x}} on {names[0]}, {{y}} on {names[1]}"
    series = tuple(
        Series(text, points[k], labels=tuple(gap.controllers[row].name for row in k))
        for k in rows.values()
        if len(k)
    )
    return draw_wide(draw, name, caption, alt, marks=(Panel("pairs", series, (decimals, decimals)),))


def _names(source: GapSide, target: GapSide) -> tuple[str, str]:
    """Return both platforms in words, with their labels."""
    one, other = (f"{side.in_words} ({side.label})" for side in (source, target))
    return one, other


def _trials(source: GapSide, target: GapSide) -> str:
    """Return the number of trials on both sides in words, once if it is the same."""
    one, other = source.trials_in_words, target.trials_in_words
    return one if one == other else f"{one} on {source.in_words} and {other} on {target.in_words}"


def _ends(of: Sequence[GapSide], low: float, high: float) -> tuple[float, float]:
    """The ends of both axes: at tenths of the scale beyond the intervals, and within the score's range."""
    sides = [side.intervals() for side in of]
    least, most = min(float(each.min()) for each, _ in sides), max(float(each.max()) for _, each in sides)
    least = min(least, low if math.isfinite(low) else 0.0)
    tenth = 0.1 if high <= 1 else max(most - least, 1e-9) / 10
    return max(math.floor(least / tenth + 1e-9) * tenth, low), min(
        math.ceil(most / tenth + 0.2) * tenth, high
    )


# differences in order


def draw_gap_differences(gap: GapStudy | ScoreGap, name: str = "gap-differences") -> Drawing:
    """The difference of means of each controller in order, with intervals, the level, and the margin.

    Args:
        gap: The gap.
        name: First part of the ids in the drawing.
    """
    source, target, level = gap.source, gap.target, gap.result.level
    score = gap.result.score
    differences = target.means - source.means
    lower, upper = _ends_of_differences(gap)
    has_ends = bool((upper > lower).any())
    order = np.argsort(differences)
    margin = gap.result.equivalence.more.get("margin")
    band = f" The gray band is the margin of equivalence, ±{margin:g}." if margin else ""
    caption = (
        f"{score[0].upper()}{score[1:]} on {target.name} ({target.label}) minus that on {source.name} ({source.label}) "
        f"of each of {source.n} controllers in order, {_trials(source, target)}"
        f"{', with intervals of 95 % for each by itself' if has_ends else ''}. Blue: the level, {level}.{band}"
    )
    span = f"{differences.min():.2f} to {differences.max():.2f}"
    alt = f"Differences of {source.n} controllers from {span}; mean {level}."

    def draw(width: float) -> Sheet:
        sheet, (axes,) = grid(width, 1, 1, 2.1)
        axes.set_gid("differences")
        most = max(1.08 * float(np.abs([lower, upper]).max()), 0.02)
        axes.set_xlim(-0.7, source.n - 0.3)
        axes.set_ylim(-most, most)
        if margin:
            axes.axhspan(-margin, margin, color=Ink.RULE, alpha=0.6, linewidth=0)
        axes.axhline(0, color=Ink.MUTED, linewidth=0.7)
        if level.low is not None and level.high is not None:
            axes.axhspan(level.low, level.high, color=Ink.BAND, alpha=0.5, linewidth=0)
        axes.axhline(level.value or 0.0, color=Ink.OURS, linewidth=1.2)
        for place, k in enumerate(order):
            draw_line(axes, [place, place], [lower[k], upper[k]], color=Ink.RUN, linewidth=0.8)
        draw_dots(axes, np.arange(source.n), differences[order], 3.4, color=Ink.TEXT)
        axes.set_xticks([])
        axes.set_xlabel("controllers in order", labelpad=3)
        axes.set_ylabel(f"difference in {score}", labelpad=3)
        return sheet

    decimals = decimals_for(differences)
    labels = tuple(
        f"{gap.controllers[k].name}: {differences[k]:.{decimals}f} [{lower[k]:.{decimals}f}, "
        f"{upper[k]:.{decimals}f}]"
        for k in order
    )
    series = Series("{label}", np.column_stack([np.arange(source.n), differences[order]]), labels=labels)
    panel = Panel("differences", (series,), (0, decimals))
    return draw_wide(draw, name, caption, alt, marks=(panel,))


def _ends_of_differences(
    gap: GapStudy | ScoreGap,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return both ends of the interval of each difference, (c,); the difference itself if there is none."""
    if not isinstance(gap, ScoreGap):
        return difference_ends(gap.source, gap.target)
    ends = [each.ends or (float(each), float(each)) for each in gap.differences]
    lower, upper = np.array(ends).T
    return lower, upper


# visited cells


def draw_gap_maps(gap: GapStudy) -> Drawing | None:
    """Draw the share of trials that cross each cell on both sides, and their difference; None if cells are unknown."""
    maps = gap.maps
    if maps is None:
        return None
    source, target, energy = gap.source, gap.target, gap.result.energy
    most = max(float(maps.source.max()), float(maps.target.max()), 0.01)
    apart = max(float(abs(maps.difference).max()), 0.01)
    p = energy.more.get("p")
    words = "" if p is None else f" ({p_equation(p)} by permutation within controllers)"
    caption = (
        f"Share of trials that cross each cell: {source.n} controllers, {source.trials} trials each on {source.name} "
        f"({source.label}) and {target.trials} on {target.name} ({target.label}); full color is {most:.2f}. Right: "
        f"where the target’s trials go more often (blue) or less often (orange); full color is {apart:.2f}. Energy "
        f"distance of visited cells {energy}{words}."
    )
    alt = f"Maps of visited cells on {source.name} and on {target.name}, and their difference of up to {apart:.2f}."
    panels = (
        (f"{source.label} {shorten(source.name, 20)}", maps.source, most),
        (f"{target.label} {shorten(target.name, 20)}", maps.target, most),
        (f"{target.label} minus {source.label}", maps.difference, apart),
    )

    def draw(width: float) -> Sheet:
        sheet, places = grid(width, 3, 3 if width > 6 else 1, None, gap=0.25)
        for k, (axes, (title, values, full)) in enumerate(zip(places, panels, strict=True)):
            axes.set_gid(f"maps-{k}")
            draw_arena(axes, gap.arena)
            draw_shares(axes, gap.arena.grid, values / full)
            head(axes, title)
        return sheet

    marks = tuple(
        Panel(f"maps-{k}", (_marks_of_cells(gap, title, values),), (3, 3))
        for k, (title, values, _) in enumerate(panels)
    )
    return draw_wide(draw, "gap-maps", caption, alt, marks=marks)


def _marks_of_cells(gap: GapStudy, title: str, values: npt.NDArray[np.float64]) -> Series:
    cells = gap.arena.grid
    rows, columns = np.divmod(np.arange(len(values)), cells.columns)
    points = np.column_stack([cells.x + (columns + 0.5) * cells.cell, cells.y + (rows + 0.5) * cells.cell])
    labels = tuple(
        f"column {column + 1}, row {row + 1}: {value:.3f}"
        for row, column, value in zip(rows, columns, values, strict=True)
    )
    return Series("{name}, {label}", points, title, labels)


# replay


def draw_gap_replay(gap: GapStudy) -> Drawing | None:
    """Draw distance and difference in heading over steps, compared with noise alone; None if no poses were recorded."""
    replay = gap.replay
    if replay is None:
        return None
    last = replay.distance.shape[1] - 1
    ends = float(replay.distance[:, last].mean()), float(replay.noise_distance[:, last].mean())
    caption = (
        f"Open-loop replay: the commands of {replay.n} trials on {gap.target.name} ({gap.target.label}) given to the "
        f"robot of {gap.source.name} ({gap.source.label}) from the same start, four times each. Line: how far the two "
        f"robots are apart after each step, mean, with the 10th to 90th percentile of trials; thin: between two "
        f"replays, which noise alone drives apart. After {last} steps {ends[0]:.2f} m and {ends[1]:.2f} m."
    )
    alt = (
        f"Curves of the distance between target and replay, which reaches {ends[0]:.2f} m after {last} steps."
    )
    panels = (
        ("apart [m]", replay.distance, replay.noise_distance, None),
        ("headings apart [rad]", replay.heading, replay.noise_heading, math.pi),
    )

    def draw(width: float) -> Sheet:
        sheet, places = grid(width, 2, 2 if width > 6 else 1, 1.6)
        for k, (axes, (title, between, noise, most)) in enumerate(zip(places, panels, strict=True)):
            axes.set_gid(f"replay-{k}")
            steps = np.arange(between.shape[1])
            low, high = np.percentile(between, [10, 90], axis=0)
            draw_band(axes, steps, low, high, 0.55)
            axes.plot(steps, between.mean(axis=0), color=Ink.OURS, linewidth=1.8, label="target and replay")
            axes.plot(
                steps,
                noise.mean(axis=0),
                color=Ink.RUN,
                linewidth=1.0,
                linestyle=_DASHED,
                label="noise alone",
            )
            axes.set_xlim(0, steps[-1])
            axes.set_ylim(0, most or max(1.08 * float(high.max()), 0.02))
            axes.set_xlabel("step", labelpad=2)
            axes.set_ylabel(title, labelpad=3)
        places[0].legend(loc="upper left", frameon=False, fontsize=7.5)
        return sheet

    marks = tuple(
        Panel(f"replay-{k}", tuple(_marks_of_curves(title, between, noise)), (0, 4))
        for k, (title, between, noise, _) in enumerate(panels)
    )
    return draw_wide(draw, "gap-replay", caption, alt, marks=marks)


def _marks_of_curves(
    title: str, between: npt.NDArray[np.float64], noise: npt.NDArray[np.float64]
) -> Iterator[Series]:
    name, _, unit = title.partition(" [")
    steps = np.unique(np.linspace(0, between.shape[1] - 1, 200).astype(int))
    for which, values in (("target and replay", between), ("noise alone", noise)):
        points = np.column_stack([steps, values.mean(axis=0)[steps]])
        yield Series(f"{{name}}, step {{x}}: {name} {{y}} {unit.rstrip(']')}", points, which)


# parts of the model


def draw_gap_why(why: Why, gap: GapStudy) -> Drawing:
    """A bar for each part of the model: by how much the RMS gap falls when the fit takes the default's place."""
    order = why.order
    values = [why.falls[k].value or 0.0 for k in order]
    caption = (
        f"What each part of the model carries of the RMS gap in coverage to {gap.target.name} ({gap.target.label}): "
        f"{why.before} with the robot’s defaults (SIM), {why.after} with the fit, {why.before.n} controllers. Bars: "
        "Shapley values over all 64 choices of parts, whose sum is the fall; lines: intervals of 95 %, controllers "
        "drawn anew and, with them, the posterior of the fit."
    )
    alt = "Bars: " + "; ".join(f"{why.parts[k]} {why.falls[k]}" for k in order) + "."

    def draw(width: float) -> Sheet:
        sheet, (axes,) = grid(width, 1, 1, 0.3 * len(order))
        axes.set_gid("why")
        ends = [end for each in why.falls for end in (each.low, each.high, each.value) if end is not None]
        low, high = min(0.0, *ends), max(0.005, *ends)
        axes.set_xlim(low - 0.04 * (high - low), high + 0.04 * (high - low))
        name_rows(axes, [why.parts[k] for k in order], grid=False)
        axes.barh(range(len(order)), values, height=0.62, color=Ink.BAND, linewidth=0)
        for row, k in enumerate(order):
            fall = why.falls[k]
            if fall.low is not None and fall.high is not None:
                draw_row(axes, row, Row(None, (fall.low, fall.high), scale=0.6))
        axes.axvline(0, color=Ink.MUTED, linewidth=0.7)
        axes.locator_params(axis="x", nbins=5 if width > 6 else 3)
        axes.set_xlabel("fall of the RMS gap", labelpad=3)
        return sheet

    labels = tuple(f"{why.parts[k]}: {why.falls[k]}" for k in order)
    series = Series("{label}", np.column_stack([values, np.arange(len(order))]), labels=labels)
    return draw_wide(draw, "gap-why", caption, alt, marks=(Panel("why", (series,), (4, 0)),))
