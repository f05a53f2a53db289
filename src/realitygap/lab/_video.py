"""A video of trials is tracked, and proposes their cells.

`VideoJob` is what pages see; `track` runs in a process of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from realitygap.errors import RealityGapError, StudyError, VisionError
from realitygap.study import (
    TrackedTrial,
    TrialToTrack,
    note_of_track,
    place_trial,
    read_camera,
    trial_of_ledger,
)
from realitygap.vision import Marks, Tracked, Tracker, VideoFile

from ._channel import Channel
from ._files import plain_files, refuse_camera, refuse_outside
from ._job import Job
from ._messages import Message, VideoDone, VideoShare, VideoWork
from ._mistakes import Mistakes
from ._scoring_files import keep_proposal, track_proposal

ENDINGS = (".mp4", ".mov", ".avi", ".mkv", ".webm")


def videos_in(root: Path) -> list[str]:
    """Return the names of the videos in the lab's folder."""
    return sorted(path.name for path in plain_files(root, ENDINGS))


def video_mistakes(root: Path, values: Mapping[str, Any]) -> Mistakes:
    """Return what is wrong in the fields of a video to track; a field that is missing is not checked."""
    mistakes = Mistakes()
    if "video" in values and values["video"] not in videos_in(root):
        with mistakes.in_field("video"):
            refuse_outside(root, values["video"])
            raise StudyError(
                f"There is no video {values['video']!r} in the lab's folder. Put it there; its name ends in "
                f"{', '.join(ENDINGS)}."
            )
    with mistakes.in_field("tags"):
        refuse_camera(root, f"?{values.get('tags') or ''}")
    return mistakes


class VideoJob(Job):
    """A video that is tracked.

    Attributes:
        spec: The video and its options.
        share: Share of it that is done, 0 to 1.
        found: Trials that were found in it.
        missed: Why others were not.

    Args:
        work: What the process is told.
        root: Where it works.
        changed: Called after each change, from another thread.
    """

    def __init__(self, work: VideoWork, root: Path, changed: Callable[[], None]) -> None:
        self.spec = work.spec
        self.share = 0.0
        self.found: list[int] = []
        self.missed: list[str] = []
        super().__init__(work, root, changed)

    def _take(self, message: Message) -> None:
        match message:
            case VideoShare():
                self.share = message.share
            case VideoDone():
                self.found, self.missed = message.found, message.missed
                self._conclude(_outcome(self.found), is_failed=not self.found)
            case _:
                super()._take(message)


def _outcome(found: list[int]) -> str:
    if not found:
        return "None of the trials was found in the video."
    return f"Found in the video: trials {', '.join(map(str, found))}. Look at their cells, and enter them."


# in a process


def track(channel: Channel, work: VideoWork) -> None:
    """Track a video, find trials in it, and propose what they crossed."""
    folder, numbers = Path(work.folder), work.trials
    wanted = {number: trial_of_ledger(folder, number) for number in numbers}
    name, marks = read_camera(work.spec, wanted[numbers[0]].arena)
    video = VideoFile(Path(work.root) / name)
    tracked = _tracked(channel, video, marks)
    placed, problems = _placed(wanted, tracked)
    for number, trial in placed.items():
        note = note_of_track(str(video.path), tracked, trial)
        warnings = " ".join(tracked.warnings)
        keep_proposal(folder, number, track_proposal(trial.score, note, name, note, warnings))
    missed = [f"Trial {number}: {problems[number]}" for number in numbers if number in problems]
    channel.say(VideoDone(sorted(placed), missed))


def _tracked(channel: Channel, video: VideoFile, marks: Marks) -> Tracked:
    tracker = Tracker(marks.tag)
    for k, (at, image) in enumerate(video):
        tracker.take(at, image)
        channel.report(VideoShare(k / max(video.n_frames, k + 1)))
    try:
        return marks.tracked(tracker.sightings())
    except ValueError as error:
        raise VisionError(str(error)) from None


def _placed(
    wanted: dict[int, TrialToTrack], tracked: Tracked
) -> tuple[dict[int, TrackedTrial], dict[int, str]]:
    """Find trials in the video, and reasons for those that are missing; of two at one time, keep the better fit."""
    placed: dict[int, TrackedTrial] = {}
    problems: dict[int, str] = {}
    for number, trial in wanted.items():
        try:
            placed[number] = place_trial(trial, tracked.track)
        except RealityGapError as error:
            problems[number] = str(error)
    for number in sorted(placed, key=lambda each: placed[each].beginning.agreement):
        if any(_overlap(wanted, placed, number, other) for other in placed if other != number):
            problems[number] = "another trial fits this part of the video better."
            del placed[number]
    return placed, problems


def _overlap(wanted: dict[int, TrialToTrack], placed: dict[int, TrackedTrial], one: int, other: int) -> bool:
    first, second = sorted((one, other), key=lambda each: placed[each].beginning.time)
    end = placed[first].beginning.time + float(wanted[first].times[-1])
    return end > placed[second].beginning.time
