"""The figures of `closing-the-gap`: the gap by budget, before and after, transfer by strategy, order of controllers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from realitygap.drawing import Ink
from realitygap.report.charts.house import NARROW, Drawing, draw_wide
from realitygap.report.charts.lines import draw_dots, draw_line, head, line_key
from realitygap.report.charts.marks import MOST_MARKS, Panel, Series
from realitygap.report.charts.rows import Row, draw_row, name_rows, stacked
from realitygap.report.charts.scatter import draw_equality
from realitygap.report.charts.sheet import Sheet, grid
from realitygap.study import CalibratedRow, ClosingSummary, TwinRow

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLORS = {"none": Ink.RUN, "cells": Ink.PEN2, "encoders": Ink.PEN2, "track": Ink.OURS}
"""Colors by the observation level of the calibration."""

MARKERS = {"none": "o", "cells": "s", "encoders": "s", "track": "D"}
_OrderMeasure = Literal["srcc_disattenuated", "mmrv_ratio"]
_GAP = 0.3
"""Space between panels [in]."""


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


def words_of(summary: ClosingSummary) -> Words:
    """Return the words for a study of twins, or of other platforms."""
    label = summary.get("label", "TWIN")
    return (
        Words(label, "robot", "sitting") if summary["plan"].get("platforms") else Words(label, "twin", "twin")
    )


def draw_closing(summary: ClosingSummary) -> dict[str, Drawing]:
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
    drawings = {}
    for key, draw in drawers.items():
        drawing = draw(summary)
        if drawing is not None:
            drawings[key] = drawing
    return drawings


def draw_budget(summary: ClosingSummary) -> Drawing | None:
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
    colors = {each: COLORS.get(each, Ink.PEN3) for each in summary["plan"]["observations"]}

    def draw(width: float) -> Sheet:
        columns = len(families) if width > NARROW + 1 else 1
        sheet, panels = grid(width, len(families), columns, 1.9, gap=_GAP)
        for axes, family in zip(panels, families, strict=True):
            axes.set_gid(f"budget-{family}")
            axes.set_xlim(-0.04 * budgets[-1], 1.04 * budgets[-1] or 1)
            axes.set_ylim(0, top)
            axes.set_xticks(budgets)
            for observe in summary["plan"]["observations"]:
                _budget_lines(axes, summary, family, observe)
            axes.set_xlabel("trials for calibrating", labelpad=2)
            head(axes, family, words.number(len(_of(summary, family))), stacked=True)
        panels[0].set_ylabel(f"RMS gap, {words.label} minus SIM", labelpad=3)
        sheet.key(
            [line_key(each, color=color, linewidth=1.2) for each, color in colors.items()],
            place="upper right",
        )
        return sheet

    marks = tuple(
        Panel(f"budget-{family}", tuple(_marks_of_budgets(summary, family)), (0, 3)) for family in families
    )
    return draw_wide(draw, "closing-budget", caption, alt, marks=marks)


def _marks_of_budgets(summary: ClosingSummary, family: str) -> Iterator[Series]:
    for observe in summary["plan"]["observations"]:
        for name, points in (
            ("median", _budget_medians(summary, family, observe)),
            *_budgets_of_twins(summary, family, observe).items(),
        ):
            if points:
                yield Series(f"{{name}}, {observe}, {{x}} trials: RMS gap {{y}}", np.array(points), name)


def _budgets_of_twins(
    summary: ClosingSummary, family: str, observe: str
) -> dict[str, list[tuple[int, float]]]:
    """Return budget and RMS gap of each twin of a family, in order."""
    series = {}
    for twin in _of(summary, family):
        points = [(0, twin["rms"]["estimate"])]
        points += [
            (each["budget"], each["rms"]["estimate"])
            for each in twin["calibrated"]
            if each["observe"] == observe
        ]
        series[str(twin["twin"])] = sorted((x, y) for x, y in points if y is not None)
    return series


def _budget_medians(summary: ClosingSummary, family: str, observe: str) -> list[tuple[int, float]]:
    return sorted(
        (row["budget"], row["rms"]["estimate"])
        for row in summary["families"]
        if row["family"] == family
        and row["observe"] in ("none", observe)
        and row["rms"]["estimate"] is not None
    )


def _budget_lines(axes: Axes, summary: ClosingSummary, family: str, observe: str) -> None:
    color = COLORS.get(observe, Ink.PEN3)
    for points in _budgets_of_twins(summary, family, observe).values():
        if points:
            draw_line(axes, *zip(*points, strict=True), color=color, linewidth=0.6, alpha=0.45)
    points = _budget_medians(summary, family, observe)
    if points:
        marker = MARKERS.get(observe, "o")
        draw_line(axes, *zip(*points, strict=True), color=color, linewidth=2.0, marker=marker, markersize=4.5)


def draw_scatter(summary: ClosingSummary) -> Drawing | None:
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

    def draw(width: float) -> Sheet:
        sheet, panels = grid(width, len(kinds), len(kinds) if width > NARROW + 1 else 1, 2.2, gap=_GAP)
        for axes, kind in zip(panels, kinds, strict=True):
            axes.set_gid(f"scatter-{kind}")
            means = list(by_kind[kind].values())
            xs, ys = (np.concatenate([each[side] for each in means]) for side in ("source", "target"))
            draw_equality(axes, 0, 1, Ink.MUTED)
            draw_dots(axes, xs, ys, 3.0, markeredgewidth=0, color=COLORS.get(kind, Ink.PEN3), alpha=0.45)
            axes.set_xlabel("coverage, SIM", labelpad=2)
            title = "as it is" if kind == "none" else f"calibrated, {kind}"
            head(axes, title, f"{len(xs)} points, {words.number(len(means))}", stacked=True)
        panels[0].set_ylabel(f"coverage, {words.label}", labelpad=3)
        return sheet

    longest = max(len(each["source"]) for twins in by_kind.values() for each in twins.values())
    n_marked = max(
        1, MOST_MARKS // (longest * len(kinds))
    )  # twins, from the first, whose controllers have marks
    text = f"{{name}}, controller {{label}}: {{x}} in simulation, {{y}} on the {words.robot}"
    marks = tuple(
        Panel(
            f"scatter-{kind}",
            tuple(
                Series(
                    text, np.column_stack([each["source"], each["target"]]), name, _numbered(each["source"])
                )
                for name, each in list(by_kind[kind].items())[:n_marked]
            ),
            (3, 3),
        )
        for kind in kinds
    )
    return draw_wide(draw, "closing-scatter", caption, alt, marks=marks)


def _numbered(values: Sequence[float]) -> tuple[str, ...]:
    return tuple(str(k + 1) for k in range(len(values)))


def draw_strategies(summary: ClosingSummary) -> Drawing | None:
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

    offsets = {strategy: stacked(np.array(each), highest) for strategy, each in values.items()}

    def draw(width: float) -> Sheet:
        sheet, (axes,) = grid(width, 1, 1, 0.27 * len(rows))
        axes.set_gid("strategies")
        axes.set_xlim(0, highest or 1)
        name_rows(axes, [row["strategy"] for row in rows], grid=False)
        for place, row in enumerate(rows):
            color = Ink.OURS if row["strategy"].startswith("posterior") else Ink.RUN
            ends = None if row["low"] is None or row["high"] is None else (row["low"], row["high"])
            dots = np.array(values[row["strategy"]])
            draw_row(axes, place, Row(row["estimate"], ends, dots, offsets[row["strategy"]], color, color))
        axes.set_xlabel("coverage on the twin, TWIN", labelpad=2)
        head(
            axes,
            "Transfer by strategy",
            words_of(summary).number(max(row["n"] for row in rows)),
            stacked=True,
        )
        return sheet

    series = []
    for place, row in enumerate(rows):
        within = "" if row["low"] is None else f" [{row['low']:.3f}, {row['high']:.3f}]"
        mean = np.array([(row["estimate"], float(place))])
        series.append(Series(f"{{name}}: mean coverage {{x}}{within}, n = {row['n']}", mean, row["strategy"]))
        twins = by_twin[row["strategy"]]
        points = np.column_stack([values[row["strategy"]], place + offsets[row["strategy"]]])
        labels = tuple(twin for twin, _ in twins)
        series.append(Series("{name}, {label}: coverage {x}", points, row["strategy"], labels))
    marks = (Panel("strategies", tuple(series), (3, 2)),)
    return draw_wide(draw, "closing-strategies", caption, alt, marks=marks)


def draw_order(summary: ClosingSummary) -> Drawing | None:
    """Draw SRCC and MMRV of each twin, before and after, with their goals."""
    if not summary["twins"]:
        return None
    words, budget = words_of(summary), summary["budget"]
    groups = {"as it is": ("none", [(str(twin["twin"]), twin["gap"]) for twin in summary["twins"]])}
    for observe in summary["plan"]["observations"]:
        gaps = [(str(twin["twin"]), each["gap"]) for twin, each in _after(summary, observe, budget)]
        if gaps:
            groups[f"calibrated, {observe}"] = (observe, gaps)
    caption = (
        "Left: Spearman’s rank correlation of the held-out controllers of coverage in simulation (SIM) and on the "
        f"{words.robot} ({words.label}), disattenuated. Right: mean maximum rank violation over its floor, that of one "
        f"half of the {words.robot}’s trials by the other. Points: {words.units}; bars: medians; lines: goals. "
        f"Calibrated by {budget} trials."
    )
    alt = "Disattenuated SRCC, and MMRV over its floor, before and after calibrating."
    goals: dict[_OrderMeasure, float] = {"srcc_disattenuated": 0.95, "mmrv_ratio": 2.0}
    titles: dict[_OrderMeasure, str] = {
        "srcc_disattenuated": "Disattenuated SRCC",
        "mmrv_ratio": "MMRV over its floor",
    }
    by_measure = {
        measure: {
            label: (kind, [(twin, value) for twin, each in gaps if (value := each[measure]) is not None])
            for label, (kind, gaps) in groups.items()
        }
        for measure in goals
    }

    ends = {
        measure: (min([0.0, *values]), 1.05 * max([goals[measure], *values]))
        for measure, known in by_measure.items()
        for values in [[value for _, gaps in known.values() for _, value in gaps]]
    }

    def draw(width: float) -> Sheet:
        sheet, panels = grid(width, 2, 2 if width > NARROW + 1 else 1, 0.32 * len(groups), gap=_GAP)
        for axes, (measure, goal) in zip(panels, goals.items(), strict=True):
            axes.set_gid(f"order-{measure}")
            axes.set_xlim(*ends[measure])
            is_named = axes is panels[0] or not sheet.is_wide
            name_rows(axes, list(groups) if is_named else [""] * len(groups), grid=False)
            draw_line(axes, [goal, goal], [-0.5, len(groups)], color=Ink.PUBLISHED, linewidth=1.0)
            for place, (kind, gaps) in enumerate(by_measure[measure].values()):
                if gaps:
                    color = COLORS.get(kind, Ink.PEN3)
                    values = np.array([value for _, value in gaps])
                    row = Row(None, None, values, stacked(values, ends[measure][1]), color, color)
                    draw_row(axes, place, row)
                    middle = float(np.median(values))
                    draw_line(axes, [middle, middle], [place - 0.3, place + 0.3], color=color, linewidth=2.4)
            at_least = "at least" if measure.startswith("srcc") else "at most"
            head(axes, titles[measure], f"goal: {at_least} {goal:g}", stacked=True)
        return sheet

    marks = tuple(
        Panel(
            f"order-{measure}",
            tuple(_marks_of_order(titles[measure], by_measure[measure], ends[measure][1])),
            (3, 2),
        )
        for measure in goals
    )
    return draw_wide(draw, "closing-order", caption, alt, marks=marks)


def _marks_of_order(
    title: str, known: Mapping[str, tuple[str, list[tuple[str, float]]]], length: float
) -> Iterator[Series]:
    for place, (label, (_, found)) in enumerate(known.items()):
        if found:
            values = np.array([value for _, value in found])
            middle = np.array([(float(np.median(values)), float(place))])
            yield Series(f"{{name}}: median {title} {{x}}, n = {len(values)}", middle, label)
            points = np.column_stack([values, place + stacked(values, length)])
            yield Series(
                f"{{name}}, {{label}}: {title} {{x}}", points, label, tuple(twin for twin, _ in found)
            )


# parts


def _of(summary: ClosingSummary, family: str) -> list[TwinRow]:
    return [
        twin for twin in summary["twins"] if twin["family"] == family and twin["rms"]["estimate"] is not None
    ]


def _after(summary: ClosingSummary, observe: str, budget: int) -> list[tuple[TwinRow, CalibratedRow]]:
    return [
        (twin, each)
        for twin in summary["twins"]
        for each in twin["calibrated"]
        if (each["observe"], each["budget"]) == (observe, budget)
    ]
