"""The interface between a fit and a simulator: trials repeated with given commands and other numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from realitygap.platforms import NOISE
from realitygap.records import TrialRecord
from realitygap.world import RobotModel

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]


class Rehearsed(Protocol):
    """Trials (k), simulated with each of m sets of numbers."""

    @property
    def poses(self) -> NDArray[np.floating]:
        """Poses x [m], y [m], heading [rad], before the robot was put back, (m, k, t + 1, 3)."""
        ...

    @property
    def wheels(self) -> NDArray[np.floating]:
        """Distances of the left and the right wheel since the start [m], (m, k, t + 1, 2)."""
        ...

    @property
    def stalled(self) -> Bools:
        """True if the robot was blocked, before each command and after the last, (m, k, t + 1)."""
        ...

    @property
    def cells(self) -> Bools:
        """True for each cell of the arena's grid on the robot's line, (m, k, c)."""
        ...

    @property
    def readings(self) -> NDArray[np.floating]:
        """Readings of the range sensors, 0 to 1, (m, k, t + 1, s)."""
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
            key: Key of the random numbers.
            anchors: (k, t + 1, 3) poses to which the robot is put back before a command; nan for none.
            keep: Names of the values that are stored for each step.
            same_noise: True if all sets draw the same random numbers. Otherwise each set draws its own.
        """
        ...


def motor_noise(robot: RobotModel) -> tuple[str, ...]:
    """Return names of the numbers that make drive and encoders noisy."""
    return tuple(
        name
        for name in robot.numbers()
        if name.startswith(("drive.", "encoder.")) and name.rpartition(".")[2] in NOISE
    )


def padded_commands(trials: Sequence[TrialRecord]) -> Floats:
    """Return the commands of trials, (k, t, 2). Zeros fill shorter trials."""
    commands = np.zeros((len(trials), max(len(trial.commands) for trial in trials), 2))
    for row, trial in zip(commands, trials, strict=True):
        row[: len(trial.commands)] = trial.commands
    return commands


def starts_of(trials: Sequence[TrialRecord]) -> Floats:
    """Return the starts of trials, (k, 3): observed poses, if there are any."""
    return np.array([trial.poses[0] if len(trial.poses) else trial.start for trial in trials], np.float64)


ALIKE = 0.1
"""Share by which commands of trials may differ in length and are taken for equally long: over a radio link none are."""


def of_one_length(trials: Sequence[TrialRecord]) -> tuple[list[TrialRecord], str]:
    """Return the largest group of trials with commands of about the same length, and a text on the others, or ""."""
    lengths = sorted(trial.step_s for trial in trials)
    if not lengths or lengths[-1] <= (1 + ALIKE) * lengths[0]:
        return list(trials), ""
    least = max(lengths, key=lambda length: sum(length <= other <= (1 + ALIKE) * length for other in lengths))
    kept = [trial for trial in trials if least <= trial.step_s <= (1 + ALIKE) * least]
    others = [length for length in lengths if not least <= length <= (1 + ALIKE) * least]
    return kept, (
        f"{len(others)} of {len(trials)} trials were left out: their commands lasted {others[0]:.3g} to "
        f"{others[-1]:.3g} s. Those of the {len(kept)} that count lasted {least:.3g} to "
        f"{max(trial.step_s for trial in kept):.3g} s."
    )


def step_of(trials: Sequence[TrialRecord]) -> float:
    """Return the median duration of a command in these trials [s].

    Raises:
        ValueError: No trial, or such different lengths that they are no robot's with one step.
    """
    if not trials:
        raise ValueError("There are no trials to fit to, expected at least one.")
    lengths = [trial.step_s for trial in trials]
    if max(lengths) > (1 + ALIKE) * min(lengths):
        raise ValueError(
            f"The trials' commands last {min(lengths):.3g} to {max(lengths):.3g} s, expected one length of time. Fit "
            "them apart."
        )
    return float(np.median(lengths))
