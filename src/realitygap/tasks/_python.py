"""Functions of a Python file of the user: a task, or numbers that describe trials."""

from __future__ import annotations

import functools
import linecache
import math
import re
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BeforeValidator,
    Field,
    PrivateAttr,
    SerializerFunctionWrapHandler,
    field_validator,
    model_serializer,
    model_validator,
)

from realitygap._limits import MOST_TOML_BYTES, read_file
from realitygap.errors import TaskError
from realitygap.records import Observe
from realitygap.settings import Settings, as_tuple, visible
from realitygap.world import Arena

from ._allowed import is_allowed, source_hash
from ._trajectories import Trajectories

PYTHON = "python:"
MOST_NUMBERS = 32
Range = Annotated[tuple[float, float], BeforeValidator(as_tuple)]


class PythonFunction(Settings):
    """A function of a Python file that gets `Trajectories` of n trials and returns numbers for each.

    `kind = "python:FILE.py:function"` names it. A function compiled by Numba (`numba.njit`) gets the kernels' own
    arrays, `TraceArrays`, without conversion, the length of a step [s], and an array of numbers to write to. The text
    of the file is part of the condition, but its folder is not. So results belong to the function that computed them.

    The settings are data. Making a function, copying it, or reading it back from a folder of results runs no code and
    opens no file. `from_file` reads a file, and the code runs only after `allowed`, or if the user has allowed a file
    with this text before.
    """

    kind: str = Field(description="python:FILE.py:function.")
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
        """Read a function's file.

        Args:
            kind: `python:FILE.py:function`, with the file's path relative to the current folder.
            settings: All other settings.

        Raises:
            TaskError: The file cannot be read.
            ValueError: A setting is wrong.
        """
        bare, source = read_python_file(kind, Path())
        return cls(kind=bare, source=source, **settings)

    @field_validator("kind")
    @classmethod
    def _names_file_and_function(cls, kind: str) -> str:
        if not re.fullmatch(r"python:.+\.py:[A-Za-z_][A-Za-z0-9_]*", kind):
            raise ValueError(f"expected python:FILE.py:FUNCTION, got {visible(kind[:200])!r}")
        return kind

    @model_validator(mode="after")
    def _has_a_text(self) -> Self:
        if "source" not in self.model_fields_set:
            raise ValueError(
                f"{self.kind} has no text. {type(self).__name__}.from_file({self.kind!r}, ...) reads its file"
            )
        return self

    def allowed(self) -> Self:
        """Return this function with the permission to run its code.

        `realitygap.run_study` calls it after the user has agreed. Call it for a file that you trust.
        """
        function = self.model_copy()
        function._may_run = True
        return function

    @property
    def may_run(self) -> bool:
        """True if it has the permission to run its code, or the user has allowed its text before."""
        return self._may_run or is_allowed(self.sha256)

    @property
    def sha256(self) -> str:
        """Hash of the file's text."""
        return source_hash(self.source)

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
            TaskError: It may not run code, the file's code fails, or the file has no such function.
        """
        if not self.may_run:
            raise TaskError(not_allowed(self))
        return _load(self.source, self.file, self.function_name)

    def numbers(self, trajectories: Trajectories, *d: int) -> NDArray[np.float64]:
        """Return what the function computes of n trials, (n,) or (n, d).

        Raises:
            TaskError: It may not run code, failed, or returned another shape, or numbers that are not finite.
        """
        function, shape = self.function(), (len(trajectories), *d)
        try:
            if hasattr(function, "py_func"):
                found = np.full(shape, np.nan)
                function(trajectories.arrays, trajectories.step_s, found)
            else:
                found = np.asarray(function(trajectories), np.float64)
        except (Exception, SystemExit) as error:  # a user's function may raise anything
            raise TaskError(_failed(self, error)) from error
        if found.shape != shape:
            numbers = f"{d[0]} numbers" if d else "one number"
            raise TaskError(
                f"{self.function_name} of {self.file} returned an array of shape {found.shape}, expected {shape}: "
                f"{numbers} for each trial."
            )
        if not np.isfinite(found).all():
            at = tuple(np.argwhere(~np.isfinite(found))[0])
            raise TaskError(
                f"{self.function_name} of {self.file} returned {found[at]} for trial {at[0]}, expected finite numbers."
            )
        return found


class PythonTask(PythonFunction):
    """A task whose function returns the score of each of n trials, (n,). A better trial has a higher score."""

    inputs: Annotated[tuple[str, ...], BeforeValidator(as_tuple)] = Field(
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

    def fitness(self, trajectories: Trajectories, arena: Arena) -> NDArray[np.float64]:
        """Return the scores that the function computes, (n,).

        Raises:
            TaskError: As `numbers`.
        """
        return self.numbers(trajectories)


class PythonDescriptor(PythonFunction):
    """A function that describes each of n trials for an archive, by one number, (n,), or by d numbers, (n, d)."""

    names: Annotated[tuple[str, ...], BeforeValidator(as_tuple)] = Field(
        min_length=1, max_length=MOST_NUMBERS, description="Names of the d numbers."
    )
    ranges: Annotated[tuple[Range, ...], BeforeValidator(as_tuple)] = Field(
        min_length=1, max_length=MOST_NUMBERS, description="Lowest and highest value of each number, (d, 2)."
    )

    @model_validator(mode="after")
    def _each_name_has_its_range(self) -> Self:
        if len(self.names) != len(self.ranges):
            raise ValueError(
                f"expected one range for each name, got {len(self.names)} for names and {len(self.ranges)} for ranges"
            )
        for name in self.names:
            if not re.fullmatch("[a-z][a-z0-9_]{0,39}", name):
                raise ValueError(
                    f"the name {visible(name[:60])!r} is none: expected up to 40 of a to z, 0 to 9, and _, with a "
                    "letter first"
                )
        if len(set(self.names)) < len(self.names):
            raise ValueError(f"names are {', '.join(self.names)}, expected each once")
        for name, (low, high) in zip(self.names, self.ranges, strict=True):
            if not low < high:
                raise ValueError(f"{name} is from {low:g} to {high:g}, expected the lowest value first")
        return self

    def describe(self, trajectories: Trajectories) -> NDArray[np.float64]:
        """Return the numbers that the function computes, (n, d).

        Raises:
            TaskError: As `numbers`.
        """
        d = len(self.names)
        return self.numbers(trajectories)[:, None] if d == 1 else self.numbers(trajectories, d)


def read_python_file(kind: str, folder: Path) -> tuple[str, str]:
    """Read the Python file of a function.

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
        raise TaskError(f"Python file {visible(str(path))} cannot be read: {reason}.") from None


