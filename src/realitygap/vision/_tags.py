"""Square tags: their families, as OpenCV has them, and their places in an arena and on a robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import check_finite, from_extra
from realitygap.world import Arena, Grid, bounds_of

CORNER_FAMILY = "36h11"
"""Family of the tags at the arena's corners."""

FAMILIES = {
    "36h11": "DICT_APRILTAG_36h11",
    "25h9": "DICT_APRILTAG_25h9",
    "16h5": "DICT_APRILTAG_16h5",
    "aruco4x4": "DICT_4X4_1000",
    "aruco5x5": "DICT_5X5_1000",
    "aruco6x6": "DICT_6X6_1000",
    "aruco7x7": "DICT_7X7_1000",
    "aruco": "DICT_ARUCO_ORIGINAL",
}
"""OpenCV's name of each; of smaller ArUco dictionaries the tags are the first ones of these."""


@cache
def dictionary(family: str) -> Any:
    """Return OpenCV's dictionary of a family.

    Raises:
        MissingExtraError: OpenCV is not installed.
    """
    aruco = from_extra("cv2", "vision").aruco
    return aruco.getPredefinedDictionary(getattr(aruco, FAMILIES[family]))


def n_tags(family: str) -> int:
    """Return the number of tags in a family; they are numbered from 0."""
    return len(dictionary(family).bytesList)


def tag_bits(family: str, number: int) -> NDArray[np.bool_]:
    """Return a tag with its black border, True for white, (b, b); row 0 is its upper edge.

    Raises:
        ValueError: The family has no such tag.
    """
    known = dictionary(family)
    if not 0 <= number < n_tags(family):
        raise ValueError(f"tag is {number}, expected 0 to {n_tags(family) - 1}: {family} has no more.")
    size = known.markerSize + 2
    image = from_extra("cv2", "vision").aruco.generateImageMarker(known, number, size)
    bits: NDArray[np.bool_] = image > 127
    return bits


Floats = NDArray[np.float64]
Box = tuple[float, float, float, float]
"""Left, lower, right and upper end [m]."""

CORNER_IDS = (0, 1, 2, 3)
"""Lower left, lower right, upper right, upper left."""

CORNER_SIZE_M = 0.06
CORNER_INSET_M = 0.01
"""Distance from the walls. It is outside of them if the cells leave no room inside."""


@dataclass(frozen=True)
class RobotTag:
    """A tag on top of a robot, its upper edge towards the robot's front.

    Attributes:
        number: Number in its family.
        size: Side of its black square [m].
        height: Height above the floor [m].
        family: Key of `FAMILIES`; empty to detect the family.
        ahead: Position ahead of the robot's reference point [m].
        left: Position to the left of the robot's reference point [m].
        turned: Counter-clockwise rotation relative to the robot [rad].
    """

    number: int = 10
    size: float = 0.07
    height: float = 0.1
    family: str = ""
    ahead: float = 0.0
    left: float = 0.0
    turned: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what is no tag.

        Raises:
            ValueError: A size that is not above 0, a height below the floor, a number that is infinite or NaN, or a
                family that nobody knows.
        """
        check_finite(vars(self))
        if not self.size > 0:
            raise ValueError(f"size is {self.size}, expected a length above 0 m.")
        if not self.height >= 0:
            raise ValueError(f"height is {self.height}, expected at least 0 m.")
        if self.family and self.family not in FAMILIES:
            raise ValueError(f"family is {self.family!r}, expected one of {', '.join(FAMILIES)}.")

    def corners(self) -> Floats:
        """Return the upper left, upper right, lower right and lower left corner, about its middle, (4, 2) [m].

        Its upper edge is towards +x.
        """
        half = self.size / 2
        return np.array([(half, half), (half, -half), (-half, -half), (-half, half)])


def bounds(arena: Arena) -> Box:
    """Return left, lower, right and upper end of an arena's walls [m].

    Raises:
        ValueError: Its walls enclose no area.
    """
    walls = bounds_of(arena)
    if walls is None:
        raise ValueError(
            f"arena {arena.name!r} has no walls around an area, expected some: tags lie at its corners"
        )
    return walls


def corner_tags(
    arena: Arena, size: float = CORNER_SIZE_M, inset: float | None = None
) -> Mapping[int, Floats]:
    """Return the corners of the four tags at an arena's corners, upright for who looks with +y up.

    By default, they are as on the sheet of `realitygap print-sheet`: in the ring around the reachable cells if that is
    wide enough, otherwise just outside the walls.

    Args:
        arena: Arena whose walls span a rectangle.
        size: Side of a tag's black square [m].
        inset: Distance from the walls to the nearest edges of the square [m]; negative for tags outside the walls.

    Returns:
        (4, 3) upper left, upper right, lower right and lower left corner on the floor [m], by number.

    Raises:
        ValueError: They do not fit.
    """
    check_finite({"size": size, "inset": inset})
    left, lower, right, upper = bounds(arena)
    if inset is None:
        inset = (
            CORNER_INSET_M
            if ring_width(bounds(arena), arena.grid) >= size + CORNER_INSET_M
            else -CORNER_INSET_M - size
        )
    if not size > 0 or 2 * (size + inset) >= min(right - left, upper - lower):
        raise ValueError(
            f"Tags of {size:g} m, {inset:g} m from the walls, expected such as fit into the corners of "
            f"{right - left:.3f} x {upper - lower:.3f} m."
        )
    near, far = inset, inset + size
    return {
        0: _square(left + near, lower + near, size),
        1: _square(right - far, lower + near, size),
        2: _square(right - far, upper - far, size),
        3: _square(left + near, upper - far, size),
    }


def ring_width(walls: Box, grid: Grid) -> float:
    """Return the smallest distance from the walls to the reachable cells [m]."""
    left, lower, right, upper = walls
    across, up = right - grid.x - grid.columns * grid.cell, upper - grid.y - grid.rows * grid.cell
    return min(grid.x - left, grid.y - lower, across, up)


def _square(x: float, y: float, size: float) -> Floats:
    """Return the corners of an upright square whose lower left is at x, y, (4, 3)."""
    return np.array([(x, y + size, 0.0), (x + size, y + size, 0.0), (x + size, y, 0.0), (x, y, 0.0)])
