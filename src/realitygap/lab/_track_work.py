"""A video of trials is tracked in its own process, which proposes cells."""

from __future__ import annotations

import time
from pathlib import Path

from realitygap.errors import RealityGapError, VisionError
from realitygap.study import (
    TrackedTrial,
    TrialToTrack,
    note_of_track,
    place_trial,
    read_camera,
    trial_of_ledger,
)
from realitygap.vision import Marks, Tracked, Tracker, VideoFile

from ._channel import Channel, Message
from ._proposals import keep_proposal, track_proposal

_TOLD_S = 0.3
"""Time between two messages on the progress [s]."""


def work(channel: Channel, order: Message) -> None:
    """Track a video, find trials in it, and propose what they crossed.

    Args:
        channel: To the server.
        order: `folder` of the study, `root` that the video is in, `spec` of the video as `read_camera` takes it, and
            `trials`, their numbers.
    """
    folder, numbers = Path(order["folder"]), [int(number) for number in order["trials"]]
    wanted = {number: trial_of_ledger(folder, number) for number in numbers}
    name, marks = read_camera(str(order["spec"]), wanted[numbers[0]].arena)
    video = VideoFile(Path(order["root"]) / name)
    tracked = _tracked(channel, video, marks)
    placed, problems = _placed(wanted, tracked)
    for number, trial in placed.items():
        note = note_of_track(str(video.path), tracked, trial)
        warnings = " ".join(tracked.warnings)
        keep_proposal(folder, number, track_proposal(trial.score, note, name, note, warnings))
    missed = [f"Trial {number}: {problems[number]}" for number in numbers if number in problems]
    channel.say("done", found=sorted(placed), missed=missed)


def _tracked(channel: Channel, video: VideoFile, marks: Marks) -> Tracked:
    tracker, last = Tracker(marks.tag), 0.0
    for k, (at, image) in enumerate(video):
        tracker.take(at, image)
        if time.monotonic() - last > _TOLD_S:
            last = time.monotonic()
            channel.say("looked", share=k / max(video.n_frames, k + 1))
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
