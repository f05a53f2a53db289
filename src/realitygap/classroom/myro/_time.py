"""Waiting and measuring time, on the clock of the robot: a simulated one may run faster than the wall's."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from types import CodeType, FrameType

from . import _robot
from ._mistakes import number

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
