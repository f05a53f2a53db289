"""Functions run in turn, or at the same time."""

from __future__ import annotations

import glob
from collections.abc import Callable
from inspect import signature
from typing import Any

from . import _robot
from ._base import Part
from ._mistakes import MyroError, whole
from ._robot import stop_robot

_GRACE_S = 0.2
"""Time in which a function that has to end may finish its present exchange with the robot."""


def loop(*functions: Any) -> str:
    """Call functions one after another, several times: `loop(step, turn, 4)`; then stop the robot.

    Args:
        functions: Functions, each called with the number of the round if it takes an argument. The last argument is the
            number of rounds.

    Raises:
        MyroError: There are no functions, or no number at the end.
    """
    *steps, count = functions or (None,)
    if not steps or not all(callable(step) for step in steps):
        raise MyroError(
            "loop() was called without functions, expected loop(step, turn, 4): functions, then how often."
        )
    for turn in range(1, whole("loop: how often", count, 0, 10**9) + 1):
        for step in steps:
            print(f"   loop #{turn}: running {_name(step)}()... ", end="")
            result = step(turn) if signature(step).parameters else step()
            print(f" => {result}" if result else "")
    robot = _robot.robot_or_none()
    if robot is not None:
        robot.stop()
    return "ok"


def doTogether(*functions: Callable[[], Any]) -> list[Any] | None:
    """Run two or more functions at the same time: `doTogether(drive, sing)`; return when all have ended.

    The robot still does one thing after another: where one function plays a tone, the other waits for the robot. On a
    simulated robot with `speed="off"` the times of all functions add up.

    Returns:
        The value that each returned, or None if none returned anything.

    Raises:
        MyroError: There are fewer than two functions.
    """
    if len(functions) < 2 or not all(callable(function) for function in functions):
        raise MyroError(
            f"doTogether() was given {len(functions)} values, expected two or more functions, without "
            "parentheses behind their names: doTogether(drive, sing)."
        )
    parts = [Part(function) for function in functions]
    try:
        for part in parts:
            part.start()
        for part in parts:
            part.join()
    except BaseException:  # Ctrl-C: do not wait for functions that may never end
        for part in parts:
            part.is_over = True
        for part in parts:
            part.join(_GRACE_S)
        stop_robot()
        raise
    for part in parts:
        if part.error is not None:
            raise part.error
    results = [part.result for part in parts]
    return results if any(result is not None for result in results) else None


def getFilenames(pattern: str) -> list[str]:
    """Return the names of files that a pattern describes, in order: `getFilenames("picture*.jpg")`."""
    return sorted(glob.glob(pattern))  # noqa: PTH207  # the pattern may name folders and begin anywhere


def _name(function: object) -> str:
    return getattr(function, "__name__", "function")
