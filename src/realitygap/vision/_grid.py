"""The printed lines of the grid on a photograph: the position of each stretch, next to that of a view."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import from_extra

from ._layout import SheetLayout
from ._pixels import View

Floats = NDArray[np.float64]

REACHES = (0.012, 0.006, 0.004, 0.003)
"""Search range for a line around its place, round by round [m]."""

STRETCHES = 2  # of each side of a cell
ALONG = 25  # samples along a stretch
STEP = 0.00025  # between samples across it [m]
CLEAR = 5.0  # a line stands out from the noise of its surroundings this much
FEWEST = 0.35  # of all stretches, or the grid is not believed
OUTLIER = 0.0008  # further from its neighbors than this it is a pen's line [m]


@dataclass(frozen=True)
class GridOffsets:
    """The places at which stretches of grid lines were found.

    Attributes:
        points: (n, 2) middles of the stretches, as printed [m].
        seen: (n, 2) positions on the photograph [px].
        normals: (n, 2) normals of the lines there, on the photograph, divided by pixels per meter, so that a product is
            in meters.
        upright: (rows, lines) offsets of upright lines along x [m], lowest stretch first.
        level: (lines, columns) offsets of level lines along y [m].
        grid_x, grid_y, cell: Lower left corner and cell size of the grid [m].
    """

    points: Floats
    seen: Floats
    normals: Floats
    upright: Floats
    level: Floats
    grid_x: float
    grid_y: float
    cell: float

    def residuals(self, view: View) -> Floats:
        """Return the distances of these stretches from their places in another view, (n,) [m]."""
        return np.asarray(np.sum((view(self.points) - self.seen) * self.normals, axis=1))

    @property
    def rms(self) -> float:
        """Root mean square of the offsets [m]."""
        values = np.concatenate([self.upright.ravel(), self.level.ravel()])
        return float(np.sqrt(np.mean(values**2)))

    def at(self, points: Floats) -> Floats:
        """Return offsets at points (..., 2) of the sheet, (..., 2) [m]; outside the grid, those of its edge."""
        u = (points[..., 0] - self.grid_x) / self.cell
        v = (points[..., 1] - self.grid_y) / self.cell
        x = _between(self.upright, u, v * STRETCHES - 0.5)
        y = _between(self.level, u * STRETCHES - 0.5, v)
        return np.stack([x, y], axis=-1)


def grid_offsets(
    image: NDArray[np.uint8], view: View, layout: SheetLayout, nearness: int
) -> GridOffsets | None:
    """Find the lines of the grid around their places in a view; None if too few are found.

    Args:
        image: (h, w) the photograph's brightness.
        view: View from the sheet to the photograph.
        layout: Layout with the grid.
        nearness: 0 looks far, higher numbers nearer.
    """
    grid = layout.grid
    reach = REACHES[min(nearness, len(REACHES) - 1)]
    u = (np.arange(grid.columns * STRETCHES) + 0.5) / STRETCHES
    v = (np.arange(grid.rows * STRETCHES) + 0.5) / STRETCHES
    upright = np.stack(np.meshgrid(np.arange(grid.columns + 1.0), v), axis=-1)
    level = np.stack(np.meshgrid(u, np.arange(grid.rows + 1.0)), axis=-1)
    corner = np.array([grid.x, grid.y])
    middles = [corner + grid.cell * upright, corner + grid.cell * level]
    all_offsets = [
        _offsets(image, view, places, axis, reach, grid.cell / STRETCHES)
        for axis, places in enumerate(middles)
    ]
    is_seen = [np.isfinite(part) & ~_is_outlier(part) for part in all_offsets]
    if sum(part.sum() for part in is_seen) < FEWEST * sum(part.size for part in is_seen):
        return None
    points, seen, normals = [], [], []
    for axis, (places, offsets, good) in enumerate(zip(middles, all_offsets, is_seen, strict=True)):
        way = np.eye(2)[axis]
        nominal = places[good]
        points.append(nominal)
        seen.append(view(nominal + offsets[good][:, None] * way))
        normals.append(_normals(view, nominal, 1 - axis))
    upright_ones, level_ones = (
        _smooth(np.where(good, part, np.nan)) for part, good in zip(all_offsets, is_seen, strict=True)
    )
    return GridOffsets(
        np.concatenate(points), np.concatenate(seen), np.concatenate(normals), upright_ones, level_ones,
        grid.x, grid.y, grid.cell,
    )  # fmt: skip


def _normals(view: View, points: Floats, along: int) -> Floats:
    """Return normals of a printed line on the photograph, whose product with pixels is in meters, (n, 2)."""
    small = 1e-4
    way, across = np.eye(2)[along], np.eye(2)[1 - along]
    line = view(points + small * way) - view(points - small * way)
    side = view(points + small * across) - view(points - small * across)
    normal = np.stack([-line[:, 1], line[:, 0]], axis=1)
    return np.asarray(normal * (2 * small / np.sum(normal * side, axis=1, keepdims=True)))


def _offsets(
    image: NDArray[np.uint8], view: View, middles: Floats, axis: int, reach: float, length: float
) -> Floats:
    """Return the distance of a dark line from each middle along an axis [m]; nan if no line is distinct."""
    cv2 = from_extra("cv2", "vision")
    across = np.arange(-reach - 4 * STEP, reach + 4.5 * STEP, STEP)
    along = np.linspace(-0.42, 0.42, ALONG) * length
    way, line = np.eye(2)[axis], np.eye(2)[1 - axis]
    offsets = along[:, None, None] * line + across[:, None] * way
    points = middles.reshape(-1, 1, 1, 2) + offsets
    places = view(points).astype(np.float32).reshape(-1, len(across), 2)
    samples = cv2.remap(image, places[..., 0], places[..., 1], cv2.INTER_LINEAR).astype(np.float32)
    samples = samples.reshape(len(points), ALONG, len(across))
    relative = samples / np.maximum(np.median(samples, axis=2, keepdims=True), 8.0)
    profiles = 1 - np.median(relative, axis=1)
    profiles = cv2.GaussianBlur(profiles, (0, 0), 1.5, sigmaY=1e-6)
    return np.array([_peak(profile, across, reach) for profile in profiles]).reshape(middles.shape[:2])


def _peak(profile: NDArray[np.float32], across: Floats, reach: float) -> float:
    """Return the place at which a profile is darkest, between samples; nan if it is not distinct."""
    inside = np.flatnonzero(np.abs(across) <= reach)
    best = int(inside[np.argmax(profile[inside])])
    level = float(np.median(profile))
    noise = 1.4826 * float(np.median(np.abs(profile - level))) + 0.002
    if profile[best] - level < CLEAR * noise or not 0 < best < len(profile) - 1:
        return float("nan")
    before, here, after = (float(value) for value in profile[best - 1 : best + 2])
    curve = before - 2 * here + after
    shift = 0.0 if curve >= 0 else 0.5 * (before - after) / curve
    return float(across[best] + STEP * np.clip(shift, -1, 1))


def _is_outlier(offsets: Floats) -> NDArray[np.bool_]:
    """Return whether offsets differ from those around them."""
    padded = np.pad(offsets, 2, constant_values=np.nan)
    around = np.lib.stride_tricks.sliding_window_view(padded, (5, 5)).reshape(*offsets.shape, 25)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # nothing was seen around
        middle = np.nanmedian(around, axis=-1)
    return np.asarray(~(np.abs(offsets - middle) < OUTLIER))


def _smooth(offsets: Floats) -> Floats:
    """Return the offsets without holes and with less noise: weighted means of those around."""
    from scipy.ndimage import gaussian_filter

    is_known = np.isfinite(offsets)
    values = np.where(is_known, offsets, 0.0)
    smooth = np.zeros_like(values)
    done = np.zeros(values.shape, np.bool_)
    for sigma in (0.7, 1.5, 4.0, 20.0):
        weight = gaussian_filter(is_known.astype(np.float64), sigma, mode="constant")
        mean = gaussian_filter(values, sigma, mode="constant") / np.maximum(weight, 1e-12)
        now = ~done & (weight > 0.15)
        smooth[now] = mean[now]
        done |= now
    return smooth


def _between(table: Floats, column: Floats, row: Floats) -> Floats:
    """Return values of a table between its entries, and those of its edge beyond."""
    from scipy.ndimage import map_coordinates

    places = np.stack([np.ravel(row), np.ravel(column)])
    return np.asarray(map_coordinates(table, places, order=1, mode="nearest").reshape(np.shape(row)))
