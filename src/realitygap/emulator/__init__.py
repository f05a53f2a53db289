"""Emulated robots for real client programs: what all families share, such as ports, servers, and witnesses.

Importing this package lets pyserial open ports whose names begin with `emulator://`.
"""

from ._arena import open_arena
from ._client import run_client
from ._emulated import EmulatedRobot
from ._port import EmulatedPort, number_in, register
from ._serve import PtyChannel, Server, TcpChannel, WitnessDoor, serve_pty, serve_tcp
from ._time import MILLISECOND, SECOND, nanoseconds
from ._witness import Witness, cells_at_times, connect_witness

register()

__all__ = [
    "MILLISECOND",
    "SECOND",
    "EmulatedPort",
    "EmulatedRobot",
    "PtyChannel",
    "Server",
    "TcpChannel",
    "Witness",
    "WitnessDoor",
    "cells_at_times",
    "connect_witness",
    "nanoseconds",
    "number_in",
    "open_arena",
    "run_client",
    "serve_pty",
    "serve_tcp",
]
