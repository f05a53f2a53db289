"""Values of a figure that the page shows on hover, and their positions in the drawing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_MARKS = 2500
"""Marks of runs in one figure: some 5 bytes each. Of more runs the first ones of each condition have marks."""


@dataclass(frozen=True)
class Series:
    """Marks that are highlighted together.

    Attributes:
        text: Text that the page shows for a mark. {name}, {label}, {x}, and {y} are replaced by its values.
        points: (m, 2) x and y in the units of the axes.
        name: Name of the series.
        labels: Label of each mark; none if `text` has no {label}.
        link: Address within the page that a click on a mark leads to, without the mark's label; empty for none.
        n_linked: Number of marks, from the first, that have the link.
    """

    text: str
    points: npt.NDArray[np.float64]
    name: str = ""
    labels: tuple[str, ...] = ()
    link: str = ""
    n_linked: int = 0


@dataclass(frozen=True)
class Panel:
    """The marks of one panel.

    Attributes:
        axes: The `gid` of the axes that they are in.
        series: The marks.
        decimals: Number of decimals of x and y, to which all values are rounded.
    """

    axes: str
    series: tuple[Series, ...]
    decimals: tuple[int, int]


class Marked(Protocol):
    """A drawing with its marks, and the frames of their panels."""

    @property
    def marks(self) -> tuple[Panel, ...]:
        """The panels with marks."""
        ...

    @property
    def frames(self) -> tuple[tuple[float, ...], ...]:
        """The frame of each panel, as of `frames_of`."""
        ...


def frames_of(figure: Figure, panels: Sequence[Panel]) -> tuple[tuple[float, ...], ...]:
    """Return the positions of the panels in a figure that was drawn with linear axes.

    Returns:
        The numbers a, b, c, d, left, top, right, and bottom for each panel, in points from the upper left corner: a
        value x of k units of its last decimal is at a + b k, and y at c + d k.
    """
    axes_by_name = {axes.get_gid(): axes for axes in figure.axes}
    height = float(figure.bbox.height)
    frames = []
    for panel in panels:
        axes = axes_by_name[panel.axes]
        units = [10.0**-decimals for decimals in panel.decimals]
        (x0, y0), (x1, y1) = axes.transData.transform([(0.0, 0.0), units])
        box = axes.get_window_extent()
        frames.append((x0, x1 - x0, height - y0, y0 - y1, box.x0, height - box.y1, box.x1, height - box.y0))
    return tuple(tuple(_short(value) for value in frame) for frame in frames)


def marks_content(wide: Marked, narrow: Marked) -> dict[str, Any]:
    """Return what the page's script reads: frames in each width, and panels with values as whole numbers.

    Args:
        wide, narrow: The forms of the figure. The panels of the narrow one are left out if they are the same objects.
    """
    content: dict[str, Any] = {
        "frames": [wide.frames, narrow.frames],
        "panels": [_panel_content(panel) for panel in wide.marks],
    }
    if narrow.marks is not wide.marks:
        content["narrow"] = [_panel_content(panel) for panel in narrow.marks]
    return content


def _panel_content(panel: Panel) -> dict[str, Any]:
    texts = list(dict.fromkeys(each.text for each in panel.series))
    return {
        "decimals": panel.decimals,
        "texts": [_numbered(text) for text in texts],
        "series": [_series_content(each, panel, texts) for each in panel.series],
    }


def _numbered(text: str) -> str:
    """Return a text with numbers instead of names in braces, as `hover.js` reads it."""
    for number, name in enumerate(("name", "label", "x", "y")):
        text = text.replace(f"{{{name}}}", f"{{{number}}}")
    return text


def _series_content(series: Series, panel: Panel, texts: Sequence[str]) -> list[Any]:
    xs, ys = (
        np.rint(values * 10**decimals).astype(int).tolist()
        for values, decimals in zip(series.points.T, panel.decimals, strict=True)
    )
    row = [texts.index(series.text), series.name, ys, 0 if xs == list(range(len(xs))) else xs]
    more = [list(series.labels) or 0, series.link or 0, series.n_linked]
    while more and not more[-1]:
        more.pop()
    return row + more


def _short(value: float) -> float:
    """Return a coordinate to a thousandth of a point, and a small factor to 6 digits."""
    return round(value, 3) if abs(value) >= 1 or value == 0 else float(f"{value:.6g}")


def decimals_for(values: npt.NDArray[np.float64]) -> int:
    """Return the decimals that show 4 digits of the largest value."""
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    return 3 if largest == 0 else min(12, max(0, 3 - math.floor(math.log10(largest))))
