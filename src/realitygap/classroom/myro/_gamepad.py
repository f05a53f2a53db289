"""Gamepads of the computer that runs the program, and joysticks: panels below the cell of a notebook.

Source: `getGamepad` and `getGamepadNow` of Myro 2.9.9 (myro/__init__.py), and the joystick interface of Linux
(Documentation/input/joydev/joystick-api.rst of the kernel). Differs: Myro reads gamepads by pygame; here no other
package is needed.
"""

from __future__ import annotations

import contextlib
import os
import struct
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from realitygap.errors import RealityGapError

from . import _robot
from ._mistakes import MyroError, choice, notebook_shell, number
from ._view import to_svg

_FOLDER = Path("/dev/input")

_EVENT = struct.Struct("=IhBB")  # time [ms], value, type, number
_BUTTON, _AXIS = 0x01, 0x02
_MOST = 32767  # of an axis
_HATS = range(0x10, 0x18)  # codes of axes that are hats, across and up in turn

_GET_NAME, _GET_AXES = 0x80806A13, 0x80406A32  # ioctl requests: a name of 128 bytes, the codes of 64 axes

_ITEMS = ("init", "name", "axis", "ball", "button", "hat")
_ALL_ITEMS = {item: item for item in (*_ITEMS, "robot", "count")}


class Gamepad:
    """A gamepad that is open; its readings are those after the last event.

    Args:
        path: The device.

    Raises:
        MyroError: It cannot be opened.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise MyroError(
                f"The gamepad {path} cannot be opened: {error.strerror}. Try another one, or ask for the right to read "
                "it."
            ) from error
        self.name = (
            _ask_device(self._file, _GET_NAME, 128).partition(b"\0")[0].decode("utf-8", "replace")
            or path.name
        )
        self._codes = _ask_device(self._file, _GET_AXES, 64)
        self._axes: dict[int, int] = {}
        self._buttons: dict[int, int] = {}

    def update(self) -> None:
        """Read all waiting events. The first ones, right after opening, name all axes and buttons.

        Raises:
            MyroError: The gamepad is gone.
        """
        while True:
            try:
                data = os.read(self._file, 64 * _EVENT.size)
            except BlockingIOError:
                return
            except OSError as error:
                self.close()
                raise MyroError(f"The gamepad {self.name} is gone. Connect it again.") from error
            for _, value, kind, place in _EVENT.iter_unpack(data):
                if kind & _AXIS:
                    self._axes[place] = value
                elif kind & _BUTTON:
                    self._buttons[place] = value
            if len(data) < 64 * _EVENT.size:
                return

    def close(self) -> None:
        """Let go of the device; the next call of a function opens it again."""
        _opened.pop(self.path, None)
        with contextlib.suppress(OSError):
            os.close(self._file)

    def item(self, name: str) -> Any:
        """Return what Myro calls by this name."""
        if name == "init":
            return True
        if name == "name":
            return self.name
        if name == "axis":
            return [value / _MOST for place, value in sorted(self._axes.items()) if not self._is_hat(place)]
        if name == "button":
            return [value for _, value in sorted(self._buttons.items())]
        if name == "hat":
            ends = [
                round(value / _MOST) for place, value in sorted(self._axes.items()) if self._is_hat(place)
            ]
            return [(across, -down) for across, down in zip(ends[::2], ends[1::2], strict=False)]
        if name == "robot":
            across, down = [*self.item("axis"), 0.0, 0.0][:2]
            return [-down, -across]
        return []  # balls: this interface has none

    def _is_hat(self, place: int) -> bool:
        return place < len(self._codes) and self._codes[place] in _HATS


_opened: dict[Path, Gamepad] = {}


def _ask_device(file: int, request: int, size: int) -> bytes:
    """Return the answer of a device; nothing if it has none."""
    try:
        import fcntl
    except ImportError:  # Windows has no such devices
        return b""
    answer = bytearray(size)
    try:
        fcntl.ioctl(file, request, answer)
    except OSError:
        return b""
    return bytes(answer)


def _paths() -> list[Path]:
    """Return the gamepads of this computer, the first one first."""
    paths = [path for path in _FOLDER.glob("js*") if path.name[2:].isdecimal()]
    return sorted(paths, key=lambda path: int(path.name[2:]))


def _gamepad(index: int) -> Gamepad:
    paths = _paths()
    if not 0 <= index < len(paths):
        there = f"there are {len(paths)}" if paths else f"there is none in {_FOLDER}"
        raise MyroError(
            f"There is no gamepad {index}: {there}. Connect one to this computer, which must run Linux. In a notebook, "
            "gamepad() reads one that is connected to the computer of the browser."
        )
    path = paths[index]
    if path not in _opened:
        _opened[path] = Gamepad(path)
    return _opened[path]


def getGamepadNow(*what: Any) -> Any:
    """Return the readings of a gamepad as they are.

    Args:
        what: Items: "axis" (each -1 to 1), "button" (each 0 or 1), "hat" (pairs of -1, 0, or 1), "robot" (speed and
            turn of its first stick, for `move`), "name", "init", "ball", or "count" (the number of gamepads). Without
            items, all of a gamepad. A number before them chooses the gamepad, from 0; a list of them several.

    Returns:
        The value of one item, or a dictionary of several; for a list of gamepads, pairs of number and readings.

    Raises:
        MyroError: There is no such gamepad or item, or it cannot be read.
    """
    return _now("getGamepadNow", what)


def getGamepad(*what: Any, wait: float = 0.05) -> Any:
    """Wait until the readings of a gamepad change, and return the new ones, once for each change.

    A robot that moves keeps moving meanwhile. "count" is returned immediately.

    Args:
        what: Items, as in `getGamepadNow`. With "any" among the items, a button counts as 1 if it was pressed or
            released.
        wait: Time between two looks [s].

    Raises:
        MyroError: There is no such gamepad or item, or it cannot be read.
    """
    seconds = number("getGamepad: wait", wait, 0.001)
    items = tuple(item for item in what if item != "any")
    before = _now("getGamepad", items)
    if "count" in items:
        return before
    after = before
    while after == before:
        _let_time_pass(seconds)
        after = _now("getGamepad", items)
    return _either(after, before) if len(items) < len(what) else after


def _let_time_pass(seconds: float) -> None:
    """Wait for a person, and let a simulated robot, whose time is not the wall's, move on meanwhile."""
    robot = _robot.robot_or_none()
    if robot is not None and robot.simulation is not None and not robot.simulation.is_timed:
        robot.pause(seconds)
    time.sleep(seconds)


