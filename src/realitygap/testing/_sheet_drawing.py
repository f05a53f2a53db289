"""A sheet as paper and ink: what is printed, and lines of felt-tip pens that cross, fade and skip."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float32]

INKS = {
    "black": (38, 38, 42),
    "red": (205, 30, 45),
    "blue": (28, 60, 165),
    "green": (15, 130, 70),
    "orange": (245, 125, 25),
    "purple": (112, 45, 145),
    "brown": (125, 72, 38),
    "pink": (242, 105, 165),
}
"""sRGB of a full stroke of common felt-tip pens."""


@dataclass(frozen=True)
class Difficulty:
    """Strength of the defects of a photographed sheet; 1 is an ordinary bad day.

    Attributes:
        ink: Fading, skipping, and unusual colors.
        paper: Creases, waves, and a faint print.
        light: Shadows, uneven light, and tint.
        camera: Tilt, lens, blur, noise, and compression.
    """

    ink: float = 1.0
    paper: float = 1.0
    light: float = 1.0
    camera: float = 1.0


def to_linear(color: ArrayLike) -> Floats:
    """Return the reflectance of sRGB values 0..255."""
    value = np.asarray(color, np.float32) / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4).astype(np.float32)


def ink_colors(names: Sequence[str], rng: np.random.Generator, spread: float) -> Floats:
    """Return the optical density of each pen's ink, (n, 3): the one of its name, varied as between makers."""
    typical = -np.log(to_linear([INKS[name] for name in names]))
    scale = np.exp(0.12 * spread * rng.normal(size=(len(names), 1)))
    tint = np.exp(0.1 * spread * rng.normal(size=(len(names), 3)))
    return (typical * scale * tint).astype(np.float32)


def resampled(path: NDArray[np.float64], spacing: float = 0.001) -> NDArray[np.float64]:
    """Return points on a path about this far from each other [m]."""
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    at = np.linspace(0, length[-1], max(2, round(length[-1] / spacing) + 1))
    return np.column_stack([np.interp(at, length, path[:, k]) for k in range(2)])


def smooth_noise(n: int, scale: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return noise of standard deviation about 1 that changes over `scale` entries, (n,)."""
    knots = rng.normal(size=max(4, int(n / scale) + 4))
    return np.interp(np.arange(n) / scale, np.arange(len(knots)), knots)


def ink_layer(
    path: NDArray[np.float64],
    shape: tuple[int, int],
    to_pixels: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    px_per_m: float,
    rng: np.random.Generator,
    difficulty: float,
) -> Floats:
    """Return the amount of ink that a pen left, (h, w): 1 for a full stroke, more if its line crosses itself."""
    import cv2

    points = resampled(path)
    n = len(points)
    width = rng.uniform(0.0012, 0.0022) * (1 + 0.1 * smooth_noise(n, 60, rng))
    fade = 1 - difficulty * rng.uniform(0, 0.55) * np.linspace(0, 1, n) ** 2
    amount = np.clip(fade * (1 + 0.12 * difficulty * smooth_noise(n, 40, rng)), 0.12, 1.25)
    for _ in range(rng.poisson(1.5 * difficulty)):  # the pen skips
        first = int(rng.integers(n))
        amount[first : first + int(rng.integers(3, 12))] *= rng.uniform(0.0, 0.4)
    thick = np.maximum(np.round(width * px_per_m), 1).astype(int).tolist()
    shades = np.clip(200 * amount, 1, 255).astype(int).tolist()
    pixels = to_pixels(points)
    layer = np.zeros(shape, np.float32)
    one = np.zeros(shape, np.uint8)
    for first in range(0, n - 1, 100):
        last = min(first + 100, n - 1)
        part = pixels[first : last + 1]
        margin = 12 + int(0.003 * px_per_m)
        low = np.maximum(np.floor(part.min(axis=0)).astype(int) - margin, 0)
        high = np.minimum(np.ceil(part.max(axis=0)).astype(int) + margin, shape[::-1])
        area = one[low[1] : high[1], low[0] : high[0]]
        area[:] = 0
        ends = np.round((part - low) * 16).astype(int).tolist()
        for k in range(first, last):
            cv2.line(area, ends[k - first], ends[k - first + 1], shades[k], thick[k], cv2.LINE_AA, 4)
        place = layer[low[1] : high[1], low[0] : high[0]]
        drawn = area.astype(np.float32) / 200
        np.copyto(place, np.maximum(place, drawn) + 0.25 * np.minimum(place, drawn))
    return layer


def scribble(box: tuple[float, float, float, float], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return a hasty stroke by hand through a box, (n, 2) [m]."""
    left, lower, right, upper = box
    x = np.linspace(left + 0.08 * (right - left), right - 0.08 * (right - left), 40)
    middle = (lower + upper) / 2 + rng.normal() * 0.08 * (upper - lower)
    slope = rng.normal() * 0.003
    y = middle + slope * np.linspace(-1, 1, 40) + 0.0008 * smooth_noise(40, 6, rng)
    return np.column_stack([x, y])
