"""The interface between a fit and a simulator: trials repeated with given commands and other numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from realitygap.platforms import NOISE
from realitygap.records import TrialRecord
from realitygap.world import Distribution, RobotModel

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]


class Rehearsed(Protocol):
    """Trials (k), simulated with each of m sets of numbers."""

    @property
    def poses(self) -> NDArray[np.floating[Any]]:
        """(m, k, t + 1, 3) x [m], y [m], heading [rad], before the robot was put back."""
        ...

    @property
    def wheels(self) -> NDArray[np.floating[Any]]:
        """(m, k, t + 1, 2) way of the left and the right wheel since the start [m]."""
        ...

    @property
    def stalled(self) -> Bools:
        """(m, k, t + 1) whether it was held up, before each command and after the last."""
        ...

    @property
    def cells(self) -> Bools:
        """(m, k, c) whether each cell of the arena's grid is on its line."""
        ...

    @property
    def readings(self) -> NDArray[np.floating[Any]]:
        """(m, k, t + 1, s) of the range sensors, 0..1."""
        ...


class Simulate(Protocol):
    """A simulator of trials with given commands: `platforms.SimEnsemble.replay`."""

    def __call__(
        self,
        starts: Floats,
        commands: Floats,
        values: Mapping[str, Any],
        key: int,
        *,
        anchors: Floats | None = None,
        keep: Sequence[str] = ("poses", "wheels", "stalled"),
        same_noise: bool = False,
    ) -> Rehearsed:
        """Simulate k trials with each of m sets of numbers.

        Args:
            starts: (k, 3) x [m], y [m], heading [rad].
            commands: (k, t, 2) move and turn, -1..1.
            values: (m,) each, by dotted name.
            key: Of the random numbers.
            anchors: (k, t + 1, 3) where the robot is put back to before a command; not a number for nowhere.
            keep: Of what every step is kept.
            same_noise: Whether all sets draw the same random numbers; each its own otherwise.
        """
        ...


def plain_numbers(robot: RobotModel) -> dict[str, float]:
    """The robot's numbers by dotted name; of those that are drawn, the centers."""
    return {
        name: value.center if isinstance(value, Distribution) else value
        for name, value in robot.numbers().items()
    }


def motor_noise(robot: RobotModel) -> tuple[str, ...]:
    """Names of the numbers that make drive and encoders noisy."""
    return tuple(
        name
        for name in robot.numbers()
        if name.startswith(("drive.", "encoder.")) and name.rpartition(".")[2] in NOISE
    )


def padded_commands(trials: Sequence[TrialRecord]) -> Floats:
    """(k, t, 2) the commands of trials, followed by standing where others are longer."""
    commands = np.zeros((len(trials), max(len(trial.commands) for trial in trials), 2))
    for row, trial in zip(commands, trials, strict=True):
        row[: len(trial.commands)] = trial.commands
    return commands


def starts_of(trials: Sequence[TrialRecord]) -> Floats:
    """(k, 3) where trials begin; where poses were seen, there."""
    return np.array([trial.poses[0] if len(trial.poses) else trial.start for trial in trials], np.float64)
