"""Functions of a Thymio for `realitygap robot`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ._ports import find_ports
from ._robot import Thymio

__all__ = ["battery", "find_ports", "info", "open_robot", "sense"]


def open_robot(port: str, record: Path | None, watchdog_s: float | None) -> Thymio:
    """Connect to a Thymio. Its program on board stops it if no command arrives.

    Raises:
        RobotError: It cannot be reached.
    """
    return Thymio(port, record=record)


def info(robot: Thymio) -> dict[str, Any]:
    """Return facts about the robot."""
    return dict(vars(robot.info))


def sense(robot: Thymio) -> dict[str, Any]:
    """Return the raw reading of each sensor, and the speeds and targets of the wheels."""
    return dict(robot.sensors())


def battery(robot: Thymio) -> tuple[str, float]:
    """Return the raw reading of the battery."""
    return "battery_raw", float(robot.battery())
