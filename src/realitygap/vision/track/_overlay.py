"""A video with the walls, the track, and the tags drawn into it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from realitygap.errors import VisionError, from_extra
from realitygap.vision._tags import bounds
from realitygap.world import Arena

from ._source import Image
from ._video import Tracked

SEEN, FILLED, WALLS, ARROW = (80, 170, 20), (0, 120, 255), (200, 80, 0), (30, 30, 220)  # blue, green, red
WORDS_WIDTH, WORDS_HEIGHT = 640, 44  # px
ARROW_M = 0.08
STEPS_A_SIDE = 24  # of a wall's line, which a lens bends


def save_overlay(
    path: Path, frames: Iterable[tuple[float, Image]], tracked: Tracked, arena: Arena, rate: float
) -> None:
    """Write the pictures with walls, the robot's line up to then, and its heading; orange for interpolated parts.

    Args:
        path: A new video, .mp4.
        frames: Pictures that were tracked.
        tracked: Result of the tracking.
        arena: Arena with the walls to draw.
        rate: Pictures a second.

    Raises:
        VisionError: It cannot be written.
    """
    cv2 = from_extra("cv2", "vision")
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"mp4v"), rate, tracked.sightings.size)
    if not writer.isOpened():
        raise VisionError(f"{path} cannot be written as a video. Expected a name such as overlay.mp4.")
    try:
        for time, image in frames:
            writer.write(draw_overlay(image, time, tracked, arena))
    finally:
        writer.release()


def draw_overlay(image: Image, time: float, tracked: Tracked, arena: Arena) -> Image:
    """Return a picture with the track until its time [s] drawn into it, (height, width, 3)."""
    cv2 = from_extra("cv2", "vision")
    drawn: Image = image.copy() if image.ndim == 3 else cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    track, camera = tracked.track, tracked.camera
    left, lower, right, upper = bounds(arena)
    ends = np.array([(left, lower), (right, lower), (right, upper), (left, upper), (left, lower)])
    at = np.arange(4 * STEPS_A_SIDE + 1) / STEPS_A_SIDE
    walls = np.column_stack([np.interp(at, np.arange(5), column) for column in ends.T])
    _line(drawn, camera.to_pixels(_at(walls, 0.0)), WALLS)
    until = int(np.searchsorted(track.times, time + 1e-9))
    if not until:
        return drawn
    line = camera.to_pixels(_at(track.poses[:until, :2], 0.0))
    for is_seen, color in ((True, SEEN), (False, FILLED)):
        for first, last in _parts(track.seen[:until], is_seen=is_seen):
            _line(drawn, line[max(first - 1, 0) : last + 1], color)
    x, y, heading = track.poses[until - 1]
    tip = [x + ARROW_M * np.cos(heading), y + ARROW_M * np.sin(heading)]
    ends_px = camera.to_pixels(_at(np.array([[x, y], tip]), tracked.tag.height))
    begin, end = (tuple(round(v) for v in point) for point in ends_px)
    cv2.arrowedLine(drawn, begin, end, ARROW, 3, cv2.LINE_AA, 0, 0.25)
    corners = tracked.sightings.robot[int(np.searchsorted(tracked.sightings.times, time - 1e-9))]
    if np.isfinite(corners).all():
        _line(drawn, np.concatenate([corners, corners[:1]]), SEEN)
    words = f"{time:6.2f} s  x {x:.3f} m  y {y:.3f} m  {np.degrees(heading) % 360:.0f} deg"
    words += "" if track.seen[until - 1] else "  filled in"
    cv2.rectangle(drawn, (0, 0), (WORDS_WIDTH, WORDS_HEIGHT), (255, 255, 255), cv2.FILLED)
    color = SEEN if track.seen[until - 1] else FILLED
    cv2.putText(drawn, words, (14, WORDS_HEIGHT - 14), cv2.FONT_HERSHEY_SIMPLEX, 0.9, color, 2, cv2.LINE_AA)
    return drawn


def _at(points: np.ndarray, z: float) -> np.ndarray:
    return np.column_stack([points, np.full(len(points), z)])


def _parts(seen: np.ndarray, *, is_seen: bool) -> list[tuple[int, int]]:
    """Return the first and last row of each stretch that is of one kind."""
    rows = np.flatnonzero(seen == is_seen)
    stretches = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1) if len(rows) else []
    return [(int(stretch[0]), int(stretch[-1])) for stretch in stretches]


def _line(image: Image, pixels: np.ndarray, color: tuple[int, int, int]) -> None:
    cv2 = from_extra("cv2", "vision")
    points = np.round(pixels * 16).astype(np.int32).reshape(-1, 1, 2)
    cv2.polylines(image, [points], False, color, 2, cv2.LINE_AA, 4)
