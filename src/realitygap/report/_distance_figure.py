"""Figures of a distance of behaviors: a map of the weight of cells, and the relation with length."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from realitygap.drawing import Ink
from realitygap.report._distance_audit import Confound, DistanceAudit, distance_notes, in_words
from realitygap.report._formats import captioned, save_drawing
from realitygap.report.charts.arena import draw_shares
from realitygap.report.charts.house import WIDE, Drawing, draw_wide, shorten
from realitygap.report.charts.lines import TextStyle, draw_band, draw_dots, draw_line, head, write
from realitygap.report.charts.rows import Row, draw_row
from realitygap.report.charts.sheet import IS_WIDE, Sheet
from realitygap.world import Grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DARKEST = 2.0
"""The weight, in means over cells, at which a cell of the map has its full color."""
_POINTS = 500
"""Pairs that are drawn one by one, at most."""
_LEAST = 15
"""Pairs of one difference in length from which on their median and quantiles are drawn."""
_FAR_SIDES = (0.1, 0.9)
_DATA = ("data", "data")
_RIGHT: TextStyle = {"ha": "right", "va": "center"}
_LEFT: TextStyle = {"ha": "left", "va": "center"}


def draw_distance(audit: DistanceAudit, *, width: float = WIDE, name: str = "distance") -> Drawing:
    """A map of what each cell weighs, and distances over the difference in length; conditions of a study below.

    Args:
        audit: Result of `audit_distance`.
        width: Width of the figure [in]. A narrow one has the parts below each other.
        name: First part of the ids.
    """
    alt = " ".join(distance_notes(audit)[2:-1])
    return draw_wide(lambda width: _draw(audit, width), name, _caption(audit), alt, width=width)


def save_distance(audit: DistanceAudit, out: str | Path) -> Path:
    """Draw an audit into a separate file, with its caption below.

    Raises:
        RecordError: the file cannot be written, or belongs to a study's results.
        ValueError: it does not end in .svg, .pdf or .png.
    """
    drawing = captioned(draw_distance(audit), "distance")
    return save_drawing(drawing, out, title=f"Distance {audit.distance.name}")


def _draw(audit: DistanceAudit, width: float) -> Sheet:
    studied = audit.confounds[1:]
    below = [0.2 * len(audit.confounds)] if studied else []
    rows = ["correlations"] * len(below)
    if width >= IS_WIDE:
        places = [["map", "pairs"], *([row, row] for row in rows)]
        sheet = Sheet(width, places, [None, *below], widths=[0.56, 0.44], gap=0.3, pad=0.3)
    else:
        places = [["map"], ["pairs"], *([row] for row in rows)]
        sheet = Sheet(width, places, [None, 2.0, *below], pad=0.3)
    _draw_map(sheet.panels["map"], audit, wide=sheet.is_wide)
    _draw_pairs(sheet.panels["pairs"], audit.confounds[0], audit, wide=sheet.is_wide)
    if studied:
        _draw_correlations(sheet.panels["correlations"], audit.confounds, wide=sheet.is_wide)
    return sheet


# the map


def _draw_map(axes: Axes, audit: DistanceAudit, *, wide: bool) -> None:
    axes.set_xlim(0, audit.columns)
    axes.set_ylim(0, audit.rows)
    weights = audit.relative_leverage
    shares = np.nan_to_num(weights / DARKEST).clip(max=1.0)
    draw_shares(axes, Grid(0.0, 0.0, 1.0, audit.columns, audit.rows), shares.ravel(), rim=0.8)
    for (row, column), weight in np.ndenumerate(weights):
        text = "" if math.isnan(weight) else f"{weight:.1f}"
        color = Ink.GROUND if shares[row, column] > 0.62 else Ink.TEXT
        middle: TextStyle = {"ha": "center", "va": "center", "color": color}
        write(axes, text, (column + 0.5, row + 0.5), (0, 0), 7.0, units=("data", "data"), **middle)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_xticks(np.arange(audit.columns) + 0.5, [str(k) for k in range(audit.columns)])
    axes.set_yticks(np.arange(audit.rows) + 0.5, [str(k) for k in range(audit.rows)])
    axes.tick_params(length=0)
    axes.set_xlabel("column of the cell", labelpad=2)
    axes.set_ylabel("row", labelpad=3)
    note = (
        "what adding or removing it does to a random walk, in means over all cells"
        if wide
        else "what it does to a walk, in means over all cells"
    )
    head(axes, f"What each cell weighs: {audit.distance.name}", note, stacked=True)


# the relation with length


def _draw_pairs(axes: Axes, confound: Confound, audit: DistanceAudit, *, wide: bool) -> None:
    differences, distances = confound.length_difference, confound.distance
    top = float(distances.max()) or 1.0
    axes.set_xlim(-1, float(differences.max()) + 1)
    axes.set_ylim(0, 1.05 * top)
    # drawn at their whole numbers they would hide each other
    jitter = np.random.default_rng(audit.seed).uniform(-0.35, 0.35, len(differences))
    draw_dots(
        axes,
        (differences + jitter)[:_POINTS],
        distances[:_POINTS],
        1.7,
        markeredgewidth=0,
        color=Ink.RUN,
        alpha=0.55,
    )
    places = [value for value in np.unique(differences) if (differences == value).sum() >= _LEAST]
    groups = [distances[differences == value] for value in places]
    if groups:
        low, high = (np.array([np.quantile(each, side) for each in groups]) for side in _FAR_SIDES)
        draw_band(axes, places, low, high)
        draw_line(axes, places, [np.median(each) for each in groups], color=Ink.OURS, linewidth=1.6)
    axes.set_xlabel("difference in visited cells", labelpad=2)
    unit = {"cells": "distance [cells]", "m": "distance [m]", "1": "distance"}[audit.distance.unit]
    axes.set_ylabel(unit, labelpad=3)
    correlation = confound.correlation
    text = "no correlation" if correlation.value is None else f"Spearman {in_words(correlation)}"
    note = f"{confound.n_pairs:,} pairs of {'random ' if wide else ''}walks: {text}"
    head(axes, "Distance and length", note, stacked=True)


def _draw_correlations(axes: Axes, confounds: list[Confound], *, wide: bool) -> None:
    lows = [each.correlation.low for each in confounds]
    low = -1.0 if any(end is not None and end < -0.25 for end in lows) else -0.25
    # names and numbers have their room within the panel, so that those above keep theirs
    before, after = (0.31, 0.24) if wide else (0.95, 1.25)
    axes.set_xlim(low - before * (1 - low), 1 + after * (1 - low))
    axes.set_ylim(len(confounds) - 0.5, -0.5)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.spines["bottom"].set_bounds(low, 1)
    ticks = np.arange(-5, 6) / 5 if wide else np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    axes.set_xticks(ticks[ticks >= low])
    axes.grid(axis="x", color=Ink.RULE, linewidth=0.5)
    draw_line(axes, [0, 0], [-0.5, len(confounds)], color=Ink.MUTED, linewidth=0.8)
    for place, confound in enumerate(confounds):
        correlation = confound.correlation
        ends = (
            None
            if correlation.low is None or correlation.high is None
            else (correlation.low, correlation.high)
        )
        draw_row(axes, place, Row(correlation.value, ends, color=Ink.OURS if place else Ink.RUN))
        name = f"{confound.label}, {confound.of}" if confound.label else confound.of
        number = "none" if correlation.value is None else in_words(correlation)
        write(axes, shorten(name, 25 if wide else 15), (low, place), (-6, 0), 7.5, units=_DATA, **_RIGHT)
        write(axes, number, (1.0, place), (8, 0), 7.5, units=_DATA, **_LEFT)
    axes.set_xlabel("Spearman’s correlation of distance with the difference in visited cells", labelpad=2)
    head(axes, "Distance and length in each condition" if wide else "In each condition")


# words


def _caption(audit: DistanceAudit) -> str:
    parts = [
        f"Left: mean distance “{audit.distance.name}” from a random walk to the same walk with the cell taken out, or "
        "put in where the walk leaves it out, over its mean over all cells: 1 where all cells weigh alike.",
        f"Right: points are pairs of walks ({min(_POINTS, audit.confounds[0].n_pairs)} of them); line and band the "
        "median, and the range of eight in ten, at each difference in visited cells.",
    ]
    if len(audit.confounds) > 1:
        parts.append(
            "Below: the same correlation over pairs of trials of different runs; bars are 95 % intervals."
        )
    return " ".join([*parts, distance_notes(audit)[-1]])
