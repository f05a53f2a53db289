"""Camera tracks of trials: into the ledger of a study, and next to other observations."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from realitygap._wording import fixed
from realitygap.errors import StudyError
from realitygap.platforms import base_robot_of
from realitygap.records import (
    LEDGER_NAME,
    PATH_PARTS,
    Ledger,
    ObservationsHead,
    ResultsFolder,
    Score,
    ScoreRole,
    TrialRecord,
    open_ledger,
    settings_of_condition,
)
from realitygap.runs import Condition, genome_of
from realitygap.vision import Beginning, Track, Tracked, find_beginning
from realitygap.world import Arena, Grid

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class TrialToTrack:
    """A trial that was driven, and is to be found in a video.

    Attributes:
        head: First line of a file of its observation.
        trial: Trial as observed, without poses.
        times: (t + 1,) when each command began, and when the last ended, since the trial's beginning [s].
        arena: Arena of the trial.
        number: Number of the trial in its ledger.
    """

    head: ObservationsHead
    trial: TrialRecord
    times: Floats
    arena: Arena
    number: int


@dataclass(frozen=True)
class TrackedTrial:
    """A trial with what a camera saw of it.

    Attributes:
        trial: Trial with poses and cells.
        score: Score for a ledger.
        beginning: Time of its start in the video [s].
        seen: Share of the pictures in it in which the robot was found.
    """

    trial: TrialRecord
    score: Score
    beginning: Beginning
    seen: float


def trial_of_ledger(source: str | Path, number: int) -> TrialToTrack:
    """Return a driven trial with its commands step by step.

    Args:
        source: Folder of a study, or file of trials.
        number: Number of the trial, as in `realitygap trials list`.

    Raises:
        StudyError: It was not driven, or has no commands.
        RecordError: There is no such study, file, or trial.
    """
    with open_ledger(source, writable=False) as ledger:
        found = trial_in(ledger, source, number)
    return replace(found, head=replace(found.head, observe="track"))


def trial_in(ledger: Ledger, source: str | Path, number: int) -> TrialToTrack:
    """Return a driven trial of an open ledger, as `trial_of_ledger`."""
    trial, record = ledger.trial(number), ledger.record(number)
    if trial.state not in ("driven", "scored") or not len(record.commands):
        raise StudyError(
            f"Trial {number} of {source} is {trial.state}, expected one that was driven. See: realitygap trials list "
            f"{source}"
        )
    if not trial.condition:
        times = np.arange(len(record.commands) + 1, dtype=np.float64) * record.step_s
        return TrialToTrack(ledger.head(), record, times, ledger.arena, number)
    individuals = ledger.individuals(trial.condition, trial.replicate, trial.generation)
    sittings = ledger.sittings()
    label = ledger.conditions()[trial.condition]["label"]
    settings = settings_of_condition(ResultsFolder.open(source).description, trial.condition)
    condition = Condition.from_settings(trial.condition, settings)
    arena = condition.arena.arena()
    t = len(record.commands)
    times = _times(record.times[:t])
    observed = replace(
        record,
        start=(arena.start.x, arena.start.y, arena.start.heading),
        step_s=float(np.median(np.diff(times))),
        readings=np.minimum(record.raw[:t] / condition.on.full_scale, 1.0),
        poses=np.empty((0, 3)),
        genome=genome_of(condition, individuals[trial.individual]).to_json(),
        end=trial.end or "step limit",
    )
    platform = condition.on.at_port(sittings[-1]["port"]) if sittings else condition.on
    head = ObservationsHead(
        platform.spec,
        label or "REAL",
        base_robot_of(platform.spec),
        arena.to_dict(),
        condition.on.command_s,
        "track",
    )
    return TrialToTrack(head, observed, times, arena, number)


def _times(began: Floats) -> Floats:
    """Return the time of each command's start and of the last one's end, since the first [s]."""
    usual = float(np.median(np.diff(began))) if len(began) > 1 else 0.5
    times: Floats = np.append(began, began[-1] + usual) - began[0]
    return times


def place_trial(
    wanted: TrialToTrack, track: Track, begins_s: float | None = None, who: str = "camera"
) -> TrackedTrial:
    """Find a trial in a track, and cut it out.

    Args:
        wanted: The trial.
        track: Track in a video that shows the whole trial.
        begins_s: Time of its start in the video [s]. Default: the time that fits its commands.
        who: Enters it.

    Raises:
        VisionError: It cannot be found.
        StudyError: The track does not include the whole trial.
    """
    if begins_s is None:
        begun = find_beginning(track, wanted.times, wanted.trial.commands, wanted.trial.stalled)
    else:
        begun = Beginning(begins_s, float("nan"))
    first, last = begun.time, begun.time + wanted.times[-1]
    if not (track.times[0] <= first and last <= track.times[-1]):
        raise StudyError(
            f"The trial is from {fixed(first, 2)} to {fixed(last, 2)} s of the video, and the robot is seen from "
            f"{track.times[0]:.2f} to {track.times[-1]:.2f} s. Film it from before the start until it stops, "
            "or correct --begins."
        )
    times = first + wanted.times
    score = score_along(track, times, wanted.arena.grid, who)
    trial = replace(wanted.trial, poses=track.at(times), cells=tuple(sorted(score.cells)))
    return TrackedTrial(trial, score, begun, float(track.between(first, last).seen.mean()))


def score_along(track: Track, times: Floats, grid: Grid, who: str) -> Score:
    """Return the score of a trial along its track.

    Args:
        track: Track that includes the whole trial.
        times: (t + 1,) when each command began, and when the last ended [s].
        grid: Grid of the counted cells.
        who: Enters it.
    """
    rows = np.arange(len(times), dtype=np.float64)
    fine = np.interp(np.arange((len(rows) - 1) * PATH_PARTS + 1) / PATH_PARTS, rows, times)
    cells = track.between(float(times[0]), float(times[-1])).cells(grid)
    ends = {grid.cell_at(x, y) for x, y, _ in track.at(times).tolist()} - {None}
    return Score(cells, who, n_ends=len(ends), path=np.round(track.at(fine), 6).tolist())


def score_tracked(
    folder: str | Path, number: int, tracked: TrackedTrial, told: str, role: ScoreRole = "score"
) -> None:
    """Enter what a camera saw of a trial into the ledger: cells, path, and a note that says of what video.

    Args:
        folder: Folder of the study.
        number: Number of the trial.
        tracked: Tracked trial.
        told: The note.
        role: Role of the score, as in `Ledger.score`.

    Raises:
        LedgerError: The ledger does not take it.
    """
    with Ledger.open(Path(folder) / LEDGER_NAME) as ledger:
        ledger.score(number, tracked.score, role)
        ledger.note(told, tracked.score.who, number)


def note_of_track(camera: str, found: Tracked, placed: TrackedTrial) -> str:
    """Return the note that goes into a ledger with what a camera saw of a trial.

    Args:
        camera: Number of the camera, or file of the video.
        found: Result of the tracking.
        placed: The trial in them.
    """
    begun = placed.beginning
    how = "said" if math.isnan(begun.agreement) else f"agreement {begun.agreement:.2f}"
    what = f"video {Path(camera).name}"
    if not camera.isdecimal():
        with Path(camera).open("rb") as file:
            what += f", sha256 {hashlib.file_digest(file, 'sha256').hexdigest()}"
    return (
        f"Cells and path by camera: {what}; begins at {fixed(begun.time, 2)} s ({how}); robot seen in "
        f"{placed.seen:.0%} of its pictures; tag {found.tag.family}:{found.tag.number}."
    )
