"""The marks that are printed on a sheet for pen traces, in the arena's coordinates and at true scale."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from realitygap.world import Arena, Grid, Pose

from ._tags import CORNER_FAMILY, CORNER_IDS, CORNER_INSET_M, CORNER_SIZE_M, Box, bounds, ring_width, tag_bits

PEN_NAMES = ("black", "red", "blue", "green", "orange", "purple", "brown", "pink")
"""Default names of the pens of a study."""

GRID_GRAY = 0.62  # seen by people and camera through tracing paper, and no pen
GRID_WIDTH = 0.0005
TEXT_GRAY = 0.45
KEY_WIDTH = 0.088  # of a box in which a pen is tried, at most [m]
KEY_HEIGHT = 0.026
KEY_GAP = 0.012
KEYS_A_STRIP = 8
MARGIN = 0.012  # of paper around everything [m]

GridLine = tuple[Literal["x", "y"], float, float, float]


@dataclass(frozen=True)
class Mark:
    """A straight line or a filled rectangle.

    Attributes:
        x1, y1, x2, y2: Ends of a line, or opposite corners [m].
        gray: 0 is black, 1 is the paper's white.
        width: Width of a line [m]; 0 fills the rectangle.
    """

    x1: float
    y1: float
    x2: float
    y2: float
    gray: float
    width: float = 0.0


@dataclass(frozen=True)
class Label:
    """Words, from their lower left end [m]; `size` is the height of capitals [m]."""

    x: float
    y: float
    text: str
    size: float
    gray: float = TEXT_GRAY


@dataclass(frozen=True)
class SheetLayout:
    """The sheet of an arena: its walls' rectangle with the grid, four tags, the start, and a box to try each pen in.

    If the outer ring of cells, which pens do not reach, is wide enough, tags and boxes are in it; otherwise, they are
    around the walls.

    Attributes:
        walls: Left, lower, right and upper end of what the walls enclose [m].
        grid: The reachable cells.
        start: Start of trials.
        pens: Names of the pens' boxes.
    """

    walls: Box
    grid: Grid
    start: Pose
    pens: tuple[str, ...] = PEN_NAMES

    @classmethod
    def of(cls, arena: Arena, pens: Sequence[str] = PEN_NAMES) -> SheetLayout:
        """Return the sheet of an arena.

        Raises:
            ValueError: Its tags would not fit.
        """
        left, lower, right, upper = walls = bounds(arena)
        layout = cls(walls, arena.grid, arena.start, tuple(pens))
        if min(right - left, upper - lower) < 3 * CORNER_SIZE_M:
            raise ValueError(
                f"arena {arena.name!r} is {right - left:g} m x {upper - lower:g} m, expected at least "
                f"{3 * CORNER_SIZE_M:g} m each way: four tags lie at its corners"
            )
        return layout

    @property
    def is_ring_free(self) -> bool:
        """True if tags and boxes are between the walls and the reachable cells."""
        return ring_width(self.walls, self.grid) >= CORNER_SIZE_M + CORNER_INSET_M

    @property
    def paper(self) -> Box:
        """The whole sheet."""
        out = MARGIN if self.is_ring_free else MARGIN + CORNER_SIZE_M + CORNER_INSET_M
        left, lower, right, upper = self.walls
        return left - out, lower - out, right + out, upper + out

    def tag_corners(self) -> NDArray[np.float64]:
        """Return the upper left, upper right, lower right and lower left corner of each tag, (4, 4, 2) [m]."""
        inset = CORNER_INSET_M if self.is_ring_free else -CORNER_INSET_M - CORNER_SIZE_M
        left, lower, right, upper = self.walls
        xs = (left + inset, right - inset - CORNER_SIZE_M)
        ys = (lower + inset, upper - inset - CORNER_SIZE_M)
        square = CORNER_SIZE_M * np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float64)
        lowers = [(xs[0], ys[0]), (xs[1], ys[0]), (xs[1], ys[1]), (xs[0], ys[1])]
        return np.array([square + lower_left for lower_left in lowers])

    def key_boxes(self) -> list[Box]:
        """Return the box of each pen in order: eight below the cells, eight above, and none for further pens."""
        tags = self.tag_corners()
        left, right = tags[0, 1, 0] + 2 * KEY_GAP, tags[1, 0, 0] - 2 * KEY_GAP
        n = min(len(self.pens), KEYS_A_STRIP)
        width = min(KEY_WIDTH, (right - left) / max(n, 1) - KEY_GAP)
        first = (left + right - n * width - (n - 1) * KEY_GAP) / 2
        middles = (tags[0, :, 1].mean(), tags[3, :, 1].mean())
        boxes = []
        for k in range(min(len(self.pens), 2 * KEYS_A_STRIP)):
            strip, place = divmod(k, KEYS_A_STRIP)
            x, y = first + place * (width + KEY_GAP), middles[strip]
            boxes.append((x, y - KEY_HEIGHT / 2, x + width, y + KEY_HEIGHT / 2))
        return boxes

    def grid_lines(self) -> list[GridLine]:
        """Return lines of the grid: which coordinate stays, its value, and between which values the other goes [m]."""
        grid = self.grid
        upright: list[GridLine] = [
            ("x", grid.x + k * grid.cell, grid.y, grid.upper_end) for k in range(grid.columns + 1)
        ]
        level: list[GridLine] = [
            ("y", grid.y + k * grid.cell, grid.x, grid.right_end) for k in range(grid.rows + 1)
        ]
        return [*upright, *level]

    def thin_marks(self) -> list[Mark]:
        """Return the marks printed in gray where pens may draw: the grid, and an arrow at the start."""
        marks = []
        for which, at, low, high in self.grid_lines():
            ends = (at, low, at, high) if which == "x" else (low, at, high, at)
            marks.append(Mark(*ends, GRID_GRAY, GRID_WIDTH))
        return marks + self._start_marks()

    def outer_marks(self) -> list[Mark]:
        """Return the marks printed outside the reach of the pens: the walls, the tags, and the boxes."""
        left, lower, right, upper = self.walls
        marks = [*_outline((left, lower, right, upper), 0.3, 0.0008)]
        for box in self.key_boxes():
            marks += _outline(box, GRID_GRAY, GRID_WIDTH)
        for number, corners in zip(CORNER_IDS, self.tag_corners(), strict=True):
            left, lower = corners[3].tolist()
            marks += tag_marks(CORNER_FAMILY, number, left, lower, CORNER_SIZE_M)
        return marks

    def labels(self) -> list[Label]:
        """Return the labels of the pens' boxes."""
        return [
            Label(box[0], box[3] + 0.003, f"{k + 1} {self.pens[k]}", 0.004)
            for k, box in enumerate(self.key_boxes())
        ]

    def _start_marks(self) -> list[Mark]:
        x, y, heading = self.start
        length, head = 0.3 * self.grid.cell, 0.1 * self.grid.cell
        tip = x + length * math.cos(heading), y + length * math.sin(heading)
        marks = [Mark(x, y, *tip, GRID_GRAY, GRID_WIDTH)]
        for turn in (0.8 * math.pi, -0.8 * math.pi):
            end = tip[0] + head * math.cos(heading + turn), tip[1] + head * math.sin(heading + turn)
            marks.append(Mark(*tip, *end, GRID_GRAY, GRID_WIDTH))
        across = head * math.cos(heading + math.pi / 2), head * math.sin(heading + math.pi / 2)
        marks.append(Mark(x - across[0], y - across[1], x + across[0], y + across[1], GRID_GRAY, GRID_WIDTH))
        return marks


def _outline(box: Box, gray: float, width: float) -> list[Mark]:
    left, lower, right, upper = box
    corners = [(left, lower), (right, lower), (right, upper), (left, upper)]
    return [Mark(*corners[k], *corners[(k + 1) % 4], gray, width) for k in range(4)]


def tag_marks(family: str, number: int, left: float, lower: float, size: float) -> list[Mark]:
    """Return the black parts of a tag, row by row from below; those side by side are one, without hairlines between."""
    is_black = ~tag_bits(family, number)
    cell = size / len(is_black)
    marks = []
    for row, bits in enumerate(is_black[::-1]):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], bits.astype(int), [0]])))
        for first, end in edges.reshape(-1, 2).tolist():
            y = lower + row * cell
            marks.append(Mark(left + first * cell, y, left + end * cell, y + cell, 0.0))
    return marks
