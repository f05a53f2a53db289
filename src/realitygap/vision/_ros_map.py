"""Arenas from maps of ROS, and back: the occupancy grids that map_server and nav2 read."""

from __future__ import annotations

import io
import math
import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from realitygap._image_file import MOST_IMAGE_BYTES, open_image, plain
from realitygap._limits import read_file
from realitygap._named_file import NamedFileError, open_named
from realitygap.errors import DescriptionError, from_extra
from realitygap.records import write_whole
from realitygap.settings import shown
from realitygap.world import Arena, ArenaFile, Obstacle, Pose

if TYPE_CHECKING:
    from PIL.Image import Image

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

_RESOLUTIONS = (1e-4, 1e3)
"""Smallest and largest side of a pixel [m]."""

_MARGIN = 4
"""Unknown pixels around a map that is written."""

_TOLERANCE = 1.5
"""Distance of a wall from the border if none is given [px]: the steps of a sloping line are up to 1.41 px from it."""

_FINE, _FINE_IF_LARGE = 4, 2
"""Parts of a pixel to which the border of free space is traced."""
_LARGE = 1 << 24
"""Pixels of a map that is traced in fewer parts, so that memory stays below 1 GB."""
_MOST_SPACES = 200_000
"""Separate spaces, free or occupied, of a map at most: noise has thousands."""

_BAND = 256
"""Rows of an image whose occupancy is computed together, so that memory does not grow with the image."""

_LUMA = (212_656, 715_158, 72_186)
"""Weights of red, green, and blue in the gray of ImageMagick, which nav2 reads with since Jazzy (ITU-R BT.709)."""

_MOST_YAML_BYTES = 65_536
_MOST_LETTERS = 1_000

_PLAIN_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]*")
"""Names that YAML reads as they are."""
_YAML_NUMBER = re.compile(
    r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?|[-+]?\.inf|\.nan", re.IGNORECASE
)
"""Numbers as yaml-cpp reads them, with which map_server reads."""
_YAML_TYPES = ("bool", "null")

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

    A pixel is free if its occupancy is below `free_thresh` and it is not transparent. Others, the unknown ones among
    them, count as occupied. There is a warning if gray 205, which map_saver writes for unknown, counts as free.

    Args:
        path: The YAML file, with image, resolution, origin, and as needed negate, occupied_thresh, free_thresh, mode.

    Raises:
        DescriptionError: The file or its image cannot be read, or a value is missing or out of range.
        MissingExtraError: The extra `ros` is not installed.

    Source: map_server of ROS 1 and ROS 2 (nav2_map_server, `map_io.cpp`), modes trinary, scale, and raw. Differs: where
    its versions disagree, a pixel is free only if it is free by both. Since Jazzy, a color has the gray of ImageMagick,
    before it was the mean of its channels. A pixel at `free_thresh` is free since Jazzy only. Before, transparency was
    one more channel in mode trinary; here such pixels are unknown, as since Jazzy. Mode raw has no thresholds there,
    and ignores transparency.
    """
    path = Path(path)
    values = _values(path)
    resolution = _number(path, "resolution", values["resolution"], *_RESOLUTIONS)
    origin = values["origin"]
    if not (isinstance(origin, list) and len(origin) in (2, 3)):
        raise DescriptionError(f"{path}: origin: expected [x, y, yaw], got {shown(origin)}.")
    x, y, yaw = (_number(path, "origin", value, -1e4, 1e4) for value in [*origin, 0.0][:3])
    mode = str(values.get("mode", "trinary")).lower()
    if mode not in _MODES:
        raise DescriptionError(f"{path}: mode: expected {', '.join(_MODES)}, got {shown(values['mode'])}.")
    free_thresh = _number(path, "free_thresh", values.get("free_thresh", FREE_THRESH), 0.0, 1.0)
    occupied = _number(path, "occupied_thresh", values.get("occupied_thresh", OCCUPIED_THRESH), 0.0, 1.0)
    if not free_thresh < occupied:
        raise DescriptionError(
            f"{path}: free_thresh: expected less than occupied_thresh, {occupied:g}, got {free_thresh:g}."
        )
    negate = _number(path, "negate", values.get("negate", 0), 0, 1)
    image = _image(path, values["image"])
    free = np.zeros((image.height, image.width), bool)
    unknown, n_unknown = (UNKNOWN if negate else 255 - UNKNOWN) / 255, 0
    for top in range(0, image.height, _BAND):
        band = image.crop((0, top, image.width, min(top + _BAND, image.height)))
        occupancy = _occupancy(np.asarray(band), mode, negate=bool(negate))
        free[top : top + _BAND] = occupancy < free_thresh
        n_unknown += int((occupancy == unknown).sum())
    if n_unknown and unknown < free_thresh and mode != "raw":
        warnings.warn(
            f"{path}: {n_unknown:,} pixels of gray {UNKNOWN}, which map_saver writes for unknown, count as free, "
            f"because free_thresh is {free_thresh:g}. If they are unknown, write free_thresh: {FREE_THRESH:g}.",
            stacklevel=2,
        )
    return OccupancyMap(path.stem, free, resolution, Pose(x, y, yaw))


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
        DescriptionError: The map has no free space, the start is not in it, or there are more than 2,048 walls or
            200,000 separate spaces.
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
    marks, n_spaces = _spaces(cv2, grid.free, 4, grid.name)
    if start is None:
        sizes = np.zeros(n_spaces, np.int64)
        for pixels in marks:
            sizes += np.bincount(pixels, minlength=n_spaces)
        space = marks == 1 + int(np.argmax(sizes[1:]))
        del marks  # so that there is room for what follows
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
        del marks
    walls = _walls(cv2, grid, space, tolerance)
    if len(walls) > MOST_WALLS:
        raise DescriptionError(
            f"The map {grid.name} has {len(walls):,} walls with a tolerance of {tolerance:g} m, expected at most "
            f"{MOST_WALLS:,}. Choose a larger tolerance (--tolerance)."
        )
    return Arena.from_file(ArenaFile(name=grid.name[:80], wall=walls, start=list(pose)))


def _spaces(
    cv2: Any, pixels: NDArray[np.bool_], connectivity: int, name: str
) -> tuple[NDArray[np.int32], int]:
    """Return (h, w) marks of separate spaces, 0 outside them, and their number with the outside.

    Raises:
        DescriptionError: There are too many.
    """
    n_spaces, marks = cv2.connectedComponents(pixels.view(np.uint8), connectivity=connectivity)
    if n_spaces > _MOST_SPACES:
        raise DescriptionError(
            f"The map {name} has {n_spaces:,} separate spaces, expected at most {_MOST_SPACES:,}. Remove noise "
            "from its image."
        )
    return marks, n_spaces


def _room(cv2: Any, space: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the distance of each pixel from what is not free [px]; the border of the image counts as such."""
    around = np.pad(space.view(np.uint8), 1)
    room: NDArray[np.float32] = cv2.distanceTransform(around, cv2.DIST_L2, 5)
    return room[1:-1, 1:-1]


