"""A video of a robot in an arena, drawn by code: tests, benchmarks and pictures of the documents use it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import from_extra
from realitygap.vision import (
    CORNER_FAMILY,
    CORNER_SIZE_M,
    Camera,
    Lens,
    RobotTag,
    corner_tags,
    tag_bits,
)
from realitygap.world import Arena, paper_arena

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]

FINE = 3  # points across and down of which a pixel is the mean
COARSE = 8  # pixels between points that are computed; those between are on a smooth surface
QUIET = 1 / 6  # width of the white border around a tag, in its sides
PAPER, WOOD, TABLE, BODY = (236, 240, 240), (96, 140, 176), (120, 126, 130), (140, 60, 50)  # blue, green, red
WALL_M = 0.04  # thickness


@dataclass(frozen=True)
class FilmedCamera:
    """Pose of a camera and defects of its pictures.

    Attributes:
        width: Width of pictures [px].
        height: Height of pictures [px].
        focal: Focal length, in widths of the picture.
        off_center: Distance of the optical axis from the picture's middle, x and y [px].
        distortion: Distortion coefficients k1, k2, p1, p2, k3.
        above: Height over the floor [m].
        beside: Position of the camera, x and y from the arena's middle [m].
        looks_at: Point of the floor in the picture's middle, x and y from the arena's middle [m].
        turned: Rotation about its axis [rad].
        exposure_s: Exposure time of a picture [s].
        blur_px: Standard deviation of the blur [px].
        noise: Standard deviation of gray values, of 255.
        uneven: Strength of the uneven brightness across a picture, 0 to 1.
    """

    width: int = 1280
    height: int = 720
    focal: float = 0.82
    off_center: tuple[float, float] = (4.0, -3.0)
    distortion: tuple[float, float, float, float, float] = (-0.12, 0.03, 0.0, 0.0, 0.0)
    above: float = 1.2
    beside: tuple[float, float] = (0.1, -0.15)
    looks_at: tuple[float, float] = (0.01, 0.0)
    turned: float = 0.03
    exposure_s: float = 1 / 60
    blur_px: float = 0.8
    noise: float = 4.0
    uneven: float = 0.35

    def camera(self, arena: Arena) -> Camera:
        """Return the true one, which a tracker has to find."""
        walls = np.array(arena.walls).reshape(-1, 2)
        middle = (walls.min(axis=0) + walls.max(axis=0)) / 2
        place = np.array([*(middle + self.beside), self.above])
        ahead = np.array([*(middle + self.looks_at), 0.0]) - place
        ahead /= np.linalg.norm(ahead)
        right = np.cross(ahead, [0.0, 1.0, 0.0])
        right /= np.linalg.norm(right)
        down = np.cross(ahead, right)
        c, s = np.cos(self.turned), np.sin(self.turned)
        rotation = np.array([c * right + s * down, c * down - s * right, ahead])
        center = ((self.width - 1) / 2 + self.off_center[0], (self.height - 1) / 2 + self.off_center[1])
        focal = self.focal * self.width
        lens = Lens(self.width, self.height, (focal, focal), center, self.distortion)
        return Camera(lens, rotation, -rotation @ place)


Path = Callable[[float], tuple[float, float, float]]
"""A function of a time [s] that returns the robot's x [m], y [m], heading [rad]."""


