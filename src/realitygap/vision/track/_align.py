"""The start of a trial in a video, found by comparing its commands with the robot's motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap._wording import fixed
from realitygap.errors import VisionError

from ._track import Track

Floats = NDArray[np.float64]

COARSE_S, FINE_S = 0.05, 0.005  # between beginnings that are tried
LEAST_AGREEMENT = 0.7  # of a beginning that is believed
LEAST_LEAD = 0.03  # over all that begin half a step or more away
MOST_TRIED = 200_000


@dataclass(frozen=True)
class Beginning:
    """The start of a trial.

    Attributes:
        time: Start in the track's time [s].
        agreement: Correlation of commands with the robot's motion, mean of ahead and turn; 1 is perfect, nan if a
            person gave the start.
    """

    time: float
    agreement: float


def find_beginning(track: Track, times: Floats, commands: Floats, stalled: NDArray[np.bool_]) -> Beginning:
    """Find the start of a trial in a track.

    Each command should have moved the robot ahead and turned it as it said; steps that began stalled are left out.

    Args:
        track: Track of a robot with the whole trial.
        times: (t + 1,) when each command began, and when the last ended, since the trial's beginning [s].
        commands: (t, 2) move and turn.
        stalled: (t,).

    Raises:
        VisionError: The track is too short, or nowhere like the commands.
    """
    room = track.times[-1] - track.times[0] - times[-1]
    if room < 0:
        raise VisionError(
            f"The trial lasts {fixed(times[-1], 1)} s, and the robot is seen for "
            f"{track.times[-1] - track.times[0]:.1f} s. Film it from before the start until it stops."
        )
    step = max(COARSE_S, room * len(times) / MOST_TRIED)
    tried = track.times[0] + np.arange(0.0, room + 1e-9, step)
    agreement = _agreement(track, tried, times, commands, ~stalled)
    best = tried[int(np.argmax(agreement))]
    away = np.abs(tried - best) >= np.diff(times).mean() / 2
    near = best + np.arange(-step, step + FINE_S, FINE_S)
    near = near[(near >= track.times[0]) & (near + times[-1] <= track.times[-1])]
    finer = _agreement(track, near, times, commands, ~stalled)
    most = float(finer.max()) if len(finer) else float(agreement.max())
    next_best = float(agreement[away].max(initial=-1.0))
    if not (most >= LEAST_AGREEMENT and most - next_best >= LEAST_LEAD):
        raise VisionError(
            f"Where the trial begins in the video is not clear: its commands and the robot's way agree to {most:.2f} "
            f"at best (expected {LEAST_AGREEMENT} or more, and {LEAST_LEAD} more than elsewhere, where it is "
            f"{next_best:.2f}). Say when it begins with --begins SECONDS, or name its video."
        )
    return Beginning(float(near[int(np.argmax(finer))]) if len(finer) else float(best), most)


def _agreement(
    track: Track, beginnings: Floats, times: Floats, commands: Floats, which: NDArray[np.bool_]
) -> Floats:
    """Return the agreement for each start, (b,)."""
    poses = track.at(np.clip((beginnings[:, None] + times).ravel(), track.times[0], track.times[-1]))
    poses = poses.reshape(len(beginnings), len(times), 3)
    moved = np.diff(poses, axis=1)
    heading = poses[:, :-1, 2] + moved[..., 2] / 2
    ahead = moved[..., 0] * np.cos(heading) + moved[..., 1] * np.sin(heading)
    correlations = []
    for motion, command in ((ahead, commands[:, 0]), (moved[..., 2], commands[:, 1])):
        motion, command = motion[:, which], command[which]
        size = np.sqrt((motion**2).sum(axis=1) * (command**2).sum())
        if (command**2).sum() > 0:
            correlations.append(
                np.divide(motion @ command, size, out=np.zeros(len(motion)), where=size > 1e-9)
            )
    return np.mean(correlations, axis=0) if correlations else np.zeros(len(beginnings))
