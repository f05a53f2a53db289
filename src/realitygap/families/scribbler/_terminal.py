"""Functions of a Scribbler for `realitygap robot`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ._ports import find_ports
from ._robot import Scribbler

__all__ = ["battery", "find_ports", "info", "open_robot", "sense"]


def open_robot(port: str, record: Path | None, watchdog_s: float | None) -> Scribbler:
    """Connect to a Scribbler."""
    return Scribbler(port, record=record, watchdog_s=watchdog_s)


def info(robot: Scribbler) -> dict[str, Any]:
    """Return facts about the robot and its Fluke."""
    found = vars(robot.info) | {"name": robot.name if robot.info.model else None}
    if robot.info.fluke != "none":
        found["ahead"] = robot.forwardness
    return found


def sense(robot: Scribbler) -> dict[str, Any]:
    """Return a reading of each sensor of the robot and its Fluke, without the camera."""
    seen: dict[str, Any] = {}
    if robot.info.model is not None:
        seen |= robot.sensors()._asdict()
    if robot.info.model == "s2":
        seen |= {"distance": robot.distance(), "encoders": robot.encoders()}
    if robot.info.fluke != "none":
        seen |= {"obstacle": robot.obstacle(), "bright": robot.bright(), "battery_v": robot.battery()}
    return seen


def battery(robot: Scribbler) -> tuple[str, float]:
    """Return the battery's voltage [V]."""
    return "battery_v", robot.battery()
