"""Somebody beside a robot that is calibrated: what it senses of itself, and cells that are counted by eye."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import typer

from realitygap.trials import RobotsOwnSenses
from realitygap.world import INCH

from ._operator import pick_cells

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from realitygap.records import Observe
    from realitygap.robots import Clock, Robot
    from realitygap.trials import TrialPlan
    from realitygap.world import Arena, Pose


class TerminalAttendant(RobotsOwnSenses):
    """Counts the cells of trials that are drawn; that the robot stands at its start is asked before."""

    observes: Observe = "cells"

    def __init__(self, arena: Arena) -> None:
        super().__init__()
        self._arena = arena
        self._plan: TrialPlan | None = None

    def meet(self, robot: Robot, arena: Arena) -> Clock:
        """A robot was opened; an S2 tells what its encoders count."""
        self._met(robot)
        self.observes = "encoders" if self.has_encoders else "cells"
        clock: Clock = robot.clock  # type: ignore[attr-defined]  # of a Scribbler
        return clock

    def place(self, plan: TrialPlan, start: Pose) -> None:
        """It stands there."""
        self.begin()
        self._plan = plan

    def look(self) -> None:
        """Nobody sees where it is."""

    def poses(self) -> NDArray[np.float64]:
        """None."""
        return np.empty((0, 3))

    def cells(self) -> tuple[int, ...]:
        """Those that its line crosses, as they are picked in the terminal."""
        from realitygap.study import NO_LINE

        if self._plan is None or self._plan.purpose in NO_LINE:
            return ()
        while True:
            cells = pick_cells(self._arena)
            if cells is not None:
                return tuple(cells)


class PlacingAttendant(TerminalAttendant):
    """Puts the robot at the start of each trial, too, and says so."""

    def place(self, plan: TrialPlan, start: Pose) -> None:
        """Asks for it, and waits."""
        x, y, heading = start.x / INCH, start.y / INCH, math.degrees(start.heading)
        typer.prompt(
            f"Put the robot {x:.1f} in from the left and {y:.1f} in from the lower wall, its front {heading:.0f} "
            "degrees counter-clockwise from the long wall, with a fresh sheet below. Enter",
            default="",
            show_default=False,
            err=True,
        )
        super().place(plan, start)
