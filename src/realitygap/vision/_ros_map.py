"""Arenas from maps of ROS, and back: the occupancy grids that map_server and nav2 read."""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap._limits import open_image, read_file
from realitygap.errors import DescriptionError, from_extra
from realitygap.records import write_whole
from realitygap.settings import shown
from realitygap.world import Arena, ArenaFile, Obstacle, Pose

MOST_SIDE = 8192
"""Width and height of a map at most [px]."""

MOST_WALLS = 2048
"""Walls of an arena at most; as `ArenaFile` has it."""

RESOLUTION = 0.01
"""Side of a pixel of a map that is written [m]."""

OCCUPIED, UNKNOWN, FREE = 0, 205, 254
"""Gray values of a map that is written; those of map_saver."""

OCCUPIED_THRESH, FREE_THRESH = 0.65, 0.196
"""Thresholds of a map that is written; 205 is between them."""

_MARGIN = 4
"""Unknown pixels around a map that is written."""

_TOLERANCE = 1.5
"""Distance of a wall from the border if none is given [px]: the steps of a sloping line are up to 1.41 px from it."""

_FINE = 4
"""Parts of a pixel to which the border of free space is traced."""

_MOST_YAML_BYTES = 65_536
_MOST_LETTERS = 1_000

_KEYS = ("image", "resolution", "origin")
_MODES = ("trinary", "scale", "raw")


