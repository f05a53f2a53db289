"""A sheet on a photograph: its tags, the lens, the grid, and uneven paper."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import VisionError, from_extra

from ._grid import GridOffsets, grid_offsets
from ._layout import SheetLayout
from ._pixels import View, shape_of, to_meters
from ._tags import CORNER_FAMILY, CORNER_IDS, dictionary

Floats = NDArray[np.float64]

ROUNDS = 3
"""Number of fits of the view to the grid's lines, each with a smaller search range."""

TAG_WEIGHT = 2.0
"""A tag's corner against a stretch of a grid line, by how precisely each is found."""


@dataclass(frozen=True)
class Sheet:
    """A sheet as it was found on a photograph.

    Attributes:
        layout: Layout that is printed on it.
        view: View from the sheet to the photograph.
        offsets: Remaining errors of the view: offsets of the grid's lines from their computed places, over the sheet;
            None if the grid was not found.
        tag_error: Root mean square of what is left at the tags' corners [m].
        grid_error: RMS distance of the lines of the grid from the view, before `offsets` are subtracted [m]; nan if
            none was found.
    """

    layout: SheetLayout
    view: View
    offsets: GridOffsets | None
    tag_error: float
    grid_error: float

    def to_photograph(self, points: Floats) -> Floats:
        """Return column and row [px] of points (..., 2) of the sheet [m], (..., 2)."""
        moved = points if self.offsets is None else points + self.offsets.at(points)
        return self.view(moved)


def find_sheet(image: NDArray[np.uint8], layout: SheetLayout) -> Sheet:
    """Find a sheet by its four tags, then by its grid.

    Args:
        image: (h, w, 3) RGB, or (h, w) gray.
        layout: Printed layout.

    Raises:
        VisionError: Not all four tags are seen, or they do not lie as on this sheet.
    """
    height, width = image.shape[:2]
    gray = _gray(image)
    corners = _tag_corners(gray)
    tags_px = np.concatenate([corners[number] for number in CORNER_IDS])
    tags_m = layout.tag_corners().reshape(-1, 2)
    view = _first_view(tags_m, tags_px, width, height)
    view = _fitted(view, tags_m, tags_px, None)
    tag_error = _rms(_in_meters(view, tags_m, view(tags_m) - tags_px))
    if tag_error > TAG_LIMIT:
        raise VisionError(
            f"The four tags were found, but not where this sheet has them: they are off by {1000 * tag_error:.0f} mm. "
            "Was it printed for this arena and at true scale (100 %, not fitted to the page)?"
        )
    grid_error = float("nan")
    offsets = None
    for nearness in range(ROUNDS):
        lines = grid_offsets(gray, view, layout, nearness)
        if lines is None:
            break
        view = _fitted(view, tags_m, tags_px, lines)
        grid_error = float(np.sqrt(np.mean(np.square(lines.residuals(view)))))
        offsets = lines
    if offsets is not None:
        last = grid_offsets(gray, view, layout, ROUNDS)
        offsets = last or offsets
        grid_error = offsets.rms
    return Sheet(layout, view, offsets, tag_error, grid_error)


TAG_LIMIT = 0.004
"""Tags further off than this are another sheet's [m]."""


