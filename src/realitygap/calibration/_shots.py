"""Trials with poses as single commands: a robot is put back to its observed pose before each (multiple shooting)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap.platforms import Play, Rehearsal, SimEnsemble
from realitygap.records import TrialRecord
from realitygap.world import Arena, RobotModel

from ._prior import Floats, Parameter, numbers_of
from ._windows import is_near, outline_of, wrapped

Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Shots:
    """The effect of each command of k trials of up to t commands.

    Attributes:
        play: The trials, with poses as anchors.
        poses: (k, t + 1, 3) x [m], y [m], heading [rad]; nan after the end of a trial.
        moved: (k, t, 3) ahead [m], aside [m] and turn [rad], in the frame of the robot before the command.
        known: (k, t) True if there was such a command, and the robot's pose is known before and after it.
        touching: (k, t) True if the robot was near a wall before or after it.
        stalled: (k, t) True if it reported a stall before it.
        readings: (k, t, s) readings of its range sensors before it.
        wheels: (k, t + 1, 2) distance of each wheel since the start [m]; nan if unknown.
    """

    play: Play
    poses: Floats
    moved: Floats
    known: Bools
    touching: Bools
    stalled: Bools
    readings: Floats
    wheels: Floats

    def blocks(self, length: int) -> tuple[NDArray[np.int64], int]:
        """Return the block of each command, (k, t), and the number of blocks."""
        k, t = self.known.shape
        n_blocks = -(-t // length)
        return np.arange(k)[:, None] * n_blocks + np.arange(t) // length, k * n_blocks


def shots_of(trials: Sequence[TrialRecord], robot: RobotModel, arena: Arena) -> Shots:
    """Return the commands of trials with poses."""
    k, t = len(trials), max(len(trial.commands) for trial in trials)
    commands, poses = np.zeros((k, t, 2)), np.full((k, t + 1, 3), np.nan)
    stalled, readings = np.zeros((k, t), np.bool_), np.zeros((k, t, len(robot.range)))
    wheels = np.full((k, t + 1, 2), np.nan)
    for row, trial in enumerate(trials):
        n = len(trial.commands)
        commands[row, :n], poses[row, : n + 1] = trial.commands, trial.poses[: n + 1]
        if len(trial.wheels):
            wheels[row, : n + 1] = trial.wheels[: n + 1]
        stalled[row, :n], readings[row, :n] = trial.stalled[:n], trial.readings[:n]
    outline = outline_of(robot)
    near = np.array([is_near(path, outline, arena) for path in poses])
    near[:, :-1] |= stalled
    near[:, 1:] |= stalled
    return Shots(
        Play(poses[:, 0], t, commands, anchors=poses),
        poses,
        _in_own_frame(poses[:, 1:], poses[:, :-1]),
        np.isfinite(poses[:, 1:]).all(axis=2) & np.isfinite(poses[:, :-1]).all(axis=2),
        near[:, :-1] | near[:, 1:],
        stalled,
        readings,
        wheels,
    )


def _in_own_frame(after: NDArray[np.floating], before: Floats) -> Floats:
    x, y = after[..., 0] - before[..., 0], after[..., 1] - before[..., 1]
    cosine, sine = np.cos(before[..., 2]), np.sin(before[..., 2])
    turn = wrapped(after[..., 2] - before[..., 2])
    return np.stack([x * cosine + y * sine, y * cosine - x * sine, turn], axis=-1)


def moved_by(rehearsal: Rehearsal, poses: Floats) -> Floats:
    """Return the motion of m robots at each command from poses (k, t + 1, 3), (m, k, t, 3); 0 if there was none."""
    return np.nan_to_num(_in_own_frame(rehearsal.poses[:, :, 1:].astype(np.float64), poses[None, :, :-1]))


@dataclass(frozen=True)
class Shooter:
    """A simulation of the commands of shots in `sim`."""

    shots: Shots
    ensemble: SimEnsemble
    prior: Sequence[Parameter]
    robot: RobotModel

    def moved(self, values: Mapping[str, Floats], key: int) -> Floats:
        """Return the motion of m robots at each command, (m, k, t, 3); 0 if there was none."""

        def of(rehearsal: Rehearsal) -> Floats:
            return moved_by(rehearsal, self.shots.poses)

        numbers = numbers_of(self.prior, values, self.robot)
        return self.ensemble.summarize(self.shots.play, numbers, key, of, keep=("poses",))

    def off(self, values: Mapping[str, Floats], key: int) -> Floats:
        """Return the observed effects minus the effects of m robots, (m, k, t, 3)."""
        off = np.nan_to_num(self.shots.moved) - self.moved(values, key)
        off[..., 2] = wrapped(off[..., 2])
        off[:, ~self.shots.known] = 0.0
        return off

    def stalls(self, values: Mapping[str, Floats], key: int) -> Floats:
        """Return the share of m robots that stall before each command, (k, t)."""

        def of(rehearsal: Rehearsal) -> NDArray[np.float32]:
            return rehearsal.stalled[:, :, :-1].astype(np.float32)

        numbers = numbers_of(self.prior, values, self.robot)
        made = self.ensemble.summarize(self.shots.play, numbers, key, of, keep=("stalled",))
        return np.asarray(made.mean(axis=0), np.float64)
