"""Sheets for tests: lines drawn by formula, photographed."""

from __future__ import annotations

from functools import cache

import numpy as np

from realitygap.testing import Difficulty, SheetPhotograph, photograph_sheet
from realitygap.vision import SheetLayout
from realitygap.world import cells_along, paper_arena

ARENA = paper_arena()
LAYOUT = SheetLayout.of(ARENA)
SCAN = Difficulty(0.0, 0.0, 0.0, 0.0)
ORDINARY = Difficulty()
SMALL = (2000, 1500)
"""Size of photographs, which are drawn and read in a quarter of the time of a phone's [px]."""


def curve(number: int) -> np.ndarray:
    """(n, 2) a line from the start that winds through the arena, another one for each number [m]."""
    t = np.linspace(0, 1, 400)
    start = ARENA.start
    width, height = 0.70, 0.26
    x = start.x + width * np.sin(np.pi * t * (1 + 0.13 * number)) ** 2 * (0.55 + 0.05 * number)
    y = start.y + height * (0.5 - 0.5 * np.cos(np.pi * t * (0.8 + 0.21 * number))) - 0.07 * np.sin(5 * t)
    return np.column_stack([x, y])


def truth(path: np.ndarray) -> set[int]:
    return set(cells_along(path, ARENA.grid))


@cache
def photo(
    seed: int,
    difficulty: Difficulty = ORDINARY,
    n: int = 8,
    has_key: bool = True,
    size: tuple[int, int] | None = SMALL,
) -> SheetPhotograph:
    """A photograph of a sheet on which the first n pens drew; None is the size of a phone's photographs."""
    return photograph_sheet(
        LAYOUT, [curve(k) for k in range(n)], seed, difficulty, has_key=has_key, size=size
    )
