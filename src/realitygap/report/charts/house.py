"""Conversion of a matplotlib figure to SVG: text as text, the same bytes every time, in sizes that fit side by side.

A figure is drawn in the colors of `Ink`. On a page each of them becomes a CSS variable, so that one drawing
serves light and dark; a drawing by itself keeps the light colors, which every program understands.
"""

from __future__ import annotations

import io
import re
import textwrap
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import realitygap
from realitygap._foreign_text import page_text
from realitygap.drawing import FONT, Ink
from realitygap.report.charts.marks import Panel, frames_of
from realitygap.report.charts.sheet import Sheet

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SVG = "http://www.w3.org/2000/svg"
_XLINK = "http://www.w3.org/1999/xlink"
_HREF = f"{{{_XLINK}}}href"

WIDE = 9.6
NARROW = 3.7
"""Widths of a figure [in] on a desktop's page and on a phone's."""

_METRIC_FONT = "DejaVu Sans"
"""Comes with matplotlib, so that the layout is the same everywhere; wider than those in `FONT`."""


_STYLE: dict[Any, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": Ink.MUTED,
    "axes.facecolor": "none",
    "axes.grid": False,
    "axes.labelcolor": Ink.TEXT,
    "axes.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "figure.dpi": 72,
    "figure.facecolor": "none",
    "font.family": [_METRIC_FONT],
    "font.size": 8.0,
    "path.simplify": False,
    "savefig.edgecolor": "none",
    "savefig.facecolor": "none",
    "svg.fonttype": "none",
    "svg.hashsalt": "realitygap",
    "text.color": Ink.TEXT,
    "text.parse_math": False,
    "xtick.color": Ink.MUTED,
    "xtick.labelcolor": Ink.TEXT,
    "xtick.labelsize": 7.5,
    "xtick.major.size": 2.5,
    "xtick.major.width": 0.6,
    "ytick.color": Ink.MUTED,
    "ytick.labelcolor": Ink.TEXT,
    "ytick.labelsize": 7.5,
    "ytick.major.size": 2.5,
    "ytick.major.width": 0.6,
}


@dataclass(frozen=True)
class Drawing:
    """A figure with its caption and its description.

    Attributes:
        svg: Picture as one `svg` element; nothing in it is fetched from elsewhere.
        caption: Content of the figure, number of runs, and interval.
        alt: Text for readers who cannot see the figure, in a sentence; `svg` includes it.
        figure: Source figure, for other formats.
        draw: Function that draws the figure in a width [in].
        name: First part of the ids in `svg`.
        mark: Function that returns the values that a page shows on hover, for a width [in]; None if there are none.
        marks: Values that a page shows on hover.
        frames: Frames of these in `svg`, one for each panel of `marks`.
    """

    svg: str
    caption: str
    alt: str
    figure: Figure | None = field(default=None, repr=False, compare=False)
    draw: Callable[[float], Sheet] | None = field(default=None, repr=False, compare=False)
    name: str = field(default="", repr=False, compare=False)
    mark: Callable[[float], tuple[Panel, ...]] | None = field(default=None, repr=False, compare=False)
    marks: tuple[Panel, ...] = field(default=(), repr=False, compare=False)
    frames: tuple[tuple[float, ...], ...] = field(default=(), repr=False, compare=False)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({shorten(self.alt, 80)!r})"

    def _repr_svg_(self) -> str:
        return self.svg

    def save(self, path: str | Path) -> Path:
        """Write the figure to a file that ends in .svg, .pdf, or .png, and return its path."""
        return realitygap.report.save_drawing(self, path)

    def in_width(self, width: float) -> Drawing:
        """Return the same figure in another width [in], for the same page.

        Raises:
            ValueError: it was made without a function that draws it.
        """
        if self.draw is None:
            raise ValueError("This figure has one width only.")
        return _drawn(self, self.draw, width, 1)


def draw_wide(
    draw: Callable[[float], Sheet],
    name: str,
    caption: str,
    alt: str,
    *,
    marks: tuple[Panel, ...] | Callable[[float], tuple[Panel, ...]] = (),
    width: float = WIDE,
) -> Drawing:
    """A figure in the width of a desktop's page, which `Drawing.in_width` draws in another one.

    Args:
        draw: Function that makes the sheet of a width [in].
        name: First part of the ids in the drawing.
        caption, alt: Caption and text of `Drawing`.
        marks: Values that a page shows on hover, or a function that makes them for a width [in] if places depend on it.
        width: Width on a desktop's page [in].
    """
    mark = marks if callable(marks) else lambda _: marks
    return _drawn(Drawing("", caption, alt, draw=draw, name=name, mark=mark), draw, width, 0)


def _drawn(drawing: Drawing, draw: Callable[[float], Sheet], width: float, number: int) -> Drawing:
    with house_style():
        sheet = draw(width)
        sheet.settle()
        svg = to_svg(sheet.figure, f"{drawing.name}-{number}", drawing.alt)
    marks = () if drawing.mark is None else drawing.mark(width)
    return replace(drawing, svg=svg, figure=sheet.figure, marks=marks, frames=frames_of(sheet.figure, marks))


