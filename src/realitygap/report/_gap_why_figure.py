"""The share of a gap that each part of the model explains, as bars."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from realitygap.drawing import Ink
from realitygap.gap import Why
from realitygap.report._drawing import (
    Drawing,
    draw_line,
    draw_wide,
    new_figure,
    place_axes,
)
from realitygap.report._marks import Panel, Series
from realitygap.study import GapStudy

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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

    def draw(width: float) -> Figure:
        high = 0.3 * len(order)
        figure = new_figure(width, high + 0.5)
        axes = place_axes(figure, 1.05, 0.08, width - 1.2, high)
        axes.set_gid("why")
        ends = [end for each in why.falls for end in (each.low, each.high, each.value) if end is not None]
        low, top = min(0.0, *ends), max(0.005, *ends)
        axes.set_xlim(low - 0.04 * (top - low), top + 0.04 * (top - low))
        axes.set_ylim(len(order) - 0.4, -0.6)
        axes.barh(range(len(order)), values, height=0.62, color=Ink.BAND, linewidth=0)
        for row, k in enumerate(order):
            each = why.falls[k]
            if each.low is not None and each.high is not None:
                draw_line(axes, [each.low, each.high], [row, row], color=Ink.OURS, linewidth=1.3)
        axes.axvline(0, color=Ink.MUTED, linewidth=0.7)
        axes.set_yticks(range(len(order)), [why.parts[k] for k in order])
        axes.tick_params(axis="y", length=0)
        axes.locator_params(axis="x", nbins=5 if width > 6 else 3)
        axes.set_xlabel("fall of the RMS gap", labelpad=3)
        return figure

    labels = tuple(f"{why.parts[k]}: {why.falls[k]}" for k in order)
    series = Series("{label}", np.column_stack([values, np.arange(len(order))]), labels=labels)
    return draw_wide(draw, "gap-why", caption, alt, marks=(Panel("why", (series,), (4, 0)),))
