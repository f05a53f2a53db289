"""The pens whose ink is in a pixel: one, two or three inks on paper, in a camera's picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import VisionError, from_extra

from ._ink import Mixtures, to_linear
from ._layout import SheetLayout
from ._pixels import shape_of, to_pixels
from ._tags import Box

Floats = NDArray[np.float32]
Place = tuple[NDArray[np.int64], ...]
"""Rows and columns."""

COMMON_INKS = {
    "black": (40, 40, 42), "gray": (120, 120, 122), "red": (205, 35, 50), "blue": (30, 62, 165),
    "green": (20, 132, 75), "orange": (243, 125, 30), "purple": (112, 48, 145), "violet": (112, 48, 145),
    "brown": (125, 72, 40), "pink": (240, 105, 165), "magenta": (200, 30, 120), "turquoise": (0, 150, 160),
    "cyan": (0, 160, 215), "yellow": (250, 220, 40),
}  # fmt: skip
"""sRGB of a full stroke of a felt-tip pen of this name, if it was not tried on the sheet."""

AROUND = 0.006  # of the sheet around the cells in which traces are looked for [m]
FAINTEST = 0.35  # density below which a pixel is bare paper
SHARPER = 3  # power of a presence: what is likeliest around counts more than its share
RARE = 0.015  # share of the ink around that a pen has at least
NEAR = 0.005  # what counts as around [m]
ROUNDS = 2
STRAY = 0.02  # probability of a pen where its trace does not pass


@dataclass(frozen=True)
class PenMaps:
    """Maps of the possible ink of each pen on a rectified sheet.

    Attributes:
        box: Left, lower, right and upper end of what they show: the cells and a little around them [m].
        px_per_m: Resolution of the maps [px/m].
        pens: Their names.
        inks: (p, 3) optical density of a full stroke of each.
        is_tried: (p,) True if the color was seen in the pen's box, and False if it is a guess from its name.
        strength: (h, w) optical density of all ink.
        presence: (p, h, w) probability that a pixel has this pen's ink, 0 on bare paper.
        hidden: (p, h, w) best likelihood of the pixel's color with this ink, relative to the best explanation, 0 to 1.
        mixtures: Mixtures that may explain the inked pixels.
        place: Rows and columns of the inked pixels.
    """

    box: Box
    px_per_m: float
    pens: tuple[str, ...]
    inks: Floats
    is_tried: NDArray[np.bool_]
    strength: Floats
    presence: Floats
    hidden: Floats
    mixtures: Mixtures
    place: Place

    @cached_property
    def highest(self) -> Floats:
        """Return the presence of the most likely pen, (h, w)."""
        return np.asarray(self.presence.max(axis=0))

    @cached_property
    def weight(self) -> Floats:
        """Weight of each pixel as evidence, (h, w).

        It is higher in the middle of a line, because its edges have a different color.
        """
        return np.asarray(np.minimum(self.strength, 3.0) ** 2 + np.float32(1e-3))

    @cached_property
    def weight_around(self) -> Floats:
        """Return the weight, smoothed over half a millimeter, (h, w)."""
        cv2 = from_extra("cv2", "vision")
        return np.asarray(cv2.GaussianBlur(self.weight, (0, 0), 0.0005 * self.px_per_m))

    @cached_property
    def smooth_strength(self) -> Floats:
        """Return the strength without the noise of single pixels, (h, w)."""
        cv2 = from_extra("cv2", "vision")
        return np.asarray(cv2.GaussianBlur(self.strength, (0, 0), 0.7))

    def along(self, traces: Floats, of_itself: Floats) -> PenMaps:
        """Return the maps, given the possible places of the other pens' traces, which explain ink better than others.

        Args:
            traces: (p, h, w) probability that a trace passes, 0 to 1.
            of_itself: (p, h, w) maximum weight of this for a pen's own ink.
        """
        passing, most = (
            np.stack([layer[self.place] for layer in part], axis=1) for part in (traces, of_itself)
        )
        passing = (STRAY + (0.5 - STRAY) * passing).astype(np.float32)
        presence = self.mixtures.presence_along(passing, most)
        return replace(self, presence=_on_map(presence, self.place, self.presence.shape))


def separate_pens(
    density: Floats, layout: SheetLayout, px_per_m: float, drawn: Sequence[int] | None = None
) -> PenMaps:
    """Tell the inks of a sheet apart.

    Args:
        density: (h, w, 3) density from `ink_density`.
        layout: Layout whose boxes show the color of each pen.
        px_per_m: Resolution of the picture.
        drawn: Pens of the layout that drew. Default: all.

    Raises:
        VisionError: A pen was not tried in its box, and its name is no color.
    """
    numbers = range(len(layout.pens)) if drawn is None else drawn
    pens = [layout.pens[k] for k in numbers]
    inks, is_tried = _inks(density, layout, px_per_m, numbers)
    box = _around_cells(layout)
    density = _part(density, layout.paper, box, px_per_m)
    strength = np.linalg.norm(density, axis=2)
    place = np.nonzero(strength > FAINTEST)
    mixtures = Mixtures.of(density[place], inks)
    shape = (len(pens), *strength.shape)
    presence = mixtures.presence(np.ones((1, len(pens)), np.float32))
    for _ in range(ROUNDS):
        around = _around(_on_map(presence, place, shape), strength, px_per_m, place)
        presence = mixtures.presence(around + RARE)
    return PenMaps(
        box, px_per_m, tuple(pens), inks, is_tried, strength,
        _on_map(presence, place, shape), _on_map(mixtures.possible(), place, shape), mixtures, place,
    )  # fmt: skip


def _around_cells(layout: SheetLayout) -> Box:
    grid, out = layout.grid, AROUND
    return grid.x - out, grid.y - out, grid.right_end + out, grid.upper_end + out


def _part(picture: Floats, whole: Box, box: Box, px_per_m: float) -> Floats:
    """Return the part of a box's picture that shows a smaller box within it."""
    top, left = round((whole[3] - box[3]) * px_per_m), round((box[0] - whole[0]) * px_per_m)
    rows, columns = shape_of(box, px_per_m)
    return picture[max(top, 0) : top + rows, max(left, 0) : left + columns]


