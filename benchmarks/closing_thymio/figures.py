"""The figures of the study: the gap by budget, before and after calibrating, and the order of controllers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from realitygap.drawing import Ink
from realitygap.report.charts.house import NARROW, Drawing, draw_wide
from realitygap.report.charts.lines import draw_dots, draw_line, head, line_key
from realitygap.report.charts.rows import Row as RowOfMarks
from realitygap.report.charts.rows import draw_row, name_rows, stacked
from realitygap.report.charts.scatter import draw_equality
from realitygap.report.charts.sheet import Sheet, grid

from .summary import LEAST_SRCC, Row, after_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLORS = {"none": Ink.RUN, "encoders": Ink.PEN2, "track": Ink.OURS}
MARKERS = {"encoders": "s", "track": "D"}
MEASURES = {
    "srcc_disattenuated": ("Disattenuated SRCC", f"goal: at least {LEAST_SRCC:g}"),
    "mmrv_ratio": ("MMRV over its floor", ""),
}
GAP = 0.3
"""Space between panels [in]."""


def drawings(summary: Row) -> dict[str, Drawing]:
    """Return the figures by name."""
    return {"budget": _budget(summary), "scatter": _scatter(summary), "order": _order(summary)}


def _number(n: int) -> str:
    return f"{n} sitting{'s' * (n != 1)}"


def _budget(summary: Row) -> Drawing:
    """RMS gap against budget, a panel for each robot: sittings thin, medians thick."""
    own = {
        family: [
            each
            for each in summary["twins"]
            if each["family"] == family and each["rms"]["estimate"] is not None
        ]
        for family in summary["plan"]["families"]
    }
    families = [family for family, found in own.items() if found]
    gaps = [row["rms"]["estimate"] or 0.0 for each in summary["twins"] for row in (each, *each["calibrated"])]
    budgets = sorted(summary["plan"]["budgets"])

    def drawn(width: float) -> Sheet:
        sheet, panels = grid(width, len(families), len(families) if width > NARROW + 1 else 1, 1.9, gap=GAP)
        for axes, family in zip(panels, families, strict=True):
            axes.set_xlim(-0.04 * budgets[-1], 1.04 * budgets[-1])
            axes.set_ylim(0, 1.08 * max(gaps))
            axes.set_xticks(budgets)
            for observe in summary["plan"]["observations"]:
                _budget_lines(axes, summary, own[family], observe)
            axes.set_xlabel("trials for calibrating", labelpad=2)
            head(axes, family, _number(len(own[family])), stacked=True)
        panels[0].set_ylabel(f"RMS gap, {summary['label']} minus SIM", labelpad=3)
        keys = [line_key(each, color=COLORS[each], linewidth=1.2) for each in summary["plan"]["observations"]]
        sheet.key(keys, place="upper right")
        return sheet

    return _figure(drawn, "budget", "RMS gap against budget of trials, a panel for each robot.")


def _budget_lines(axes: Axes, summary: Row, sittings: Sequence[Row], observe: str) -> None:
    for sitting in sittings:
        points = [(0, sitting["rms"]["estimate"])]
        points += [
            (each["budget"], each["rms"]["estimate"])
            for each in sitting["calibrated"]
            if each["observe"] == observe
        ]
        known = sorted((x, y) for x, y in points if y is not None)
        draw_line(axes, *zip(*known, strict=True), color=COLORS[observe], linewidth=0.6, alpha=0.45)
    medians = sorted(
        (row["budget"], row["rms"]["estimate"])
        for row in summary["families"]
        if row["family"] == sittings[0]["family"] and row["observe"] in ("none", observe)
        if row["rms"]["estimate"] is not None
    )
    draw_line(
        axes,
        *zip(*medians, strict=True),
        color=COLORS[observe],
        linewidth=2.0,
        marker=MARKERS[observe],
        markersize=4.5,
    )


def _groups(summary: Row) -> dict[str, tuple[str, list[Row]]]:
    """Return the title, the observation level, and the results of all sittings, as it is and by each calibration."""
    found = {"as it is": ("none", summary["twins"])}
    for observe in summary["plan"]["observations"]:
        rows = [row for each in summary["twins"] if (row := after_of(each, observe, summary["budget"]))]
        if rows:
            found[f"calibrated, {observe}"] = (observe, rows)
    return found


def _scatter(summary: Row) -> Drawing:
    """The mean coverage of each held-out controller in simulation against that on the robot."""
    groups = _groups(summary)

    def drawn(width: float) -> Sheet:
        sheet, panels = grid(width, len(groups), len(groups) if width > NARROW + 1 else 1, 2.2, gap=GAP)
        for axes, (title, (observe, rows)) in zip(panels, groups.items(), strict=True):
            xs, ys = (np.concatenate([row["means"][side] for row in rows]) for side in ("source", "target"))
            draw_equality(axes, 0, 1, Ink.MUTED)
            draw_dots(axes, xs, ys, 3.0, markeredgewidth=0, color=COLORS[observe], alpha=0.45)
            axes.set_xlabel("coverage, SIM", labelpad=2)
            head(axes, title, f"{len(xs)} points, {_number(len(rows))}", stacked=True)
        panels[0].set_ylabel(f"coverage, {summary['label']}", labelpad=3)
        return sheet

    return _figure(
        drawn, "scatter", "Coverage in simulation against that on the robot, before and after calibrating."
    )


def _order(summary: Row) -> Drawing:
    """SRCC and MMRV of each sitting, before and after calibrating."""
    groups = _groups(summary)
    values: Mapping[str, list[tuple[str, Any]]] = {
        measure: [
            (observe, np.array([v for row in rows if (v := row["gap"][measure]) is not None]))
            for observe, rows in groups.values()
        ]
        for measure in MEASURES
    }

    def drawn(width: float) -> Sheet:
        sheet, panels = grid(width, 2, 2 if width > NARROW + 1 else 1, 0.32 * len(groups), gap=GAP)
        for axes, (measure, (title, note)) in zip(panels, MEASURES.items(), strict=True):
            ends = np.concatenate([[0.0, 1.0], *(found for _, found in values[measure])])
            low, high = float(ends.min()), 1.05 * float(ends.max())
            axes.set_xlim(low, high)
            name_rows(
                axes,
                list(groups) if axes is panels[0] or not sheet.is_wide else [""] * len(groups),
                grid=False,
            )
            if note:
                draw_line(axes, [LEAST_SRCC] * 2, [-0.5, len(groups)], color=Ink.PUBLISHED, linewidth=1.0)
            for place, (observe, found) in enumerate(values[measure]):
                if len(found):
                    color = COLORS[observe]
                    draw_row(axes, place, RowOfMarks(None, None, found, stacked(found, high), color, color))
                    middle = float(np.median(found))
                    draw_line(axes, [middle] * 2, [place - 0.3, place + 0.3], color=color, linewidth=2.4)
            head(axes, title, note, stacked=True)
        return sheet

    return _figure(
        drawn, "order", "Disattenuated SRCC, and MMRV over its floor, before and after calibrating."
    )


def _figure(drawn: Any, name: str, alt: str) -> Drawing:
    return draw_wide(drawn, f"closing-{name}", alt, alt)
