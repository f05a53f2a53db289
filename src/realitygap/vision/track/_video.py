"""A robot's track from pictures: of a video, or of a live camera while it drives."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from realitygap._closed_on_exit import ClosedOnExit
from realitygap.errors import VisionError, check_finite
from realitygap.vision._tags import CORNER_SIZE_M, RobotTag, corner_tags
from realitygap.world import Arena

from ._camera import Camera, fit_camera
from ._lens import Lens
from ._source import Image, Source
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

    def tracked(self, sightings: Sightings) -> Tracked:
        """Compute the track and the camera from sightings.

        Raises:
            VisionError: The robot's tag or too many corner tags were not found, or they are at wrong places.
            ValueError: The corner tags do not fit into the arena.
        """
        refuse_unseen(sightings, self.tag)
        tag = with_family(self.tag, sightings)
        layout = corner_tags(self.arena, self.corner_size, self.corner_inset)
        is_seen = np.isfinite(sightings.robot).all(axis=(1, 2))
        camera = fit_camera(
            sightings.size, sightings.corners, layout, lens=self.lens, robot=sightings.robot[is_seen], tag=tag
        )
        track = track_of(sightings, camera, tag)
        return Tracked(track, camera, tag, sightings, tuple(_warnings(sightings, track)))


def track_video(frames: Iterable[tuple[float, Image]], marks: Marks) -> Tracked:
    """Track a robot in a video.

    Args:
        frames: Times [s] and pictures; a `VideoFile` or another source is one.
        marks: Tags, arena and lens.

    Raises:
        VisionError: As `Marks.tracked`.
    """
    tracker = Tracker(marks.tag)
    for at, image in frames:
        tracker.take(at, image)
    return marks.tracked(tracker.sightings())


def _warnings(sightings: Sightings, track: Track) -> list[str]:
    warnings = []
    robot = sightings.robot[np.isfinite(sightings.robot).all(axis=(1, 2))]
    side_px = float(np.median(np.hypot(*np.moveaxis(robot - np.roll(robot, 1, axis=1), -1, 0))))
    if abs(track.size_error) > MOST_SIZE_ERROR + ROUND_PX / side_px:
        how = "larger" if track.size_error > 0 else "smaller"
        warnings.append(
            f"The robot's tag looks {abs(track.size_error):.0%} {how} than its size and height say: measure both again "
            "(tag-size, tag-height); where it is, is off by as much of its parallax."
        )
    if sightings.moved > MOST_MOVED_PX:
        warnings.append(
            f"A corner tag moved by {sightings.moved:.0f} pixels: camera and sheet should be at rest while it films."
        )
    return warnings


PATIENCE_S = 3.0
"""Maximum time for a picture before the camera counts as disconnected."""


class LiveTrack(ClosedOnExit):
    """A track from a live camera: it processes every picture, and returns the robot's poses since `begin`.

    Args:
        source: The camera, whose times are those of `clock`.
        marks: Tags, arena and lens.
        clock: Tells the time [s].
    """

    def __init__(self, source: Source, marks: Marks, clock: Callable[[], float] = time.monotonic) -> None:
        self.marks = marks
        self.now = clock
        self._source = source
        self._tracker = Tracker(marks.tag)
        self._has_come = threading.Condition()
        self._last = -float("inf")
        self._is_closed = False
        self._problem = ""
        self._thread = threading.Thread(target=self._watch, name="camera", daemon=True)
        self._thread.start()

    def _watch(self) -> None:
        problem = f"{self._source.name} gives no more pictures. Is it plugged in?"
        try:
            for at, image in self._source:
                with self._has_come:
                    if self._is_closed:
                        return
                    self._tracker.take(at, image)
                    self._last = at
                    self._has_come.notify_all()
        except Exception as error:  # reported to the thread that waits for a picture
            problem = f"{self._source.name} failed: {error}"
        with self._has_come:
            self._problem = problem
            self._has_come.notify_all()

    def begin(self) -> None:
        """Forget the robot's poses. The corner tags are kept."""
        with self._has_come:
            self._tracker.forget()

    def tracked(self, until_s: float | None = None) -> Tracked:
        """Return the result of tracking since `begin`.

        Args:
            until_s: Wait for a picture of this time or later [s].

        Raises:
            VisionError: The camera is gone, or what it saw does not do, as `Marks.tracked`.
        """
        with self._has_come:
            while until_s is not None and self._last < until_s:
                if not self._next_has_come():
                    raise VisionError(
                        self._problem or f"{self._source.name} gave no picture for {PATIENCE_S:g} s."
                    )
            sightings = self._tracker.sightings()
        return self.marks.tracked(sightings)

    def _next_has_come(self) -> bool:
        """Wait for one more picture. Each one restarts the time to wait, because many may still be unprocessed."""
        before = self._last
        self._has_come.wait_for(lambda: self._last > before or bool(self._problem), PATIENCE_S)
        return self._last > before

    def close(self) -> None:
        """Let go of the camera; safe to call twice."""
        with self._has_come:
            self._is_closed = True
        self._thread.join(PATIENCE_S)
        self._source.close()
