"""Families of square tags, as OpenCV has them."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import from_extra

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
