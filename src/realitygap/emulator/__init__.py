"""A Scribbler for real client programs: bytes in front, any simulated robot behind.

Importing this package lets pyserial open ports such as `emulator://s2?fluke=2&seed=1&speed=off`.
"""

from ._emulator import Emulator
from ._faults import Faults
from ._port import EmulatedPort, EmulatorClock, register
from ._scene import Scene
from ._scene_file import open_scene
from ._serve import Server, serve_pty, serve_tcp
from ._simulated import SCRIBBLER_BODY, BoxOnWheels, RobotOfItsOwn, SimulatedRobot
from ._witness import DirectWitness, RemoteWitness, Witness, connect_witness

register()

__all__ = [
    "SCRIBBLER_BODY",
    "BoxOnWheels",
    "DirectWitness",
    "EmulatedPort",
    "Emulator",
    "EmulatorClock",
    "Faults",
    "RemoteWitness",
    "RobotOfItsOwn",
    "Scene",
    "Server",
    "SimulatedRobot",
    "Witness",
    "connect_witness",
    "open_scene",
    "serve_pty",
    "serve_tcp",
]