def _walls(cv2: Any, grid: OccupancyMap, space: NDArray[np.bool_], tolerance: float) -> list[list[float]]:
    """Return (w, 4) the borders of a free space as walls [m]."""
    rows, columns = np.flatnonzero(space.any(1)), np.flatnonzero(space.any(0))
    top, left = int(rows[0]), int(columns[0])
    part = space[top : rows[-1] + 1, left : columns[-1] + 1]
    # what is solid holds together at corners of pixels, so that lines one pixel wide have no gaps
    solid = np.pad(~part, 1, constant_values=True)
    _spaces(cv2, solid, 8, grid.name)  # so many borders at most
    n_parts = _FINE if solid.size <= _LARGE else _FINE_IF_LARGE
    fine = solid.view(np.uint8).repeat(n_parts, 0).repeat(n_parts, 1)
    borders, tree = cv2.findContours(fine, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    walls = []
    for border, (_, _, _, parent) in zip(borders, tree[0], strict=True):
        if parent < 0 and not border.min():
            continue  # the edge of the picture
        corners = cv2.approxPolyDP(border, tolerance / grid.resolution * n_parts, closed=True)[:, 0, :]
        if len(corners) < 2:
            continue  # smaller than the tolerance
        places = np.rint((corners + 0.5) / n_parts) - 1.0  # the corners of pixels
        points = grid.to_map(places[:, 0] + left, places[:, 1] + top).round(4).tolist()
        ends = [*points[1:], points[0]] if len(points) > 2 else points[1:]
        walls += [[*first, *second] for first, second in zip(points, ends, strict=False) if first != second]
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
        ValueError: The resolution is not from 0.0001 to 1,000 m.
    """
    from PIL import Image, ImageDraw

    path = Path(path)
    least, most = _RESOLUTIONS
    if not least <= resolution <= most:
        raise ValueError(f"resolution is {resolution!r}, expected {least:g} to {most:g} m.")
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
    name = " ".join("".join(c if c.isprintable() else " " for c in arena.name).split())
    text = (
        f"# Arena {name}. Start: {start} (x [m], y [m], heading [rad])\n"
        f"image: {_yaml_text(file.name)}\nmode: trinary\nresolution: {_yaml_number(resolution)}\n"
        f"origin: [{_yaml_number(origin[0])}, {_yaml_number(origin[1])}, 0.0]\nnegate: 0\n"
        f"occupied_thresh: {OCCUPIED_THRESH:g}\nfree_thresh: {FREE_THRESH:g}\n"
    )
    write_whole(path, text.encode())
    return file


def _yaml_number(value: float) -> str:
    """Return a length to a nanometer. PyYAML takes 1e-05, without a point, for text."""
    return np.format_float_positional(round(float(value), 9), trim="0")


def _yaml_text(name: str) -> str:
    if _PLAIN_NAME.fullmatch(name):
        return name
    return '"' + "".join(c if c.isalnum() and c.isascii() else f"\\U{ord(c):08x}" for c in name) + '"'


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
        values = yaml.load(text, _loader(yaml))
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        message = str(error).split("\n")[0]
        raise DescriptionError(f"{path}: not YAML ({message}).") from None
    missing = [key for key in _KEYS if not (isinstance(values, dict) and key in values)]
    if missing:
        raise DescriptionError(
            f"{path}: it has no {', '.join(missing)}, expected the YAML file of a map: image, resolution, and origin."
        )
    return dict(values)


def _loader(yaml: Any) -> Any:
    """Return a loader that reads numbers as map_server does: 5e-2 is a number, 010 is ten, and 1:30 is text."""

    class Loader(yaml.SafeLoader):  # type: ignore[misc]
        yaml_implicit_resolvers: ClassVar = {
            letter: [(tag, form) for tag, form in forms if tag.rpartition(":")[2] in _YAML_TYPES]
            for letter, forms in yaml.SafeLoader.yaml_implicit_resolvers.items()
        }

    def number(_: Any, node: Any) -> float:
        text = str(node.value)
        return (
            int(text)
            if text.lstrip("+-").isdecimal()
            else float(text.lower().replace(".inf", "inf").replace(".nan", "nan"))
        )

    Loader.add_implicit_resolver(
        "tag:yaml.org,2002:float",
        re.compile(f"(?:{_YAML_NUMBER.pattern})$", re.IGNORECASE),
        list("+-.0123456789"),
    )
    Loader.add_constructor("tag:yaml.org,2002:float", number)
    return Loader


def _number(path: Path, key: str, value: Any, least: float, most: float) -> float:
    if isinstance(value, bool) and key == "negate":
        value = int(value)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (is_number and least <= value <= most):
        raise DescriptionError(
            f"{path}: {key}: expected a number from {least:g} to {most:g}, got {shown(value)}."
        )
    return float(value)


def _image(path: Path, name: Any) -> Image:
    """Return the image that a map names, as L, LA, RGB, RGBA, or I;16."""
    try:
        with open_named(path.parent, name, MOST_IMAGE_BYTES) as file, open_image(file, MOST_SIDE) as image:
            return plain(image)
    except NamedFileError as error:
        raise DescriptionError(f"{path}: image: {error}") from None
    except (OSError, ValueError) as error:
        raise DescriptionError(f"{path}: image: {name} is no image that can be read ({error}).") from None


def _occupancy(pixels: NDArray[Any], mode: str, *, negate: bool) -> NDArray[np.float64]:
    """Return (h, w) the occupancy of pixels, 0 to 1; 1 where they are transparent.

    Args:
        pixels: (h, w) gray, or (h, w, c) with the channels LA, RGB, or RGBA, of 8 or 16 bits.
        mode: trinary, scale, or raw, in which a gray up to 100 is the occupancy in percent.
        negate: True if white is occupied.
    """
    full = np.iinfo(pixels.dtype).max
    layers = [pixels] if pixels.ndim == 2 else list(np.moveaxis(pixels, -1, 0))
    alpha = layers.pop() if len(layers) in (2, 4) else None
    red, green, blue = (layer.astype(np.int64) for layer in (layers * 3)[:3])
    weighted = (_LUMA[0] * red + _LUMA[1] * green + _LUMA[2] * blue) / sum(_LUMA)
    mean = (red + green + blue) / 3
    if mode == "raw":
        percent = [np.rint(gray / full * 255) for gray in (weighted, mean)]
        shares = [np.where(value <= 100, value / 100, 1.0) for value in percent]
    else:
        shares = [gray / full if negate else (full - gray) / full for gray in (weighted, mean)]
    occupancy = np.maximum(*shares)
    return occupancy if alpha is None else np.where(alpha < full, 1.0, occupancy)
