"""A picture of plain shapes as pixels."""

from __future__ import annotations

import io
import itertools
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ._colors import Ink, rgb_of
from ._picture import Disc, Line, Picture, Point, Text

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

FINER = 3
"""Factor by which shapes are drawn finer than shown, in both directions, which smooths their edges."""
_POINTS = 480.0
"""Width of the picture for which line widths and letters have the size that they say [pt]."""


def to_image(picture: Picture, width: int = 720) -> Image:
    """Return the picture as an RGB image, line widths and letters as large in it as `to_svg` has them in 480 pt.

    Args:
        picture: Picture to draw.
        width: Width of the image [pixels]; its height follows.

    Raises:
        ValueError: The picture's rectangle is empty, or the width is not above 0.
    """
    from PIL import Image, ImageDraw

    across, up = picture.right - picture.left, picture.top - picture.bottom
    if not (across > 0 and up > 0 and width > 0):
        raise ValueError(f"The picture is {across:g} by {up:g}, {width} pixels wide: expected more than 0.")
    height = max(1, round(width * up / across))
    large = Image.new("RGB", (width * FINER, height * FINER), Ink.GROUND)
    _Pen(picture, ImageDraw.Draw(large), width * FINER).draw()
    return large.resize((width, height), Image.Resampling.BOX)


def to_png(picture: Picture, width: int = 720) -> bytes:
    """Return the picture as the bytes of a PNG file; see `to_image`."""
    file = io.BytesIO()
    to_image(picture, width).save(file, "PNG")
    return file.getvalue()


class _Pen:
    """Draws the shapes of a picture, one after the other."""

    def __init__(self, picture: Picture, draw: ImageDraw, width: int) -> None:
        self.picture, self.canvas = picture, draw
        self.scale = width / (picture.right - picture.left)  # pixels for each of the picture's units
        self.point = width / _POINTS  # pixels for each pt

    def draw(self) -> None:
        for shape in self.picture.shapes:
            if isinstance(shape, Line):
                self.line(shape)
            elif isinstance(shape, Disc):
                self.disc(shape)
            else:
                self.text(shape)

    def at(self, x: float, y: float) -> Point:
        return (x - self.picture.left) * self.scale, (self.picture.top - y) * self.scale

    def line(self, line: Line) -> None:
        points = [self.at(*point) for point in line.points]
        if line.fill is not None and len(points) > 2:
            self.canvas.polygon(points, fill=rgb_of(line.fill))
        if line.color is None or len(points) < 2:
            return
        width = max(1, round(line.width * self.point))
        path = [*points, points[0], points[1]] if line.closed else points
        dashes = _dashed(path, [part * self.point for part in line.dash]) if line.dash else iter([path])
        for part in dashes:
            self.canvas.line(part, fill=rgb_of(line.color), width=width, joint="curve")

    def disc(self, disc: Disc) -> None:
        x, y = self.at(disc.x, disc.y)
        radius = disc.radius * self.point
        if disc.color is not None:
            outer = radius + disc.width * self.point / 2
            self.canvas.ellipse([x - outer, y - outer, x + outer, y + outer], fill=rgb_of(disc.color))
            radius -= disc.width * self.point / 2
        if radius > 0:
            self.canvas.ellipse([x - radius, y - radius, x + radius, y + radius], fill=rgb_of(disc.fill))

    def text(self, text: Text) -> None:
        from PIL import ImageFont

        x, y = self.at(text.x, text.y)
        x, y = x + text.shift[0] * self.point, y - text.shift[1] * self.point
        font = ImageFont.load_default(text.size * self.point)
        anchor = {"start": "lm", "middle": "mm", "end": "rm"}[text.anchor]
        rim = round(1.5 * self.point) if text.halo else 0
        self.canvas.text(
            (x, y),
            text.text,
            fill=rgb_of(text.color),
            font=font,
            anchor=anchor,
            stroke_width=rim,
            stroke_fill=rgb_of(Ink.GROUND),
        )


def _dashed(path: Sequence[Point], dash: Sequence[float]) -> Iterator[list[Point]]:
    """Yield the strokes of a dashed line: lengths of strokes and gaps in turn, all above 0."""
    lengths = itertools.cycle(dash)
    is_stroke, left = True, next(lengths)
    for (x1, y1), (x2, y2) in itertools.pairwise(path):
        whole = math.hypot(x2 - x1, y2 - y1)
        done = 0.0
        while whole - done > 0:
            onward = min(done + left, whole)
            if is_stroke:
                yield [
                    (x1 + (x2 - x1) * part / whole, y1 + (y2 - y1) * part / whole) for part in (done, onward)
                ]
            left -= onward - done
            done = onward
            if left <= 0:
                is_stroke, left = not is_stroke, next(lengths)


__all__ = ["to_image", "to_png"]
