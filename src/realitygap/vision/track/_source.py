"""Pictures with their times: of a video file, or of a camera that is plugged in."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from realitygap._closed_on_exit import ClosedOnExit
from realitygap._limits import MOST_VIDEO_PIXELS
from realitygap.errors import VisionError, from_extra

Image = NDArray[np.uint8]

USUAL_RATE = 30.0  # pictures a second, where a file does not say
LOG_ERRORS = 2  # of OpenCV's levels
CAMERA_SIZE = (1280, 720)  # asked for [px]; a camera gives what it has


class Source(Protocol):
    """A source of pictures.

    Attributes:
        name: Name to show.
        size: Width and height [px].
        rate: Approximate number of pictures per second.
    """

    name: str
    size: tuple[int, int]
    rate: float

    def __iter__(self) -> Iterator[tuple[float, Image]]:
        """Return the time [s] and picture (height, width, 3) blue, green, red, or (height, width) gray, in order."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


def _capture(what: str | int) -> Any:
    """Open OpenCV's capture with its own messages off, because this module reports the errors."""
    cv2 = from_extra("cv2", "vision")
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # AV_LOG_QUIET
    if hasattr(cv2, "setLogLevel"):  # OpenCV 4
        cv2.setLogLevel(LOG_ERRORS)
    else:
        cv2.utils.logging.setLogLevel(LOG_ERRORS)
    return cv2.VideoCapture(what)


@dataclass
class VideoFile:
    """A video, from its first picture on each time it is gone through; times begin with 0 [s].

    Raises:
        VisionError: It is missing, or no video that can be read.
    """

    path: Path

    def __post_init__(self) -> None:
        """Look into it."""
        self.name = self.path.name
        if not self.path.is_file():
            raise VisionError(
                f"There is no video {self.path}. Name a file, or a camera by its number such as 0."
            )
        capture = self._open()
        cv2 = from_extra("cv2", "vision")
        width, height = (capture.get(key) for key in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
        if width * height > MOST_VIDEO_PIXELS:  # there may be no room to read even one
            raise VisionError(
                f"{self.path} has pictures of {width:.0f} x {height:.0f} pixels, expected at most "
                f"{MOST_VIDEO_PIXELS:,} pixels. Make them smaller."
            )
        is_read, image = capture.read()
        rate = capture.get(cv2.CAP_PROP_FPS)
        self.n_frames = max(0, int(capture.get(cv2.CAP_PROP_FRAME_COUNT)))
        capture.release()
        if not is_read:
            raise VisionError(
                f"{self.path} is no video that can be read. Expected such as .mp4, .mov, .avi or .mkv."
            )
        self.size = (image.shape[1], image.shape[0])
        self.rate = float(rate) if 1 <= rate <= 1000 else USUAL_RATE

    def _open(self) -> Any:
        return _capture(str(self.path))

    def __iter__(self) -> Iterator[tuple[float, Image]]:
        """Yield all pictures."""
        cv2 = from_extra("cv2", "vision")
        capture = self._open()
        last = -1.0
        try:
            while True:
                is_read, image = capture.read()
                if not is_read:
                    return
                time_s = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000
                last = time_s if time_s > last else last + 1 / self.rate  # some files have no times
                yield last, image
        finally:
            capture.release()

    def close(self) -> None:
        """Nothing is held."""


class CameraDevice(ClosedOnExit):
    """A camera that is plugged in; times are of the clock that is given.

    Args:
        number: Number of the camera in the system, from 0.
        clock: Tells the time [s].

    Raises:
        VisionError: There is none, or it gives no picture.
    """

    def __init__(self, number: int, clock: Callable[[], float] = time.monotonic) -> None:
        cv2 = from_extra("cv2", "vision")
        self.name, self._clock = f"camera {number}", clock
        self._capture = _capture(number)
        self._capture.set(cv2.CAP_PROP_FRAME_WIDTH, CAMERA_SIZE[0])
        self._capture.set(cv2.CAP_PROP_FRAME_HEIGHT, CAMERA_SIZE[1])
        is_read, image = self._capture.read() if self._capture.isOpened() else (False, None)
        if not is_read or image is None:
            raise VisionError(
                f"There is no camera {number}, or another program has it. Plug it in, try the next number, or name a "
                "video file."
            )
        self.size = (image.shape[1], image.shape[0])
        rate = self._capture.get(cv2.CAP_PROP_FPS)
        self.rate = float(rate) if 1 <= rate <= 1000 else USUAL_RATE

    def __iter__(self) -> Iterator[tuple[float, Image]]:
        """Yield pictures until the camera is closed or unplugged."""
        while True:
            is_read, image = self._capture.read()
            if not is_read:
                return
            yield self._clock(), image

    def close(self) -> None:
        """Let go of it."""
        self._capture.release()


def open_source(name: str) -> VideoFile | CameraDevice:
    """Return a camera by its number, or a video by its file.

    Raises:
        VisionError: There is no such thing.
    """
    return CameraDevice(int(name)) if name.isdecimal() else VideoFile(Path(name))
