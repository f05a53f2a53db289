"""The tags at the corners of a sheet, as OpenCV has them."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import from_extra


@cache
def dictionary() -> Any:
    """OpenCV's dictionary of the family 36h11.

    Raises:
        MissingExtraError: OpenCV is not installed.
    """
    aruco = from_extra("cv2", "vision").aruco
    return aruco.getPredefinedDictionary(aruco.DICT_APRILTAG_36h11)


def tag_bits(number: int) -> NDArray[np.bool_]:
    """Return a tag with its black border, True for white, (8, 8); row 0 is its upper edge."""
    known = dictionary()
    size = known.markerSize + 2
    image: NDArray[np.uint8] = from_extra("cv2", "vision").aruco.generateImageMarker(known, number, size)
    return np.asarray(image > 127)
