"""The robot at a port, with the settings of a condition."""

from __future__ import annotations

from realitygap.errors import StudyError
from realitygap.robots.scribbler import is_in_this_program
from realitygap.trials import Operator, WitnessObserver

from ._physical import OpenRobot


def connect_robot(port: str) -> OpenRobot:
    """Return what opens the robot at a port, with the settings of a condition's platform."""
    return lambda platform: platform.at_port(port).connect()


def default_operator(port: str) -> Operator:
    """The witness of an emulator in this program.

    Raises:
        StudyError: Some other port: somebody has to place that robot and look at what it drew.
    """
    if is_in_this_program(port):
        return Operator(WitnessObserver())
    raise StudyError(
        f"Who places the robot at {port} and says what it drew? Give an operator: `realitygap drive` leads a person "
        "through it, and realitygap.trials.Operator(WitnessObserver(witness)) serves an emulator elsewhere."
    )
