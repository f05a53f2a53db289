"""Helpers for people who add a robot; nothing else in the package imports them."""

from ._robot import RobotContractError, check_robot

__all__ = ["RobotContractError", "check_robot"]
