"""Straight walls: how far they are, and whether an outline touches one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Walls:
    """The walls of an arena as arrays.

    Args:
        segments: (w, 4) x1, y1, x2, y2 of each wall [m]; there may be none.
    """

    def __init__(self, segments: Sequence[Sequence[float]]) -> None:
        ends = np.asarray(segments, dtype=float).reshape(-1, 4)
        self.n = len(ends)
        self._x, self._y = ends[:, 0].copy(), ends[:, 1].copy()
        self._along_x, self._along_y = ends[:, 2] - ends[:, 0], ends[:, 3] - ends[:, 1]
        squared = self._along_x**2 + self._along_y**2
        self._squared = np.where(squared > 0, squared, 1.0)  # a wall without length is a point

    def nearest(self, x: float, y: float) -> float:
        """Distance from a point to the nearest wall [m]; inf where there is none."""
        if not self.n:
            return float("inf")
        to_x, to_y = x - self._x, y - self._y
        along = np.clip((to_x * self._along_x + to_y * self._along_y) / self._squared, 0.0, 1.0)
        return float(np.hypot(to_x - along * self._along_x, to_y - along * self._along_y).min())

    def touch(self, xs: Floats, ys: Floats) -> bool:
        """Whether an outline with corners (b,) [m] in order meets a wall."""
        if not self.n:
            return False
        xs, ys = xs[:, None], ys[:, None]
        side = self._along_x * (ys - self._y) - self._along_y * (xs - self._x)
        edge_x, edge_y = np.roll(xs, -1, 0) - xs, np.roll(ys, -1, 0) - ys
        first = edge_x * (self._y - ys) - edge_y * (self._x - xs)
        last = first + edge_x * self._along_y - edge_y * self._along_x
        return bool(((side * np.roll(side, -1, 0) <= 0) & (first * last <= 0)).any())

    def ranges(self, xs: Floats, ys: Floats, angles: Floats, reach: float) -> Floats:
        """Distances [m] along rays from (r,) points at (r,) angles to the first wall, at most `reach`."""
        return self.hits(xs, ys, angles, reach)[0]

    def hits(self, xs: Floats, ys: Floats, angles: Floats, reach: float) -> tuple[Floats, NDArray[np.intp]]:
        """Likewise, and which wall it is; -1 where none is within reach."""
        if not self.n:
            return np.full(len(xs), reach), np.full(len(xs), -1)
        ray_x, ray_y = np.cos(angles)[:, None], np.sin(angles)[:, None]
        to_x, to_y = self._x - xs[:, None], self._y - ys[:, None]
        across = ray_x * self._along_y - ray_y * self._along_x
        parallel = across == 0
        across = np.where(parallel, 1.0, across)
        far = (to_x * self._along_y - to_y * self._along_x) / across
        along = (to_x * ray_y - to_y * ray_x) / across
        meets = ~parallel & (far >= 0) & (along >= 0) & (along <= 1)
        far = np.where(meets, far, np.inf)
        wall = far.argmin(1)
        distance = far[np.arange(len(far)), wall]
        return np.minimum(distance, reach), np.where(distance <= reach, wall, -1)
