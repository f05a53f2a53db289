"""A camera and a depth camera: one ray for each column of the picture."""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.drawing import Ink, Line, Shape, rgb_of

from ._robot import Device

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

SKY = "lightblue"
GROUND = "#eef3dd"
FAR = 10.0
"""Distance at which bars have their minimum height and colors have faded [m]."""
NO_LIMIT = 1000.0
"""Maximum length of a ray [m]."""
LAMP_FAR = 5.0
"""Distance from which a lamp is a dot [m]."""
LAMP_SIZE = 10
"""Radius of a lamp seen from nearby [pixels]."""
OPENING = 2 * math.pi / 3


class Column(NamedTuple):
    """A column of a camera's picture.

    Attributes:
        color: Color of the wall or robot, as given.
        height: Height of its bar [pixels].
        distance: Distance to it [m].
        closeness: 1 - distance / 10 m, and 0 beyond.
    """

    color: str
    height: int
    distance: float
    closeness: float


class LampSeen(NamedTuple):
    """A lamp as a camera sees it: angle to the left of the heading [rad], distance [m], color."""

    angle: float
    distance: float
    color: str


class Camera(Device):
    """A color picture of walls, robots and lamps ahead, from the robot's center.

    Each column of the picture is a ray. The wall or robot that it meets becomes a bar in its color around the horizon.
    Nearer things are taller and brighter; robots are half as tall as walls. Lamps are discs, drawn over all bars behind
    them.

    Args:
        width, height: Size of the picture [pixels].
        field: Horizontal field of view [rad].
        fade: Whether colors fade with distance.

    Attributes:
        columns: (width,) columns from left to right; None if the ray meets nothing.
        lamps: All lamps, including those behind the robot.

    Source: Jyro 0.3.2. Differs: Jyro's pictures of another size than 60 x 40 are wrong, and its lamps are always
    yellow.
    """

    kind = "camera"

    def __init__(
        self, width: int = 60, height: int = 40, field: float = OPENING, *, fade: bool = True
    ) -> None:
        super().__init__()
        if width < 2 or height < 2 or not 0 < field <= 2 * math.pi:
            raise ValueError(
                f"width {width}, height {height} and field {field:g} rad: expected at least 2 x 2 pixels and a field "
                "above 0 up to 2 pi."
            )
        self.width, self.height, self.field, self.fade = width, height, field, fade
        self.columns: list[Column | None] = [None] * width
        self.lamps: list[LampSeen] = []
        self._mounts = np.zeros((width, 3))
        angle, step = field / 2, field / (width - 1)
        for k in range(width):  # as a running sum, which is how Jyro has it
            self._mounts[k, 2] = angle
            angle -= step

    def read(self) -> None:
        """Refresh the columns and the lamps."""
        distances, hits = self.robot.world.look(self.robot, self._mounts, NO_LIMIT)
        self.columns = [
            None if hit < 0 else self._column(distance, hit)
            for distance, hit in zip(distances.tolist(), hits.tolist(), strict=True)
        ]
        self.lamps = [
            LampSeen(*self._direction(lamp.x, lamp.y), lamp.color) for lamp in self.robot.world.lights
        ]

    def _column(self, distance: float, hit: int) -> Column:
        color, owner = self.robot.world.what(hit)
        closeness = (FAR - min(distance, FAR)) / FAR
        full = self.height / 2 if owner is None else self.height / 4
        return Column(color, int(min(max(closeness**2 * full, 1), full)), distance, closeness)

    def _direction(self, x: float, y: float) -> tuple[float, float]:
        """Return the angle to the left of the heading, -pi/2 to 3 pi/2 [rad], and distance [m]."""
        here = self.robot.pose
        toward = math.atan2(y - here.y, x - here.x) - here.heading
        return (toward + math.pi / 2) % (2 * math.pi) - math.pi / 2, math.hypot(x - here.x, y - here.y)

    @property
    def image(self) -> NDArray[np.uint8]:
        """Red, green and blue, 0 to 255, (height, width, 3)."""
        from PIL import Image, ImageDraw

        image = Image.new("RGB", (self.width, self.height), "white")
        self._paint(ImageDraw.Draw(image))
        return np.asarray(image)

    @property
    def pixels(self) -> NDArray[np.float32]:
        """Red, green and blue, 0 to 1, (height, width, 3)."""
        return self.image.astype(np.float32) / np.float32(255)

    def _paint(self, draw: ImageDraw) -> None:
        middle = self.height / 2
        draw.rectangle([(0, 0), (self.width, middle)], fill=rgb_of(SKY))
        draw.rectangle([(0, middle), (self.width, self.height)], fill=rgb_of(GROUND))
        seen: list[tuple[float, int, Column | LampSeen]] = [
            (column.distance, k, column) for k, column in enumerate(self.columns) if column
        ]
        seen += [(lamp.distance, -1, lamp) for lamp in self.lamps]
        for _, k, what in sorted(seen, key=lambda one: one[0], reverse=True):
            if isinstance(what, Column):
                self._bar(draw, k, what, self._shade(what))
            else:
                self._lamp(draw, what)

    def _bar(self, draw: ImageDraw, k: int, column: Column, color: tuple[int, int, int]) -> None:
        top = (self.height - column.height) / 2
        draw.line([(k, top), (k, self.height - top)], fill=color, width=1)

    def _shade(self, column: Column) -> tuple[int, int, int]:
        red, green, blue = rgb_of(column.color)
        share = column.closeness if self.fade else 1.0
        return int(red * share), int(green * share), int(blue * share)

    def _lamp(self, draw: ImageDraw, lamp: LampSeen) -> None:
        x, y = self.width / 2 - lamp.angle / (self.field / 2) * self.width / 2, self.height / 2
        radius = int(LAMP_SIZE * (LAMP_FAR - min(lamp.distance, LAMP_FAR)) / LAMP_FAR)
        draw.ellipse([(x - radius, y - radius), (x + radius, y + radius)], fill=rgb_of(lamp.color))

    def _repr_png_(self) -> bytes:
        from PIL import Image

        file = io.BytesIO()
        scale = max(1, 480 // self.width)
        large = Image.fromarray(self.image).resize((self.width * scale, self.height * scale), 0)
        large.save(file, "PNG")
        return file.getvalue()

    def rays(self) -> list[Shape]:
        """Return the edges of the field of view."""
        shapes: list[Shape] = []
        for angle, column in ((self.field / 2, self.columns[0]), (-self.field / 2, self.columns[-1])):
            if column:
                end = (column.distance * math.cos(angle), column.distance * math.sin(angle))
                ends = (self.robot.point(0.0, 0.0), self.robot.point(*end))
                shapes.append(Line(ends, Ink.PEN4, 0.6, (2.0, 2.0)))
        return shapes

    def shapes(self) -> list[Shape]:
        """Return the camera on the robot."""
        return [self.robot.polygon(((0.14, -0.06), (0.06, -0.06), (0.06, 0.06), (0.14, 0.06)), "black", None)]

    def to_dict(self) -> dict[str, Any]:
        """Return the size, field, and columns, as plain values."""
        return super().to_dict() | {
            "width": self.width,
            "height": self.height,
            "field": self.field,
            "columns": [list(column) if column else None for column in self.columns],
            "lamps": [list(lamp) for lamp in self.lamps],
        }


class DepthCamera(Camera):
    """A gray picture of distances: white is near, black is `max_range` and further.

    Floor and sky are ramps that darken towards the horizon. Lamps are invisible.

    Args:
        max_range: Distance at which bars are black [m].
        width, height, field: Arguments of `Camera`.

    Source: Jyro 0.3.2. Differs: as `Camera`. Its key is `robot["depth-camera"]`, so that a robot can have both cameras.
    """

    kind = "depth-camera"

    def __init__(self, max_range: float, width: int = 60, height: int = 40, field: float = OPENING) -> None:
        super().__init__(width, height, field)
        if not (math.isfinite(max_range) and max_range > 0):
            raise ValueError(f"max_range is {max_range!r}, expected a length above 0 [m].")
        self.max_range = max_range

    def _paint(self, draw: ImageDraw) -> None:
        for row in range(int(self.height / 2)):
            shade = (_gray(row / (self.height / 2)),) * 3
            draw.line([(0, row), (self.width, row)], fill=shade, width=1)
            draw.line([(0, self.height - row), (self.width, self.height - row)], fill=shade, width=1)
        for k, column in enumerate(self.columns):
            if column:
                self._bar(draw, k, column, (_gray(column.distance / self.max_range),) * 3)


def _gray(share: float) -> int:
    return int(255 - max(min(share, 1.0), 0.0) * 255)
