"""The Fluke's camera: pictures of the arena drawn by casting rays, in the camera's own format.

In each group of four bytes of a row, byte 0 is V, 1 is Y, 2 is U and 3 is Y. The floor is light with the grid's cells
in gray, and tape on it is dark. The walls are of wood, 9 cm high, and the room is above them. The camera's position and
field of view and all colors are chosen.
"""

from __future__ import annotations

import io
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap.emulator import Walls
from realitygap.world import FloorImage

from ._scene import Scene
from ._simulated import SimulatedRobot

Bytes = NDArray[np.uint8]
Floats = NDArray[np.float64]

FORWARD = 0.089  # of the middle of the axle, at the end with the caster [m]
HEIGHT = 0.075  # of the camera above the floor [m]
WIDTH_OF_VIEW = math.radians(50)
WALL_HEIGHT = 0.09  # [m]
MARK = 0.004  # width of the marks between cells [m]
FAR = 10.0  # [m]
N_WINDOWS = 4
QUALITY = 80  # of JPEG pictures

# Y, U, V; 128 is no color
ROOM = (200.0, 128.0, 128.0)
FLOOR = (225.0, 124.0, 132.0)
MARKS = (150.0, 126.0, 130.0)
TAPE = (30.0, 128.0, 128.0)
WOOD = (165.0, 96.0, 152.0)


@dataclass(frozen=True)
class Window:
    """A part of the picture, with both ends, in columns and rows from the lower left."""

    x_low: int = 0
    y_low: int = 0
    x_high: int = 0
    y_high: int = 0
    x_step: int = 1
    y_step: int = 1


