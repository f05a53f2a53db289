"""The record of one trial on any platform."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

Observe = Literal["readings", "cells", "encoders", "track"]
"""Observation level of a trial. Each level adds data: commands, readings, and stall; crossed cells; encoders; poses."""

OBSERVATIONS: tuple[Observe, ...] = ("readings", "cells", "encoders", "track")
"""Observation levels in ascending order. Each includes those before it."""

CALIBRATES: tuple[Observe, ...] = OBSERVATIONS[1:]
"""Levels that a calibration can use. Readings alone contain no information about the robot's position."""


NO_LINE = ("path", "sensors")
"""Purposes of trials of which no cells are counted: the first ends where a ruler says, the second stands."""


def sees(observe: Observe, least: Observe) -> bool:
    """Return whether an observation has as much as another, the least that is wanted."""
    return OBSERVATIONS.index(observe) >= OBSERVATIONS.index(least)


@dataclass(frozen=True)
class TrialRecord:
    """A trial of t commands; row k of what is sensed is from before command k.

    Attributes:
        start: (3,) start of the robot: x [m], y [m], heading [rad]; zeros if only its study has it.
        step_s: Duration of a command [s].
        commands: (t, 2) move and turn, -1..1.
        readings: (t, s) reading of each range sensor, 0..1.
        stalled: (t,) bool.
        cells: Crossed cells of the arena's grid, ascending, because a pen's line does not show their order. Empty if
            not counted.
        wheels: (t + 1, 2) distance of the left and the right wheel since the start, by encoders [m]; no rows if not
            observed.
        poses: (t + 1, 3) x [m], y [m], heading [rad]; no rows without a camera.
        genome: Controller as JSON text; empty if commands were given.
        number: Number of the trial on its platform, which selects its noise.
        purpose: Purpose, such as controller, path, sensors, motion, contact.
        battery_v: Battery voltage at its start [V]; nan if unknown.
        end: Why it ended, as `EndReason` has it.
        end_pose: Final pose, measured by a ruler: x [m], y [m], heading [rad], which includes all full turns from the
            start; None if not measured.
        last_readings: (s,) reading of each range sensor after the last command; no entries if not observed.
        last_stalled: True if the last command was blocked; False if not observed.
        times: Time of each look at the sensors since the start [s]. It has (t + 1,) entries if the robot looked after
            the last command, otherwise (t,). A simulation has no entries, because times follow from `step_s`.
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

    def seen_as(self, observe: Observe) -> Self:
        """Return the trial with no more than is to be observed."""
        poses = self.poses if observe == "track" else np.empty((0, 3))
        wheels = self.wheels if sees(observe, "encoders") else np.empty((0, 2))
        return replace(self, poses=poses, wheels=wheels, cells=self.cells if sees(observe, "cells") else ())

    @property
    def observe(self) -> Observe:
        """Observation level: cells if it has neither wheels nor poses, counted or not."""
        if len(self.poses):
            return "track"
        return "encoders" if len(self.wheels) else "cells"
