"""Measurements with ruler and protractor of a robot's pose at the end of a trial."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from realitygap.records import TrialRecord
from realitygap.world import INCH

RULER = INCH / 8
"""Lengths are read to the eighth of an inch [m]."""

PROTRACTOR = math.radians(1.0)
"""Angles are read to the degree [rad]."""

EXACT = 1e-6
"""Resolution of lengths and angles of a camera or an encoder [m, rad]."""


@dataclass(frozen=True)
class Moved:
    """The motion from the start of a trial to its end.

    Attributes:
        ahead, left: End, in the frame of the start [m].
        turned: Turn to the left, including all full turns [rad].
        length_step, angle_step: Resolution of the lengths and angles [m, rad].
    """

    ahead: float
    left: float
    turned: float
    length_step: float = EXACT
    angle_step: float = EXACT

    @property
    def way(self) -> float:
        """Length of the arc from the start to the end [m]; negative if the end is behind the start."""
        chord, half = math.hypot(self.ahead, self.left), self.turned / 2
        arc = chord * (half / math.sin(half) if 1e-9 < abs(half) < math.pi / 2 else 1.0)
        return math.copysign(arc, self.ahead)


def ruled(trial: TrialRecord) -> TrialRecord:
    """Return the trial of a camera as a ruler would measure it: only the rounded pose of its end."""
    moved = moved_by_camera(trial)
    return replace(
        trial,
        poses=np.empty((0, 3)),
        end_pose=end_pose_of(
            trial,
            round(moved.ahead / RULER) * RULER,
            round(moved.left / RULER) * RULER,
            round(moved.turned / PROTRACTOR) * PROTRACTOR,
        ),
    )


def end_pose_of(trial: TrialRecord, ahead: float, left: float, turned: float) -> tuple[float, float, float]:
    """Return the pose at the end of a trial, from measurements in the frame of its start [m, rad]."""
    x, y, heading = trial.start
    sine, cosine = math.sin(heading), math.cos(heading)
    return x + ahead * cosine - left * sine, y + ahead * sine + left * cosine, heading + turned


def moved_by_camera(trial: TrialRecord) -> Moved:
    """Return the motion from a camera's poses. Turns are counted if no command turns by half a turn or more."""
    headings = np.unwrap(trial.poses[:, 2])
    x, y = trial.poses[-1, :2].tolist()
    return _seen_from(trial, x, y, float(headings[-1] - headings[0]), EXACT, EXACT)


def moved_in(trial: TrialRecord) -> Moved | None:
    """Return the motion from the start of a trial to its end, by a camera or a ruler; None without either."""
    if len(trial.poses):
        return moved_by_camera(trial)
    if trial.end_pose is None:
        return None
    x, y, heading = trial.end_pose
    return _seen_from(trial, x, y, heading - trial.start[2], RULER, PROTRACTOR)


def _seen_from(
    trial: TrialRecord, x: float, y: float, turned: float, length_step: float, angle_step: float
) -> Moved:
    x0, y0, heading = trial.start
    sine, cosine = math.sin(heading), math.cos(heading)
    east, north = x - x0, y - y0
    return Moved(east * cosine + north * sine, north * cosine - east * sine, turned, length_step, angle_step)
