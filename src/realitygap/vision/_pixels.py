"""A sheet in pixels: straight from above, and through a camera that views it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import from_extra

from ._layout import Mark
from ._tags import Box

SUB = 4  # fractional bits of OpenCV's drawing coordinates


def shape_of(box: Box, px_per_m: float) -> tuple[int, int]:
    """Return rows and columns of a picture of this box."""
    return round((box[3] - box[1]) * px_per_m), round((box[2] - box[0]) * px_per_m)


def to_pixels(points: NDArray[np.float64], box: Box, px_per_m: float) -> NDArray[np.float64]:
    """Return column and row of points [m] in a picture of this box, (n, 2). The middle of pixel 0 is at 0."""
    column = (points[..., 0] - box[0]) * px_per_m - 0.5
    row = (box[3] - points[..., 1]) * px_per_m - 0.5
    return np.stack([column, row], axis=-1)


def to_meters(pixels: NDArray[np.float64], box: Box, px_per_m: float) -> NDArray[np.float64]:
    """Return points [m] of columns and rows in a picture of this box, (n, 2)."""
    x = (pixels[..., 0] + 0.5) / px_per_m + box[0]
    y = box[3] - (pixels[..., 1] + 0.5) / px_per_m
    return np.stack([x, y], axis=-1)


def raster(marks: Iterable[Mark], box: Box, px_per_m: float) -> NDArray[np.float32]:
    """Return the darkness of marks, 0 for white paper to 1 for black, (h, w); row 0 is the upper edge of the box."""
    cv2 = from_extra("cv2", "vision")
    picture = np.zeros(shape_of(box, px_per_m), np.float32)
    fine = np.zeros(picture.shape, np.uint8)
    for mark in marks:
        ends = np.array([(mark.x1, mark.y1), (mark.x2, mark.y2)])
        if mark.width:
            corners = _stroke(ends, mark.width)
        else:
            corners = np.array(
                [(mark.x1, mark.y1), (mark.x2, mark.y1), (mark.x2, mark.y2), (mark.x1, mark.y2)]
            )
        pixels = to_pixels(corners, box, px_per_m)
        low = np.maximum(np.floor(pixels.min(axis=0)).astype(int) - 2, 0)
        high = np.ceil(pixels.max(axis=0)).astype(int) + 3
        part = fine[low[1] : high[1], low[0] : high[0]]
        part[:] = 0
        moved = np.round((pixels - low) * (1 << SUB)).astype(np.int32)
        cv2.fillConvexPoly(part, moved, 255, cv2.LINE_AA, SUB)
        place = picture[low[1] : high[1], low[0] : high[0]]
        np.maximum(place, part.astype(np.float32) * np.float32((1 - mark.gray) / 255), out=place)
    return picture


def _stroke(ends: NDArray[np.float64], width: float) -> NDArray[np.float64]:
    """Return the corners of a line of this width, (4, 2)."""
    along = ends[1] - ends[0]
    length = float(np.hypot(*along))
    across = np.array([-along[1], along[0]]) * (width / 2 / length)
    return np.array([ends[0] + across, ends[1] + across, ends[1] - across, ends[0] - across])


Floats = NDArray[np.float64]


@dataclass(frozen=True)
class View:
    """A camera's view of a plane.

    A point of the plane goes through the homography; its offset from the picture's middle, in half diagonals, is then
    multiplied by 1 + k1 r² + k2 r⁴.

    Attributes:
        homography: (3, 3) homography from the plane [m] to the picture without its lens [px].
        k1: Distortion of the lens.
        k2: Distortion of the lens, farther out.
        width: Width of the picture [px].
        height: Height of the picture [px].

    Source: Brown (1971), radial distortion. Differs: about the picture's middle, and without tangential terms.
    """

    homography: Floats
    k1: float
    k2: float
    width: int
    height: int

    def __call__(self, points: Floats) -> Floats:
        """Return column and row [px] of points (..., 2) of the plane [m], (..., 2)."""
        h = self.homography
        x, y = points[..., 0], points[..., 1]
        w = h[2, 0] * x + h[2, 1] * y + h[2, 2]
        middle = np.array([(self.width - 1) / 2, (self.height - 1) / 2])
        u = (h[0, 0] * x + h[0, 1] * y + h[0, 2]) / w - middle[0]
        v = (h[1, 0] * x + h[1, 1] * y + h[1, 2]) / w - middle[1]
        far = (u * u + v * v) * (4 / (self.width**2 + self.height**2))
        bent = 1 + far * (self.k1 + self.k2 * far)
        return np.stack([u * bent + middle[0], v * bent + middle[1]], axis=-1)

    @classmethod
    def from_numbers(cls, numbers: Floats, width: int, height: int) -> View:
        """Return the view of `numbers`."""
        scale = np.hypot(width, height)
        homography = np.append(numbers[:8], 1.0).reshape(3, 3) * np.array([[scale], [scale], [1.0]])
        return cls(homography, float(numbers[8]), float(numbers[9]), width, height)

    def numbers(self) -> Floats:
        """Return numbers that a fit varies, each of a size about 1, (10,)."""
        scale = np.hypot(self.width, self.height)
        h = self.homography / self.homography[2, 2] / np.array([[scale], [scale], [1.0]])
        return np.append(h.ravel()[:8], [self.k1, self.k2])
