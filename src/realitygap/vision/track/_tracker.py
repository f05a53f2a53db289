"""A tracker that finds tags in consecutive pictures and stores their positions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import VisionError, from_extra
from realitygap.vision._tags import CORNER_FAMILY, CORNER_IDS, FAMILIES, RobotTag, dictionary

from ._source import Image

Floats = NDArray[np.float64]

CORNERS_AT_FIRST = 10  # pictures in which the corner tags are looked for
CORNERS_EVERY = 45  # pictures, later
FAMILY_AFTER = 3  # pictures with the robot's tag settle its family: small tags are also seen where none is
MARGIN = 1.0  # sides of the tag around it, in which it is looked for next
FASTEST = 1.5  # sides of the tag from one picture to the next, beyond what it moved before


def make_detector(family: str) -> Any:
    """Return OpenCV's detector of a family, with corners to parts of a pixel."""
    aruco = from_extra("cv2", "vision").aruco
    rules = aruco.DetectorParameters()
    rules.cornerRefinementMethod = aruco.CORNER_REFINE_SUBPIX
    rules.cornerRefinementWinSize = 5
    rules.cornerRefinementMaxIterations = 30
    rules.cornerRefinementMinAccuracy = 0.01
    return aruco.ArucoDetector(dictionary(family), rules)


def find_tags(image: Image, detector: Any) -> dict[int, Floats]:
    """Return the corners of each tag in a gray picture, (4, 2) pixels, by number; tags seen twice are left out."""
    corners, numbers, _ = detector.detectMarkers(image)
    if numbers is None:
        return {}
    listed = [int(number) for number in np.ravel(numbers)]
    return {
        number: np.asarray(square, np.float64).reshape(4, 2)
        for number, square in zip(listed, corners, strict=True)
        if listed.count(number) == 1
    }


def gray_of(image: Image) -> Image:
    """Return a picture in gray, (height, width)."""
    if image.ndim == 2:
        return image
    cv2 = from_extra("cv2", "vision")
    gray: Image = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    return gray


@dataclass(frozen=True)
class Sightings:
    """The tags found in t pictures.

    Attributes:
        times: (t,) [s].
        robot: (t, 4, 2) pixels of the corners of the robot's tag; nan if not found.
        corners: (4, 2) pixels of the corners of each corner tag, by number: the median over pictures.
        moved: Largest distance of a corner tag from that median [px]: above a pixel or two, the camera or the tag
            moved.
        family: Family of the robot's tag; empty if it was never found.
        size: Width and height of the pictures [px].
    """

    times: Floats
    robot: Floats
    corners: Mapping[int, Floats]
    moved: float
    family: str
    size: tuple[int, int]


