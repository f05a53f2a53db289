"""Platforms, whatever can try a controller, and the contract of a robot."""

from ._contract import Command, Label, Observation, Robot, check_command
from ._jyro import STEP_S, JyroPlatform
from ._scribbler_platform import ScribblerPlatform

__all__ = ["STEP_S", "Command", "JyroPlatform", "Label", "Observation", "Robot", "ScribblerPlatform", "check_command"]
