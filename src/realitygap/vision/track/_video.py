"""The conversion of a video to a track."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from realitygap.errors import check_finite
from realitygap.vision._tag_layout import CORNER_SIZE_M, RobotTag, corner_tags
from realitygap.world import Arena

from ._camera import Camera, fit_camera
from ._lens import Lens
from ._source import Image
from ._track import Track, track_of
from ._tracker import Sightings, Tracker, refuse_unseen, with_family

MOST_SIZE_ERROR = 0.03  # beyond, what was said of the tag cannot be
ROUND_PX = 1.0  # by which a square looks smaller, as blurred corners are round
MOST_MOVED_PX = 3.0


@dataclass(frozen=True)
class Tracked:
    """The result of tracking a robot in pictures.

    Attributes:
        track: The robot's path.
        camera: Pose and lens of the camera.
        tag: The robot's tag, with its family.
        sightings: The tags found, in pixels.
        warnings: Descriptions of problems.
    """

    track: Track
    camera: Camera
    tag: RobotTag
    sightings: Sightings
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class Marks:
    """The tags and the lens, as known before a camera records.

    Attributes:
        arena: Arena with tags at its corners.
        tag: The robot's tag.
        lens: The camera's lens; None to fit it to the tags.
        corner_size: Size of the corner tags, as in `corner_tags`.
        corner_inset: Inset of the corner tags, as in `corner_tags`.
    """

    arena: Arena
    tag: RobotTag = RobotTag()  # noqa: RUF009  # frozen
    lens: Lens | None = None
    corner_size: float = CORNER_SIZE_M
    corner_inset: float | None = None

    def __post_init__(self) -> None:
        """Raise a ValueError if a number is infinite or NaN."""
        check_finite(vars(self))

    def tracked(self, found: Sightings) -> Tracked:
        """Compute the track and the camera from sightings.

        Raises:
            VisionError: The robot's tag or too many corner tags were not found, or they are at wrong places.
            ValueError: The corner tags do not fit into the arena.
        """
        refuse_unseen(found, self.tag)
        tag = with_family(self.tag, found)
        layout = corner_tags(self.arena, self.corner_size, self.corner_inset)
        there = np.isfinite(found.robot).all(axis=(1, 2))
        camera = fit_camera(
            found.size, found.corners, layout, lens=self.lens, robot=found.robot[there], tag=tag
        )
        track = track_of(found, camera, tag)
        return Tracked(track, camera, tag, found, tuple(_warnings(found, track)))


def track_video(frames: Iterable[tuple[float, Image]], marks: Marks) -> Tracked:
    """Track a robot in a video.

    Args:
        frames: Times [s] and pictures; a `VideoFile` or another source is one.
        marks: Tags, arena and lens.

    Raises:
        VisionError: As `Marks.tracked`.
    """
    tracker = Tracker(marks.tag)
    for time, image in frames:
        tracker.take(time, image)
    return marks.tracked(tracker.sightings())


def _warnings(found: Sightings, track: Track) -> list[str]:
    said = []
    there = found.robot[np.isfinite(found.robot).all(axis=(1, 2))]
    side_px = float(np.median(np.hypot(*np.moveaxis(there - np.roll(there, 1, axis=1), -1, 0))))
    if abs(track.size_error) > MOST_SIZE_ERROR + ROUND_PX / side_px:
        how = "larger" if track.size_error > 0 else "smaller"
        said.append(
            f"The robot's tag looks {abs(track.size_error):.0%} {how} than its size and height say: measure both again "
            "(tag-size, tag-height); where it is, is off by as much of its parallax."
        )
    if found.moved > MOST_MOVED_PX:
        said.append(
            f"A corner tag moved by {found.moved:.0f} pixels: camera and sheet should be at rest while it films."
        )
    return said
