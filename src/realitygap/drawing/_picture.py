"""Plain shapes that make a picture, and the picture as SVG."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from realitygap._foreign_text import page_text

from ._colors import Ink

FONT = "'Helvetica Neue', Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif"

Point = tuple[float, float]


@dataclass(frozen=True)
class Line:
    """Straight pieces from point to point, perhaps closed and filled.

    Attributes:
        points: (n, 2) in the picture's unit, y upwards.
        color: Color of the line; None for none.
        width: Width of the line [pt].
        dash: Lengths of strokes and gaps [pt]; empty for an unbroken line.
        closed: True to join the last point to the first.
        fill: Color of the area, None for none.
    """

    points: tuple[Point, ...]
    color: str | None = Ink.TEXT
    width: float = 1.0
    dash: tuple[float, ...] = ()
    closed: bool = False
    fill: str | None = None


@dataclass(frozen=True)
class Disc:
    """A filled circle whose size does not follow the picture's unit.

    Attributes:
        x, y: Center, in the picture's unit.
        radius: [pt].
        color: Color of the rim; None for none.
        fill: Color of the area.
        width: Width of the rim [pt].
    """

    x: float
    y: float
    radius: float
    color: str | None = None
    fill: str = Ink.TEXT
    width: float = 1.0


@dataclass(frozen=True)
class Text:
    """A line of text.

    Attributes:
        x, y: Position in the picture's unit: its start, middle, or end, at half of its height.
        text: Text to show.
        size: [pt].
        anchor: Part of the text that is at x.
        shift: Offset to the right and up [pt].
        color: Color of the letters.
        bold: True for bold letters.
        halo: True for a rim in the background's color, which separates the letters from lines.
        upright: True for text that runs upwards.
    """

    x: float
    y: float
    text: str
    size: float = 8.0
    anchor: Literal["start", "middle", "end"] = "middle"
    shift: Point = (0.0, 0.0)
    color: str = Ink.TEXT
    bold: bool = False
    halo: bool = False
    upright: bool = False


Shape = Line | Disc | Text


@dataclass(frozen=True)
class Picture:
    """Shapes in a rectangle, one unit as long across as up; it shows itself in notebooks.

    Attributes:
        title: Title.
        description: Text that describes the picture for readers who cannot see it.
        left, bottom, right, top: Rectangle, in the unit of the shapes.
        shapes: Shapes from back to front.
    """

    title: str
    description: str
    left: float
    bottom: float
    right: float
    top: float
    shapes: tuple[Shape, ...]

    def to_svg(self, width: float = 480.0) -> str:
        """Return the picture as one `svg` element with its own background, so that it is legible on any page.

        Args:
            width: Width of the picture [pt]; its height follows.

        Raises:
            ValueError: The rectangle is empty.
        """
        across, up = self.right - self.left, self.top - self.bottom
        if not (across > 0 and up > 0):
            raise ValueError(f"The picture is {across:g} wide and {up:g} high, expected more than 0.")
        scale = width / across
        height = up * scale
        parts = [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{_number(width)}pt" height="{_number(height)}pt" '
            f'viewBox="0 0 {_number(width)} {_number(height)}" role="img" aria-label="{_text(self.description)}" '
            'style="stroke-linejoin: round; max-width: 100%; height: auto">',
            f"<title>{_text(self.title)}</title><desc>{_text(self.description)}</desc>",
            f'<rect width="100%" height="100%" fill="{Ink.GROUND}"/>',
        ]
        for shape in self.shapes:
            if isinstance(shape, Line):
                parts.append(_line(shape, self._placed(shape.points, scale)))
            else:
                ((x, y),) = self._placed([(shape.x, shape.y)], scale)
                parts.append(_disc(shape, x, y) if isinstance(shape, Disc) else _label(shape, x, y))
        return "".join([*parts, "</svg>"])

    def _placed(self, points: Sequence[Point], scale: float) -> list[Point]:
        return [((x - self.left) * scale, (self.top - y) * scale) for x, y in points]

    def _repr_svg_(self) -> str:
        return self.to_svg()


def _number(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".") if "." in f"{value:.2f}" else str(value)


def _text(text: str) -> str:
    return html.escape(page_text(text))


def _line(line: Line, points: list[Point]) -> str:
    path = "M" + "L".join(f"{_number(x)} {_number(y)}" for x, y in points) + ("Z" if line.closed else "")
    style = f'fill="{line.fill or "none"}"'
    if line.color is not None:
        style += f' stroke="{line.color}" stroke-width="{_number(line.width)}"'
        if line.dash:
            style += f' stroke-dasharray="{" ".join(_number(part) for part in line.dash)}"'
    return f'<path d="{path}" {style}/>'


def _disc(disc: Disc, x: float, y: float) -> str:
    rim = "" if disc.color is None else f' stroke="{disc.color}" stroke-width="{_number(disc.width)}"'
    return f'<circle cx="{_number(x)}" cy="{_number(y)}" r="{_number(disc.radius)}" fill="{disc.fill}"{rim}/>'


def _label(text: Text, x: float, y: float) -> str:
    x, y = x + text.shift[0], y - text.shift[1]
    turn = f' transform="rotate(-90 {_number(x)} {_number(y)})"' if text.upright else ""
    halo = (
        f' stroke="{Ink.GROUND}" stroke-width="3" paint-order="stroke" stroke-linejoin="round"'
        if text.halo
        else ""
    )
    return (
        f'<text x="{_number(x)}" y="{_number(y)}" dy="0.35em" text-anchor="{text.anchor}" fill="{text.color}"'
        f'{halo}{turn} style="font: {"bold " if text.bold else ""}{_number(text.size)}px {FONT}">'
        f"{_text(text.text)}</text>"
    )