def _inks(
    density: Floats, layout: SheetLayout, px_per_m: float, numbers: Sequence[int]
) -> tuple[Floats, NDArray[np.bool_]]:
    boxes = layout.key_boxes()
    inks, tried = [], []
    for k in numbers:
        seen = _tried(density, boxes[k], layout, px_per_m) if k < len(boxes) else None
        tried.append(seen is not None)
        inks.append(_named(layout.pens[k]) if seen is None else seen)
    return np.array(inks, np.float32), np.array(tried)


def _tried(density: Floats, box: Box, layout: SheetLayout, px_per_m: float) -> Floats | None:
    """Return the density of a full stroke in a pen's box; None if the box is empty."""
    inset = 0.003
    corners = np.array([(box[0] + inset, box[3] - inset), (box[2] - inset, box[1] + inset)])
    (left, upper), (right, lower) = np.round(to_pixels(corners, layout.paper, px_per_m)).astype(int)
    inside = density[upper:lower, left:right].reshape(-1, 3)
    strength = np.linalg.norm(inside, axis=1)
    inked = np.sort(strength[strength > 2 * FAINTEST])
    if len(inked) < LEAST_TRIED * px_per_m**2:
        return None
    full = inside[strength >= inked[int(0.6 * len(inked))]]
    return np.asarray(np.median(full, axis=0))


LEAST_TRIED = 8e-6
"""Ink in a box from which on its pen was tried [m²]."""


def _named(pen: str) -> Floats:
    """Return the density of a full stroke of a pen by its name.

    Raises:
        VisionError: It is no color.
    """
    from matplotlib.colors import is_color_like, to_rgb

    if pen.lower() in COMMON_INKS:
        color = np.array(COMMON_INKS[pen.lower()], np.uint8)
    elif is_color_like(pen.lower()):
        color = np.round(255 * np.array(to_rgb(pen.lower()))).astype(np.uint8)
    else:
        raise VisionError(
            f"Pen {pen!r}: its box on the sheet is empty, and its name is no color. Draw a line in the box with it, or "
            "name its color, such as red or #c01030."
        )
    return -np.log(np.maximum(to_linear(color), np.float32(0.02)))


def _around(presence: Floats, strength: Floats, px_per_m: float, place: Place) -> Floats:
    """Return each pen's share of the ink around each place, (n, p)."""
    cv2 = from_extra("cv2", "vision")
    sigma = NEAR * px_per_m / 4
    small = [
        cv2.resize(
            layer**SHARPER * np.minimum(strength, 3), None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA
        )
        for layer in presence
    ]
    smooth = np.array([cv2.GaussianBlur(layer, (0, 0), sigma) for layer in small])
    smooth /= np.maximum(smooth.sum(axis=0), 1e-4)
    full = [
        cv2.resize(layer, strength.shape[::-1], interpolation=cv2.INTER_LINEAR)[place] for layer in smooth
    ]
    return np.stack(full, axis=1)


def _on_map(values: Floats, place: Place, shape: tuple[int, ...]) -> Floats:
    """Return values (n, p) at their places, 0 elsewhere, (p, h, w)."""
    maps = np.zeros(shape, np.float32)
    for p in range(shape[0]):
        maps[p][place] = values[:, p]
    return maps
