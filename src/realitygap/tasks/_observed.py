"""Observed trials in the form in which tasks read them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import TaskError
from realitygap.records import TrialRecord, sees
from realitygap.world import Arena

from ._task import Task
from ._trajectories import TraceArrays, Trajectories


def score_observed(task: Task, trials: Sequence[TrialRecord], arena: Arena) -> NDArray[np.float64]:
    """Return what observed trials are worth to a task.

    Args:
        task: The task.
        trials: n trials, each with as much as the task needs, by `task.observe`.
        arena: Arena of the trials.

    Returns:
        (n,) scores, finite.

    Raises:
        TaskError: A trial has less than the task needs, or the task cannot be scored in the arena.
        ValueError: The trials differ in their numbers of steps or sensors.
    """
    if not trials:
        return np.empty(0)
    if sees(task.observe, "track"):
        _refuse(trials, task, "poses", [len(trial.poses) == 0 for trial in trials])
        hidden = [name for name in arena.vary if not name.startswith("arena.start.")]
        if task.needs_trace and hidden:
            raise TaskError(
                f"{hidden[0]} of arena {arena.name!r} is sampled for each trial, and an observer does not get "
                f"the value: a trial cannot be scored for task {task.name!r}. Set it to a number."
            )
    if task.needs_trace:
        _refuse(trials, task, "a look at its end", [len(trial.last_readings) == 0 for trial in trials])
    elif task.observe == "cells":
        _refuse(trials, task, "cells", [not trial.cells for trial in trials])
    return np.asarray(task.fitness(observed_trajectories(trials, arena), arena), np.float64)


def _refuse(trials: Sequence[TrialRecord], task: Task, what: str, lacks: Sequence[bool]) -> None:
    if any(lacks):
        number = trials[lacks.index(True)].number
        raise TaskError(
            f"Trial {number} has no {what.removeprefix('a ')}, which task {task.name!r} needs. Drive the trials again, "
            f"and let {task.observe} be observed."
        )


def observed_trajectories(trials: Sequence[TrialRecord], arena: Arena) -> Trajectories:
    """Stack observed trials. Readings are those that the controllers saw, with all noise.

    Args:
        trials: n >= 1 trials of t commands each, with s range sensors.
        arena: Arena of the trials.

    Returns:
        Trajectories without inputs of networks. Missing observations have no rows (wheels, poses), or are NaN
        (coverage without cells, and the readings at the end).

    Raises:
        ValueError: The trials differ in their numbers of steps or sensors.
    """
    shapes = {trial.readings.shape for trial in trials}
    if len(shapes) != 1:
        raise ValueError(f"The readings of trials have the shapes {sorted(shapes)}, expected one shape.")
    ((n_steps, n_sensors),) = shapes
    n_cells = arena.grid.n_cells
    unseen = np.full(n_sensors, np.nan)
    has_poses = all(len(trial.poses) == n_steps + 1 for trial in trials)
    poses = np.empty((0, 3, len(trials)))
    if has_poses:
        origin = np.array([arena.start.x, arena.start.y, 0.0])
        poses = _last([(trial.poses - origin) / [1.0, 1.0, math.tau] for trial in trials])
    wheels = np.empty((0, 2, len(trials)))
    if all(len(trial.wheels) == n_steps + 1 for trial in trials):
        wheels = _last([trial.wheels for trial in trials])
    ends = [trial.last_readings if len(trial.last_readings) else unseen for trial in trials]
    stalled = [np.append(trial.stalled, trial.last_stalled) for trial in trials]
    return Trajectories(
        arena=arena,
        step_s=float(np.median([trial.step_s for trial in trials])),
        arrays=TraceArrays(
            poses=poses,
            readings=_last(
                [np.vstack([trial.readings, end]) for trial, end in zip(trials, ends, strict=True)]
            ),
            inputs=np.empty((n_steps, 0, len(trials))),
            commands=_last([trial.commands for trial in trials]),
            stalled=np.stack(stalled, axis=-1),
            wheels=wheels,
        ),
        sensors=tuple(f"range.{k}" for k in range(n_sensors)),
        network_inputs=(),
        coverage_line=np.array([len(trial.cells) / n_cells if trial.cells else np.nan for trial in trials]),
        coverage_ends=np.array(
            [_cells_at_ends(trial.poses, arena) / n_cells if has_poses else np.nan for trial in trials]
        ),
        n_stalls=np.array([int(steps[1:].sum()) for steps in stalled], np.int32),
    )


def _last(arrays: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return n arrays (t, k) as (t, k, n)."""
    return np.ascontiguousarray(np.stack(arrays, axis=-1), np.float64)


def _cells_at_ends(poses: NDArray[np.float64], arena: Arena) -> int:
    """Return the number of cells in which the robot stood at its start and after each command."""
    return len({arena.grid.cell_at(float(x), float(y)) for x, y, _ in poses} - {None})
