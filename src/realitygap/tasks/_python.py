"""A task of one's own: a function of a Python file."""

from __future__ import annotations

import functools
import hashlib
import linecache
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from realitygap.errors import TaskError
from realitygap.settings import Settings
from realitygap.world import Arena

from ._trajectories import Trajectories

PYTHON = "python:"


class PythonTask(Settings):
    """What a function of one's own says that trials are worth.

    `kind = "python:FILE.py:function"` names it. The function gets `Trajectories` of n trials and returns n numbers,
    more for what is better. One that Numba compiled (`numba.njit`) gets the kernels' own arrays, `TraceArrays`, the
    length of a step [s] and an array of n numbers to write to: nothing is converted for it. The text of the file is
    part of the condition, its folder is not: results stay with the function that they were computed with.
    """

    kind: str = Field(
        pattern=r"^python:.+\.py:[A-Za-z_][A-Za-z0-9_]*$", description="python:FILE.py:function."
    )
    inputs: tuple[str, ...] = Field(
        ("obstacle", "stall", "time"),
        min_length=1,
        max_length=256,
        description="What networks see, in order: obstacle, stall, time, bias, range.K, light.K, line.K, bump.K, "
        "encoder.K, goal_sector.K, goal_distance, last_move, last_turn.",
    )
    source: str = Field(
        "",
        description="The file's text; read from the file where it is empty.",
        json_schema_extra={"hidden": True},
        repr=False,
    )

    @model_validator(mode="before")
    @classmethod
    def _read_the_file(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        if isinstance(values.get("inputs"), list):
            values = {**values, "inputs": tuple(values["inputs"])}
        if values.get("source") or str(values.get("kind")).count(":") < 2:
            return values
        path = Path(str(values["kind"]).removeprefix(PYTHON).rpartition(":")[0])
        bare = f"{PYTHON}{path.name}:{str(values['kind']).rpartition(':')[2]}"
        try:
            return {**values, "kind": bare, "source": path.read_text("utf-8")}
        except (OSError, UnicodeDecodeError) as error:
            said = getattr(error, "strerror", None) or error
            raise ValueError(f"task file {path} cannot be read: {said}") from None

    @model_validator(mode="after")
    def _has_the_function(self) -> Self:
        try:
            self._function()
        except TaskError as error:
            raise ValueError(str(error).rstrip(".")) from None
        return self

    @property
    def name(self) -> str:
        """As `[task] kind` has it."""
        return self.kind

    @property
    def needs_trace(self) -> bool:
        """Always: nobody knows what the function looks at."""
        return True

    @property
    def file(self) -> str:
        """The file's path as it was given."""
        return self.kind.removeprefix(PYTHON).rpartition(":")[0]

    @property
    def function_name(self) -> str:
        """The function's name."""
        return self.kind.rpartition(":")[2]

    def _function(self) -> Callable[..., Any]:
        return _load(self.source, self.file, self.function_name)

    def fitness(self, trajectories: Trajectories, arena: Arena) -> NDArray[np.float64]:
        """(n,) what the function says.

        Raises:
            TaskError: It failed, or did not return n finite numbers.
        """
        function, n = self._function(), len(trajectories)
        try:
            if hasattr(function, "py_func"):
                told = np.full(n, np.nan)
                function(trajectories.arrays, trajectories.step_s, told)
            else:
                told = np.asarray(function(trajectories), np.float64)
        except Exception as error:  # whatever a function of somebody's own does
            raise TaskError(_failed(self, error)) from error
        if told.shape != (n,):
            raise TaskError(
                f"{self.function_name} of {self.file} returned an array of shape {told.shape}, expected ({n},): one "
                "number for each trial."
            )
        if not np.isfinite(told).all():
            k = int(np.flatnonzero(~np.isfinite(told))[0])
            raise TaskError(
                f"{self.function_name} of {self.file} returned {told[k]} for trial {k}, expected finite numbers."
            )
        return told


@functools.lru_cache(maxsize=32)
def _load(source: str, file: str, name: str) -> Callable[..., Any]:
    """A function of a file's text.

    Raises:
        TaskError: The text cannot be run, or has no such function.
    """
    digest = hashlib.sha256(source.encode()).hexdigest()[:16]
    shown_as = f"<{file} {digest}>"
    linecache.cache[shown_as] = (len(source), None, source.splitlines(keepends=True), shown_as)
    space: dict[str, Any] = {"__name__": f"realitygap_task_{digest}", "__file__": shown_as}
    try:
        exec(compile(source, shown_as, "exec"), space)
    except Exception as error:  # whatever a file of somebody's own does
        raise TaskError(f"{file} cannot be run: {_line_of(error, shown_as)}{_said(error)}") from error
    function = space.get(name)
    if not callable(function):
        raise TaskError(f"{file} has no function {name!r}.")
    found: Callable[..., Any] = function
    return found


def _failed(task: PythonTask, error: Exception) -> str:
    digest = hashlib.sha256(task.source.encode()).hexdigest()[:16]
    line = _line_of(error, f"<{task.file} {digest}>")
    return f"{task.function_name} of {task.file} failed: {line}{_said(error)}"


def _line_of(error: Exception, shown_as: str) -> str:
    """Where in the file it happened; nothing where it did not happen there."""
    if isinstance(error, SyntaxError) and error.filename == shown_as:
        return f"line {error.lineno}: "
    lines = [
        frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == shown_as
    ]
    return f"line {lines[-1]}: " if lines else ""


def _said(error: Exception) -> str:
    text = str(error).strip().split("\n")[0]
    return f"{type(error).__name__}: {text}." if text else f"{type(error).__name__}."
