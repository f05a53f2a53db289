"""The robot at a port, with the settings of a condition."""

from __future__ import annotations

from importlib import import_module

from realitygap.errors import StudyError
from realitygap.robots import Robot, ScribblerPlatform
from realitygap.robots.scribbler import is_in_this_program
from realitygap.trials import Operator, WitnessOperator

from ._physical import OpenRobot

WATCHDOG_S = 1.0
"""After so long a silence of the controlling loop the driver stops the motors [s]."""


def connect_robot(port: str) -> OpenRobot:
    """What opens the robot at a port."""

    def open_robot(platform: ScribblerPlatform) -> Robot:
        from realitygap.robots.scribbler import Scribbler

        if is_in_this_program(port):
            import_module("realitygap.emulator")  # which tells pyserial of such ports
        robot = Scribbler(
            port,
            step_s=platform.wait_s,
            reading_max=platform.reading_max,
            watchdog_s=WATCHDOG_S,
        )
        try:
            if robot.info.fluke != "none":
                robot.set_forwardness(platform.forwardness)
                robot.set_ir_power(platform.ir_power)
        except BaseException:
            robot.close()
            raise
        return robot

    return open_robot


def default_operator(port: str) -> Operator:
    """The witness of an emulator in this program.

    Raises:
        StudyError: Some other port: somebody has to place that robot and look at what it drew.
    """
    if is_in_this_program(port):
        return WitnessOperator()
    raise StudyError(
        f"Who places the robot at {port} and says what it drew? Give an operator: `realitygap run` leads a person "
        "through it, and realitygap.trials.WitnessOperator(witness) serves an emulator elsewhere."
    )
