"""The robot at a port, with the settings of a condition."""

from __future__ import annotations

from realitygap.errors import StudyError
from realitygap.platforms import Platform, names_a_port, split_spec
from realitygap.robots import Robot, is_in_this_program
from realitygap.trials import Operator, WitnessObserver
from realitygap.world import Arena

from ._physical import OpenRobot


def connect_robot(port: str, arena: Arena | None = None) -> OpenRobot:
    """Return what opens the robot at a port, with the settings of a condition's platform.

    Args:
        port: Name of the port, with or without the platform's name before it.
        arena: Start of a robot that is emulated in this program, unless its port gives the start.
    """

    def open_robot(platform: Platform) -> Robot:
        name, rest = split_spec(port)
        if names_a_port(port) and name != platform.name:
            raise StudyError(f"{port} is a port of platform {name!r}, expected one of {platform.name!r}.")
        robot = platform.at_port(rest if names_a_port(port) else port)
        return (robot if arena is None else robot.in_arena(arena)).connect()

    return open_robot


def default_operator(port: str) -> Operator:
    """Return the witness of an emulator in this program.

    Raises:
        StudyError: Another port, whose robot needs a person who places it and scores its trials.
    """
    if is_in_this_program(port):
        return Operator(WitnessObserver())
    raise StudyError(
        f"No operator places the robot at {port} and reports its cells. Run `realitygap drive` to be the "
        "operator; realitygap.trials.Operator(WitnessObserver(witness)) serves an emulator elsewhere."
    )
