"""A twin opened as a robot, whatever its engine: MuJoCo, or `sim` itself behind the same wall."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import whole_number
from realitygap.robots import Command, Label, VirtualClock
from realitygap.robots.twin import TwinModel, TwinRobot
from realitygap.trials import NoiseKey
from realitygap.world import Arena, Pose

from ..sim._platform import SimPlatform
from ..sim._robot import SimRobot

TWIN_KEY = 0x7477_696E_0000_0000
"""Number added to a twin's seed, so that `sim` draws other numbers under its own name than as a twin."""


class SimTwin(SimRobot):
    """The platform `sim` with its defaults as a twin to which there is no gap.

    Args:
        model: The twin, whose engine is sim.
        arena: Arena of the robot.
        number: Number of the trial, which selects the noise.
    """

    label: Label = "TWIN"

    def __init__(self, model: TwinModel, arena: Arena, *, number: int = 0) -> None:
        self.model = model
        self._number = whole_number("number", number, 0, 2**32 - 1)
        self.clock = VirtualClock()
        super().__init__(SimPlatform(step_s=model.step_s), arena, noise_key=self._key_of(number))
        self._points = [self.pose]

    def _key_of(self, number: int) -> NoiseKey:
        return NoiseKey((TWIN_KEY + self.model.seed) % 2**64, replicate=number)

    @property
    def number(self) -> int:
        """Number of the trial that the next `reset` starts."""
        return self._number

    @number.setter
    def number(self, number: int) -> None:
        self._number = whole_number("number", number, 0, 2**32 - 1)
        self.noise_key = self._key_of(self._number)

    def reset(self, pose: Pose | None = None) -> None:
        """Begin trial `number` at a pose, or at the arena's start."""
        super().reset(pose)
        self._points = [self.pose]

    def drive(self, command: Command) -> None:
        """Run one command for `step_s` of the simulation."""
        super().drive(command)
        self.clock.sleep(self.step_s)
        self._points.append(self.pose)

    def path(self) -> NDArray[np.float64]:
        """Return poses x [m], y [m] and heading [rad] at the start and after each command, (n, 3)."""
        return np.array(self._points)

    @property
    def wheels(self) -> tuple[float, float]:
        """Way of the left and the right wheel since the start of the trial, as its encoders tell it [m]."""
        return self.encoders

    @property
    def battery_v(self) -> float:
        """Not known: `sim` has no battery [V]."""
        return math.nan


def open_twin(model: TwinModel, arena: Arena, *, number: int = 0) -> TwinRobot | SimTwin:
    """Return a twin in an arena, as a robot.

    Args:
        model: The twin.
        arena: Arena of the robot.
        number: Number of the trial, which selects the noise.

    Raises:
        MissingExtraError: MuJoCo is not installed, and the twin's engine is that.
    """
    if model.engine == "sim":
        return SimTwin(model, arena, number=number)
    return TwinRobot(model, arena, number=number)
