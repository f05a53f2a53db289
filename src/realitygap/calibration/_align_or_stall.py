"""A check on friction without a simulator: whether a robot that drives straight into a wall aligns with it or stalls.

Friction tilts the wall's push, which passes the axle on one side or the other. The robot aligns if a + atan(mu) <
atan(c_x / |c_y|). Here a is the angle between its heading and the wall, and c is the touching point in the frame of its
axle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from realitygap.records import TrialRecord
from realitygap.world import Arena, RobotModel

from ._simulate import Bools, Floats

TOUCHES_M = 0.006
ALIGNED = math.radians(1.0)  # turned by so much in the step after the first touch
HEAD_ON = math.radians(85.0)  # nearer to head on two corners touch


@dataclass(frozen=True)
class Encounters:
    """First touches of robots that drove straight on.

    Attributes:
        margin: (e,) atan(c_x / |c_y|) - a [rad]. The robot aligns if the angle of friction is smaller.
        aligned: (e,) True if it turned towards the wall.
    """

    margin: Floats
    aligned: Bools

    def agreeing(self, friction: float) -> int:
        """Return the number of robots that the rule predicts correctly at this friction."""
        return int(((self.margin > math.atan(friction)) == self.aligned).sum())


def encounters_of(trials: Sequence[TrialRecord], robot: RobotModel, arena: Arena) -> Encounters:
    """Return all first touches in trials with poses, on which another step of the same command follows."""
    outline = np.array([point for part in robot.body for point in part.outline()])
    axle = robot.centers()["drive.axle"]
    margins, aligned = [], []
    for trial in trials:
        for row in _straight_rows(trial):
            touch = _touch(trial.poses[row], outline, arena)
            if touch is None or _touch(trial.poses[row - 1], outline, arena) is not None:
                continue
            ahead = math.copysign(1.0, trial.commands[row, 0]) * robot.drive.ahead
            wall, (x, y) = touch
            angle = abs(wall)
            if ahead * (x - axle) <= 0 or angle > HEAD_ON:
                continue
            margins.append(math.atan2(abs(x - axle), abs(y)) - angle)
            turned = trial.poses[row + 1, 2] - trial.poses[row, 2]
            aligned.append(abs(math.remainder(wall + turned, math.pi)) < angle - ALIGNED)
    return Encounters(np.array(margins), np.array(aligned, np.bool_))


def _straight_rows(trial: TrialRecord) -> list[int]:
    """Return rows before which and after which the same straight command was given."""
    if not len(trial.poses):
        return []
    move, turn = trial.commands.T
    same = (turn[1:] == 0) & (turn[:-1] == 0) & (move[1:] == move[:-1]) & (np.abs(move[1:]) > 0.5)
    return [int(k) + 1 for k in np.flatnonzero(same)]


def _touch(pose: Floats, outline: Floats, arena: Arena) -> tuple[float, tuple[float, float]] | None:
    """Return the heading against the touched wall [rad, -pi / 2..pi / 2], and the touching point in its frame [m]."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    points = pose[:2] + outline @ np.array([[cos, sin], [-sin, cos]])
    for x1, y1, x2, y2 in arena.segments:
        way = np.array([x2 - x1, y2 - y1])
        length = float(np.hypot(*way))
        off = points - (x1, y1)
        away = np.abs(off[:, 0] * way[1] - off[:, 1] * way[0]) / length
        nearest = int(np.argmin(away))
        if away[nearest] < TOUCHES_M:
            angle = math.remainder(pose[2] - math.atan2(way[1], way[0]), math.pi)
            return angle, (float(outline[nearest, 0]), float(outline[nearest, 1]))
    return None
