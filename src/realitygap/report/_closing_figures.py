"""The figures of `closing-the-gap`: the gap by budget, before and after, transfer by strategy, order of controllers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from realitygap.drawing import Ink
from realitygap.report._drawing import (
    NARROW,
    Drawing,
    draw_line,
    draw_wide,
    new_figure,
    place_axes,
)
from realitygap.report._marks import MOST_MARKS, Panel, Series

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Summary = Mapping[str, Any]
COLORS = {"none": Ink.RUN, "cells": Ink.PEN2, "encoders": Ink.PEN2, "track": Ink.OURS}
"""Colors by the observation level of the calibration."""

MARKERS = {"none": "o", "cells": "s", "encoders": "s", "track": "D"}
_HEAD, _FOOT, _LEFT, _RIGHT, _GAP = 0.52, 0.5, 0.55, 0.12, 0.34


class Words(NamedTuple):
    """Words for what was calibrated.

    Attributes:
        label: TWIN or EMULATED.
        robot: Word for the robot.
        unit: Word for one of the equal parts of the study.
    """

    label: str
    robot: str
    unit: str

    @property
    def units(self) -> str:
        """The word for several of them."""
        return f"{self.unit}s"

    def number(self, n: int) -> str:
        """Return n of them in words."""
        return f"1 {self.unit}" if n == 1 else f"{n} {self.units}"


def words_of(summary: Summary) -> Words:
    """Return the words for a study of twins, or of other platforms."""
    label = summary.get("label", "TWIN")
    return (
        Words(label, "robot", "sitting") if summary["plan"].get("platforms") else Words(label, "twin", "twin")
    )


def draw_closing(summary: Summary) -> dict[str, Drawing]:
    """All figures that the summary of `closing-the-gap` has enough for, by name.

    Args:
        summary: Result of `summarize_closing`.
    """
    drawers = {
        "budget": draw_budget,
        "scatter": draw_scatter,
        "strategies": draw_strategies,
        "order": draw_order,
    }
    found = {}
    for key, draw in drawers.items():
        drawing = draw(summary)
        if drawing is not None:
            found[key] = drawing
    return found


def draw_budget(summary: Summary) -> Drawing | None:
    """RMS gap against budget, a panel a family: each twin thin, medians thick."""
    words = words_of(summary)
    families = [family for family in summary["plan"]["families"] if _of(summary, family)]
    if not families:
        return None
    gaps = [
        each["rms"]["estimate"] or 0.0 for twin in summary["twins"] for each in (twin, *twin["calibrated"])
    ]
    top = 1.08 * max(gaps) or 1.0
    budgets = sorted(summary["plan"]["budgets"])
    caption = (
        "Root mean square over the held-out controllers of the difference between mean coverage on the "
        f"{words.robot} ({words.label}) and in simulation (SIM), noise taken out, against the trials that calibrating "
        f"was given; by family, and by what it saw of these trials. Thin lines: {words.units}. Thick lines: medians."
    )
    alt = "RMS gap against budget of trials, a panel for each family."

    def draw_family(axes: Axes, family: str) -> None:
        axes.set_gid(f"budget-{family}")
        axes.set_xlim(-0.04 * budgets[-1], 1.04 * budgets[-1] or 1)
        axes.set_ylim(0, top)
        axes.set_xticks(budgets)
        for observe in summary["plan"]["observations"]:
            _budget_lines(axes, summary, family, observe)
        axes.set_xlabel("trials for calibrating", labelpad=2)
        _title(axes, family, words.number(len(_of(summary, family))))

    def draw(width: float) -> Figure:
        figure, panels = _panels(width, len(families), 1.9)
        for axes, family in zip(panels, families, strict=True):
            draw_family(axes, family)
        panels[0].set_ylabel(f"RMS gap, {words.label} less SIM", labelpad=3)
        _key(figure, [(observe, observe) for observe in summary["plan"]["observations"]])
        return figure

    marks = tuple(
        Panel(f"budget-{family}", tuple(_marks_of_budgets(summary, family)), (0, 3)) for family in families
    )
    return draw_wide(draw, "closing-budget", caption, alt, marks=marks)


def _marks_of_budgets(summary: Summary, family: str) -> Iterator[Series]:
    for observe in summary["plan"]["observations"]:
        for name, points in (
            ("median", _budget_medians(summary, family, observe)),
            *_budgets_of_twins(summary, family, observe).items(),
        ):
            if points:
                yield Series(f"{{name}}, {observe}, {{x}} trials: RMS gap {{y}}", np.array(points), name)


def _budgets_of_twins(summary: Summary, family: str, observe: str) -> dict[str, list[tuple[int, float]]]:
    """Return budget and RMS gap of each twin of a family, in order."""
    found = {}
    for twin in _of(summary, family):
        points = [(0, twin["rms"]["estimate"])]
        points += [
            (each["budget"], each["rms"]["estimate"])
            for each in twin["calibrated"]
            if each["observe"] == observe
        ]
        found[str(twin["twin"])] = sorted((x, y) for x, y in points if y is not None)
    return found


def _budget_medians(summary: Summary, family: str, observe: str) -> list[tuple[int, float]]:
    return sorted(
        (row["budget"], row["rms"]["estimate"])
        for row in summary["families"]
        if row["family"] == family
        and row["observe"] in ("none", observe)
        and row["rms"]["estimate"] is not None
    )


def _budget_lines(axes: Axes, summary: Summary, family: str, observe: str) -> None:
    color = COLORS.get(observe, Ink.PEN3)
    for points in _budgets_of_twins(summary, family, observe).values():
        if points:
            draw_line(axes, *zip(*points, strict=True), color=color, linewidth=0.6, alpha=0.45)
    points = _budget_medians(summary, family, observe)
    if points:
        marker = MARKERS.get(observe, "o")
        draw_line(axes, *zip(*points, strict=True), color=color, linewidth=2.0, marker=marker, markersize=4.5)


def draw_scatter(summary: Summary) -> Drawing | None:
    """Draw the mean coverage of each held-out controller in simulation against that on the twin, before and after."""
    budget = summary["budget"]
    kinds = [
        "none",
        *(observe for observe in summary["plan"]["observations"] if _after(summary, observe, budget)),
    ]
    if not summary["twins"]:
        return None
    words = words_of(summary)
    caption = (
        f"Each point is a held-out controller in one of {words.number(len(summary['twins']))}: its mean coverage in "
        f"simulation (SIM) and on the {words.robot} ({words.label}); before, and after calibrating by {budget} trials. "
        "On the diagonal the simulation is right."
    )
    alt = f"Coverage in simulation against that on the {words.robot}, before and after calibrating."
    by_kind = {
        kind: {str(twin["twin"]): twin["means"] for twin in summary["twins"]}
        if kind == "none"
        else {str(twin["twin"]): each["means"] for twin, each in _after(summary, kind, budget)}
        for kind in kinds
    }

    def draw(width: float) -> Figure:
        figure, panels = _panels(width, len(kinds), 2.2)
        for axes, kind in zip(panels, kinds, strict=True):
            axes.set_gid(f"scatter-{kind}")
            means = list(by_kind[kind].values())
            xs = np.concatenate([each["source"] for each in means])
            ys = np.concatenate([each["target"] for each in means])
            axes.set_xlim(0, 1)
            axes.set_ylim(0, 1)
            draw_line(axes, [0, 1], [0, 1], color=Ink.MUTED, linewidth=0.7)
            draw_line(
                axes, xs, ys, linestyle="none", marker="o", markersize=3.0, markeredgewidth=0,
                color=COLORS.get(kind, Ink.PEN3), alpha=0.45,
            )  # fmt: skip
            axes.set_xlabel("coverage, SIM", labelpad=2)
            title = "as it is" if kind == "none" else f"calibrated, {kind}"
            _title(axes, title, f"{len(xs)} points, {words.number(len(means))}")
        panels[0].set_ylabel(f"coverage, {words.label}", labelpad=3)
        return figure

    text = f"{{name}}, controller {{label}}: {{x}} in simulation, {{y}} on the {words.robot}"
    marks = tuple(
        Panel(
            f"scatter-{kind}",
            tuple(
                Series(
                    text, np.column_stack([each["source"], each["target"]]), name, _numbered(each["source"])
                )
                for name, each in list(by_kind[kind].items())[: _most_series(by_kind, len(kinds))]
            ),
            (3, 3),
        )
        for kind in kinds
    )
    return draw_wide(draw, "closing-scatter", caption, alt, marks=marks)


def _numbered(values: Sequence[float]) -> tuple[str, ...]:
    return tuple(str(k + 1) for k in range(len(values)))


def _most_series(by_kind: Mapping[str, Mapping[str, Any]], n_kinds: int) -> int:
    """Return the number of twins, from the first, whose controllers have marks."""
    longest = max(len(each["source"]) for twins in by_kind.values() for each in twins.values())
    return max(1, MOST_MARKS // (longest * n_kinds))


def draw_strategies(summary: Summary) -> Drawing | None:
    """Quality on the twins by strategy: each twin, and the mean with its interval."""
    rows = summary["strategies"]
    if not rows:
        return None
    by_twin = {
        row["strategy"]: [
            (str(twin["twin"]), each["quality"]["estimate"])
            for twin in summary["twins"]
            for each in twin.get("transfer", [])
            if each["strategy"] == row["strategy"]
        ]
        for row in rows
    }
    values = {strategy: [value for _, value in found] for strategy, found in by_twin.items()}
    highest = 1.05 * max(max(each) for each in values.values())
    caption = (
        f"Mean coverage on the twin (TWIN) in fresh trials of what each strategy chose with "
        f"{summary['plan']['transfer_budget']} trials on it. Small points: twins. Large points and bars: mean over "
        "twins and its 95 % interval."
    )
    alt = "Coverage on the twins by strategy of transfer."

    def draw(width: float) -> Figure:
        left = 1.35
        height = 0.27 * len(rows)
        figure = new_figure(width, _HEAD + height + _FOOT)
        axes = place_axes(figure, left, _HEAD, width - left - _RIGHT, height)
        axes.set_gid("strategies")
        axes.set_xlim(0, highest or 1)
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_yticks(range(len(rows)), [row["strategy"] for row in rows])
        axes.tick_params(axis="y", length=0)
        for place, row in enumerate(rows):
            color = Ink.OURS if row["strategy"].startswith("posterior") else Ink.RUN
            spread = _spread(place, len(values[row["strategy"]]))
            draw_line(
                axes, values[row["strategy"]], spread, linestyle="none", marker="o", markersize=3.0,
                markeredgewidth=0, color=color, alpha=0.45,
            )  # fmt: skip
            if row["low"] is not None:
                draw_line(axes, [row["low"], row["high"]], [place, place], color=color, linewidth=2.0)
            draw_line(axes, [row["estimate"]], [place], color=color, marker="o", markersize=6)
        axes.set_xlabel("coverage on the twin, TWIN", labelpad=2)
        _title(axes, "Transfer by strategy", words_of(summary).number(max(row["n"] for row in rows)))
        return figure

    series = []
    for place, row in enumerate(rows):
        within = "" if row["low"] is None else f" [{row['low']:.3f}, {row['high']:.3f}]"
        mean = np.array([(row["estimate"], float(place))])
        series.append(Series(f"{{name}}: mean coverage {{x}}{within}, n = {row['n']}", mean, row["strategy"]))
        twins = by_twin[row["strategy"]]
        points = np.column_stack([values[row["strategy"]], _spread(place, len(twins))])
        labels = tuple(twin for twin, _ in twins)
        series.append(Series("{name}, {label}: coverage {x}", points, row["strategy"], labels))
    marks = (Panel("strategies", tuple(series), (3, 2)),)
    return draw_wide(draw, "closing-strategies", caption, alt, marks=marks)


def _spread(place: int, n: int) -> npt.NDArray[np.float64]:
    """Return places around that of a row, so that equal values are visible, (n,)."""
    return place + np.random.default_rng(place).uniform(-0.28, 0.28, n)


def draw_order(summary: Summary) -> Drawing | None:
    """Draw SRCC and MMRV of each twin, before and after, with their goals."""
    if not summary["twins"]:
        return None
    words, budget = words_of(summary), summary["budget"]
    groups = {"as it is": ("none", [(str(twin["twin"]), twin["gap"]) for twin in summary["twins"]])}
    for observe in summary["plan"]["observations"]:
        found = [(str(twin["twin"]), each["gap"]) for twin, each in _after(summary, observe, budget)]
        if found:
            groups[f"calibrated, {observe}"] = (observe, found)
    caption = (
        "Left: Spearman’s correlation over the held-out controllers of coverage in simulation (SIM) and on the "
        f"{words.robot} ({words.label}), disattenuated. Right: mean maximum rank violation over its floor, that of one "
        f"half of the {words.robot}’s trials by the other. Points: {words.units}; bars: medians; lines: goals. "
        f"Calibrated by {budget} trials."
    )
    alt = "Disattenuated SRCC, and MMRV over its floor, before and after calibrating."
    goals = {"srcc_disattenuated": 0.95, "mmrv_ratio": 2.0}
    titles = {"srcc_disattenuated": "Disattenuated SRCC", "mmrv_ratio": "MMRV over its floor"}
    by_measure = {
        measure: {
            label: (kind, [(twin, each[measure]) for twin, each in found if each[measure] is not None])
            for label, (kind, found) in groups.items()
        }
        for measure in goals
    }

    def draw(width: float) -> Figure:
        figure, panels = _panels(width, 2, 0.32 * len(groups), left=1.35)
        for axes, (measure, goal) in zip(panels, goals.items(), strict=True):
            axes.set_gid(f"order-{measure}")
            known = {
                label: (kind, [value for _, value in found])
                for label, (kind, found) in by_measure[measure].items()
            }
            largest = max((value for _, each in known.values() for value in each), default=goal)
            lowest = min((value for _, each in known.values() for value in each), default=0.0)
            axes.set_xlim(min(0.0, lowest), 1.05 * max(largest, goal))
            axes.set_ylim(len(groups) - 0.5, -0.5)
            draw_line(axes, [goal, goal], [-0.5, len(groups)], color=Ink.PUBLISHED, linewidth=1.0)
            for place, (kind, values) in enumerate(known.values()):
                if values:
                    color = COLORS.get(kind, Ink.PEN3)
                    draw_line(
                        axes, values, _spread(place, len(values)), linestyle="none", marker="o", markersize=3.0,
                        markeredgewidth=0, color=color, alpha=0.5,
                    )  # fmt: skip
                    middle = float(np.median(values))
                    draw_line(axes, [middle, middle], [place - 0.3, place + 0.3], color=color, linewidth=2.4)
            axes.set_yticks(range(len(groups)), list(groups) if axes is panels[0] else [""] * len(groups))
            axes.tick_params(axis="y", length=0)
            at_least = "at least" if measure.startswith("srcc") else "at most"
            _title(axes, titles[measure], f"goal: {at_least} {goal:g}")
        return figure

    marks = tuple(
        Panel(f"order-{measure}", tuple(_marks_of_order(titles[measure], by_measure[measure])), (3, 2))
        for measure in goals
    )
    return draw_wide(draw, "closing-order", caption, alt, marks=marks)


def _marks_of_order(title: str, known: Mapping[str, tuple[str, list[tuple[str, float]]]]) -> Iterator[Series]:
    for place, (label, (_, found)) in enumerate(known.items()):
        if found:
            values = [value for _, value in found]
            middle = np.array([(float(np.median(values)), float(place))])
            yield Series(f"{{name}}: median {title} {{x}}, n = {len(values)}", middle, label)
            points = np.column_stack([values, _spread(place, len(values))])
            yield Series(
                f"{{name}}, {{label}}: {title} {{x}}", points, label, tuple(twin for twin, _ in found)
            )


# parts


def _of(summary: Summary, family: str) -> list[Summary]:
    return [
        twin for twin in summary["twins"] if twin["family"] == family and twin["rms"]["estimate"] is not None
    ]


def _after(summary: Summary, observe: str, budget: int) -> list[tuple[Summary, Summary]]:
    return [
        (twin, each)
        for twin in summary["twins"]
        for each in twin["calibrated"]
        if (each["observe"], each["budget"]) == (observe, budget)
    ]


def _panels(width: float, n: int, height: float, left: float = _LEFT) -> tuple[Figure, list[Axes]]:
    """Create axes: side by side in a wide figure, below each other in a narrow one."""
    wide = width > NARROW + 1
    columns = n if wide else 1
    each = (width - left - _RIGHT - (columns - 1) * _GAP) / columns
    row = _HEAD + height + _FOOT
    figure = new_figure(width, row * (1 if wide else n))
    panels = []
    for k in range(n):
        column, line = (k, 0) if wide else (0, k)
        panels.append(place_axes(figure, left + column * (each + _GAP), line * row + _HEAD, each, height))
    return figure, panels


def _title(axes: Axes, title: str, text: str) -> None:
    place = {"xy": (0, 1), "xycoords": "axes fraction", "textcoords": "offset points"}
    axes.annotate(title, xytext=(0, 16), fontsize=9, weight="bold", **place)  # type: ignore[arg-type]
    axes.annotate(text, xytext=(0, 5.5), fontsize=7.5, color=Ink.MUTED, **place)  # type: ignore[arg-type]


def _key(figure: Figure, entries: Sequence[tuple[str, str]]) -> None:
    """Draw the key of colors and markers in the upper right corner."""
    width = figure.get_size_inches()[0]
    height = figure.get_size_inches()[1]
    for k, (kind, text) in enumerate(reversed(entries)):
        figure.text(
            1 - (_RIGHT + 0.72 * k) / width, 1 - 0.12 / height, f"— {text}",
            ha="right", va="top", fontsize=7.5, color=COLORS.get(kind, Ink.PEN3),
        )  # fmt: skip
