"""Helpers for people who add a robot, and films drawn by code; nothing else in the package imports them."""

from ._filmed import Film, FilmedCamera, path_through, save_film
from ._robot import RobotContractError, check_robot

__all__ = ["Film", "FilmedCamera", "RobotContractError", "check_robot", "path_through", "save_film"]
