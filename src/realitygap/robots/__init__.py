"""Platforms, which try controllers, and the contract of a robot."""

from . import scribbler, thymio, twin
from ._clock import Clock, SystemClock, VirtualClock
from ._contract import (
    Command,
    Label,
    Observation,
    Robot,
    channels_of,
    check_command,
    check_observation,
    select_channels,
)
from ._families import is_in_this_program, list_ports, open_on, split_port
from ._in_program import ProgramRobot
from ._recorded_robot import RecordedRobot
from ._recording import Recorder, Recording, read_recording
from ._recording_mcap import export_mcap

__all__ = [
    "Clock",
    "Command",
    "Label",
    "Observation",
    "ProgramRobot",
    "RecordedRobot",
    "Recorder",
    "Recording",
    "Robot",
    "SystemClock",
    "VirtualClock",
    "channels_of",
    "check_command",
    "check_observation",
    "export_mcap",
    "is_in_this_program",
    "list_ports",
    "open_on",
    "read_recording",
    "scribbler",
    "select_channels",
    "split_port",
    "thymio",
    "twin",
]
