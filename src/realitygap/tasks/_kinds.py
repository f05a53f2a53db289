"""Tasks by the names that study files have for them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from realitygap.errors import did_you_mean
from realitygap.settings import Settings

from ._coverage import CoverageTask
from ._python import PYTHON, PythonTask
from ._step_tasks import AvoidTask, GoalTask, LightTask, WallTask

TASKS: dict[str, type[Settings]] = {
    "coverage": CoverageTask,
    "avoid": AvoidTask,
    "light": LightTask,
    "wall": WallTask,
    "goal": GoalTask,
}
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
