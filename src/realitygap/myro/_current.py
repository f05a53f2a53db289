"""The robot that Myro's functions speak to, its clock, and how a method of a robot becomes such a function."""

from __future__ import annotations

import builtins
import functools
import inspect
from collections.abc import Callable
from typing import TYPE_CHECKING, Concatenate, ParamSpec, TypeVar

from realitygap.robots import SystemClock

from ._mistakes import MyroError

if TYPE_CHECKING:
    from ._robot import Scribbler

P = ParamSpec("P")
T = TypeVar("T")

_WALL = SystemClock()
_robot: Scribbler | None = None
_limit_s: float | None = None


def robot_or_none() -> Scribbler | None:
    """The robot in use; None before `initialize` and after it was closed."""
    return _robot


def use(robot: Scribbler | None) -> None:
    """From now on Myro's functions speak to this robot, which programs also know as `robot`."""
    global _robot
    _robot = robot
    builtins.robot = robot  # type: ignore[attr-defined]  # as in Myro: programs just say robot.forward()


def set_limit(seconds: float | None) -> None:
    """Give a program so many seconds with each robot that it opens from now on; None for no limit."""
    global _limit_s
    _limit_s = seconds


def limit() -> float | None:
    """How long a program may use a robot [s]."""
    return _limit_s


def robot_for(function: str) -> Scribbler:
    """The robot in use.

    Raises:
        MyroError: There is none; the text says how to get one.
    """
    if _robot is None:
        raise MyroError(
            f'{function}() needs a robot, and there is none yet. Call initialize("sim") for a simulated one, or '
            'initialize("/dev/rfcomm0") (on Windows initialize("COM3")) with the port of yours.'
        )
    return _robot


def now() -> float:
    """The time on the robot's clock [s]; on the computer's where there is no robot."""
    return _WALL.now() if _robot is None else _robot.now()


def sleep(seconds: float) -> None:
    """Let time pass [s]: a simulated robot moves on meanwhile."""
    if _robot is None:
        _WALL.sleep(seconds)
    else:
        _robot.pause(seconds)


def of_robot(method: Callable[Concatenate[Scribbler, P], T]) -> Callable[P, T]:
    """Myro's function of the name of a method: it does the same with the robot in use."""
    name = method.__name__

    @functools.wraps(method)
    def function(*args: P.args, **kwargs: P.kwargs) -> T:
        return method(robot_for(name), *args, **kwargs)

    signature = inspect.signature(method)
    function.__signature__ = signature.replace(  # type: ignore[attr-defined]  # what help() shows
        parameters=list(signature.parameters.values())[1:]
    )
    function.__qualname__ = name
    return function