@dataclass
class Tracker:
    """Takes pictures one by one.

    Args:
        tag: Tag of the robot. Without a family, the family is detected.

    Raises:
        ValueError: The robot's tag cannot be told from a corner's.
    """

    tag: RobotTag
    corner_family: str = CORNER_FAMILY
    _times: list[float] = field(default_factory=list)
    _robot: list[Floats | None] = field(default_factory=list)
    _corners: dict[int, list[Floats]] = field(default_factory=dict)
    _size: tuple[int, int] = (0, 0)
    _n_taken: int = 0
    _last: Floats | None = None
    _last_number: int = 0
    _moved: Floats = field(default_factory=lambda: np.zeros(2))
    _was_just_seen: bool = False

    def __post_init__(self) -> None:
        """Make the detectors ready."""
        self._check(self.tag.family)
        self._corner_detector = make_detector(self.corner_family)
        names = [self.tag.family] if self.tag.family else [
            name for name in FAMILIES if name != self.corner_family or self.tag.number not in CORNER_IDS
        ]  # fmt: skip
        self._detectors = {name: make_detector(name) for name in names}
        self._seen_of = dict.fromkeys(names, 0)

    def _check(self, family: str) -> None:
        if family == self.corner_family and self.tag.number in CORNER_IDS:
            raise ValueError(
                f"Tag {self.tag.number} of {family} lies at a corner of the arena, expected another number on the "
                "robot."
            )

    @property
    def family(self) -> str:
        """Family of the robot's tag, as far as it is known: the one found most often."""
        best = max(self._seen_of, key=lambda name: self._seen_of[name])
        return best if self._seen_of[best] or self.tag.family else ""

    def take(self, time: float, image: Image) -> Floats | None:
        """Return the corners of the robot's tag in the next picture, (4, 2) pixels; None if it is not found."""
        gray = gray_of(image)
        self._size = (gray.shape[1], gray.shape[0])
        number = self._n_taken
        self._n_taken += 1
        corners: Floats | None = None
        if number < CORNERS_AT_FIRST or number % CORNERS_EVERY == 0:
            tags = find_tags(gray, self._corner_detector)
            self._keep_corners(tags)
            if self.corner_family in self._detectors:
                corners = tags.get(self.tag.number)
        if corners is not None:
            self._seen_of[self.corner_family] += 1
        elif self._last is not None:
            corners = self._look_nearby(gray, self._last, number - self._last_number)
        else:
            corners = self._look_everywhere(gray)
        if corners is not None:
            last = self._last if self._was_just_seen else None
            self._moved = np.zeros(2) if last is None else (corners - last).mean(axis=0)
            self._last, self._last_number = corners, number
        self._was_just_seen = corners is not None
        self._times.append(time)
        self._robot.append(corners)
        return corners

    def _keep_corners(self, tags: Mapping[int, Floats]) -> None:
        for number, corners in tags.items():
            if number in CORNER_IDS:
                self._corners.setdefault(number, []).append(corners)

    def _look_nearby(self, gray: Image, last: Floats, n_pictures: int) -> Floats | None:
        """Look for the robot's tag near its expected place.

        The searched area grows with the number of pictures without the tag.
        """
        expected = last + self._moved
        side = float(np.hypot(*(last - np.roll(last, 1, axis=0)).T).max())
        room = MARGIN * side / 2 + n_pictures * (FASTEST * side + float(np.hypot(*self._moved))) / 2
        low = np.maximum(np.floor(expected.min(axis=0) - room).astype(int), 0)
        high = np.minimum(np.ceil(expected.max(axis=0) + room).astype(int) + 1, gray.shape[::-1])
        if (high - low < 2 * side / 3).any():
            return None
        part = np.ascontiguousarray(gray[low[1] : high[1], low[0] : high[0]])
        corners = find_tags(part, self._detectors[self.family]).get(self.tag.number)
        return None if corners is None else corners + low

    def _look_everywhere(self, gray: Image) -> Floats | None:
        """Search in all families until one of them has shown the tag often enough."""
        seen = {
            name: find_tags(gray, detector).get(self.tag.number) for name, detector in self._detectors.items()
        }
        for name, corners in seen.items():
            self._seen_of[name] += corners is not None
        best = self.family
        if not best or seen[best] is None:
            return None
        return seen[best] if self._seen_of[best] >= FAMILY_AFTER or len(self._detectors) == 1 else None

    def forget(self) -> None:
        """Forget the robot's sightings, as for a new trial; the corner tags and the tag's family are remembered."""
        self._times, self._robot = [], []

    def sightings(self) -> Sightings:
        """Return all sightings so far."""
        missing = np.full((4, 2), np.nan)
        robot = [missing if corners is None else corners for corners in self._robot]
        middle = {number: np.median(views, axis=0) for number, views in sorted(self._corners.items())}
        moved = [np.abs(np.array(views) - middle[number]).max() for number, views in self._corners.items()]
        return Sightings(
            np.array(self._times), np.array(robot).reshape(-1, 4, 2), middle, float(max(moved, default=0.0)),
            self.family, self._size,
        )  # fmt: skip


def refuse_unseen(sightings: Sightings, tag: RobotTag) -> None:
    """Refuse pictures without the robot's tag.

    Raises:
        VisionError: The tag is in none of them.
    """
    if not np.isfinite(sightings.robot).any():
        family = f" of {tag.family}" if tag.family else ""
        raise VisionError(
            f"The robot's tag {tag.number}{family} is in none of {len(sightings.times)} pictures. Expected it flat on "
            "top of the robot, whole, with a white border, at least 30 pixels wide (the option tag names another "
            "number)."
        )


def with_family(tag: RobotTag, sightings: Sightings) -> RobotTag:
    """Return the tag with the detected family."""
    return replace(tag, family=sightings.family or tag.family)
