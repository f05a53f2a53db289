"""A custom task: a function of a Python file."""

from __future__ import annotations

import functools
import linecache
import math
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PrivateAttr, SerializerFunctionWrapHandler, model_serializer, model_validator

from realitygap._limits import MOST_TOML_BYTES, read_file
from realitygap.errors import TaskError
from realitygap.records import Observe
from realitygap.settings import Settings, visible
from realitygap.world import Arena

from ._allowed import source_hash
from ._trajectories import Trajectories

PYTHON = "python:"


class PythonTask(Settings):
    """A function of a Python file that scores trials.

    `kind = "python:FILE.py:function"` names it. The function gets `Trajectories` of n trials and returns n numbers. A
    better trial has a higher number. A function compiled by Numba (`numba.njit`) gets the kernels' own arrays,
    `TraceArrays`, without conversion, the length of a step [s], and an array of n numbers to write to. The text of the
    file is part of the condition, but its folder is not. So results belong to the function that computed them.

    The settings are data. Making a task, copying it, or reading it back from a folder of results runs no code and opens
    no file. `from_file` reads a file, and only the task that `allowed` returns runs the code.
    """

    kind: str = Field(
        pattern=r"^python:.+\.py:[A-Za-z_][A-Za-z0-9_]*$", description="python:FILE.py:function."
    )
    inputs: tuple[str, ...] = Field(
        ("obstacle", "stall", "time"),
        min_length=1,
        max_length=256,
        description="Inputs of networks, in order: obstacle, stall, time, bias, range.K, light.K, line.K, bump.K, "
        "encoder.K, goal_sector.K, goal_distance, last_move, last_turn.",
    )
    observe: Observe = Field(
        "track",
        description="Minimum observation level of a robot's trial that the function can score: readings, cells, "
        "encoders, or track.",
    )
    source: str = Field(
        "",
        description="Text of the file. Study files name the file instead.",
        json_schema_extra={"hidden": True},
        repr=False,
    )
    # Not a setting: no file and no folder of results can give this permission.
    _may_run: bool = PrivateAttr(default=False)

    @classmethod
    def from_file(cls, kind: str, **settings: Any) -> Self:
        """Read a task's file.

        Args:
            kind: `python:FILE.py:function`, with the file's path relative to the current folder.
            settings: `inputs`.

        Raises:
            TaskError: The file cannot be read.
            ValueError: A setting is wrong.
        """
        bare, source = read_task_file(kind, Path())
        return cls(kind=bare, source=source, **settings)

    @model_validator(mode="before")
    @classmethod
    def _take_a_list_of_inputs(cls, values: Any) -> Any:
        if isinstance(values, dict) and isinstance(values.get("inputs"), list):
            return {**values, "inputs": tuple(values["inputs"])}
        return values

    @model_validator(mode="after")
    def _has_a_text(self) -> Self:
        if "source" not in self.model_fields_set:
            raise ValueError(f"{self.kind} has no text. PythonTask.from_file({self.kind!r}) reads its file")
        return self

    def allowed(self) -> Self:
        """Return this task with the permission to run its code.

        `realitygap.run_study` calls it after the user has agreed. Call it for a file that you trust.
        """
        task = self.model_copy()
        task._may_run = True
        return task

    @property
    def may_run(self) -> bool:
        """True if it has the permission to run its code."""
        return self._may_run

    @property
    def sha256(self) -> str:
        """Hash of the file's text."""
        return source_hash(self.source)

    @property
    def name(self) -> str:
        """Name of the task, the same as `[task] kind`."""
        return self.kind

    @property
    def needs_trace(self) -> bool:
        """Always True, because the function may read any part of a trial."""
        return True

    @property
    def score_name(self) -> str:
        """Name of the score in figures."""
        return f"score of {self.function_name}"

    @property
    def score_range(self) -> tuple[float, float]:
        """Minimum and maximum of the score."""
        return (-math.inf, math.inf)

    @model_serializer(mode="wrap")
    def _without_default_observation(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the default of `observe`, so that older conditions keep their hashes."""
        values: dict[str, Any] = handler(self)
        if self.observe == "track":
            values.pop("observe", None)
        return values

    @property
    def file(self) -> str:
        """Path of the file, as given."""
        return self.kind.removeprefix(PYTHON).rpartition(":")[0]

    @property
    def function_name(self) -> str:
        """Name of the function."""
        return self.kind.rpartition(":")[2]

    def function(self) -> Callable[..., Any]:
        """Run the file's text and return its function.

        Raises:
            TaskError: The task may not run code, the file's code fails, or the file has no such function.
        """
        if not self._may_run:
            raise TaskError(not_allowed(self))
        return _load(self.source, self.file, self.function_name)

    def fitness(self, trajectories: Trajectories, arena: Arena) -> NDArray[np.float64]:
        """Return the scores that the function computes, (n,).

        Raises:
            TaskError: The task may not run code, the function failed, or it did not return n finite numbers.
        """
        function, n = self.function(), len(trajectories)
        try:
            if hasattr(function, "py_func"):
                scores = np.full(n, np.nan)
                function(trajectories.arrays, trajectories.step_s, scores)
            else:
                scores = np.asarray(function(trajectories), np.float64)
        except Exception as error:  # a user's function may raise anything
            raise TaskError(_failed(self, error)) from error
        if scores.shape != (n,):
            raise TaskError(
                f"{self.function_name} of {self.file} returned an array of shape {scores.shape}, expected ({n},): one "
                "number for each trial."
            )
        if not np.isfinite(scores).all():
            k = int(np.flatnonzero(~np.isfinite(scores))[0])
            raise TaskError(
                f"{self.function_name} of {self.file} returned {scores[k]} for trial {k}, expected finite numbers."
            )
        return scores


def read_task_file(kind: str, folder: Path) -> tuple[str, str]:
    """Read the Python file of a task.

    Args:
        kind: `python:FILE.py:function`.
        folder: Folder of a relative FILE.

    Returns:
        `kind` with the file's name alone, and the file's text.

    Raises:
        TaskError: The file cannot be read.
    """
    file, _, function = kind.removeprefix(PYTHON).rpartition(":")
    path = folder / file
    try:
        text = read_file(path, MOST_TOML_BYTES, plain=True).decode("utf-8")
        return f"{PYTHON}{path.name}:{function}", text.replace("\r\n", "\n").replace("\r", "\n")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise TaskError(f"task file {visible(str(path))} cannot be read: {reason}.") from None


def not_allowed(task: PythonTask) -> str:
    """Return the message of a task that may not run."""
    return (
        f"The task {visible(task.kind)} runs the code of a Python file (SHA-256 {task.sha256}), and you have not "
        "allowed this file. Nothing was run. Read the file. If you trust it, answer the question that `realitygap run` "
        "asks in a terminal, or give --allow-code (in Python: allow_code=True)."
    )


@functools.lru_cache(maxsize=32)
def _load(source: str, file: str, name: str) -> Callable[..., Any]:
    """Run the text of a file and return a function of it.

    Raises:
        TaskError: The text cannot be run, or has no such function.
    """
    digest = source_hash(source)[:16]
    shown_as = f"<{file} {digest}>"
    linecache.cache[shown_as] = (len(source), None, source.splitlines(keepends=True), shown_as)
    space: dict[str, Any] = {"__name__": f"realitygap_task_{digest}", "__file__": shown_as}
    try:
        exec(compile(source, shown_as, "exec"), space)
    except Exception as error:  # a user's file may raise anything
        raise TaskError(f"{file} cannot be run: {_line_of(error, shown_as)}{_said(error)}") from error
    function = space.get(name)
    if not callable(function):
        raise TaskError(f"{file} has no function {name!r}.")
    found: Callable[..., Any] = function
    return found


def _failed(task: PythonTask, error: Exception) -> str:
    line = _line_of(error, f"<{task.file} {task.sha256[:16]}>")
    return f"{task.function_name} of {task.file} failed: {line}{_said(error)}"


def _line_of(error: Exception, shown_as: str) -> str:
    """Return the line of the file at which the error occurred, or an empty string if it occurred elsewhere."""
    if isinstance(error, SyntaxError) and error.filename == shown_as:
        return f"line {error.lineno}: "
    lines = [
        frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == shown_as
    ]
    return f"line {lines[-1]}: " if lines else ""


def _said(error: Exception) -> str:
    text = str(error).strip().split("\n")[0]
    return f"{type(error).__name__}: {text}." if text else f"{type(error).__name__}."