@dataclass
class Film:
    """Pictures of a robot that follows a path in an arena. Each iteration gives the same pictures.

    Attributes:
        path: Path of the robot.
        duration_s: Duration [s].
        rate: Pictures a second.
        tag: Tag on the robot. Default family: 36h11.
        arena: Arena of the film.
        filmed: The camera.
        corner_size: Size of the corner tags, as in `corner_tags`.
        corner_inset: Inset of the corner tags, as in `corner_tags`.
        missed: Times [s] from and to which a hand hides the robot's tag.
        lost: Share of pictures that never arrive.
        seed: Seed of the noise and of lost pictures.
        n_exposures: Places of the robot of which a picture is the mean, as it moves while that is exposed.
        name: Name for people.
    """

    path: Path
    duration_s: float
    rate: float = 30.0
    tag: RobotTag = field(default_factory=RobotTag)
    arena: Arena = field(default_factory=paper_arena)
    filmed: FilmedCamera = field(default_factory=FilmedCamera)
    corner_size: float = CORNER_SIZE_M
    corner_inset: float | None = None
    missed: tuple[tuple[float, float], ...] = ()
    lost: float = 0.0
    seed: int = 0
    n_exposures: int = 5
    name: str = "film"

    def __post_init__(self) -> None:
        """Draw what does not move."""
        self.size = (self.filmed.width, self.filmed.height)
        self.camera = self.filmed.camera(self.arena)
        self._floor = self._plane(0.0)
        self._top = self._plane(self.tag.height)
        self._still = self._background()
        self._texture = _texture(self.tag.family or CORNER_FAMILY, self.tag.number)
        across = np.linspace(-1, 1, self.filmed.width)[None, :, None]
        down = np.linspace(-1, 1, self.filmed.height)[:, None, None]
        dark = self.filmed.uneven * (0.35 * across + 0.15 * down + 0.25 * (across**2 + down**2))
        self._light = (1 - dark).astype(np.float32)
        self._rest = self._blurred(_coarse(self._still)) * self._light
        rng = np.random.default_rng([self.seed, 3])
        self._noise = rng.standard_normal((8, *self.size[::-1]), np.float32) * self.filmed.noise

    def _plane(self, z: float) -> NDArray[np.float32]:
        """Return (FINE height, FINE width, 2) what point at height z each part of a pixel shows [m]."""
        from scipy.interpolate import RectBivariateSpline

        x = np.arange(-COARSE, self.filmed.width + 2.0 * COARSE, COARSE)
        y = np.arange(-COARSE, self.filmed.height + 2.0 * COARSE, COARSE)
        pixels = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        points = self.camera.on_plane(pixels, z).reshape(len(y), len(x), 2)
        fine_x = (np.arange(FINE * self.filmed.width) + 0.5) / FINE - 0.5
        fine_y = (np.arange(FINE * self.filmed.height) + 0.5) / FINE - 0.5
        fine = [RectBivariateSpline(y, x, points[..., k])(fine_y, fine_x) for k in (0, 1)]
        return np.stack(fine, axis=-1).astype(np.float32)

    def _background(self) -> NDArray[np.float32]:
        """Return (FINE height, FINE width, 3) the empty arena."""
        x, y = self._floor[..., 0], self._floor[..., 1]
        walls = np.array(self.arena.walls).reshape(-1, 2)
        low, high = walls.min(axis=0), walls.max(axis=0)
        image = np.empty((*x.shape, 3), np.float32)
        image[:] = TABLE
        inside = (x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1])
        near = (x > low[0] - WALL_M) & (x < high[0] + WALL_M) & (y > low[1] - WALL_M) & (y < high[1] + WALL_M)
        image[near] = WOOD
        image[inside] = PAPER
        grid = self.arena.grid
        lines = (np.abs((x - grid.x) / grid.cell % 1 - 0.5) > 0.494) | (
            np.abs((y - grid.y) / grid.cell % 1 - 0.5) > 0.494
        )
        image[inside & lines] *= 0.8
        for number, corners in corner_tags(self.arena, self.corner_size, self.corner_inset).items():
            middle = corners[:, :2].mean(axis=0)
            _paint(
                image,
                x - float(middle[0]),
                y - float(middle[1]),
                1.0,
                0.0,
                _texture(CORNER_FAMILY, number),
                self.corner_size,
            )
        return image

    def times(self) -> Floats:
        """Return times of the pictures that arrive, (t,) [s]."""
        all_of_them = np.arange(int(self.duration_s * self.rate)) / self.rate
        arrives = np.random.default_rng([self.seed, 1]).random(len(all_of_them)) >= self.lost
        arrives[:5] = True
        return all_of_them[arrives]

    def truth(self, times: Floats) -> Floats:
        """Return the true poses of the robot, (n, 3)."""
        return np.array([self.path(float(time)) for time in times], np.float64)

    def __iter__(self) -> Iterator[tuple[float, Image]]:
        """Yield the time [s] and picture."""
        for k, time in enumerate(self.times()):
            yield float(time), self.picture(float(time), k)

    def picture(self, time: float, number: int = 0) -> Image:
        """Return the picture in blue, green, red at a time [s], with the noise of a number, (height, width, 3)."""
        shifts = np.linspace(-0.5, 0.5, self.n_exposures) * self.filmed.exposure_s
        poses = self.truth(np.clip(time + shifts, 0.0, self.duration_s))
        fine, rows, columns = self._with_robot(poses)
        if any(first <= time <= last for first, last in self.missed):
            self._hide(fine, rows, columns, poses[len(poses) // 2])
        part = (
            slice(rows.start // FINE, rows.stop // FINE),
            slice(columns.start // FINE, columns.stop // FINE),
        )
        image = self._rest.copy()
        image[part] = self._blurred(_coarse(fine)) * self._light[part]
        rng = np.random.default_rng([self.seed, 2, number])
        shift = rng.integers(0, self.size[::-1])
        image += np.roll(self._noise[rng.integers(len(self._noise))], shift, axis=(0, 1))[..., None]
        shown: Image = np.clip(image, 0, 255).astype(np.uint8)
        return shown

    def _blurred(self, image: NDArray[np.float32]) -> NDArray[np.float32]:
        if not self.filmed.blur_px:
            return image
        cv2 = from_extra("cv2", "vision")
        blurred: NDArray[np.float32] = cv2.GaussianBlur(image, (0, 0), self.filmed.blur_px)
        return blurred

    def _with_robot(self, poses: Floats) -> tuple[NDArray[np.float32], slice, slice]:
        """Return the part of the fine picture around the robot, as it looks on the mean of poses."""
        middle = poses[len(poses) // 2]
        reach = 0.16
        around = middle[:2] + reach * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        points = np.concatenate([np.column_stack([around, np.full(4, z)]) for z in (0.0, self.tag.height)])
        pixels = self.camera.to_pixels(points)
        low = np.clip(np.floor(pixels.min(axis=0)).astype(int), 0, self.size)
        high = np.clip(np.ceil(pixels.max(axis=0)).astype(int), 0, self.size)
        rows, columns = slice(low[1] * FINE, high[1] * FINE), slice(low[0] * FINE, high[0] * FINE)
        total = np.zeros_like(self._still[rows, columns])
        for x, y, heading in poses.tolist():
            total += self._drawn(rows, columns, x, y, heading)
        return total / np.float32(len(poses)), rows, columns

    def _drawn(self, rows: slice, columns: slice, x: float, y: float, heading: float) -> NDArray[np.float32]:
        image = self._still[rows, columns].copy()
        c, s = math.cos(heading), math.sin(heading)  # plain numbers: pictures stay float32
        for plane, shade in ((self._floor, 0.55), (self._top, 1.0)):  # its shadow, then its top
            dx, dy = plane[rows, columns, 0] - x, plane[rows, columns, 1] - y
            ahead, left = c * dx + s * dy, c * dy - s * dx
            body = (np.abs(left) < 0.075) & (np.abs(ahead) < 0.09) & (ahead * ahead + left * left < 0.01)
            if shade < 1:
                image[body] *= shade
            else:
                image[body] = BODY
        tag, turned = self.tag, heading + self.tag.turned
        middle = x + c * tag.ahead - s * tag.left, y + s * tag.ahead + c * tag.left
        dx, dy = self._top[rows, columns, 0] - middle[0], self._top[rows, columns, 1] - middle[1]
        # a tag's upper edge is towards the robot's front: a quarter of a turn from upright
        _paint(image, dx, dy, math.sin(turned), -math.cos(turned), self._texture, tag.size)
        return image

    def _hide(self, fine: NDArray[np.float32], rows: slice, columns: slice, pose: Floats) -> None:
        away = self._top[rows, columns] - pose[:2] - np.array([0.02, -0.01])
        fine[np.hypot(away[..., 0], away[..., 1] * 0.6) < 0.06] = (150, 175, 215)

    def close(self) -> None:
        """Nothing is held."""


def _coarse(fine: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the pixels of a fine picture."""
    h, w = fine.shape[0] // FINE, fine.shape[1] // FINE
    means: NDArray[np.float32] = fine.reshape(h, FINE, w, FINE, 3).mean(axis=(1, 3))
    return means


def _texture(family: str, number: int) -> NDArray[np.float32]:
    """Return a tag with its white border, finely, as seen upright."""
    bits = tag_bits(family, number).astype(np.float32)
    side = 24 * len(bits)
    big = np.kron(bits, np.ones((24, 24), np.float32))
    return np.pad(big, round(side * QUIET), constant_values=1.0)


def _paint(
    image: NDArray[np.float32],
    dx: NDArray[np.float32],
    dy: NDArray[np.float32],
    c: float,
    s: float,
    texture: NDArray[np.float32],
    size: float,
) -> None:
    """Put a tag into a picture whose points are dx, dy from its middle [m]; c, s turn it from upright."""
    cv2 = from_extra("cv2", "vision")
    right, up = c * dx + s * dy, c * dy - s * dx
    scale = len(texture) / (size * (1 + 2 * QUIET))
    column = (right * scale + len(texture) / 2 - 0.5).astype(np.float32)
    row = (len(texture) / 2 - 0.5 - up * scale).astype(np.float32)
    inside = (column > -0.5) & (column < len(texture) - 0.5) & (row > -0.5) & (row < len(texture) - 0.5)
    shown = cv2.remap(texture, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    image[inside] = (25 + 215 * shown[inside])[:, None]


def path_through(times: Floats, poses: Floats) -> Path:
    """Return a path through poses (n, 3) at times (n,) [s], linear in between; it rests before and after."""
    headings = np.unwrap(poses[:, 2])

    def path(time: float) -> tuple[float, float, float]:
        return (
            float(np.interp(time, times, poses[:, 0])),
            float(np.interp(time, times, poses[:, 1])),
            float(np.interp(time, times, headings)),
        )

    return path


def save_film(film: Film, file: str) -> None:
    """Write a film as a video.

    Raises:
        OSError: It cannot be written.
    """
    cv2 = from_extra("cv2", "vision")
    writer = cv2.VideoWriter(file, cv2.VideoWriter_fourcc(*"mp4v"), film.rate, film.size)
    if not writer.isOpened():
        raise OSError(0, "cannot be written as a video", file)
    for _, image in film:
        writer.write(image)
    writer.release()
