"""The shapes of a `Picture` in a figure, so that it looks as it does by itself."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from realitygap.drawing import Disc, Ink, Line, Picture, Text
from realitygap.report.charts.lines import TextStyle, draw_dots, draw_line, write
from realitygap.report.charts.sheet import Sheet, grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_SIDES: dict[str, Literal["left", "center", "right"]] = {"start": "left", "middle": "center", "end": "right"}


def draw_picture(axes: Axes, picture: Picture, *, scale: float = 1.0) -> None:
    """Draw a picture into axes of its proportions.

    Args:
        axes: Axes, from which everything else is removed.
        picture: Picture to draw.
        scale: Scale of everything that is measured in points.
    """
    axes.set_axis_off()
    axes.set_xlim(picture.left, picture.right)
    axes.set_ylim(picture.bottom, picture.top)
    for order, shape in enumerate(picture.shapes):
        if isinstance(shape, Line):
            _draw_line(axes, shape, order, scale)
        elif isinstance(shape, Disc):
            draw_dots(
                axes,
                [shape.x],
                [shape.y],
                2 * shape.radius * scale,
                color=shape.fill,
                markeredgecolor=shape.color or shape.fill,
                markeredgewidth=shape.width * scale if shape.color else 0.0,
                zorder=2 + order,
                clip_on=False,
            )
        else:
            _draw_text(axes, shape, order, scale)


def picture_sheet(picture: Picture, width: float) -> Sheet:
    """A figure of a width [in] that holds nothing but a picture; call under `house_style`."""
    sheet, (axes,) = grid(width, 1, 1, None, gap=0.0, pad=0.0)
    draw_picture(axes, picture)
    return sheet


def _draw_line(axes: Axes, line: Line, order: int, scale: float) -> None:
    points = np.array([*line.points, line.points[0]] if line.closed else line.points)
    if line.fill is not None:
        axes.fill(points[:, 0], points[:, 1], color=line.fill, linewidth=0, zorder=2 + order, clip_on=False)
    if line.color is not None:
        dash = tuple(part / line.width for part in line.dash)
        draw_line(
            axes,
            points[:, 0],
            points[:, 1],
            color=line.color,
            linewidth=line.width * scale,
            linestyle=(0, dash) if dash else "solid",
            dash_capstyle="butt",
            solid_capstyle="projecting",
            zorder=2 + order,
            clip_on=False,
        )


def _draw_text(axes: Axes, text: Text, order: int, scale: float) -> None:
    style: TextStyle = {
        "ha": _SIDES[text.anchor],
        "va": "center",
        "rotation": 90 if text.upright else 0,
        "color": text.color,
        "weight": "bold" if text.bold else "normal",
        "zorder": 2 + order,
        "annotation_clip": False,
    }
    if text.halo:
        style["bbox"] = {"boxstyle": "square,pad=0.08", "facecolor": Ink.GROUND, "edgecolor": "none"}
    shift = text.shift[0] * scale, text.shift[1] * scale
    write(axes, text.text, (text.x, text.y), shift, text.size * scale, units=("data", "data"), **style)
