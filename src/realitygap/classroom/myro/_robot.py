"""Myro's robot, the one in use and its clock, and how a method of a robot becomes a function of Myro."""

from __future__ import annotations

import builtins
import contextlib
import functools
import inspect
from collections.abc import Callable, Mapping
from typing import Concatenate, ParamSpec, TypeVar

from realitygap._closed_on_exit import ClosedOnExit
from realitygap._foreign_text import printable
from realitygap.errors import RobotError
from realitygap.robots import SystemClock

from ._base import Base
from ._driving import Driving, Paths
from ._fluke import Camera, Fluke
from ._identity import Identity
from ._mistakes import MyroError, choice
from ._ports import open_port
from ._senses import Senses
from ._simulation import Option
from ._sound import Lights, Sound

P = ParamSpec("P")
T = TypeVar("T")

_WALL = SystemClock()
_in_use: Scribbler | None = None
_limit_s: float | None = None

_HELLO = (784, 880, 698, 349, 523)
"""The tones of a robot that was just opened [Hz], each of 30 ms: Myro's."""


class Scribbler(Driving, Senses, Sound, Lights, Camera, Identity, Paths, Fluke, Base, ClosedOnExit):
    """A Scribbler on a port, in the terms of Myro; Myro's functions speak to the one that was opened last.

    As a context manager it stops and lets go of the robot at the end.

    Args:
        port: The robot's port ("/dev/rfcomm0", "COM3"), an emulator's ("emulator://s2?fluke=2"), or "sim" for a
            simulated robot. Default: ask in the terminal.
        options: Options of "sim", see `simulator`.

    Raises:
        MyroError: The robot cannot be opened; the text says what to try.
    """

    def __init__(self, port: str | int | None = None, **options: Option) -> None:
        before = robot_or_none()
        if before is not None:
            with contextlib.suppress(RobotError):  # a robot that is gone shall not keep the next one away
                before.close()
        self._port, self._options = port, options
        self.openConnection()
        use(self)
        self.restart()

    def __repr__(self) -> str:
        info = self._driver.info
        fluke = "no Fluke" if info.fluke == "none" else f"Fluke {info.fluke}"
        return f"<Scribbler {info.model or 'unknown'} with {fluke} on {info.port}, {info.label}>"

    def openConnection(self) -> None:
        """Open the port again after `closeConnection`.

        Raises:
            MyroError: The robot cannot be opened.
        """
        self._driver, self.simulation = open_port(self._port, **self._options)
        self.clock = self._driver.clock
        self.deadline = None if _limit_s is None else self.clock.now() + _limit_s

    open = openConnection

    def closeConnection(self) -> None:
        """Stop the robot and let go of its port."""
        if self.simulation is not None:
            self.simulation.close()
        self._driver.close()

    def close(self) -> None:
        """Close like `closeConnection`. Myro's functions then have no robot until `initialize`."""
        try:
            self.closeConnection()
        finally:
            if robot_or_none() is self:
                use(None)

    def restart(self) -> None:
        """Stop the robot, switch its lights off, let it play its five tones and greet."""
        if self._driver.info.model is None:
            return
        self.stop()
        self.setLED("all", "off")
        for hz in _HELLO:
            self.beep(0.03, hz)
        print(printable(f"Hello, I'm {self.getName()}!"))

    def reboot(self) -> None:
        """Restart the robot, as its reset button does."""
        self.driver.reset_robot()

    def update(self) -> None:
        """Do nothing: each reading asks the robot. Programs call it."""

    def requestStop(self) -> None:
        """Stop the robot, from anywhere in a program."""
        self.stop()

    def set(self, item: str, position: str | float, value: str | float | None = None) -> None:
        """Set something by its name: `set("led", "left", "on")` is `setLED("left", "on")`.

        Args:
            item: "led", "name", "password", "volume", "startsong", "whitebalance", "irpower", "forwardness" or "data".
            position: Next argument of the function that sets it.
            value: Further argument, for "led" and "data".
        """
        setter = choice("set: the item", item, self._setters())
        if item.lower() in ("led", "data"):
            setter(position, value)
        else:
            setter(position)

    def _setters(self) -> Mapping[str | int, Callable[..., None]]:
        return {
            "led": self.setLED,
            "name": self.setName,
            "password": self.setPassword,
            "volume": self.setVolume,
            "startsong": self.setStartSong,
            "whitebalance": self.setWhiteBalance,
            "irpower": self.setIRPower,
            "forwardness": self.setForwardness,
            "data": self.setData,
        }

    def _getters(self) -> Mapping[str | int, Callable[..., object]]:
        return {
            "all": self.getAll,
            "light": self.getLight,
            "ir": self.getIR,
            "line": self.getLine,
            "stall": self.getStall,
            "obstacle": self.getObstacle,
            "bright": self.getBright,
            "blob": self.getBlob,
            "battery": self.getBattery,
            "distance": self.getDistance,
            "name": self.getName,
            "password": self.getPassword,
            "data": self.getData,
            "info": self.getInfo,
            "forwardness": self.getForwardness,
            "volume": self.getVolume,
            "startsong": self.getStartSong,
            "version": self.getVersion,
            "config": self._config,
            "picture": self.takePicture,
        }


