"""Platforms, whatever can try a controller, and the contract of a robot."""

from . import scribbler, twin
from ._clock import Clock, SystemClock
from ._contract import Command, Label, Observation, Robot, check_command
from ._in_program import ProgramRobot
from ._jyro import STEP_S, JyroPlatform
from ._recorded_robot import RecordedRobot
from ._recording import Recorder, Recording, read_recording
from ._recording_mcap import export_mcap
from ._scribbler_platform import ScribblerPlatform
from ._sim import ARENA, DEFAULT_ROBOT, NOISE, SimPlatform, as_numbers
from ._twin_platform import TwinPlatform, hash_elsewhere

__all__ = [
    "ARENA",
    "DEFAULT_ROBOT",
    "NOISE",
    "STEP_S",
    "Clock",
    "Command",
    "JyroPlatform",
    "Label",
    "Observation",
    "ProgramRobot",
    "RecordedRobot",
    "Recorder",
    "Recording",
    "Robot",
    "ScribblerPlatform",
    "SimPlatform",
    "SystemClock",
    "TwinPlatform",
    "as_numbers",
    "check_command",
    "export_mcap",
    "hash_elsewhere",
    "read_recording",
    "scribbler",
    "twin",
]