def rectify(image: NDArray[np.uint8], sheet: Sheet, px_per_m: float) -> NDArray[np.uint8]:
    """Return the sheet from straight above, (h, w, 3); row 0 is its upper edge.

    Args:
        image: The photograph on which it was found.
        sheet: Sheet on the photograph.
        px_per_m: Pixels a meter.
    """
    cv2 = from_extra("cv2", "vision")
    box = sheet.layout.paper
    rows, columns = shape_of(box, px_per_m)
    step = 8  # the way to the photograph is smooth: known at every eighth pixel, it is known between
    coarse = np.stack(
        np.meshgrid(np.arange(0, columns + step, step), np.arange(0, rows + step, step)), axis=-1
    ).astype(np.float64)
    places = sheet.to_photograph(to_meters(coarse, box, px_per_m)).astype(np.float32)
    fine = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).astype(np.float32) / step
    lookup = cv2.remap(places, fine[..., 0], fine[..., 1], cv2.INTER_LINEAR)
    source = _shrunk(image, sheet, px_per_m)
    scale = source.shape[1] / image.shape[1]
    lookup = (lookup + 0.5) * scale - 0.5
    picture: NDArray[np.uint8] = cv2.remap(
        source, lookup[..., 0], lookup[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    return picture


def _shrunk(image: NDArray[np.uint8], sheet: Sheet, px_per_m: float) -> NDArray[np.uint8]:
    """Return the photograph with about as many pixels as are asked for, so that none is skipped."""
    cv2 = from_extra("cv2", "vision")
    left, lower, right, upper = sheet.layout.walls
    corners = sheet.to_photograph(np.array([(left, lower), (right, lower), (right, upper), (left, upper)]))
    sides = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
    wanted = np.array([right - left, upper - lower] * 2) * px_per_m
    factor = float(np.max(wanted / sides))
    if factor > 0.8:
        return image
    return np.asarray(cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA))


def _gray(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    cv2 = from_extra("cv2", "vision")
    return image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))


def _tag_corners(gray: NDArray[np.uint8]) -> dict[int, Floats]:
    """Return the corners of the four tags, upper left, upper right, lower right, lower left, (4, 2) [px] each.

    Raises:
        VisionError: One of them is not found.
    """
    cv2 = from_extra("cv2", "vision")
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    settings.cornerRefinementWinSize = 5
    detector = cv2.aruco.ArucoDetector(dictionary(CORNER_FAMILY), settings)
    tags: dict[int, Floats] = {}
    for blur in (0.0, 1.5, 3.0):
        seen = gray if blur == 0 else cv2.GaussianBlur(gray, (0, 0), blur)
        corners, numbers, _ = detector.detectMarkers(seen)
        for number, four in zip([] if numbers is None else numbers.ravel().tolist(), corners, strict=True):
            if number in CORNER_IDS:
                tags.setdefault(number, np.asarray(four, np.float64).reshape(4, 2))
        if len(tags) == len(CORNER_IDS):
            return tags
    names = ("lower left", "lower right", "upper right", "upper left")
    missing = ", ".join(names[number] for number in CORNER_IDS if number not in tags)
    raise VisionError(
        f"Of the sheet's four tags {len(tags)} were found; missing: {missing}. Take the photo again with all four "
        "corners in it, sharp and without glare; `realitygap print-sheet` prints such a sheet."
    )


def _first_view(here: Floats, observed: Floats, width: int, height: int) -> View:
    cv2 = from_extra("cv2", "vision")
    homography, _ = cv2.findHomography(here, observed)
    if homography is None:
        raise VisionError("The sheet's tags lie on one line of the photograph. Take it from further above.")
    return View(np.asarray(homography, np.float64), 0.0, 0.0, width, height)


def _fitted(view: View, here: Floats, observed: Floats, lines: GridOffsets | None) -> View:
    """Return the view that fits the observed tags and grid best."""
    from scipy.optimize import least_squares

    width, height = view.width, view.height
    px = 1 / _px_per_m(view, here)

    def off(numbers: Floats) -> Floats:
        tried = View.from_numbers(numbers, width, height)
        bent = np.array([2 * numbers[8], 4 * numbers[9]])  # a weak pull towards a straight lens
        parts = [TAG_WEIGHT * 1000 * px * (tried(here) - observed).ravel(), bent]
        if lines is not None:
            parts.append(1000 * lines.residuals(tried))
        return np.concatenate(parts)

    solution = least_squares(off, view.numbers(), loss="soft_l1", x_scale="jac", max_nfev=60)
    return View.from_numbers(solution.x, width, height)


def _px_per_m(view: View, points: Floats) -> float:
    """Return pixels of the photograph a meter, over the sheet."""
    low, high = points.min(axis=0), points.max(axis=0)
    return float(np.hypot(*(view(high) - view(low))) / np.hypot(*(high - low)))


def _in_meters(view: View, points: Floats, pixels: Floats) -> Floats:
    return pixels / _px_per_m(view, points)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum(values**2, axis=-1))))
