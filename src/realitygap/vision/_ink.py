"""The ink density of a sheet, corrected for light, shadows, and printed marks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import from_extra

from ._layout import SheetLayout
from ._raster import raster

Floats = NDArray[np.float32]

WIDEST_INK = 0.007  # what is dark over less than this is ink, over more a shadow [m]
WIDEST_BUNDLE = 0.03  # of lines without paper between them [m]
SHADOW_TINT = 0.1  # a shadow colors what it falls on by less
DARKEST_SHADOW = 0.45  # and leaves more than this share of the light
DARKEST = 4.0  # optical density beyond which a camera sees black


def to_linear(picture: NDArray[np.uint8]) -> Floats:
    """Return the light, 0 to 1, of sRGB values, (..., 3)."""
    value = np.arange(256) / 255
    table = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    return table.astype(np.float32)[picture]


def ink_density(picture: NDArray[np.uint8], layout: SheetLayout, px_per_m: float) -> Floats:
    """Return the natural optical density of ink on a rectified sheet, per color channel, (h, w, 3); 0 is bare paper.

    Args:
        picture: (h, w, 3) RGB, from `rectify`.
        layout: Printed layout, whose thin lines are removed.
        px_per_m: Resolution of the picture.
    """
    light = to_linear(picture)
    paper = _paper(light, px_per_m)
    density = -np.log(np.clip(light / paper, np.exp(-DARKEST), 1.0))
    return _without_print(density, layout, px_per_m)


def _paper(light: Floats, px_per_m: float) -> Floats:
    """Return the light of bare paper, (h, w, 3), without lines but with the edges of shadows.

    If lines are so close that no paper is visible between them, paper farther away is used. A shadow is nearly gray and
    never black, so colored or black pixels are ink.
    """
    cv2 = from_extra("cv2", "vision")
    smooth = cv2.GaussianBlur(light, (0, 0), 0.0006 * px_per_m)  # or noise would lift it
    near = _closed(smooth, WIDEST_INK * px_per_m)
    small = cv2.resize(near, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
    far = _closed(small, WIDEST_BUNDLE * px_per_m / 4)
    far = np.maximum(cv2.resize(far, near.shape[1::-1], interpolation=cv2.INTER_LINEAR), 1e-3)
    ratio = near / far
    colored = ratio.max(axis=2) - ratio.min(axis=2)
    is_ink = (colored > SHADOW_TINT) | (ratio.min(axis=2) < DARKEST_SHADOW)
    share = cv2.GaussianBlur(is_ink.astype(np.float32), (0, 0), 0.002 * px_per_m)[..., None]
    paper = near + np.minimum(2 * share, 1) * (far - near)
    return np.asarray(np.maximum(cv2.GaussianBlur(paper, (0, 0), 0.0015 * px_per_m), 1e-3))


def _closed(light: Floats, size: float) -> Floats:
    """Return the light with everything dark and narrower than this many pixels filled."""
    cv2 = from_extra("cv2", "vision")
    odd = 2 * round(size / 2) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (odd, odd))
    return np.asarray(cv2.morphologyEx(light, cv2.MORPH_CLOSE, kernel))


def _without_print(density: Floats, layout: SheetLayout, px_per_m: float) -> Floats:
    """Return the density minus that of the thin printed lines, as far as they are visible."""
    cv2 = from_extra("cv2", "vision")
    drawn = raster(layout.thin_marks(), layout.paper, px_per_m)
    drawn = cv2.GaussianBlur(cv2.dilate(drawn, np.ones((3, 3), np.uint8)), (0, 0), 0.8)
    drawn /= max(float(drawn.max()), 1e-6)
    on_line = drawn > 0.8
    seen = np.median(density[on_line], axis=0) if on_line.any() else np.zeros(3, np.float32)
    return np.asarray(np.maximum(density - 1.15 * drawn[..., None] * seen.astype(np.float32), 0))