def robot_or_none() -> Scribbler | None:
    """Return the robot in use; None before `initialize` and after it was closed."""
    return _in_use


def use(robot: Scribbler | None) -> None:
    """Make Myro's functions use this robot, which programs also know as `robot`."""
    global _in_use
    _in_use = robot
    builtins.robot = robot  # type: ignore[attr-defined]  # as in Myro: programs just say robot.forward()


def set_limit(seconds: float | None) -> None:
    """Limit the time of a program with each robot that it opens from now on [s]; None for no limit."""
    global _limit_s
    _limit_s = seconds


def robot_for(function: str) -> Scribbler:
    """Return the robot in use.

    Raises:
        MyroError: There is none; the text says how to get one.
    """
    if _in_use is None:
        raise MyroError(
            f'{function}() needs a robot, and there is none yet. Call initialize("sim") for a simulated one, or '
            'initialize("/dev/rfcomm0") (on Windows initialize("COM3")) with the port of yours.'
        )
    return _in_use


def now() -> float:
    """Return the time on the robot's clock [s]; on the computer's if there is no robot."""
    return _WALL.now() if _in_use is None else _in_use.now()


def sleep(seconds: float) -> None:
    """Let time pass [s]: a simulated robot moves on meanwhile."""
    if _in_use is None:
        _WALL.sleep(seconds)
    else:
        _in_use.pause(seconds)


def of_robot(method: Callable[Concatenate[Scribbler, P], T]) -> Callable[P, T]:
    """Return Myro's function of the name of a method: it does the same with the robot in use."""
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


def initialize(id: str | int | None = None, **options: Option) -> None:
    """Open a robot, which from now on obeys Myro's functions, and greet.

    Args:
        id: The robot's port ("/dev/rfcomm0", on Windows "COM3"), "sim" for a simulated robot, which a notebook shows
            live, or an emulator's port. Default: ask in the terminal.
        options: Options of "sim", see `simulator`.

    Raises:
        MyroError: The robot cannot be opened; the text says what to try.
    """
    Scribbler(id, **options)


init = initialize


def simulator(id: object = None, **options: Option) -> None:
    """Open a simulated robot: `initialize("sim")`.

    Args:
        id: Taken and ignored, as in Myro.
        options: Options of `initialize("sim?...")`: seed, start, speed, model, fluke, arena, view.
    """
    Scribbler("sim", **options)


def makeRobot(kind: str, port: str | int | None = None) -> Scribbler:
    """Return a robot: `makeRobot("Scribbler", "/dev/rfcomm0")`, or `makeRobot("SimScribbler")` for a simulated one.

    Raises:
        MyroError: It is another kind of robot, or cannot be opened.
    """
    simulated = choice(
        "makeRobot: the kind", kind, {"scribbler": False, "simscribbler": True, "simulator": True}
    )
    return Scribbler("sim" if simulated else port)


def SimScribbler(id: object = None, **options: Option) -> Scribbler:
    """Return a simulated robot as an object: `robot = SimScribbler()`."""
    return Scribbler("sim", **options)


def stop() -> None:
    """Stop both wheels; without a robot nothing happens, as in Myro."""
    robot = robot_or_none()
    if robot is not None:
        robot.stop()


def stop_robot() -> None:
    """Stop the robot, if there is one and it can be reached: for ways out that must not fail."""
    try:
        stop()
    except (RobotError, MyroError, OSError):
        return
