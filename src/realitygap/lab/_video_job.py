"""A video of a study's trials that is tracked, as the pages see it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ._files import plain_files
from ._job import Job

ENDINGS = (".mp4", ".mov", ".avi", ".mkv", ".webm")


def videos_in(root: Path) -> list[str]:
    """Return the names of the videos in the lab's folder."""
    return sorted(path.name for path in plain_files(root, ENDINGS))


class VideoJob(Job):
    """A video at work.

    Attributes:
        spec: Of the video.
        share: Of it gone through, 0 to 1.
        found: Trials that were found in it.
        missed: Why others were not.

    Args:
        folder: Of the study.
        root: That the video is in.
        spec: Of the video.
        trials: To look for.
        changed: Called after each change, from another thread.
    """

    def __init__(
        self, folder: Path, root: Path, spec: str, trials: Sequence[int], changed: Callable[[], None]
    ) -> None:
        self.spec = spec
        self.share = 0.0
        self.found: list[int] = []
        self.missed: list[str] = []
        order = {
            "work": "track", "folder": str(folder), "root": str(root), "spec": spec, "trials": list(trials)
        }  # fmt: skip
        super().__init__(order, root, changed)

    def _on_looked(self, message: dict[str, Any]) -> None:
        self.share = message["share"]

    def _on_done(self, message: dict[str, Any]) -> None:
        self.found, self.missed = message["found"], message["missed"]
        self.outcome, self.is_failed = _outcome(self.found), not self.found


def _outcome(found: list[int]) -> str:
    if not found:
        return "None of the trials was found in the video."
    return f"Found in the video: trials {', '.join(map(str, found))}. Look at their cells, and enter them."
