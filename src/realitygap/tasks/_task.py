"""The contract of a task, and the tasks by the names that study files have for them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import did_you_mean
from realitygap.records import Observe
from realitygap.settings import Settings
from realitygap.world import Arena

from ._coverage import CoverageTask
from ._python import PYTHON, PythonTask
from ._step_tasks import STEP_TASKS
from ._trajectories import Trajectories


@runtime_checkable
class Task(Protocol):
    """A task, which rewards trials.

    A task of a study file is also a `Settings`, whose values enter the condition's hash.

    `fitness` is a function of the trials alone: the same trials are worth the same, whatever else is tried in the
    same call.

    Attributes:
        name: Name of the task, the same as `[task] kind`.
        inputs: Inputs of the networks, in order: `obstacle` (the largest of the range readings), `stall`, `time` (step
            / steps), `bias` (constant, the last if there is one), one sensor's reading `range.K`, `light.K`, `line.K`,
            `bump.K`, `encoder.K`, `goal_sector.K` (the quarter around the robot with the goal), `goal_distance`,
            `last_move`, `last_turn`.
        needs_trace: True if `fitness` uses single steps. Otherwise the arrays of steps have no rows.
        observe: Minimum observation level of a trial that can be scored.
        score_range: Minimum and maximum of the score; infinite if there is no limit.
        score_name: Name of the score in figures, with its unit, such as `coverage` or `distance along walls [m]`.
    """

    @property
    def name(self) -> str: ...

    @property
    def inputs(self) -> tuple[str, ...]: ...

    @property
    def needs_trace(self) -> bool: ...

    @property
    def observe(self) -> Observe: ...

    @property
    def score_name(self) -> str: ...

    @property
    def score_range(self) -> tuple[float, float]: ...

    def fitness(self, trajectories: Trajectories, arena: Arena) -> NDArray[np.float64]:
        """Return the finite score of each trial, (n,). A better trial has a higher score."""
        ...


TASKS: dict[str, type[Settings]] = {"coverage": CoverageTask, **STEP_TASKS}
"""Kinds of `[task] kind`, except python:FILE.py:function. Each is a `Settings` and, except coverage, a `Task`."""


def task_model(values: Mapping[str, Any]) -> type[Settings]:
    """Return the settings that a table [task] has.

    Raises:
        ValueError: There is no task of this kind.
    """
    kind = values.get("kind", "coverage")
    if isinstance(kind, str) and kind.startswith(PYTHON):
        return PythonTask
    if not isinstance(kind, str) or kind not in TASKS:
        raise ValueError(
            f"unknown kind {kind!r}. {did_you_mean(str(kind), TASKS)} A function of your own is "
            "python:FILE.py:function"
        )
    return TASKS[kind]


def as_task(value: Any) -> Any:
    """Return the task of a table; any other value is returned unchanged."""
    if not isinstance(value, Mapping):
        return value
    model = task_model(value)
    if model is CoverageTask:
        value = {key: part for key, part in value.items() if key != "kind"}
    return model(**value)
