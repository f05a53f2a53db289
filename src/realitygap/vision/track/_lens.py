"""A camera's lens: how directions become pixels, and the file that keeps it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from realitygap._limits import MOST_TOML_BYTES, parse_toml, read_file
from realitygap.errors import VisionError, check_finite, from_extra

Floats = NDArray[np.float64]

LENS_FORMAT = "realitygap lens 1"
MOST_VIEWS = 40  # of a chessboard; more take long and tell nothing new
LEAST_VIEWS = 5
INVERSE_STEPS = 20  # each takes a tenth or less of what is left, of lenses that are no fisheye
LEAST_APART = 0.04  # of the width: views nearer to the one before are left out


@dataclass(frozen=True)
class Lens:
    """A pinhole and its distortion, for pictures of one size.

    Attributes:
        width: Width of pictures [px].
        height: Height of pictures [px].
        focal: Focal length across and down [px].
        center: Intersection of the optical axis with the picture [px].
        distortion: k1, k2, p1, p2, k3 of the Brown-Conrady model, as OpenCV has it.
        rms: Error of the points of the fit [px]; nan if it was not fitted.

    Source: Brown (1966), in the form of OpenCV's calib3d.
    """

    width: int
    height: int
    focal: tuple[float, float]
    center: tuple[float, float]
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    rms: float = float("nan")

    def __post_init__(self) -> None:
        """Raise a ValueError if a number other than the error is infinite or NaN."""
        check_finite({"focal": self.focal, "center": self.center, "distortion": self.distortion})

    @property
    def matrix(self) -> Floats:
        """Camera matrix, (3, 3)."""
        (fx, fy), (cx, cy) = self.focal, self.center
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def to_pixels(self, directions: Floats) -> Floats:
        """Return pixels of (n, 2) directions x / z, y / z of the camera's own axes."""
        x, y = directions[:, 0], directions[:, 1]
        k1, k2, p1, p2, k3 = self.distortion
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        across = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        down = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        return np.column_stack([across, down]) * self.focal + self.center

    def to_directions(self, pixels: Floats) -> Floats:
        """Return the directions of pixels, (n, 2): the inverse of `to_pixels`, by iteration."""
        distorted = (np.asarray(pixels, np.float64) - self.center) / self.focal
        k1, k2, p1, p2, k3 = self.distortion
        x, y = distorted.T
        for _ in range(INVERSE_STEPS):
            r2 = x * x + y * y
            radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
            across = distorted[:, 0] - 2 * p1 * x * y - p2 * (r2 + 2 * x * x)
            down = distorted[:, 1] - p1 * (r2 + 2 * y * y) - 2 * p2 * x * y
            x, y = across / radial, down / radial
        return np.column_stack([x, y])

    def scaled_to(self, width: int, height: int) -> Lens:
        """Return the same lens for pictures of another size.

        Raises:
            VisionError: They have another shape, so another part of what the sensor sees.
        """
        if abs(width * self.height - height * self.width) > 0.01 * width * self.height:
            raise VisionError(
                f"The lens was fitted to pictures of {self.width} x {self.height}, and these have {width} x {height}: "
                "another shape. Fit the lens with the camera's present setting (realitygap lens)."
            )
        by = width / self.width
        (fx, fy), (cx, cy) = self.focal, self.center
        return replace(
            self, width=width, height=height, focal=(fx * by, fy * by),
            center=((cx + 0.5) * by - 0.5, (cy + 0.5) * by - 0.5), rms=self.rms * by,
        )  # fmt: skip

    def to_toml(self) -> str:
        """Return the text of a file."""
        return (
            f"format = {LENS_FORMAT!r}\nwidth = {self.width}  # px\nheight = {self.height}\n"
            f"focal = {_plain(self.focal)}  # px, across and down\ncenter = {_plain(self.center)}\n"
            f"distortion = {_plain(self.distortion)}  # k1, k2, p1, p2, k3\nrms = {float(self.rms)}  # px\n"
        )