def not_allowed(function: PythonFunction) -> str:
    """Return the message of a function that may not run."""
    return (
        f"{visible(function.kind)} runs the code of a Python file (SHA-256 {function.sha256}), and you have not "
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
    except (Exception, SystemExit) as error:  # a user's file may raise anything
        raise TaskError(f"{file} cannot be run: {_line_of(error, shown_as)}{_said(error)}") from error
    function = space.get(name)
    if not callable(function):
        raise TaskError(f"{file} has no function {name!r}.")
    found: Callable[..., Any] = function
    return found


def _failed(function: PythonFunction, error: BaseException) -> str:
    line = _line_of(error, f"<{function.file} {function.sha256[:16]}>")
    return f"{function.function_name} of {function.file} failed: {line}{_said(error)}"


def _line_of(error: BaseException, shown_as: str) -> str:
    """Return the line of the file at which the error occurred, or an empty string if it occurred elsewhere."""
    if isinstance(error, SyntaxError) and error.filename == shown_as:
        return f"line {error.lineno}: "
    lines = [
        frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == shown_as
    ]
    return f"line {lines[-1]}: " if lines else ""


def _said(error: BaseException) -> str:
    text = str(error).strip().split("\n")[0]
    return f"{type(error).__name__}: {text}." if text else f"{type(error).__name__}."
