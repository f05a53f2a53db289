"""The colors of mixtures of inks on paper, and the mixtures that may explain a color."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ._ink import DARKEST

Floats = NDArray[np.float32]

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
        found = np.empty_like(odds)
        for part in self._parts():
            weight = self.likely[self.color[part]] * np.exp(np.log(odds[part]) @ holds)
            its = weight @ holds.T
            without = np.maximum(weight.sum(axis=1, keepdims=True) - its, np.float32(1e-20))
            its *= np.minimum(most[part] / odds[part], 1)
            found[part] = its / (its + without)
        return found

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
        found = np.empty((len(self.color), self.n_pens), np.float32)
        for part in self._parts():
            weight = self.likely[self.color[part]] * prior(known[part] if len(known) > 1 else known)
            weight += np.float32(1e-20)
            found[part] = (weight @ holds.T) / weight.sum(axis=1, keepdims=True)
        return found


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