@dataclass(frozen=True)
class OccupancyMap:
    """A map of ROS.

    Attributes:
        name: Name of the file without the ending.
        free: (h, w) bool, True for a pixel that is known to be free; row 0 is at the top, as in its image.
        resolution: Side of a pixel [m].
        origin: Pose of the lower left corner of the image in the frame of the map.
    """

    name: str
    free: NDArray[np.bool_]
    resolution: float
    origin: Pose

    def to_map(self, columns: NDArray[np.float64], rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, 2) x and y [m] of places in the image, in pixels from its upper left corner."""
        return np.array(
            [
                self.origin.point(column * self.resolution, (len(self.free) - row) * self.resolution)
                for column, row in zip(columns.tolist(), rows.tolist(), strict=True)
            ]
        ).reshape(-1, 2)

    def to_image(self, x: float, y: float) -> tuple[int, int]:
        """Return the column and the row of the pixel at a place [m], which may lie outside."""
        sine, cosine = math.sin(self.origin.heading), math.cos(self.origin.heading)
        across, up = x - self.origin.x, y - self.origin.y
        column = (across * cosine + up * sine) / self.resolution
        row = len(self.free) - (up * cosine - across * sine) / self.resolution
        return math.floor(column), math.floor(row)


def read_map(path: str | Path) -> OccupancyMap:
    """Return the map of ROS in a YAML file and the image that it names (PGM, PNG, or another).

    A pixel is free if its occupancy is below `free_thresh`. Others, the unknown ones among them, count as occupied.

    Args:
        path: The YAML file, with image, resolution, origin, and as needed negate, occupied_thresh, free_thresh, mode.

    Raises:
        DescriptionError: The file or its image cannot be read, or a value is missing or out of range.
        MissingExtraError: The extra `ros` is not installed.

    Source: map_server of ROS 1 and ROS 2 (nav2_map_server), modes trinary, scale, and raw. Differs: an image's
    transparency counts for nothing.
    """
    path = Path(path)
    values = _values(path)
    resolution = _number(path, "resolution", values["resolution"], 1e-4, 1e3)
    origin = values["origin"]
    if not (isinstance(origin, list) and len(origin) in (2, 3)):
        raise DescriptionError(f"{path}: origin: expected [x, y, yaw], got {shown(origin)}.")
    x, y, yaw = (_number(path, "origin", value, -1e4, 1e4) for value in [*origin, 0.0][:3])
    mode = values.get("mode", "trinary")
    if mode not in _MODES:
        raise DescriptionError(f"{path}: mode: expected {', '.join(_MODES)}, got {shown(mode)}.")
    free_thresh = _number(path, "free_thresh", values.get("free_thresh", FREE_THRESH), 0.0, 1.0)
    occupied = _number(path, "occupied_thresh", values.get("occupied_thresh", OCCUPIED_THRESH), 0.0, 1.0)
    if not free_thresh < occupied:
        raise DescriptionError(
            f"{path}: free_thresh: expected less than occupied_thresh, {occupied:g}, got {free_thresh:g}."
        )
    negate = _number(path, "negate", values.get("negate", 0), 0, 1)
    gray = _gray(path, values["image"])
    if mode == "raw":
        occupancy = np.where(gray <= 100, gray / 100.0, 1.0)
    else:
        occupancy = gray / 255.0 if negate else (255 - gray) / 255.0
    return OccupancyMap(path.stem, occupancy < free_thresh, resolution, Pose(x, y, yaw))


def arena_of_map(
    source: OccupancyMap | str | Path,
    start: Pose | tuple[float, float, float] | None = None,
    *,
    tolerance: float | None = None,
) -> Arena:
    """Return the arena around the free space of a map that a start belongs to.

    Each border of this space becomes walls: straight lines that end at corners of pixels, and that are nowhere further
    from it than the tolerance and half a pixel. Parts that cannot be reached from the start are left out.

    Args:
        source: The map, or its YAML file.
        start: x [m], y [m], and heading [rad] in the frame of the map. If not given, the place furthest from all walls
            in the largest free space, facing +x.
        tolerance: Largest distance of a wall from the border [m]; 1.5 pixels if not given, which makes the steps of a
            sloping line straight.

    Raises:
        DescriptionError: The map has no free space, the start is not in it, or there are more than 2,048 walls.
        MissingExtraError: The extra `ros` is not installed.
    """
    cv2 = from_extra("cv2", "ros")
    grid = source if isinstance(source, OccupancyMap) else read_map(source)
    tolerance = _TOLERANCE * grid.resolution if tolerance is None else tolerance
    if not (math.isfinite(tolerance) and tolerance > 0):
        raise ValueError(f"tolerance is {tolerance!r}, expected a length above 0 [m].")
    if not grid.free.any():
        raise DescriptionError(
            f"The map {grid.name} has no free pixel. Check negate and free_thresh in its YAML file."
        )
    _, marks, sizes, _ = cv2.connectedComponentsWithStats(grid.free.astype(np.uint8), connectivity=4)
    if start is None:
        space = marks == 1 + int(np.argmax(sizes[1:, cv2.CC_STAT_AREA]))
        row, column = divmod(int(np.argmax(_room(cv2, space))), space.shape[1])
        (x, y), *_ = grid.to_map(np.array([column + 0.5]), np.array([row + 0.5])).tolist()
        pose = Pose(round(x, 4), round(y, 4), 0.0)
    else:
        pose = Pose(*map(float, start))
        column, row = grid.to_image(pose.x, pose.y)
        is_within = 0 <= row < grid.free.shape[0] and 0 <= column < grid.free.shape[1]
        if not (is_within and grid.free[row, column]):
            raise DescriptionError(
                f"The start ({pose.x:g}, {pose.y:g}) is not in free space of the map {grid.name}. Choose another one, "
                "or leave it out."
            )
        space = marks == marks[row, column]
    walls = _walls(cv2, grid, space, tolerance)
    if len(walls) > MOST_WALLS:
        raise DescriptionError(
            f"The map {grid.name} has {len(walls):,} walls with a tolerance of {tolerance:g} m, expected at most "
            f"{MOST_WALLS:,}. Choose a larger tolerance (--tolerance)."
        )
    return Arena.from_file(ArenaFile(name=grid.name[:80], wall=walls, start=list(pose)))


def _room(cv2: Any, space: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the distance of each pixel from what is not free [px]; the border of the image counts as such."""
    around = np.pad(space.astype(np.uint8), 1)
    room: NDArray[np.float32] = cv2.distanceTransform(around, cv2.DIST_L2, 5)
    return room[1:-1, 1:-1]


