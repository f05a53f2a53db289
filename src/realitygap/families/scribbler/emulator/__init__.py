"""A Scribbler for real client programs, with any simulated robot behind it."""

from ._emulator import Emulator
from ._link import Faults
from ._scene import Scene, open_scene
from ._simulated import SCRIBBLER_BODY, BoxOnWheels, RobotOfItsOwn, SimulatedRobot

__all__ = [
    "SCRIBBLER_BODY",
    "BoxOnWheels",
    "Emulator",
    "Faults",
    "RobotOfItsOwn",
    "Scene",
    "SimulatedRobot",
    "open_scene",
]
