"""The flow of a program: waits and timers on the robot's clock, and functions in turn or at the same time.

The clock of a simulated robot may run faster than the wall's.
"""

from __future__ import annotations

import glob
import sys
from collections.abc import Callable, Iterator
from inspect import signature
from types import CodeType, FrameType
from typing import Any

from . import _robot
from ._base import Part
from ._mistakes import MyroError, number, whole

_Site = tuple[CodeType, int]  # a line of a program
_timers: dict[_Site, tuple[FrameType, float, float]] = {}  # frame, start [s], duration [s]


def wait(seconds: float) -> None:
    """Do nothing for some seconds; a robot that moves keeps moving.

    Raises:
        MyroError: It is not a number of at least 0.
    """
    _robot.sleep(number("wait: the seconds", seconds, 0))


def currentTime() -> float:
    """Return the time [s]; only differences mean something."""
    return _robot.now()


def timer(seconds: float = 0) -> Iterator[float]:
    """Yield the seconds since the start, for loops: `for t in timer(5):` runs for 5 seconds.

    Args:
        seconds: Duration [s]; 0 for ever.

    Raises:
        MyroError: It is not a number of at least 0.
    """
    duration = number("timer: the seconds", seconds, 0)
    start = _robot.now()
    while True:
        passed = _robot.now() - start
        if duration and passed > duration:
            return
        yield round(passed, 3)


def timeRemaining(seconds: float = 0) -> bool:
    """Return whether time remains, for loops: `while timeRemaining(5):` runs for 5 seconds.

    Each line of a program has its own timer, which starts when the program first reaches the line, and again after it
    has ended.

    Args:
        seconds: Duration [s]; 0 for ever.

    Raises:
        MyroError: It is not a number of at least 0.

    Differs: If a function returned before the time was over, the next call restarts the timer. Myro continued with the
    remaining time.
    """
    duration = number("timeRemaining: the seconds", seconds, 0)
    if not duration:
        return True
    caller = sys._getframe(1)
    site = (caller.f_code, caller.f_lineno)  # Python compiles the test of a loop twice, on one line
    now = _robot.now()
    frame, start, before = _timers.get(site, (None, now, duration))
    if frame is not caller or before != duration:
        _timers[site] = (caller, now, duration)
        return True
    if now - start > duration:
        del _timers[site]
        return False
    return True


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


def doTogether(*functions: Callable[[], object]) -> list[object] | None:
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
        _robot.stop_robot()
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
