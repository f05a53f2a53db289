"""Emulated robots for real client programs: what all families share, such as ports, servers, and witnesses.

Importing this package lets pyserial open ports whose names begin with `emulator://`.
"""

from ._emulated import MILLISECOND, SECOND, EmulatedRobot, nanoseconds
from ._port import EmulatedPort, number_in, open_arena, register
from ._serve import Server, WitnessDoor, serve_pty, serve_tcp
from ._walls import Walls
from ._witness import DirectWitness, Witness, cells_at_times, connect_witness

register()

__all__ = [
    "MILLISECOND",
    "SECOND",
    "DirectWitness",
    "EmulatedPort",
    "EmulatedRobot",
    "Server",
    "Walls",
    "Witness",
    "WitnessDoor",
    "cells_at_times",
    "connect_witness",
    "nanoseconds",
    "number_in",
    "open_arena",
    "serve_pty",
    "serve_tcp",
]
