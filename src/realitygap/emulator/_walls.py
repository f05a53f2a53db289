"""Straight walls and discs that sensors of an emulated robot see, and that its outline meets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from realitygap.world import Arena

Floats = NDArray[np.float64]


class Walls:
    """Straight walls and discs as arrays. An obstacle becomes its sides and, if it is round, the discs of its corners.

    Args:
        segments: (w, 4) x1, y1, x2, y2 of each wall [m]; there may be none.
        discs: (d, 3) x, y and radius of each disc [m]; there may be none.
    """

    def __init__(self, segments: Sequence[Sequence[float]], discs: Sequence[Sequence[float]] = ()) -> None:
        ends = np.asarray(segments, dtype=float).reshape(-1, 4)
        self.n = len(ends)
        self._x, self._y = ends[:, 0].copy(), ends[:, 1].copy()
        self._along_x, self._along_y = ends[:, 2] - ends[:, 0], ends[:, 3] - ends[:, 1]
        squared = self._along_x**2 + self._along_y**2
        self._squared = np.where(squared > 0, squared, 1.0)  # a wall without length is a point

        self._discs = np.asarray(discs, dtype=float).reshape(-1, 3)

    @classmethod
    def of(cls, arena: Arena) -> Walls:
        """Return the walls and obstacles of an arena."""
        discs = [
            (x, y, obstacle.radius)
            for obstacle in arena.obstacles
            if obstacle.radius
            for x, y in obstacle.placed
        ]
        return cls(arena.segments, discs)

    def nearest(self, x: float, y: float) -> float:
        """Return the distance [m] from a point to the nearest wall or disc: inf if there is none, below 0 in a disc."""
        far = np.hypot(x - self._discs[:, 0], y - self._discs[:, 1]) - self._discs[:, 2]
        to_disc = float(far.min()) if len(far) else float("inf")
        if not self.n:
            return to_disc
        to_x, to_y = x - self._x, y - self._y
        along = np.clip((to_x * self._along_x + to_y * self._along_y) / self._squared, 0.0, 1.0)
        return min(to_disc, float(np.hypot(to_x - along * self._along_x, to_y - along * self._along_y).min()))

    def touch(self, xs: Floats, ys: Floats) -> bool:
        """Return whether an outline with corners (b,) [m] in order touches a wall or a disc."""
        if len(self._discs) and self._touch_disc(xs, ys):
            return True
        if not self.n:
            return False
        xs, ys = xs[:, None], ys[:, None]
        side = self._along_x * (ys - self._y) - self._along_y * (xs - self._x)
        edge_x, edge_y = np.roll(xs, -1, 0) - xs, np.roll(ys, -1, 0) - ys
        first = edge_x * (self._y - ys) - edge_y * (self._x - xs)
        last = first + edge_x * self._along_y - edge_y * self._along_x
        return bool(((side * np.roll(side, -1, 0) <= 0) & (first * last <= 0)).any())

    def _touch_disc(self, xs: Floats, ys: Floats) -> bool:
        """Return whether a side of an outline is within the radius of a disc."""
        along_x, along_y = np.roll(xs, -1) - xs, np.roll(ys, -1) - ys
        to_x, to_y = self._discs[:, :1] - xs, self._discs[:, 1:2] - ys
        squared = along_x**2 + along_y**2
        share = np.clip((to_x * along_x + to_y * along_y) / np.where(squared > 0, squared, 1.0), 0.0, 1.0)
        far = np.hypot(to_x - share * along_x, to_y - share * along_y).min(1)
        return bool((far <= self._discs[:, 2]).any())

    def ranges(self, xs: Floats, ys: Floats, angles: Floats, reach: float) -> Floats:
        """Return distances [m] along rays from (r,) points at (r,) angles to the first of them, at most `reach`."""
        return self.hits(xs, ys, angles, reach)[0]

    def hits(self, xs: Floats, ys: Floats, angles: Floats, reach: float) -> tuple[Floats, NDArray[np.intp]]:
        """Return distances along rays, and indices of the objects, discs after walls, or -1 if none is within reach."""
        ray_x, ray_y = np.cos(angles)[:, None], np.sin(angles)[:, None]
        far = np.hstack([self._to_walls(xs, ys, ray_x, ray_y), self._to_discs(xs, ys, ray_x, ray_y)])
        if not far.shape[1]:
            return np.full(len(xs), reach), np.full(len(xs), -1)
        which = far.argmin(1)
        distance = far[np.arange(len(far)), which]
        return np.minimum(distance, reach), np.where(distance <= reach, which, -1)

    def _to_walls(self, xs: Floats, ys: Floats, ray_x: Floats, ray_y: Floats) -> Floats:
        """Return the distance along each ray to each wall, (r, w) [m]; inf if it misses."""
        to_x, to_y = self._x - xs[:, None], self._y - ys[:, None]
        across = ray_x * self._along_y - ray_y * self._along_x
        parallel = across == 0
        across = np.where(parallel, 1.0, across)
        far = (to_x * self._along_y - to_y * self._along_x) / across
        along = (to_x * ray_y - to_y * ray_x) / across
        meets = ~parallel & (far >= 0) & (along >= 0) & (along <= 1)
        return np.asarray(np.where(meets, far, np.inf))

    def _to_discs(self, xs: Floats, ys: Floats, ray_x: Floats, ray_y: Floats) -> Floats:
        """Return the distance along each ray to each disc, (r, d) [m]; 0 inside it, inf if it misses."""
        to_x, to_y = self._discs[:, 0] - xs[:, None], self._discs[:, 1] - ys[:, None]
        ahead = to_x * ray_x + to_y * ray_y
        aside = to_x * ray_y - to_y * ray_x
        left = self._discs[:, 2] ** 2 - aside**2
        far = ahead - np.sqrt(np.maximum(left, 0.0))
        inside = np.hypot(to_x, to_y) <= self._discs[:, 2]
        return np.asarray(np.where(inside, 0.0, np.where((left >= 0) & (far >= 0), far, np.inf)))
