"""Synthetic photographs of sheets with pen traces, from known paths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.vision import SheetLayout

from ._sheet_drawing import Difficulty, Floats, ink_colors, ink_layer, scribble

TEXTURE_PX_PER_M = 4000.0
SIZES = ((4000, 3000), (4000, 3000), (3264, 2448))
"""Sizes of photographs [px]: those of phones of the last ten years."""


@dataclass(frozen=True)
class SheetPhotograph:
    """A synthetic photograph, and what is on it.

    Attributes:
        jpeg: The file.
        layout: Layout of the sheet.
        paths: Path of each pen, (n, 2) x and y [m].
    """

    jpeg: bytes
    layout: SheetLayout
    paths: tuple[NDArray[np.float64], ...]


def photograph_sheet(
    layout: SheetLayout,
    paths: Sequence[NDArray[np.float64]],
    seed: int,
    difficulty: Difficulty | None = None,
    *,
    has_key: bool = True,
    size: tuple[int, int] | None = None,
) -> SheetPhotograph:
    """Return a photograph of a sheet on which pens drew these paths.

    Args:
        layout: Layout of the sheet. Its pens draw the paths, in their order.
        paths: Path of each pen, (n, 2) x and y [m].
        seed: Seed of all defects.
        difficulty: Strength of the defects.
        has_key: True if each pen was tried in its box.
        size: Width and height of the photograph [px]. Default: one of `SIZES`, drawn by the seed.
    """
    rng = np.random.default_rng((seed, 0x5EE7))
    hard = difficulty or Difficulty()
    paper = draw_sheet(layout, paths, rng, hard, has_key=has_key)
    return SheetPhotograph(
        take_photograph(paper, layout, rng, hard, size), layout, tuple(np.asarray(path) for path in paths)
    )


def draw_sheet(
    layout: SheetLayout,
    paths: Sequence[NDArray[np.float64]],
    rng: np.random.Generator,
    hard: Difficulty,
    *,
    has_key: bool,
) -> Floats:
    """Return the reflectance of the sheet, 4 pixels per millimeter, (h, w, 3)."""
    import cv2

    from realitygap.vision import raster, to_pixels

    box, scale = layout.paper, TEXTURE_PX_PER_M
    printed = raster([*layout.thin_marks(), *layout.outer_marks()], box, scale)
    veil = 1 - hard.paper * rng.uniform(0, 0.35)  # tracing paper over the print
    white = np.array([0.93, 0.92, 0.89], np.float32) * (1 + 0.02 * rng.normal(size=3)).astype(np.float32)
    grain = cv2.GaussianBlur(rng.standard_normal(printed.shape, np.float32), (0, 0), 1.5)
    density = np.zeros((*printed.shape, 3), np.float32)
    inks = ink_colors(layout.pens[: len(paths)], rng, hard.ink)
    keys = layout.key_boxes()
    for k, path in enumerate(paths):
        strokes = [path, scribble(keys[k], rng)] if has_key and k < len(keys) else [path]
        for number, stroke in enumerate(strokes):
            layer = ink_layer(
                stroke, printed.shape, lambda points: to_pixels(points, box, scale), scale, rng,
                hard.ink if number == 0 else 0.3 * hard.ink,
            )  # fmt: skip
            inked = np.nonzero(layer)
            amount = np.asarray(layer[inked] * (1 + 0.6 * grain[inked]), np.float32)
            density[inked] += amount[:, None] * inks[k]
    np.exp(-density, out=density)
    density *= (1 - np.float32(0.97 * veil) * printed)[..., None]
    density *= 0.985 * white
    density += (0.015 + 0.0015 * grain)[..., None]
    return density


def take_photograph(
    paper: Floats,
    layout: SheetLayout,
    rng: np.random.Generator,
    hard: Difficulty,
    size: tuple[int, int] | None = None,
) -> bytes:
    """Return the JPEG file of a photograph of this sheet, as from a phone held over it."""
    import cv2

    usual = SIZES[int(rng.integers(len(SIZES)))]
    size = size or usual
    columns, rows = _seen_from(layout, size, rng, hard)
    texture: Any = paper * _creases(paper.shape[:2], rng, hard)[..., None]
    table = _table(rng)
    texture = cv2.GaussianBlur(texture, (0, 0), 0.5)  # the photograph has fewer pixels
    wave_x, wave_y = _waves(columns.shape, rng, hard)
    picture = cv2.remap(
        texture, columns + wave_x, rows + wave_y, cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT, borderValue=table,
    )  # fmt: skip
    return _develop(np.asarray(picture * _light(columns.shape, rng, hard), np.float32), rng, hard)


def _table(rng: np.random.Generator) -> tuple[float, float, float]:
    """Return the reflectance of the table or floor."""
    dark = rng.uniform(0.05, 0.6)
    return dark, dark * rng.uniform(0.7, 1.0), dark * rng.uniform(0.45, 1.0)


def _seen_from(
    layout: SheetLayout, size: tuple[int, int], rng: np.random.Generator, hard: Difficulty
) -> tuple[Floats, Floats]:
    """Return the column and row of the texture at each pixel of the photograph."""
    width, height = size
    left, lower, right, upper = layout.paper
    corners = np.array([(left, lower), (right, lower), (right, upper), (left, upper)])
    middle = corners.mean(axis=0)
    focal = rng.uniform(0.75, 1.0) * width
    tilt = np.radians(hard.camera * rng.uniform(0, 24))
    turn = rng.choice([0.0, np.pi]) + np.radians(hard.camera * rng.normal() * 5)
    towards = rng.uniform(0, 2 * np.pi)
    axis = np.array([np.cos(towards), np.sin(towards), 0.0]) * tilt
    import cv2

    from realitygap.vision import to_pixels

    tilted = cv2.Rodrigues(axis)[0]
    turned = cv2.Rodrigues(np.array([0.0, 0.0, turn]))[0]
    flip = np.diag([1.0, -1.0, -1.0])  # the camera looks down, its rows grow downwards
    rotation = tilted @ turned @ flip
    k1 = hard.camera * rng.uniform(-0.08, 0.05)
    k2 = hard.camera * rng.uniform(-0.015, 0.015)
    center = np.array([width - 1, height - 1]) / 2
    reach = np.hypot(width, height) / 2
    fill = rng.uniform(0.9, 0.97)

    def homography(distance: float, shift: NDArray[np.float64], zoom: float) -> NDArray[np.float64]:
        camera = np.array(
            [[zoom * focal, 0, center[0] + shift[0]], [0, zoom * focal, center[1] + shift[1]], [0, 0, 1]]
        )
        to_camera = np.column_stack([rotation[:, 0], rotation[:, 1], [0, 0, distance]])
        about = np.array([[1, 0, -middle[0]], [0, 1, -middle[1]], [0, 0, 1.0]])
        return np.asarray(camera @ to_camera @ about, np.float64)

    distance = 1.15 * (right - left) * focal / width
    shift, zoom = np.zeros(2), 1.0
    edge = np.concatenate([np.linspace(corners[k], corners[(k + 1) % 4], 20) for k in range(4)])
    for _ in range(12):
        there = _distorted(_apply(homography(distance, shift, zoom), edge), center, reach, k1, k2)
        low, high = there.min(axis=0), there.max(axis=0)
        shift += center - (low + high) / 2
        zoom *= float(np.min(fill * np.array(size) / (high - low)))
    view = homography(distance, shift, zoom)

    step = 8  # the way to the sheet is smooth: known at every eighth pixel, it is known between
    coarse = np.stack(
        np.meshgrid(np.arange(0, width + step, step), np.arange(0, height + step, step)), axis=-1
    )
    away = coarse - center
    far = np.linspace(0, 1.6, 2000)
    bent = far * (1 + k1 * far**2 + k2 * far**4)
    rho = np.hypot(away[..., 0], away[..., 1]) / reach
    straight = center + away * (np.interp(rho, bent, far) / np.maximum(rho, 1e-9))[..., None]
    on_sheet = _apply(np.linalg.inv(view), np.asarray(straight.reshape(-1, 2), np.float64)).reshape(
        coarse.shape
    )
    texels = to_pixels(on_sheet, layout.paper, TEXTURE_PX_PER_M).astype(np.float32)
    x, y = np.meshgrid(np.arange(width, dtype=np.float32) / step, np.arange(height, dtype=np.float32) / step)
    fine = cv2.remap(texels, x, y, cv2.INTER_LINEAR)
    return np.asarray(fine[..., 0]), np.asarray(fine[..., 1])


def _apply(view: NDArray[np.floating], points: NDArray[np.floating]) -> NDArray[np.float64]:
    seen = np.column_stack([points, np.ones(len(points))]) @ view.T
    return np.asarray(seen[:, :2] / seen[:, 2:], np.float64)


def _distorted(
    points: NDArray[np.float64], center: NDArray[np.float64], reach: float, k1: float, k2: float
) -> NDArray[np.float64]:
    away = points - center
    far = (away**2).sum(axis=1, keepdims=True) / reach**2
    return np.asarray(center + away * (1 + k1 * far + k2 * far**2), np.float64)


def _creases(shape: tuple[int, int], rng: np.random.Generator, hard: Difficulty) -> Floats:
    """Return the brightness of folds and of the planes between them, (h, w)."""
    y, x = np.mgrid[0 : shape[0] : 4, 0 : shape[1] : 4].astype(np.float32)
    bright = np.ones(x.shape, np.float32)
    for _ in range(rng.poisson(2.5 * hard.paper)):
        way = rng.choice([0.0, np.pi / 2]) + rng.normal() * 0.15
        at = rng.uniform(0.1, 0.9) * np.array(shape[::-1])
        far = ((x - at[0]) * np.cos(way) + (y - at[1]) * np.sin(way)) / np.float32(TEXTURE_PX_PER_M)
        wide = rng.uniform(0.0008, 0.003)
        bright *= 1 + np.float32(rng.normal() * 0.1) * np.exp(-((far / wide) ** 2))
        bright *= 1 + np.float32(rng.normal() * 0.04) * np.tanh(far / wide)
    import cv2

    return np.asarray(cv2.resize(bright, shape[::-1], interpolation=cv2.INTER_LINEAR))


def _waves(shape: tuple[int, int], rng: np.random.Generator, hard: Difficulty) -> tuple[Floats, Floats]:
    """Return the apparent displacement of paper that does not lie flat, x and y, (h, w) each [texels]."""
    import cv2

    height = cv2.resize(
        rng.normal(size=(4, 6)).astype(np.float32), shape[::-1], interpolation=cv2.INTER_CUBIC
    )
    way = rng.uniform(0, 2 * np.pi)
    far = hard.paper * rng.uniform(0, 0.0012) * TEXTURE_PX_PER_M
    return (height * np.float32(far * np.cos(way)), height * np.float32(far * np.sin(way)))


def _light(shape: tuple[int, ...], rng: np.random.Generator, hard: Difficulty) -> Floats:
    """Return the light on the part of the sheet that each pixel shows, (h, w, 3)."""
    import cv2

    height, width = shape
    small = (height // 8, width // 8)
    y, x = np.mgrid[0 : small[0], 0 : small[1]].astype(np.float32)
    u, v = x / small[1] - 0.5, y / small[0] - 0.5
    way = rng.uniform(0, 2 * np.pi)
    bright = 1 + hard.light * rng.uniform(0, 0.8) * (u * np.cos(way) + v * np.sin(way))
    bright = bright * (1 - hard.light * rng.uniform(0, 0.5) * (u * u + v * v))
    tint = np.exp(0.1 * hard.light * rng.normal(size=3)).astype(np.float32)
    light = (bright[..., None] * tint).astype(np.float32)
    for _ in range(rng.poisson(1.3 * hard.light)):
        shade = np.zeros(small, np.uint8)
        middle = rng.uniform(0, 1, 2) * small[::-1]
        angles = np.sort(rng.uniform(0, 2 * np.pi, 8))
        radius = rng.uniform(0.1, 0.45, 8) * small[1]
        outline = middle + radius[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
        cv2.fillPoly(shade, [np.round(outline).astype(np.int32)], 255)
        soft = cv2.GaussianBlur(shade.astype(np.float32) / 255, (0, 0), float(np.exp(rng.uniform(0.3, 3.2))))
        dark = rng.uniform(0.15, 0.5)
        light *= 1 - dark * soft[..., None] * np.array([1.0, 0.97, 0.93], np.float32)
    return np.asarray(cv2.resize(light, (width, height), interpolation=cv2.INTER_LINEAR))


def _develop(picture: Floats, rng: np.random.Generator, hard: Difficulty) -> bytes:
    """Blur, exposure, noise, sharpening and JPEG."""
    import cv2

    blur = 0.6 + hard.camera * rng.uniform(0, 1.1)
    picture = np.asarray(cv2.GaussianBlur(picture, (0, 0), blur), np.float32)
    length = int(rng.integers(0, 1 + round(5 * hard.camera))) if rng.uniform() < 0.4 else 0
    if length > 1:
        kernel = np.zeros((length + 2, length + 2), np.float32)
        way, half = rng.uniform(0, np.pi), length / 2
        middle = (length + 1) / 2
        ends = [
            (round(middle + s * half * np.cos(way)), round(middle + s * half * np.sin(way))) for s in (-1, 1)
        ]
        cv2.line(kernel, ends[0], ends[1], 1.0, 1, cv2.LINE_AA)
        picture = np.asarray(cv2.filter2D(picture, -1, kernel / kernel.sum()), np.float32)
    picture *= rng.uniform(0.55, 0.95) / np.percentile(picture[::16, ::16], 97)
    noise = hard.camera * rng.uniform(0.004, 0.015)
    coarse = (picture.shape[0] // 2 + 1, picture.shape[1] // 2 + 1, 3)
    rough: Any = rng.standard_normal(coarse, np.float32)
    rough = cv2.resize(rough, picture.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    grainy = picture + np.float32(noise) * rough * np.sqrt(np.maximum(picture, 0.02))
    table = np.arange(4097) / 4096
    encoded = 255 * np.where(table <= 0.0031308, 12.92 * table, 1.055 * table ** (1 / 2.4) - 0.055)
    shown = encoded.astype(np.float32)[(np.clip(grainy, 0, 1) * 4096).astype(np.int32)]
    if rng.uniform() < 0.5:
        shown = shown + np.float32(rng.uniform(0.2, 0.8)) * (shown - cv2.GaussianBlur(shown, (0, 0), 1.5))
    pixels = np.clip(shown + 0.5, 0, 255).astype(np.uint8)
    quality = int(rng.uniform(95 - 45 * hard.camera, 95))
    done, jpeg = cv2.imencode(".jpg", pixels[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise RuntimeError("OpenCV could not write a JPEG picture.")
    return bytes(jpeg)