def _now(function: str, what: Sequence[Any]) -> Any:
    if what and isinstance(what[0], (list, tuple)):
        return [(index, _now(function, (index, *what[1:]))) for index in what[0]]
    index = 0
    if what and isinstance(what[0], int):
        index, what = what[0], what[1:]
    items = [choice(f"{function}: the item", item, _ALL_ITEMS) for item in what] or list(_ITEMS)
    readings: dict[str, Any] = {}
    of_device = [item for item in items if item != "count"]
    if of_device:
        gamepad = _gamepad(index)
        gamepad.update()
        readings = {item: gamepad.item(item) for item in of_device}
    if "count" in items:
        readings["count"] = len(_paths())
    return next(iter(readings.values())) if len(readings) == 1 else readings


def _either(after: Any, before: Any) -> Any:
    """Return the readings after a change, with 1 for buttons that were pressed before or are now."""
    if isinstance(after, dict):
        return {name: _either(value, before[name]) for name, value in after.items()}
    if isinstance(after, (list, tuple)):
        return type(after)(_either(*pair) for pair in zip(after, before, strict=True))
    return after or before if isinstance(after, int) else after


_BEAT_S = 0.1  # between two messages of a panel


def joyStick(showSensors: object = False) -> None:
    """Show a joystick below the cell: drag it, use the arrow keys, or tick *Gamepad*; let go, and the robot stops.

    The robot also stops if the notebook loses the focus or its page is closed. While a cell runs, the joystick does
    nothing. In Myro it opens a window.

    Args:
        showSensors: Ignored.

    Raises:
        MyroError: There is no robot, no notebook, or anywidget is not installed.
    """
    _show_panel("joyStick")


def Joystick(showSensors: object = False) -> None:
    """Show a joystick; as `joyStick`."""
    _show_panel("Joystick")


def joystick(showSensors: object = False) -> None:
    """Show a joystick; as `joyStick`."""
    _show_panel("joystick")


def gamepad(*phrases: object) -> None:
    """Show a joystick that reads a gamepad after you tick *Gamepad*; as `joyStick`.

    The left stick drives the robot, and each button stops it.

    Args:
        phrases: Ignored.
    """
    _show_panel("gamepad")


def _show_panel(function: str) -> None:
    robot = _robot.robot_for(function)
    if notebook_shell() is None:
        raise MyroError(
            f"{function}() needs a notebook, such as JupyterLab. Elsewhere, drive on the page Robot of `realitygap "
            "lab`."
        )
    from realitygap.classroom import DrivePanel  # takes time that most programs can do without

    simulation = robot.simulation

    def drive(ahead: float, turn: float) -> None:
        robot.move(ahead, turn)
        if simulation is not None and not simulation.is_timed:
            robot.pause(_BEAT_S)

    picture = None if simulation is None else lambda: to_svg(simulation)
    try:
        panel = DrivePanel(drive, robot.stop, title=robot.getName(), picture=picture)
    except RealityGapError as error:
        raise MyroError(str(error)) from error
    from IPython.display import display

    display(panel)
