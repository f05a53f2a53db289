"""Ink on paper: its optical density, the colors of mixtures, and the mixtures that may explain a color."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import from_extra

from ._layout import SheetLayout
from ._pixels import raster

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


CELL = 0.1  # of the table of densities
SPREAD = (0.14, 0.055)  # deviation of a density: at 0, and more for each unit of it
AMOUNTS = {
    1: (0.15, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0, 1.25, 1.6, 2.0, 2.5),
    2: (0.25, 0.5, 0.85, 1.3, 2.0),
    3: (0.4, 1.2),
}
"""Amounts of each ink in sets of one, two, or three: 1 in a full stroke, more if a line crosses itself."""

COVERED = (1.0, 0.65, 0.35)
"""Shares of a pixel that one ink covers: less at the edge of a line."""

SEVERAL = (1.0, 0.3, 0.1)
"""Prior probability of a set of one, two and three inks, if the lines are unknown."""

TOGETHER = 20_000  # places that are weighed at a time


@cache
def ink_sets(n_pens: int) -> tuple[tuple[int, ...], ...]:
    """Return all sets of one, two and three pens."""
    return tuple(pens for count in (1, 2, 3) for pens in itertools.combinations(range(n_pens), count))


@dataclass(frozen=True)
class Mixtures:
    """The mixtures that may explain the color of each inked place.

    Attributes:
        likely: (k, s) likelihood of each color under each set of inks.
        color: (n,) index of the color of each place.
        n_pens: Number of pens.
    """

    likely: Floats
    color: NDArray[np.int64]
    n_pens: int

    @classmethod
    def of(cls, density: Floats, inks: Floats) -> Mixtures:
        """Return the mixtures that may explain the densities of places.

        Args:
            density: (n, 3) optical density of each place.
            inks: (p, 3) optical density of full strokes.
        """
        base = round(DARKEST / CELL)
        cells = np.minimum((density / CELL).astype(np.int32), base - 1)
        codes, color = np.unique((cells[:, 0] * base + cells[:, 1]) * base + cells[:, 2], return_inverse=True)
        seen = np.stack([codes // base**2, codes // base % base, codes % base], axis=1)
        return cls(_likelihoods(((seen + 0.5) * CELL).astype(np.float32), inks), color, len(inks))

    def presence(self, drawing: Floats) -> Floats:
        """Return the probability of each ink, (n, p), if some pens are known to draw more around a place than others.

        Args:
            drawing: (n, p) or (1, p) how much of the ink around each place is each pen's.
        """
        holds = self._holds()
        several = np.array([SEVERAL[len(pens) - 1] for pens in ink_sets(self.n_pens)], np.float32)
        return self._shares(np.log(drawing), lambda part: np.exp(part @ holds) * several)

    def presence_along(self, passing: Floats, of_itself: Floats) -> Floats:
        """Return the probability of each ink, (n, p), given the probabilities that other pens' traces pass.

        A pen's own trace has little weight, because ink that other pens explain is no evidence of it.

        Args:
            passing: (n, p) between 0 and 1.
            of_itself: (n, p) maximum weight of a pen's own trace.
        """
        odds = passing / (1 - passing)
        holds = self._holds()
        most = of_itself / (1 - of_itself)
        shares = np.empty_like(odds)
        for part in self._parts():
            weight = self.likely[self.color[part]] * np.exp(np.log(odds[part]) @ holds)
            its = weight @ holds.T
            without = np.maximum(weight.sum(axis=1, keepdims=True) - its, np.float32(1e-20))
            its *= np.minimum(most[part] / odds[part], 1)
            shares[part] = its / (its + without)
        return shares

    def possible(self) -> Floats:
        """Return the best likelihood of each place's color with a pen's ink, relative to the best, 0..1, (n, p)."""
        holds = self._holds() > 0
        several = np.array([SEVERAL[len(pens) - 1] for pens in ink_sets(self.n_pens)], np.float32)
        weight = self.likely * several
        best = np.stack([weight[:, holds[p]].max(axis=1) for p in range(self.n_pens)], axis=1)
        return np.asarray((best / np.maximum(best.max(axis=1, keepdims=True), 1e-20))[self.color])

    def _holds(self) -> Floats:
        """Return 1 for each set with a pen, (p, s)."""
        sets = ink_sets(self.n_pens)
        return np.array([[p in pens for pens in sets] for p in range(self.n_pens)], np.float32)

    def _parts(self) -> Iterator[slice]:
        return (slice(first, first + TOGETHER) for first in range(0, len(self.color), TOGETHER))

    def _shares(self, known: Floats, prior: Callable[[Floats], Floats]) -> Floats:
        """Return each ink's share of all sets, weighted by likelihood, (n, p)."""
        holds = self._holds()
        shares = np.empty((len(self.color), self.n_pens), np.float32)
        for part in self._parts():
            weight = self.likely[self.color[part]] * prior(known[part] if len(known) > 1 else known)
            weight += np.float32(1e-20)
            shares[part] = (weight @ holds.T) / weight.sum(axis=1, keepdims=True)
        return shares


def _likelihoods(seen: Floats, inks: Floats) -> Floats:
    """Return the likelihood of each color (n, 3) under each set of inks, (n, s)."""
    table = []
    for pens in ink_sets(len(inks)):
        mixes = np.array(list(itertools.product(AMOUNTS[len(pens)], repeat=len(pens))))
        densities = mixes @ inks[list(pens)].astype(np.float64)
        if len(pens) == 1:
            densities = np.concatenate([_at_edge(densities, share) for share in COVERED])
        table.append(_likelihood(seen, densities))
    return np.ascontiguousarray(np.array(table, np.float32).T)


def _at_edge(densities: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Return the densities (m, 3) of pixels that ink covers in part."""
    return np.asarray(-np.log(1 - share * (1 - np.exp(-densities))))


def _likelihood(seen: Floats, densities: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the likelihood of colors as a mean over densities (m, 3) of mixed inks, (n,)."""
    shown = -np.log(np.exp(-densities) + np.exp(-DARKEST) * 0.8)
    deviation = SPREAD[0] + SPREAD[1] * np.linalg.norm(shown, axis=1)
    off = ((seen[:, None, :] - shown[None].astype(np.float32)) ** 2).sum(axis=2) / deviation**2
    return np.asarray((np.exp(-0.5 * off) / deviation**3).mean(axis=1))
