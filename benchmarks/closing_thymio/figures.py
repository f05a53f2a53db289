"""The figures of the study: the gap by budget, and before and after calibrating."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from realitygap.drawing import Ink
from realitygap.report.charts.house import NARROW, Drawing, draw_wide
from realitygap.report.charts.lines import draw_dots, draw_line, head, line_key
from realitygap.report.charts.scatter import draw_equality
from realitygap.report.charts.sheet import Sheet, grid

from .summary import Row, after_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLORS = {"none": Ink.RUN, "encoders": Ink.PEN2, "track": Ink.OURS}
MARKERS = {"encoders": "s", "track": "D"}
GAP = 0.3
"""Space between panels [in]."""


def drawings(summary: Row) -> dict[str, Drawing]:
    """Return the figures by name."""
    return {"budget": _budget(summary), "scatter": _scatter(summary)}


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
        panels[0].set_ylabel(f"RMS gap, SIM against {summary['label']}", labelpad=3)
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


def _figure(drawn: Any, name: str, alt: str) -> Drawing:
    return draw_wide(drawn, f"closing-{name}", alt, alt)
