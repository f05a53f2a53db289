"""Helpers for people who add a robot, and films and photographs drawn by code. No other package here imports them."""

from ._filmed import Film, FilmedCamera, path_through, save_film
from ._platform import PlatformContractError, check_platform
from ._robot import RobotContractError, check_robot
from ._sheet_drawing import Difficulty
from ._sheet_photograph import SheetPhotograph, photograph_sheet
from ._sheet_trials import driven_paths

__all__ = [
    "Difficulty",
    "Film",
    "FilmedCamera",
    "PlatformContractError",
    "RobotContractError",
    "SheetPhotograph",
    "check_platform",
    "check_robot",
    "driven_paths",
    "path_through",
    "photograph_sheet",
    "save_film",
]