class Camera:
    """The camera of a Fluke, which draws the scene from the robot.

    Args:
        robot: The robot that carries the camera.
        scene: The scene to draw.
        model: "1" (256 x 192) or "2" (1280 x 800, or 427 x 266).
    """

    def __init__(self, robot: SimulatedRobot, scene: Scene, model: str) -> None:
        self._robot, self._scene, self._model = robot, scene, model
        self._walls = Walls.of(scene.arena)
        self.restart()

    def restart(self) -> None:
        """Begin as after switching on."""
        self._size = (256, 192) if self._model == "1" else (1280, 800)
        self._windows = [Window()] * N_WINDOWS
        self._registers = bytearray(256)
        for register, value in {0x00: 0, 0x01: 0x80, 0x02: 0x80, 0x06: 0x80, 0x10: 0x41}.items():
            self._registers[register] = value
        self._registers[0x12], self._registers[0x13] = 0x14, 0xA3
        self._thresh = 1
        self._colors = bytes((0, 254, 126, 145, 90, 120))  # Y, U, V low and high
        self._seen: tuple[object, Bytes] | None = None

    def set_size(self, width: int, height: int) -> None:
        """Choose the size of the picture."""
        self._size = (width, height)

    def register(self, number: int) -> int:
        """Return a register of the camera."""
        return self._registers[number]

    def set_register(self, number: int, value: int) -> None:
        """Write one."""
        self._registers[number] = value

    def set_window(self, number: int, window: Window) -> None:
        """Choose a window; a number beyond the last one means the first."""
        self._windows[number if number < N_WINDOWS else 0] = window

    def set_colors(self, thresh: int, limits: bytes) -> None:
        """Choose what belongs to the blob: how many in a row, and limits of Y, U and V, both inside."""
        self._thresh, self._colors = thresh, limits

    # pictures

    def raw(self) -> Bytes:
        """Return the picture, (rows, columns), V Y U Y; the same array until the robot or a register changes."""
        key = (self._robot.pose, self._size, bytes(self._registers))
        if self._seen is None or self._seen[0] != key:
            self._seen = (key, self._take())
        return self._seen[1]

    def window(self, number: int) -> Bytes:
        """Return the part of the picture in a window; rows count from below on a Fluke 1, from above on a Fluke 2."""
        window = self._windows[number if number < N_WINDOWS else 0]
        low, high = window.y_low, window.y_high
        if self._model == "1":
            low, high = (191 - high) & 0xFF, (191 - low) & 0xFF
        return self.raw()[
            low : high + 1 : max(1, window.y_step), window.x_low : window.x_high + 1 : max(1, window.x_step)
        ]

    def window_sum(self, number: int) -> int:
        """Return the sum of its bytes, as far as three bytes hold it."""
        return int(self.window(number).sum(dtype=np.int64)) & 0xFFFFFF

    def _in_colors(self) -> NDArray[np.bool_]:
        """Return whether each group of four columns lies inside the limits, (rows, groups)."""
        picture = self.raw()
        picture = picture[:, : picture.shape[1] // 4 * 4].reshape(len(picture), -1, 4)
        y_low, y_high, u_low, u_high, v_low, v_high = self._colors
        lows = np.array((v_low, y_low, u_low, y_low), dtype=np.uint8)
        highs = np.array((v_high, y_high, u_high, y_high), dtype=np.uint8)
        return np.asarray(((picture >= lows) & (picture <= highs)).all(2))

    def runs(self, most: int) -> list[int]:
        """Return lengths of runs of groups, first those outside; after `most` of them one more and no further.

        A run begins when as many in a row as chosen with `set_colors` are inside, or outside.
        """
        inside = self._in_colors().ravel()
        borders = np.flatnonzero(np.diff(inside)) + 1
        starts = [0, *borders.tolist()]
        ends = [*borders.tolist(), len(inside)]
        thresh = max(1, self._thresh)
        runs: list[int] = []
        within, begun = False, 0
        for start, end in zip(starts, ends, strict=True):
            if bool(inside[start]) == within or end - start < thresh:
                continue
            if len(runs) >= most:
                return [*runs, 0]
            turn = start + thresh - 1
            runs.append(turn - begun)
            within, begun = not within, turn
        return [*runs, len(inside) - begun]

    def blob(self, window: int | None) -> tuple[int, int, int]:
        """Return the number of groups inside the limits, and the mean column and row of their first bytes."""
        inside = self._in_colors().copy()
        if window is not None:
            part = self._windows[window if window < N_WINDOWS else 0]
            rows, columns = np.arange(inside.shape[0]), 4 * np.arange(inside.shape[1])
            inside &= ((rows >= part.y_low) & (rows <= part.y_high))[:, None]
            inside &= (columns >= part.x_low) & (columns <= part.x_high)
        rows, columns = np.nonzero(inside)
        if not len(rows):
            return 0, 0, 0
        return len(rows), int(4 * columns.sum()) // len(rows), int(rows.sum()) // len(rows)

    # JPEG

    def jpeg_header(self, *, in_color: bool) -> bytes:
        """Return all of a JPEG file before the compressed data."""
        width, height = self._size
        if self._model == "1":
            width = 128
        blank = np.zeros((height, width), dtype=np.uint8)
        return _jpeg(blank, blank if in_color else None, blank)[0]

    def jpeg_scan(self, *, in_color: bool, careful: bool) -> bytes:
        """Return the compressed data and the end mark.

        To be careful makes no difference here: the tables are those of the header either way.
        """
        picture = self.raw()
        if self._model == "1":
            y, u, v = picture[:, 1::2], np.repeat(picture[:, 2::4], 2, 1), np.repeat(picture[:, 0::4], 2, 1)
        else:
            y, u, v = _whole(picture)
        return _jpeg(y, u if in_color else None, v)[1]

    # drawing

    def _take(self) -> Bytes:
        width, height = self._size
        columns = (width + 3) // 4 * 4
        drawn = _draw(self._robot, self._scene, self._walls, columns // 2, height)
        image = self._exposed(drawn)
        picture = np.empty((height, columns), dtype=np.uint8)
        picture[:, 1::2] = image[..., 0]
        picture[:, 2::4] = image[:, ::2, 1]
        picture[:, 0::4] = image[:, ::2, 2]
        return np.ascontiguousarray(picture[:, :width])

    def _exposed(self, image: Floats) -> Bytes:
        """Return the brightness and color by the registers: automatic, or as darkenCamera and manualCamera set them."""
        registers = self._registers
        brightness = 1.0
        if self._model == "1" and registers[0x13] == 0xA0:
            brightness = (
                (1 + registers[0x00] / 64) * (registers[0x10] / 0x41) ** 0.5 * (registers[0x06] / 0x80)
            )
        elif self._model == "2" and registers[0x00]:
            brightness = registers[0x00] / 128
        image[..., 0] *= brightness
        if registers[0x12] == 0x10:  # without white balance the lamps' color shows
            image[..., 1] -= 6
            image[..., 2] += 6
        return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def _draw(robot: SimulatedRobot, scene: Scene, walls: Walls, columns: int, rows: int) -> Floats:
    """Draw the camera's view as (rows, columns, 3) Y, U and V, 0 to 255."""
    x, y, heading = robot.pose
    heading += math.pi  # it looks to the end with the caster
    x, y = x + FORWARD * math.cos(heading), y + FORWARD * math.sin(heading)
    half = math.tan(WIDTH_OF_VIEW / 2)
    across = (0.5 - (np.arange(columns) + 0.5) / columns) * 2 * half  # to the left, at a distance of 1
    angles = heading + np.arctan(across)
    far, wall = walls.hits(np.full(columns, x), np.full(columns, y), angles, FAR)
    depth = far * np.cos(angles - heading)  # along the way that the camera looks
    slope = (
        (0.5 - (np.arange(rows) + 0.5) / rows) * 2 * half * rows / (2 * columns)
    )  # upwards, pixels are square
    at_wall = HEIGHT + slope[:, None] * depth  # height at which each pixel meets the wall of its column
    image = np.empty((rows, columns, 3))
    image[:] = ROOM
    is_floor = at_wall < 0
    _draw_floor(image, is_floor, scene, (x, y, heading), across, slope)
    shade = np.where(wall % 2 == 0, 1.0, 0.88) * (1 - 0.25 * np.minimum(depth, 1.0))
    is_wall = ~is_floor & (at_wall <= WALL_HEIGHT) & (wall >= 0)
    wood = np.array(WOOD) + np.zeros((columns, 3))
    wood[:, 0] *= shade
    grain = 4 * np.sin(at_wall * 700)
    image[is_wall] = np.broadcast_to(wood, image.shape)[is_wall]
    image[..., 0] += np.where(is_wall, grain, 0.0)
    return image


def _draw_floor(
    image: Floats,
    is_floor: NDArray[np.bool_],
    scene: Scene,
    camera: tuple[float, float, float],
    across: Floats,
    slope: Floats,
) -> None:
    below = np.flatnonzero(slope < 0)
    if not len(below):
        return
    x, y, heading = camera
    ahead = np.minimum(HEIGHT / -slope[below], FAR)[:, None]
    floor_x = x + ahead * (math.cos(heading) - math.sin(heading) * across)
    floor_y = y + ahead * (math.sin(heading) + math.cos(heading) * across)
    colors = np.empty((*floor_x.shape, 3))
    colors[:] = FLOOR
    colors[_is_marked(scene, floor_x, floor_y)] = MARKS
    floor = scene.arena.floor
    if floor.image is not None:
        colors[..., 0] *= _brightness(floor.image, floor_x, floor_y)
    for line in floor.tape:
        colors[_is_on(line, floor.tape_width, floor_x, floor_y)] = TAPE
    part = is_floor[below]
    rows = image[below]
    rows[part] = colors[part]
    image[below] = rows


def _is_marked(scene: Scene, x: Floats, y: Floats) -> NDArray[np.bool_]:
    """Return whether the floor has a mark between cells at each point."""
    grid = scene.arena.grid
    u, v = (x - grid.x) / grid.cell, (y - grid.y) / grid.cell
    half = MARK / 2 / grid.cell
    inside = (u >= -half) & (u <= grid.columns + half) & (v >= -half) & (v <= grid.rows + half)
    return np.asarray(inside & ((np.abs(u - np.rint(u)) < half) | (np.abs(v - np.rint(v)) < half)))


def _brightness(image: FloorImage, x: Floats, y: Floats) -> Floats:
    """Return the brightness of the floor's image at points, or that of its edge beyond it: 0 black, 1 white."""
    scale = image.columns / image.width
    columns = np.clip(((x - image.x) * scale).astype(int), 0, image.columns - 1)
    rows = np.clip(((y - image.y) * scale).astype(int), 0, image.rows - 1)
    return np.asarray(image.brightness[rows, columns], dtype=float)


def _is_on(line: tuple[float, float, float, float], width: float, x: Floats, y: Floats) -> NDArray[np.bool_]:
    x1, y1, x2, y2 = line
    along_x, along_y = x2 - x1, y2 - y1
    squared = along_x**2 + along_y**2 or 1.0
    share = np.clip(((x - x1) * along_x + (y - y1) * along_y) / squared, 0, 1)
    return np.asarray(np.hypot(x - x1 - share * along_x, y - y1 - share * along_y) <= width / 2)


def _whole(picture: Bytes) -> tuple[Bytes, Bytes, Bytes]:
    """Return Y, U and V at every pixel."""
    width = picture.shape[1]
    padded = np.pad(picture, ((0, 0), (0, -width % 4)), mode="edge")
    y, u, v = (
        np.repeat(padded[:, 1::2], 2, 1),
        np.repeat(padded[:, 2::4], 4, 1),
        np.repeat(padded[:, 0::4], 4, 1),
    )
    return y[:, :width], u[:, :width], v[:, :width]


def _jpeg(y: Bytes, u: Bytes | None, v: Bytes) -> tuple[bytes, bytes]:
    """Return the header and compressed data of a picture; gray without U."""
    from PIL import Image

    if u is None:
        image = Image.fromarray(y)
    else:
        image = Image.merge("YCbCr", [Image.fromarray(np.ascontiguousarray(plane)) for plane in (y, u, v)])
    file = io.BytesIO()
    image.save(file, "JPEG", quality=QUALITY, subsampling="4:2:2" if u is not None else -1)
    data = file.getvalue()
    place = 2
    while data[place + 1] != 0xDA:
        place += 2 + int.from_bytes(data[place + 2 : place + 4], "big")
    place += 2 + int.from_bytes(data[place + 2 : place + 4], "big")
    return data[:place], data[place:]
