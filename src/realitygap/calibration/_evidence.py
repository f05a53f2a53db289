"""Trials as long vectors: the observed ones, and the same trials run in `sim`.

Each vector is a fixed function of the observations. So a correct simulator gives vectors of the same distribution:

* Given commands are repeated, and all observations count.
* With poses, a robot is put back to its observed pose before each command, and each command is predicted separately
  (multiple shooting). So trials of controllers can be used, too.
* With encoders, the wheels of any trial are predicted from its commands, because nothing else moves them in `sim`.
* Without poses, controllers drive again in simulation, because their commands depend on their readings.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import groupby
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import Genome
from realitygap.platforms import Play, Rehearsal
from realitygap.records import Observe, TrialRecord
from realitygap.world import Arena, RobotModel

from ._shots import shots_of

Vectors = NDArray[np.float32]

BLOCK = 5  # steps over which what controllers do is averaged: beyond, chance has moved what they meet
LEAST_STEPS = 5  # of a trial that tells anything

# The least that can be told apart of each kind, as standard deviation: below it a simulator without noise would be
# refuted by rounding.
FINEST = {
    "ahead": 2e-4,
    "aside": 2e-4,
    "turn": 1e-3,
    "reading": 0.02,
    "readings": 0.02,
    "stall": 0.02,
    "wheels": 1e-4,
    "cell": 0.05,
    "command": 0.02,
    "coverage": 0.01,
}
"""Smallest difference that counts for each kind of entry, in its unit. `readings` are those of a robot that is not put
back."""

Scalar = TypeVar("Scalar", bound=np.generic)


@dataclass(frozen=True)
class Evidence:
    """Trials to be simulated, and their weights.

    Attributes:
        play: The trials.
        keep: Names of the values that are stored for each step.
        of: (m, d) vectors of m robots' trials.
        seen: (d,) vector of the observed trials.
        kinds: (d,) kind of each entry, a key of `FINEST`.
        trial: (d,) index of the observed trial of each entry.
        step: (d,) at which step; -1 for what is of the whole trial.
        at_walls: (d,) True if the robot was near a wall then; all False if its poses are not known.
    """

    play: Play
    keep: tuple[str, ...]
    of: Callable[[Rehearsal], Vectors]
    seen: Vectors
    kinds: NDArray[np.str_]
    trial: NDArray[np.int64]
    step: NDArray[np.int64]
    at_walls: NDArray[np.bool_]

    @property
    def finest(self) -> Vectors:
        """The smallest difference that counts, (d,)."""
        return np.array([FINEST[kind] for kind in self.kinds], np.float32)


@dataclass
class _Columns:
    """Entries of vectors, a group after the other: of each group its kind, its values, and the steps of a row."""

    groups: list[tuple[str, NDArray[np.floating] | NDArray[np.bool_], int]] = field(default_factory=list)

    def add(self, kind: str, values: NDArray[np.floating] | NDArray[np.bool_], per_step: int = 1) -> None:
        """Add values (m, k, t, ...), or (m, k, c) for the whole trial if `per_step` is 0."""
        self.groups.append((kind, values, per_step))

    @property
    def vectors(self) -> Vectors:
        """Return all entries, (m, d)."""
        return np.concatenate(
            [values.reshape(len(values), -1).astype(np.float32, copy=False) for _, values, _ in self.groups],
            axis=1,
        )

    @property
    def kinds(self) -> NDArray[np.str_]:
        """Return the kind of each entry, (d,)."""
        return np.concatenate([np.full(values[0].size, kind) for kind, values, _ in self.groups])

    @property
    def trial(self) -> NDArray[np.int64]:
        """Return the trial of each entry, (d,)."""
        return np.concatenate(
            [np.repeat(np.arange(values.shape[1]), values[0, 0].size) for _, values, _ in self.groups]
        )

    @property
    def step(self) -> NDArray[np.int64]:
        """Return the step of each entry, (d,); -1 for the whole trial."""
        return np.concatenate([_steps_of(values.shape[1:], per_step) for _, values, per_step in self.groups])


def _steps_of(shape: tuple[int, ...], per_step: int) -> NDArray[np.int64]:
    steps = np.full(shape, -1)
    if per_step:
        steps[:] = (np.arange(shape[1]) * per_step).reshape(1, -1, *[1] * (len(shape) - 2))
    return steps.reshape(-1)


def evidence_of(
    trials: Sequence[TrialRecord], genomes: Sequence[Genome | None], robot: RobotModel, arena: Arena
) -> list[Evidence]:
    """Return the evidence of trials, grouped by their number of steps.

    Args:
        trials: Recorded trials.
        genomes: Controller of each trial; None if its commands were given.
        robot: Robot of the trials.
        arena: Arena of the trials.
    """
    numbered = [
        (k, trial, genome)
        for k, (trial, genome) in enumerate(zip(trials, genomes, strict=True))
        if len(trial.commands) >= LEAST_STEPS
    ]

    def alike(row: tuple[int, TrialRecord, Genome | None]) -> tuple[int, Observe, bool, str]:
        _, trial, genome = row
        interface = "" if genome is None or trial.observe == "track" else repr(genome.interface)
        return len(trial.commands), trial.observe, bool(interface), interface

    evidence: list[Evidence] = []
    for (_, observe, is_driven, _), group in groupby(sorted(numbered, key=alike), key=alike):
        evidence += _of_group(list(group), observe, is_driven, robot, arena)
    return evidence


def _of_group(
    group: list[tuple[int, TrialRecord, Genome | None]],
    observe: Observe,
    is_driven: bool,
    robot: RobotModel,
    arena: Arena,
) -> list[Evidence]:
    number = np.array([k for k, _, _ in group])
    seen = _as_rehearsal([trial for _, trial, _ in group], arena.grid.n_cells)
    starts = np.array([t.poses[0] if len(t.poses) else t.start for _, t, _ in group])
    commands = np.array([trial.commands for _, trial, _ in group])
    steps = commands.shape[1]
    given = Play(starts, steps, commands)
    if observe == "track":
        anchors = np.array([trial.poses for _, trial, _ in group])
        put_back = Play(starts, steps, commands, anchors=anchors)
        keep = ("poses", "readings", "stalled", "wheels")[: 4 if seen.wheels.shape[2] else 3]
        one = _evidence(put_back, keep, partial(_shooting, anchors), seen, number)
        near = shots_of([trial for _, trial, _ in group], robot, arena).touching
        made = [replace(one, at_walls=near[np.searchsorted(number, one.trial), one.step])]
    elif is_driven:
        driven = Play(starts, steps, genomes=tuple(genome for _, _, genome in group if genome is not None))
        made = [
            _evidence(driven, ("readings", "stalled", "commands"), partial(_in_blocks, steps), seen, number)
        ]
    else:
        made = [_evidence(given, ("readings", "stalled"), partial(_step_by_step, steps), seen, number)]
    if observe == "encoders":
        made.append(_evidence(given, ("wheels",), _wheels, seen, number))
    return made


def _evidence(
    play: Play,
    keep: tuple[str, ...],
    columns_of: Callable[[Rehearsal], _Columns],
    seen: Rehearsal,
    number: NDArray[np.int64],
) -> Evidence:
    columns = columns_of(seen)
    return Evidence(
        play,
        keep,
        lambda rehearsal: columns_of(rehearsal).vectors,
        columns.vectors[0],
        columns.kinds,
        number[columns.trial],
        columns.step,
        np.zeros(len(columns.step), np.bool_),
    )


def _as_rehearsal(trials: Sequence[TrialRecord], n_cells: int) -> Rehearsal:
    """Return the observations as one rehearsal of one robot; a missing observation has no steps."""
    cells = np.zeros((1, len(trials), n_cells), np.bool_)
    for k, trial in enumerate(trials):
        cells[0, k, list(trial.cells)] = True

    def stacked(name: str, dtype: type[Scalar]) -> NDArray[Scalar]:
        return np.array([[getattr(trial, name) for trial in trials]], dtype)

    return Rehearsal(
        stacked("poses", np.float64),
        stacked("readings", np.float32),
        stacked("stalled", np.bool_),
        stacked("wheels", np.float64) if all(len(t.wheels) for t in trials) else np.empty((1, len(trials), 0, 2)),
        stacked("commands", np.float32),
        cells,
    )  # fmt: skip


def _shooting(anchors: NDArray[np.float64], rehearsal: Rehearsal) -> _Columns:
    """Return the effect of each command on a robot moved to its observed pose, in its frame, and its readings."""
    before = anchors[:, :-1].astype(np.float32)
    moved = rehearsal.poses[:, :, 1:] - before
    sine, cosine = np.sin(before[..., 2]), np.cos(before[..., 2])
    columns = _Columns()
    columns.add("ahead", moved[..., 0] * cosine + moved[..., 1] * sine)
    columns.add("aside", moved[..., 1] * cosine - moved[..., 0] * sine)
    columns.add("turn", (moved[..., 2] + np.pi) % (2 * np.pi) - np.pi)
    t = before.shape[1]
    columns.add("reading", rehearsal.readings[:, :, :t])
    columns.add("stall", rehearsal.stalled[:, :, :t])
    if rehearsal.wheels.shape[2]:
        columns.add("wheels", np.diff(rehearsal.wheels, axis=2))
    return columns


def _step_by_step(t: int, rehearsal: Rehearsal) -> _Columns:
    """Add all observations of trials with t given commands that are not put back."""
    columns = _Columns()
    columns.add("readings", rehearsal.readings[:, :, :t])
    columns.add("stall", rehearsal.stalled[:, :, :t])
    columns.add("cell", rehearsal.cells, 0)
    columns.add("coverage", rehearsal.cells.mean(axis=2, keepdims=True), 0)
    return columns


def _in_blocks(t: int, rehearsal: Rehearsal) -> _Columns:
    """Return the observations and commands of controllers in t steps, in blocks of time, with their correlation."""
    readings = rehearsal.readings[:, :, :t]
    stalled = rehearsal.stalled[:, :, :t, None].astype(np.float32)
    commands = rehearsal.commands
    columns = _Columns()
    columns.add("readings", _blocks(readings), BLOCK)
    columns.add("stall", _blocks(stalled), BLOCK)
    columns.add("command", _blocks(commands), BLOCK)
    columns.add("cell", rehearsal.cells, 0)
    columns.add("coverage", rehearsal.cells.mean(axis=2, keepdims=True), 0)
    most = readings.max(axis=-1, keepdims=True)
    seen = np.concatenate(
        [most, most == 0, most - readings.min(axis=-1, keepdims=True), stalled, commands], axis=-1
    )
    for lag in (0, 1, 2, 4):
        a, b = seen[:, :, : t - lag], seen[:, :, lag:]
        columns.add("readings", np.swapaxes(a, -1, -2) @ b / (t - lag), 0)
    return columns


def _blocks(values: NDArray[np.floating]) -> NDArray[np.floating]:
    m, k, t = values.shape[:3]
    whole = t - t % BLOCK
    parts = values[:, :, :whole].reshape(m, k, whole // BLOCK, BLOCK, *values.shape[3:])
    return np.asarray(parts.mean(axis=3))


def _wheels(rehearsal: Rehearsal) -> _Columns:
    columns = _Columns()
    columns.add("wheels", np.diff(rehearsal.wheels, axis=2))
    return columns
