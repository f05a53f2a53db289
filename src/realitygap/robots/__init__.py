"""Platforms, whatever can try a controller, and the contract of a robot."""

from ._clock import Clock, SystemClock
from ._contract import Command, Label, Observation, Robot, check_command
from ._jyro import STEP_S, JyroPlatform

__all__ = [
    "STEP_S",
    "Clock",
    "Command",
    "JyroPlatform",
    "Label",
    "Observation",
    "Robot",
    "SystemClock",
    "check_command",
]
