"""The record of one trial on any platform."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Observe = Literal["readings", "cells", "encoders", "track"]
"""How much is seen of a robot: commands, readings and stall; crossed cells, too; its encoders, too; its poses, too."""

OBSERVATIONS: tuple[Observe, ...] = ("readings", "cells", "encoders", "track")
"""From the least to the most: each has all that those before it have."""

CALIBRATES: tuple[Observe, ...] = OBSERVATIONS[1:]
"""As much as a calibration needs: from readings alone nothing is told of where a robot drove."""


UNDER_WAY = ("running", "driven")
"""Ends of records of trials that go on: the robot drives, or a person has yet to say what they saw of it."""


def sees(observe: Observe, least: Observe) -> bool:
    """Return whether an observation has as much as another, the least that is wanted."""
    return OBSERVATIONS.index(observe) >= OBSERVATIONS.index(least)


@dataclass(frozen=True)
class TrialRecord:
    """A trial of t commands; row k of what is sensed is from before command k.

    Attributes:
        start: (3,) where the robot was put: x [m], y [m], heading [rad]; zeros where only its study knows.
        step_s: Duration of a command [s].
        commands: (t, 2) move and turn, -1..1.
        readings: (t, s) of each range sensor, 0..1.
        stalled: (t,) bool.
        cells: Crossed cells of the arena's grid, ascending: of a pen's line the order is not known. Empty where
            nobody counted.
        wheels: (t + 1, 2) way of the left and the right wheel since the start, by encoders [m]; no rows where
            encoders are not observed.
        poses: (t + 1, 3) x [m], y [m], heading [rad]; no rows where no camera looks.
        genome: The controller as JSON text; empty where commands were given one by one.
        number: Of the trial on its platform: with which noise it ran.
        purpose: What it was driven for, such as controller, path, sensors, motion, contact.
        battery_v: At its start [V]; nan where it is not known.
        end: Why it ended, as `EndReason` has it.
        end_pose: Where it stood at its end by a ruler: x [m], y [m], heading [rad] with all full turns from that of
            the start on; None where nobody measured.
        last_readings: (s,) of each range sensor after the last command; no entries where nobody looked.
        last_stalled: Whether the last command was blocked; False where nobody looked.
        times: Since the trial began [s], of each look at the sensors, so (t + 1,) if the robot looked after the last
            command, otherwise (t,). No entries for a simulation, in which they follow from `step_s`.
        raw: Readings at these times in the robot's own units, a row each; no rows for a simulation.
        problem: Message about the end; empty after the last step.
    """

    start: tuple[float, float, float]
    step_s: float
    commands: NDArray[np.float64]
    readings: NDArray[np.float64]
    stalled: NDArray[np.bool_]
    cells: tuple[int, ...] = ()
    wheels: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    poses: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))
    genome: str = ""
    number: int = 0
    purpose: str = "controller"
    battery_v: float = float("nan")
    end: str = "step limit"
    end_pose: tuple[float, float, float] | None = None
    last_readings: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    last_stalled: bool = False
    times: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    raw: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 0)))
    problem: str = ""

    def __repr__(self) -> str:
        steps = f"{len(self.commands)} steps of {self.step_s:g} s"
        return f"{type(self).__name__}({self.number}, {self.purpose}, {steps}, observed: {self.observe})"

    @property
    def n_stalls(self) -> int:
        """Number of steps that began with the robot blocked."""
        return int(self.stalled.sum())

    @property
    def observe(self) -> Observe:
        """Observation level: cells if it has neither wheels nor poses, counted or not."""
        if len(self.poses):
            return "track"
        return "encoders" if len(self.wheels) else "cells"
