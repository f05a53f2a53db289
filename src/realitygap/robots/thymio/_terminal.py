"""Functions of a Thymio for `realitygap robot`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from realitygap.errors import RobotError

from ._ports import find_ports
from ._robot import Thymio

__all__ = ["battery", "find_ports", "info", "open_robot", "sense"]


def open_robot(port: str, record: Path | None) -> Thymio:
    """Connect to a Thymio.

    Raises:
        RobotError: It cannot be reached, or a recording is asked for.
    """
    if record is not None:
        raise RobotError("Sessions with a Thymio cannot be recorded: leave --record out.")
    return Thymio(port)


def info(robot: Thymio) -> dict[str, Any]:
    """Return facts about the robot."""
    return dict(vars(robot.info))


def sense(robot: Thymio) -> dict[str, Any]:
    """Return the raw reading of each sensor, and the speeds and targets of the wheels."""
    return dict(robot.sensors())


def battery(robot: Thymio) -> tuple[str, float]:
    """Return the raw reading of the battery."""
    return "battery_raw", float(robot.battery())