@contextmanager
def house_style() -> Iterator[None]:
    """Draw with our settings, whatever the user's are; they are back as they were afterwards.

    matplotlib keeps its settings for the whole process, so draw from one thread at a time. Within another one it does
    nothing: setting all of them takes some milliseconds.
    """
    import matplotlib as mpl

    if mpl.rcParams["svg.hashsalt"] == _STYLE["svg.hashsalt"]:
        yield
        return
    with mpl.rc_context(), warnings.catch_warnings():
        # letters that our measuring font lacks are there in the reader's
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        yield


def shorten(text: str, n_letters: int) -> str:
    """Text of a user's file on one line, printable, at most so long."""
    plain = "".join(letter if letter.isprintable() else " " for letter in text)
    return textwrap.shorten(plain, n_letters, placeholder="…") if " " in plain else _cut(plain, n_letters)


def wrap(text: str, n_letters: int, n_lines: int = 3) -> str:
    """Text of a user's file on a few lines, printable, none much longer than asked."""
    plain = "".join(letter if letter.isprintable() else " " for letter in text)
    return "\n".join(textwrap.wrap(plain, n_letters, max_lines=n_lines, placeholder="…"))


def letters_in(width: float, size: float = 8.0) -> int:
    """Return the number of letters of a size [points] that a line of a width [in] has room for."""
    return int(width / (0.0098 * size))


def _cut(text: str, n_letters: int) -> str:
    return text if len(text) <= n_letters else text[: n_letters - 1] + "…"


def to_svg(figure: Figure, name: str, alt: str) -> str:
    """The figure as one `svg` element; call under `house_style`.

    Args:
        figure: Figure in the colors of `Ink`.
        name: First part of the ids inside, which must differ from that of every other drawing on a page.
        alt: Text of `aria-label`.
    """
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
    root = ET.fromstring(page_text(buffer.getvalue()))
    _drop_baggage(root)
    _rename_ids(root, name)
    for element in root.iter():
        _tidy(element)
    root.attrib.pop("version", None)
    root.set("role", "img")
    root.set("aria-label", page_text(alt))
    root.set("style", "stroke-linejoin: round; stroke-linecap: butt")
    ET.register_namespace("", _SVG)
    return ET.tostring(root, encoding="unicode")


def inline(svg: str) -> str:
    """Return a drawing as part of an HTML page: without namespaces, size, and fonts, with colors as CSS variables."""
    start, rest = svg.split(">", 1)
    start = re.sub(r' (?:xmlns(?::\w+)?|width|height)="[^"]*"', "", start)
    colors = {color: f"var(--ink-{name})" for name, color in Ink.names().items()}
    pattern = re.compile(r"(?<=[:] )(?:" + "|".join(colors) + r")(?=[;\"])")
    rest = pattern.sub(lambda match: colors[match[0]], rest).replace(_FONT_STYLE, "")
    return f"{start}>{_PATH.sub(lambda match: _closer(match[0]), rest)}"


_FONT_STYLE = f"font-family: {FONT}; "
"""The style sheet of a page gives it to all texts in figures."""

_PATH = re.compile(' d="[^"]*"')


def _closer(path: str) -> str:
    """A path without the spaces that it does not need."""
    for letter in "LCQM":
        path = path.replace(f" {letter} ", letter)
    return path.replace('"M ', '"M').replace(" z", "z")


def _drop_baggage(root: ET.Element) -> None:
    """Remove metadata, and the style sheet, which would apply to the whole page."""
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag in (f"{{{_SVG}}}metadata", f"{{{_SVG}}}style"):
                parent.remove(child)


def _rename_ids(root: ET.Element, name: str) -> None:
    """Give ids that are referred to names of our own, and remove all others."""
    used: dict[str, str] = {}
    for element in root.iter():
        target = element.attrib.pop(_HREF, None)
        if target is not None:
            element.set("href", "#" + used.setdefault(target[1:], f"{name}-{len(used)}"))
        clip = element.get("clip-path")
        if clip is not None:
            element.set("clip-path", f"url(#{used.setdefault(clip[5:-1], f'{name}-{len(used)}')})")
    for element in root.iter():
        own = element.attrib.pop("id", None)
        if own in used:
            element.set("id", used[own])


def _tidy(element: ET.Element) -> None:
    """Round to hundredths of a point, and use the reader's fonts instead of the one for measuring."""
    if "d" in element.attrib:
        element.set("d", _round(" ".join(element.attrib["d"].split())))
    for key in ("x", "y", "transform"):
        if key in element.attrib:
            element.set(key, _round(element.attrib[key]))
    if element.get("transform", "").startswith("rotate(-0 "):
        del element.attrib["transform"]
    if element.tag == f"{{{_SVG}}}text":
        style = re.sub(r"font-family: [^;]*", f"font-family: {FONT}", element.get("style", ""))
        element.set("style", re.sub(r"(font: [^;]*?px )[^;]*", rf"\g<1>{FONT}", style))
    if element.text is not None and not element.text.strip():
        element.text = None
    element.tail = None


def _round(text: str) -> str:
    return re.sub(r"-?\d+\.\d{3,}", lambda match: f"{float(match[0]):.2f}".rstrip("0").rstrip("."), text)
