"""Figures of a distance of behaviors: a map of the weight of cells, and the relation with length."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from realitygap.drawing import Ink
from realitygap.report._distance_audit import Confound, DistanceAudit, distance_notes, in_words
from realitygap.report._drawing import (
    WIDE,
    Drawing,
    draw_dots,
    draw_line,
    house_style,
    new_figure,
    place_axes,
    shorten,
    to_svg,
    write,
)
from realitygap.report._formats import captioned, save_drawing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DARKEST = 2.0
"""The weight, in means over cells, at which a cell of the map has its full color."""
_POINTS = 500
"""Pairs that are drawn one by one, at most."""
_LEAST = 15
"""Pairs of one difference in length from which on their median and quantiles are drawn."""
_FAR_SIDES = (0.1, 0.9)


def draw_distance(audit: DistanceAudit, *, width: float = WIDE, name: str = "distance") -> Drawing:
    """A map of what each cell weighs, and distances over the difference in length; conditions of a study below.

    Args:
        audit: Result of `audit_distance`.
        width: Width of the figure [in]. A narrow one has the parts below each other.
        name: First part of the ids.
    """
    with house_style():
        figure = _draw(audit, width)
        alt = " ".join(distance_notes(audit)[2:-1])
        return Drawing(to_svg(figure, name, alt), _caption(audit), alt, figure)


def save_distance(audit: DistanceAudit, out: str | Path) -> Path:
    """Draw an audit into a separate file, with its caption below.

    Raises:
        RecordError: the file cannot be written, or belongs to a study's results.
        ValueError: it does not end in .svg, .pdf or .png.
    """
    drawing = captioned(draw_distance(audit), "distance")
    return save_drawing(drawing, out, title=f"Distance {audit.distance.name}")


def _draw(audit: DistanceAudit, width: float) -> Figure:
    wide = width >= 6
    left, gap, right, head, foot = 0.42, 0.78, 0.12, 0.5, 0.46
    map_width = (width - left - gap - right) * 0.56 if wide else width - left - right
    height = map_width * audit.rows / audit.columns
    plot_left = left + map_width + gap if wide else left + 0.12
    plot_top = head if wide else 2 * head + height + foot
    upper = plot_top + height + foot
    studied = audit.confounds[1:]
    lower = 0.55 + 0.2 * (len(studied) + 1) + foot if studied else 0.0
    figure = new_figure(width, upper + lower)
    _draw_map(place_axes(figure, left, head, map_width, height), audit, wide=wide)
    axes = place_axes(figure, plot_left, plot_top, width - right - plot_left, height)
    _draw_pairs(axes, audit.confounds[0], audit, wide=wide)
    if studied:
        names = 0.2 * width if wide else 0.3 * width
        numbers = 1.45
        box = place_axes(figure, names, upper + 0.4, width - names - numbers, 0.2 * (len(studied) + 1))
        _draw_correlations(box, audit.confounds, names, wide=wide)
    return figure


def _title(axes: Axes, title: str, text: str = "") -> None:
    write(axes, title, (0, 1), (0, 17), 9, weight="bold")
    write(axes, text, (0, 1), (0, 5.5), 7.5, color=Ink.MUTED)


# the map


def _draw_map(axes: Axes, audit: DistanceAudit, *, wide: bool) -> None:
    from matplotlib.colors import LinearSegmentedColormap
    from matplotlib.patches import Rectangle

    shades = LinearSegmentedColormap.from_list("weight", [Ink.GROUND, Ink.BAND, Ink.OURS])
    axes.set_xlim(0, audit.columns)
    axes.set_ylim(0, audit.rows)
    weights = audit.relative_leverage
    for (row, column), weight in np.ndenumerate(weights):
        part = 0.0 if math.isnan(weight) else min(weight / DARKEST, 1.0)
        axes.add_patch(
            Rectangle((column, row), 1, 1, facecolor=shades(part), edgecolor=Ink.GROUND, linewidth=0.8)
        )
        axes.text(
            column + 0.5,
            row + 0.5,
            "" if math.isnan(weight) else f"{weight:.1f}",
            ha="center",
            va="center",
            fontsize=7.0,
            color=Ink.GROUND if part > 0.62 else Ink.TEXT,
        )
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_xticks(np.arange(audit.columns) + 0.5, [str(k) for k in range(audit.columns)])
    axes.set_yticks(np.arange(audit.rows) + 0.5, [str(k) for k in range(audit.rows)])
    axes.tick_params(length=0)
    axes.set_xlabel("column of the cell", labelpad=2)
    axes.set_ylabel("row", labelpad=3)
    _title(
        axes,
        f"What each cell weighs: {audit.distance.name}",
        "what adding or removing it does to a random walk, in means over all cells"
        if wide
        else "what it does to a walk, in means over all cells",
    )


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
        axes.fill_between(places, low, high, color=Ink.BAND, alpha=0.6, linewidth=0)
        draw_line(axes, places, [np.median(each) for each in groups], color=Ink.OURS, linewidth=1.6)
    axes.set_xlabel("difference in visited cells", labelpad=2)
    unit = {"cells": "distance [cells]", "m": "distance [m]", "1": "distance"}[audit.distance.unit]
    axes.set_ylabel(unit, labelpad=3)
    found = confound.correlation
    text = "no correlation" if found.value is None else f"Spearman {in_words(found)}"
    _title(
        axes, "Distance and length", f"{confound.n_pairs:,} pairs of {'random ' if wide else ''}walks: {text}"
    )


def _draw_correlations(axes: Axes, confounds: list[Confound], names: float, *, wide: bool) -> None:
    lows = [each.correlation.low for each in confounds]
    axes.set_xlim(-1 if any(low is not None and low < -0.25 for low in lows) else -0.25, 1)
    axes.set_ylim(len(confounds) - 0.5, -0.5)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.grid(axis="x", color=Ink.RULE, linewidth=0.5)
    draw_line(axes, [0, 0], [-0.5, len(confounds)], color=Ink.MUTED, linewidth=0.8)
    for row, each in enumerate(confounds):
        found = each.correlation
        color = Ink.RUN if row == 0 else Ink.OURS
        if found.value is not None and found.low is not None and found.high is not None:
            draw_line(axes, [found.low, found.high], [row, row], color=color, linewidth=2.2)
            draw_line(axes, [found.value], [row], color=color, marker="o", markersize=5)
        label = f"{each.label}, {each.of}" if each.label else each.of
        for text, at, x, side in (
            (shorten(label, int(names / 0.075)), 0.0, -6, "right"),
            ("none" if found.value is None else in_words(found), 1.0, 8, "left"),
        ):
            write(
                axes, text, (at, row), (x, 0), 7.5, xycoords=("axes fraction", "data"), ha=side, va="center"
            )
    axes.set_xlabel("Spearman’s correlation of distance with the difference in visited cells", labelpad=2)
    write(
        axes,
        "Distance and length in each condition" if wide else "In each condition",
        (0, 1),
        (-72 * names + 4, 8),
        9,
        weight="bold",
    )


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
