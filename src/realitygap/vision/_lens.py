"""The mapping of points on a flat sheet to a photograph: a homography, then the distortion of a lens."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
