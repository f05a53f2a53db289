"""The floor of an arena: dark tape, or an image."""

from __future__ import annotations

import base64
import zlib
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import check_finite

from ._obstacle import TAPE_WIDTH, Segment, distance_to_segment

MOST_PIXELS = 512  # across or up: a larger image is more than line sensors see, and would fill records


@dataclass(frozen=True)
class FloorImage:
    """The brightness of the floor, pixel by pixel. Beyond the image it is that of the nearest edge.

    Attributes:
        x, y: Lower left corner [m].
        width: Width on the floor [m]; pixels are square.
        columns, rows: Numbers of pixels.
        pixels: (rows * columns) bytes, 0 black to 255 white, the top row first, compressed and in letters.
    """

    x: float
    y: float
    width: float
    columns: int
    rows: int
    pixels: str

    def __post_init__(self) -> None:
        """Raise a ValueError if a number is infinite or NaN."""
        check_finite(vars(self))

    @classmethod
    def of(cls, x: float, y: float, width: float, gray: NDArray[np.uint8]) -> FloorImage:
        """Return the image of (rows, columns) bytes, 0 black to 255 white, the top row first."""
        rows, columns = gray.shape
        packed = base64.b85encode(zlib.compress(np.ascontiguousarray(gray, np.uint8).tobytes(), 9))
        return cls(x, y, width, columns, rows, packed.decode())

    @cached_property
    def gray(self) -> NDArray[np.uint8]:
        """Gray values, 0 black to 255 white, the top row first, (rows, columns)."""
        unpacker = zlib.decompressobj()
        data = unpacker.decompress(base64.b85decode(self.pixels), self.rows * self.columns)
        return np.frombuffer(data, np.uint8).reshape(self.rows, self.columns)

    @property
    def height(self) -> float:
        """Height on the floor [m]."""
        return self.width * self.rows / self.columns

    @property
    def brightness(self) -> NDArray[np.float32]:
        """Brightness, 0 black to 1 white, the row of lowest y first, (rows, columns)."""
        return np.asarray(self.gray[::-1] / np.float32(255), dtype=np.float32)

    def at(self, x: float, y: float) -> float:
        """Return the brightness of the pixel nearest to a point [m]: 0 black, 1 white."""
        scale = self.columns / self.width
        column = min(self.columns - 1, max(0, int((x - self.x) * scale)))
        row = min(self.rows - 1, max(0, int((y - self.y) * scale)))
        return float(self.gray[self.rows - 1 - row, column]) / 255


@dataclass(frozen=True)
class Floor:
    """A white floor with black tape on it, or an image.

    Attributes:
        tape: (k, 4) x1, y1, x2, y2 along the middle of each strip [m].
        tape_width: Width of the strips of tape [m].
        image: Image that is printed on the floor.
    """

    tape: tuple[Segment, ...] = ()
    tape_width: float = TAPE_WIDTH
    image: FloorImage | None = None

    def __post_init__(self) -> None:
        """Raise a ValueError if a number is infinite or NaN."""
        check_finite(vars(self))

    def brightness(self, x: float, y: float) -> float:
        """Return the brightness of the floor at a point [m]: 0 black, as tape is, to 1 white."""
        if any(distance_to_segment(x, y, strip) <= self.tape_width / 2 for strip in self.tape):
            return 0.0
        return 1.0 if self.image is None else self.image.at(x, y)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values without empty ones."""
        values: dict[str, Any] = {}
        if self.tape:
            values |= {"tape": [list(strip) for strip in self.tape], "tape_width": self.tape_width}
        if self.image is not None:
            names = ("x", "y", "width", "columns", "rows", "pixels")
            values["image"] = {name: getattr(self.image, name) for name in names}
        return values

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Floor:
        """Return the floor that `to_dict` described."""
        tape = tuple((x1, y1, x2, y2) for x1, y1, x2, y2 in values.get("tape", ()))
        image = FloorImage(**values["image"]) if "image" in values else None
        return cls(tape, values.get("tape_width", TAPE_WIDTH), image)


BARE_FLOOR = Floor()