def _walls(cv2: Any, grid: OccupancyMap, space: NDArray[np.bool_], tolerance: float) -> list[list[float]]:
    """Return (w, 4) the borders of a free space as walls [m]."""
    rows, columns = np.flatnonzero(space.any(1)), np.flatnonzero(space.any(0))
    top, left = int(rows[0]), int(columns[0])
    part = space[top : rows[-1] + 1, left : columns[-1] + 1]
    # what is solid holds together at corners of pixels, so that lines one pixel wide have no gaps
    solid = np.pad(~part, 1, constant_values=True).astype(np.uint8)
    fine = np.kron(solid, np.ones((_FINE, _FINE), np.uint8))
    borders, tree = cv2.findContours(fine, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    walls = []
    for border, (_, _, _, parent) in zip(borders, tree[0], strict=True):
        if parent < 0 and not border.min():
            continue  # the edge of the picture
        corners = cv2.approxPolyDP(border, tolerance / grid.resolution * _FINE, closed=True)[:, 0, :]
        if len(corners) < 2:
            continue  # smaller than the tolerance
        places = np.rint((corners + 0.5) / _FINE) - 1.0  # the corners of pixels
        points = grid.to_map(places[:, 0] + left, places[:, 1] + top).round(4).tolist()
        ends = [*points[1:], points[0]] if len(points) > 2 else points[1:]
        walls += [[*one, *other] for one, other in zip(points, ends, strict=False) if one != other]
    return walls


def save_map(arena: Arena, path: str | Path, *, resolution: float = RESOLUTION) -> Path:
    """Write an arena as a map of ROS: a YAML file, and its image next to it (.pgm).

    Walls are a pixel wide, and obstacles are filled. Space that the start belongs to is free, and the rest is unknown.
    Lights, the floor, the goal, and the cells are in no map; the start is a comment.

    Args:
        arena: The arena.
        path: The YAML file to write; one that is there is replaced.
        resolution: Side of a pixel [m].

    Returns:
        The path of the image.

    Raises:
        DescriptionError: The map would have more than 8,192 pixels each way, or a wall covers the start.
        MissingExtraError: The extra `ros` is not installed.
        RecordError: A file cannot be written.
        ValueError: The resolution is not above 0.
    """
    from PIL import Image, ImageDraw

    path = Path(path)
    if not (math.isfinite(resolution) and resolution > 0):
        raise ValueError(f"resolution is {resolution!r}, expected a length above 0 [m].")
    points = [(x, y) for x1, y1, x2, y2 in arena.walls for x, y in ((x1, y1), (x2, y2))]
    points += [point for obstacle in arena.obstacles for point in obstacle.outline()]
    points += [(pose.x, pose.y) for pose in arena.starts]
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    width, height = (math.ceil(size / resolution) + 1 + 2 * _MARGIN for size in (high - low).tolist())
    if max(width, height) > MOST_SIDE:
        raise DescriptionError(
            f"The map of {arena.name} would have {width:,} x {height:,} pixels, expected at most {MOST_SIDE:,} each "
            "way. Choose a larger resolution (--resolution)."
        )
    # walls at a whole number of pixels from the lowest one lie in the middle of theirs
    origin = low - (_MARGIN + 0.5) * resolution

    def pixel(x: float, y: float) -> tuple[float, float]:
        return math.floor((x - origin[0]) / resolution + 1e-6), height - 1 - math.floor(
            (y - origin[1]) / resolution + 1e-6
        )

    image = Image.new("L", (width, height), FREE)
    draw = ImageDraw.Draw(image)
    for obstacle in arena.obstacles:
        _draw_obstacle(draw, obstacle, pixel)
    for x1, y1, x2, y2 in arena.walls:
        draw.line([pixel(x1, y1), pixel(x2, y2)], fill=OCCUPIED)
    gray = np.array(image)
    column, row = (int(value) for value in pixel(arena.start.x, arena.start.y))
    cv2 = from_extra("cv2", "ros")
    _, marks = cv2.connectedComponents((gray == FREE).astype(np.uint8), connectivity=4)
    if not marks[row, column]:
        raise DescriptionError(
            f"With pixels of {resolution:g} m a wall covers the start of {arena.name}. Choose a smaller resolution "
            "(--resolution)."
        )
    gray[(gray == FREE) & (marks != marks[row, column])] = UNKNOWN
    file = path.with_suffix(".pgm")
    stream = io.BytesIO()
    Image.fromarray(gray).save(stream, "PPM")
    write_whole(file, stream.getvalue())
    start = ", ".join(f"{value:g}" for value in arena.start)
    text = (
        f"# Arena {' '.join(arena.name.split())}. Start: {start} (x [m], y [m], heading [rad])\n"
        f"image: {file.name}\nmode: trinary\nresolution: {resolution:g}\n"
        f"origin: [{origin[0]:.6g}, {origin[1]:.6g}, 0.0]\nnegate: 0\n"
        f"occupied_thresh: {OCCUPIED_THRESH:g}\nfree_thresh: {FREE_THRESH:g}\n"
    )
    write_whole(path, text.encode())
    return file


def _draw_obstacle(draw: Any, obstacle: Obstacle, pixel: Any) -> None:
    corners = [pixel(*corner) for corner in obstacle.outline()]
    if len(set(corners)) > 2:
        draw.polygon(corners, fill=OCCUPIED, outline=OCCUPIED)
    else:
        draw.point(corners, fill=OCCUPIED)


def _values(path: Path) -> dict[str, Any]:
    """Return the values of the YAML file, all that a map needs among them."""
    yaml = from_extra("yaml", "ros")
    try:
        text = read_file(path, _MOST_YAML_BYTES).decode()
    except FileNotFoundError:
        raise DescriptionError(f"There is no map {path}. Name the YAML file of a map.") from None
    except OSError as error:
        raise DescriptionError(f"Cannot read the map {path}: {error.strerror or error}.") from None
    except ValueError as error:
        raise DescriptionError(f"{path}: not a YAML file of a map ({error}).") from None
    try:
        for event in yaml.parse(text, yaml.SafeLoader):
            # a list of references to lists of references takes all memory once it is printed
            if isinstance(event, yaml.AliasEvent):
                raise DescriptionError(f"{path}: it has references (*), expected plain values.")
            if isinstance(event, yaml.ScalarEvent) and len(event.value) > _MOST_LETTERS:
                raise DescriptionError(
                    f"{path}: a value has {len(event.value):,} letters, expected at most {_MOST_LETTERS:,}."
                )
        values = yaml.safe_load(text)
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        said = str(error).split("\n")[0]
        raise DescriptionError(f"{path}: not YAML ({said}).") from None
    missing = [key for key in _KEYS if not (isinstance(values, dict) and key in values)]
    if missing:
        raise DescriptionError(
            f"{path}: it has no {', '.join(missing)}, expected the YAML file of a map: image, resolution, and origin."
        )
    return dict(values)


def _number(path: Path, key: str, value: Any, least: float, most: float) -> float:
    if isinstance(value, bool) and key == "negate":
        value = int(value)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (is_number and least <= value <= most):
        raise DescriptionError(
            f"{path}: {key}: expected a number from {least:g} to {most:g}, got {shown(value)}."
        )
    return float(value)


def _gray(path: Path, name: Any) -> NDArray[np.float64]:
    """Return the gray values of the image, 0 to 255."""
    if not isinstance(name, str) or not name or "\x00" in name:
        raise DescriptionError(f"{path}: image: expected the name of an image file, got {shown(name)}.")
    file = path.parent / name
    if not file.resolve().is_relative_to(path.parent.resolve()):
        raise DescriptionError(
            f"{path}: image: expected a file in the folder of the map, got {shown(name)}. Copy the image there, and "
            "change its name in the YAML file."
        )
    try:
        with open_image(file, MOST_SIDE) as picture:
            return np.asarray(picture.convert("L"), dtype=np.float64)
    except FileNotFoundError:
        raise DescriptionError(f"{path}: image: there is no file {file}.") from None
    except (OSError, ValueError) as error:
        raise DescriptionError(f"{path}: image: {name} is no image that can be read ({error}).") from None