def _plain(numbers: Iterable[float]) -> list[float]:
    """Return Python's numbers, whose text is that of TOML."""
    return [float(number) for number in numbers]


def read_lens(path: Path | str) -> Lens:
    """Return the lens that a file of `realitygap lens` describes.

    Raises:
        VisionError: There is no such file, or it is none.
    """
    try:
        values = parse_toml(read_file(Path(path), MOST_TOML_BYTES).decode("utf-8"))
    except (OSError, ValueError) as error:
        raise VisionError(
            f"{path} cannot be read as the file of a lens ({error}). Make one: realitygap lens"
        ) from None
    try:
        if values["format"] != LENS_FORMAT:
            raise ValueError(f"format is {values['format']!r}, expected {LENS_FORMAT!r}")
        fx, fy = map(float, values["focal"])
        cx, cy = map(float, values["center"])
        k1, k2, p1, p2, k3 = map(float, values["distortion"])
        made = Lens(
            int(values["width"]), int(values["height"]), (fx, fy), (cx, cy), (k1, k2, p1, p2, k3), float(values["rms"])
        )  # fmt: skip
        if not all(map(math.isfinite, (fx, fy, cx, cy, *made.distortion))) or math.isinf(made.rms):
            raise ValueError("a number of it is not finite")
        if not all(value > 0 for value in (made.width, made.height, fx, fy)):
            raise ValueError("its size or focal length is not above 0")
    except (KeyError, OverflowError, TypeError, ValueError) as error:  # OverflowError: an infinite width
        raise VisionError(f"{path} is no file of a lens: {error}. Make one: realitygap lens") from None
    return made


def fit_lens(images: Iterable[NDArray[np.uint8]], columns: int, rows: int, square: float) -> Lens:
    """Return the lens of a camera that was shown a chessboard from several sides.

    Args:
        images: Gray pictures. Pictures without the whole board are left out, and so are those with the board at the
            same place as in the previous one.
        columns, rows: Inner corners of the board, at least 3 each.
        square: Side of a square [m].

    Raises:
        ValueError: No such board.
        VisionError: Too few pictures show it.

    Source: Zhang (2000), as OpenCV's calibrateCamera has it.
    """
    if min(columns, rows) < 3 or not square > 0:
        raise ValueError(
            f"The board has {columns} x {rows} inner corners and squares of {square:g} m, expected at least 3 x 3 and "
            "a size above 0."
        )
    cv2 = from_extra("cv2", "vision")
    views: list[Floats] = []
    n, width, height = 0, 0, 0
    for image in images:
        n += 1
        height, width = image.shape
        is_seen, corners = cv2.findChessboardCornersSB(image, (columns, rows))
        if not is_seen:
            continue
        view = np.asarray(corners, np.float64).reshape(-1, 2)
        if not views or np.abs(views[-1] - view).mean() > LEAST_APART * width:
            views.append(view)
        if len(views) == MOST_VIEWS:
            break
    if len(views) < LEAST_VIEWS:
        raise VisionError(
            f"Of {n} pictures {len(views)} show a board of {columns} x {rows} inner corners from a new side, expected "
            f"at least {LEAST_VIEWS}. Count the corners where four squares meet, and show the board whole, tilted and "
            "at all edges of the picture."
        )
    board = np.zeros((columns * rows, 3), np.float32)
    board[:, :2] = np.mgrid[:columns, :rows].T.reshape(-1, 2) * square
    rms, matrix, distortion, _, _ = cv2.calibrateCamera(
        [board] * len(views), [view.astype(np.float32).reshape(-1, 1, 2) for view in views], (width, height), None, None
    )  # fmt: skip
    k1, k2, p1, p2, k3 = np.ravel(distortion)[:5].tolist()
    return Lens(
        width, height, (float(matrix[0, 0]), float(matrix[1, 1])), (float(matrix[0, 2]), float(matrix[1, 2])),
        (k1, k2, p1, p2, k3), float(rms),
    )  # fmt: skip
