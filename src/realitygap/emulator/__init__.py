"""Robots for real client programs: a Scribbler with any simulated robot behind it, and the playground's Thymio.

Importing this package lets pyserial open ports such as `emulator://s2?fluke=2&seed=1&speed=off` and
`emulator://playground?speed=8`.
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
from .thymio._playground import LACKS, Playground, why_not
from .thymio._port import open_playground
from .thymio._serve import PlaygroundServer

register()

__all__ = [
    "LACKS",
    "SCRIBBLER_BODY",
    "BoxOnWheels",
    "Emulator",
    "Faults",
    "LiveView",
    "Playground",
    "PlaygroundServer",
    "PtyChannel",
    "RobotOfItsOwn",
    "Scene",
    "Server",
    "SimulatedRobot",
    "TcpChannel",
    "Witness",
    "connect_witness",
    "make_emulator",
    "open_playground",
    "open_scene",
    "run_client",
    "serve_pty",
    "serve_tcp",
    "why_not",
]
