"""A Scribbler for real client programs: bytes in front, any simulated robot behind.

Importing this package lets pyserial open ports such as `emulator://s2?fluke=2&seed=1&speed=off`.
"""

from ._client import run_client
from ._emulator import Emulator
from ._faults import Faults
from ._port import make_emulator, register
from ._scene import Scene
from ._scene_file import open_scene
from ._serve import PtyChannel, Server, TcpChannel, serve_pty, serve_tcp
from ._simulated import SCRIBBLER_BODY, BoxOnWheels, RobotOfItsOwn, SimulatedRobot
from ._view import LiveView
from ._witness import Witness, connect_witness

register()

__all__ = [
    "SCRIBBLER_BODY",
    "BoxOnWheels",
    "Emulator",
    "Faults",
    "LiveView",
    "PtyChannel",
    "RobotOfItsOwn",
    "Scene",
    "Server",
    "SimulatedRobot",
    "TcpChannel",
    "Witness",
    "connect_witness",
    "make_emulator",
    "open_scene",
    "run_client",
    "serve_pty",
    "serve_tcp",
]
