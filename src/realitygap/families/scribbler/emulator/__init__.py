"""A Scribbler for real client programs, with any simulated robot behind it."""

from ._emulator import Emulator
from ._faults import Faults
from ._port import make_emulator
from ._scene import Scene, open_scene
from ._simulated import SCRIBBLER_BODY, BoxOnWheels, RobotOfItsOwn, SimulatedRobot
from ._view import LiveView

__all__ = [
    "SCRIBBLER_BODY",
    "BoxOnWheels",
    "Emulator",
    "Faults",
    "LiveView",
    "RobotOfItsOwn",
    "Scene",
    "SimulatedRobot",
    "make_emulator",
    "open_scene",
]
