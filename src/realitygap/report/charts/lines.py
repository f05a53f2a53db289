"""Lines, marks, bands, and texts in axes whose limits are set."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, TypedDict, Unpack

import numpy as np
import numpy.typing as npt

from realitygap.drawing import Ink, line_pen

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

Dash = Literal["solid", "", "none"] | tuple[float, Sequence[float]]
"""Style of a line: a name of matplotlib's, or an offset with the lengths of strokes and gaps [line widths]."""


class LineStyle(TypedDict, total=False):
    """Arguments of matplotlib for a line with marks."""

    color: str
    alpha: float
    linewidth: float
    linestyle: Dash
    marker: str
    markersize: float
    markerfacecolor: str
    markeredgecolor: str
    markeredgewidth: float
    solid_capstyle: Literal["butt", "projecting", "round"]
    dash_capstyle: Literal["butt", "projecting", "round"]
    solid_joinstyle: Literal["miter", "round", "bevel"]
    zorder: float
    clip_on: bool


class TextStyle(TypedDict, total=False):
    """Arguments of matplotlib for a text."""

    color: str
    ha: Literal["left", "center", "right"]
    va: Literal["bottom", "baseline", "center", "center_baseline", "top"]
    weight: Literal["normal", "bold"]
    rotation: float
    linespacing: float
    zorder: float
    bbox: dict[str, str | float]
    annotation_clip: bool


def draw_line(axes: Axes, xs: npt.ArrayLike, ys: npt.ArrayLike, **style: Unpack[LineStyle]) -> None:
    """Plot like `axes.plot` if the limits of the axes are set, without measuring the line."""
    from matplotlib.lines import Line2D

    line = axes.add_artist(Line2D(np.atleast_1d(xs), np.atleast_1d(ys), **style))
    line.set_in_layout(False)


def draw_dots(
    axes: Axes, xs: npt.ArrayLike, ys: npt.ArrayLike, size: float, **style: Unpack[LineStyle]
) -> None:
    """Marks of a size [points], round by default, as by `draw_line`."""
    marks: LineStyle = {"marker": "o", "linestyle": "", "markersize": size, **style}
    draw_line(axes, xs, ys, **marks)


def pen_style(index: int, width: float) -> LineStyle:
    """A line of a width [points] in the color and with the dashes of its number, as of `line_pen`."""
    color, dashes = line_pen(index)
    return {"color": color, "linestyle": (0, dashes) if dashes else "solid", "linewidth": width}


def draw_rings(
    axes: Axes, xs: npt.ArrayLike, ys: npt.ArrayLike, size: float, color: str, /, **style: Unpack[LineStyle]
) -> None:
    """Marks like those of `draw_dots` with the color of the ground inside."""
    rings: LineStyle = {**hollow(color), **style}
    draw_dots(axes, xs, ys, size, **rings)


def hollow(color: str, rim: float = 1.1) -> LineStyle:
    """The style of marks with the color of the ground inside."""
    return {"color": color, "markerfacecolor": Ink.GROUND, "markeredgewidth": rim}


def draw_band(
    axes: Axes, xs: npt.ArrayLike, low: npt.ArrayLike, high: npt.ArrayLike, alpha: float = 0.6
) -> None:
    """The area between two curves; call it where it is not all NaN."""
    axes.fill_between(xs, low, high, color=Ink.BAND, alpha=alpha, linewidth=0)


def mark_key(label: str, marker: str, size: float, /, **style: Unpack[LineStyle]) -> Artist:
    """A mark of a size [points] for a legend."""
    mark: LineStyle = {"marker": marker, "linestyle": "", "markersize": size, **style}
    return line_key(label, **mark)


def line_key(label: str, **style: Unpack[LineStyle]) -> Artist:
    """A line for a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], label=label, **style)


def area_key(label: str, color: str, alpha: float = 1.0) -> Artist:
    """An area for a legend."""
    from matplotlib.patches import Patch

    return Patch(facecolor=color, alpha=alpha, label=label)


def panel_key(
    axes: Axes, handles: Sequence[Artist], *, columns: int, size: float, length: float = 1.4
) -> None:
    """A legend in a panel without anything else; `length` of its lines [letters]."""
    axes.set_axis_off()
    axes.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns,
        frameon=False,
        fontsize=size,
        handlelength=length,
        handletextpad=0.6,
        borderaxespad=0.0,
        columnspacing=1.2,
        labelspacing=0.3 if size < 8 else 0.7,
    )


def write(
    axes: Axes,
    text: str,
    place: Sequence[float],
    shift: tuple[float, float],
    size: float,
    *,
    units: tuple[str, str] = ("axes fraction", "axes fraction"),
    **style: Unpack[TextStyle],
) -> None:
    """Text of a size [points], moved by `shift` [points] from a place in the units of x and y."""
    note = axes.annotate(
        text, (place[0], place[1]), shift, xycoords=units, textcoords="offset points", fontsize=size, **style
    )
    note.set_in_layout(units != ("data", "data"))  # one within a panel needs no room beside it


def head(
    axes: Axes,
    title: str,
    note: str = "",
    *,
    stacked: bool = False,
    below: bool = False,
    color: str = Ink.TEXT,
) -> None:
    """Above axes, or below them: what they show on the left, and its label and number on the right.

    Args:
        axes: Axes of a panel.
        title: What the panel shows.
        note: Label and number.
        stacked: True to write the note under the title, both on the left.
        below: True to write both below the axes.
        color: Color of the title.
    """
    style: TextStyle = {"va": "top" if below else "bottom", "linespacing": 1.1}
    y, up = (0.0, -4.0) if below else (1.0, 5.0)
    bold: TextStyle = {**style, "weight": "bold", "color": color}
    write(axes, title, (0.0, y), (1, up + (11 if stacked else 0)), 8.5, **bold)
    muted: TextStyle = {**style, "ha": "left" if stacked else "right", "color": Ink.MUTED}
    if note:
        write(axes, note, (0.0 if stacked else 1.0, y), (1 if stacked else -1, up), 7.5, **muted)


SPECIES_PENS = (Ink.PEN1, Ink.PEN2, Ink.PEN3, Ink.PEN5, Ink.PEN4, Ink.PEN6, Ink.PEN7, Ink.PEN0)
"""Colors of species, by the order of their numbers."""


def generation_axis(axes: Axes, unit: str, most: int = 8) -> None:
    """Number generations from left to right, with `most` numbers at most, and name the unit of the values."""
    from matplotlib.ticker import MaxNLocator

    axes.xaxis.set_major_locator(MaxNLocator(most, integer=True))
    axes.set_xlabel("generation", labelpad=2)
    axes.set_ylabel(unit)
