"""The marker that a camera sees of a robot: where it is on the body, and which heading it shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from realitygap.records import TrialRecord
from realitygap.world import Arena, Fitted, RobotModel

from ._log_model import MotionLog
from ._motion_log import LEAST_ROWS, fit_motion_logs, motion_log
from ._one_thread import one_blas_thread
from ._windows import is_near, outline_of

LEFT, HEADING = "camera.left", "camera.heading"


@dataclass(frozen=True)
class Marker:
    """A fitted marker.

    Attributes:
        fitted: Its position to the left of the axle's middle [m], and the heading that it shows if the robot's is 0
            [rad], with 90 % intervals.
        left: The first, 0 if the trials do not show that it is another number [m].
        heading: The second, likewise [rad].
    """

    fitted: tuple[Fitted, ...]
    left: float
    heading: float

    def taken_from(self, trial: TrialRecord) -> TrialRecord:
        """Return a trial with the poses of the body's origin instead of the marker's."""
        if not len(trial.poses) or (self.left, self.heading) == (0.0, 0.0):
            return trial
        heading = trial.poses[:, 2] - self.heading
        x = trial.poses[:, 0] + self.left * np.sin(heading)
        y = trial.poses[:, 1] - self.left * np.cos(heading)
        return replace(trial, poses=np.stack([x, y, heading], axis=1))

    @property
    def note(self) -> str:
        """The correction of the poses, in words; empty if there is none."""
        if (self.left, self.heading) == (0.0, 0.0):
            return ""
        side = "left" if self.left > 0 else "right"
        return (
            f"The camera's marker is {1000 * abs(self.left):.1f} mm to the {side} of the axle's middle, and turned by "
            f"{self.heading:.3f} rad. The fit uses the poses of the body."
        )


@one_blas_thread()
def fit_marker(
    trials: Sequence[TrialRecord], robot: RobotModel, arena: Arena, *, seed: int = 0
) -> Marker | None:
    """Return the marker that trials with poses show, from the parts in which the robot is away from walls.

    Args:
        trials: Trials; those without poses are left out.
        robot: The robot with its nominal numbers.
        arena: Arena of the trials.
        seed: Seed of the draws.

    Returns:
        The marker; None if no trial shows a motion away from walls, or if commands do not set the wheels.
    """
    if robot.drive.mixing != "wheels":
        return None
    logs = [log for trial in trials if len(trial.poses) for log in _free_parts(trial, robot, arena)]
    if not logs:
        return None
    fit = fit_motion_logs(logs, robot, cameras=[0] * len(logs), hold_out=0.0, seed=seed)
    rows = {row.name: row for row in fit.fitted if row.name in (LEFT, HEADING)}

    def known(name: str) -> float:
        row = rows.get(name)
        return row.estimate if row is not None and row.identified and not row.low <= 0.0 <= row.high else 0.0

    return Marker(tuple(rows.values()), known(LEFT), known(HEADING))


def _free_parts(trial: TrialRecord, robot: RobotModel, arena: Arena) -> list[MotionLog]:
    """Return the parts of a trial in which the robot is away from walls, as logs."""
    near = is_near(trial.poses, outline_of(robot), arena) | ~np.isfinite(trial.poses).all(axis=1)
    move, turn = trial.commands.T
    ahead = robot.drive.ahead * move
    wheels = np.clip(np.stack([ahead - turn, ahead + turn], axis=1), -1.0, 1.0)
    wheels = np.concatenate([wheels, wheels[-1:]])
    edges = np.flatnonzero(np.diff(np.concatenate([[1], near.astype(int), [1]])))
    parts = []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        if end - begin < LEAST_ROWS or not wheels[begin:end].any():
            continue
        time = np.arange(end - begin) * trial.step_s
        parts.append(motion_log(time, wheels[begin:end], poses=trial.poses[begin:end]))
    return parts
