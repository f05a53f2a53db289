"""Myro's joystick and gamepad: a panel below the notebook's cell."""

from __future__ import annotations

from typing import Any

from realitygap.errors import RealityGapError

from ._mistakes import MyroError, notebook_shell
from ._robot import robot_for
from ._view import to_svg

_BEAT_S = 0.1  # between two messages of a panel


def joyStick(showSensors: Any = False) -> None:
    """Show a joystick below the cell: drag it, use the arrow keys, or tick *Gamepad*; let go, and the robot stops.

    The robot also stops if the notebook loses the focus or its page is closed. While a cell runs, the joystick does
    nothing. In Myro it opens a window.

    Args:
        showSensors: Ignored.

    Raises:
        MyroError: There is no robot, no notebook, or anywidget is not installed.
    """
    _show_panel("joyStick")


def Joystick(showSensors: Any = False) -> None:
    """Show a joystick; as `joyStick`."""
    _show_panel("Joystick")


def joystick(showSensors: Any = False) -> None:
    """Show a joystick; as `joyStick`."""
    _show_panel("joystick")


def gamepad(*phrases: Any) -> None:
    """Show a joystick that reads a gamepad after you tick *Gamepad*; as `joyStick`.

    The left stick drives the robot, and each button stops it.

    Args:
        phrases: Ignored.
    """
    _show_panel("gamepad")


def _show_panel(function: str) -> None:
    robot = robot_for(function)
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
