"""Functions of a robot on ROS 2 for `realitygap robot`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ._ports import find_ports
from ._robot import Ros2Robot

__all__ = ["battery", "find_ports", "info", "open_robot", "sense"]


def open_robot(port: str, record: Path | None, watchdog_s: float | None) -> Ros2Robot:
    """Connect to a robot. Its gateway stops it if no command arrives.

    Raises:
        RobotError: It cannot be reached.
    """
    return Ros2Robot(port, record=record)


def info(robot: Ros2Robot) -> dict[str, Any]:
    """Return facts about the robot."""
    return dict(vars(robot.info))


def sense(robot: Ros2Robot) -> dict[str, Any]:
    """Return the newest message of each topic, and the readings that a controller sees."""
    return robot.sensors() | {"readings": robot.observe().readings}


def battery(robot: Ros2Robot) -> tuple[str, float]:
    """Return the battery's voltage [V]."""
    return "battery_v", robot.volts()
