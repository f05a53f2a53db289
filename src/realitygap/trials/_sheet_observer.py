"""The observer of a robot that draws on a sheet: a person, who counts the cells that the line crosses."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from realitygap.records import EndReason, Observe, Score, TrialRecord
from realitygap.robots import Robot
from realitygap.world import Arena

from ._own_senses import OwnSenses
from ._target import TrialPlan

PickCells = Callable[[Arena], Sequence[int] | None]
"""Has a person say which cells a line crosses; None asks again."""

Settle = Callable[[str, bool], Literal["void", "driven"]]
"""A function that asks a person about a trial that was cut off. It gets the reason and whether the trial can count."""


class SheetObserver(OwnSenses):
    """A person counts the cells of each trial that is drawn; an S2 reports its encoders.

    Args:
        pick: Asks the person.
        without_line: Purposes of trials that draw no line.
        stand: Function that has the robot put at the start of a trial; None if that was asked before.
        settle: Function that asks about a trial that was running when the program ended; if None, the trial is void.
    """

    who = "person"
    asks = True
    observes: Observe = "cells"

    def __init__(
        self,
        pick: PickCells,
        without_line: Container[str] = (),
        stand: Callable[[TrialPlan, Arena, Observe], None] | None = None,
        settle: Settle | None = None,
    ) -> None:
        super().__init__()
        self._pick, self._without_line, self._stand, self._settle = pick, without_line, stand, settle
        self._plan: TrialPlan | None = None

    def meet(self, robot: Robot, arena: Arena | None = None) -> None:
        """Take note of whether it has encoders."""
        self._met(robot)
        self.observes = "encoders" if self.has_encoders else "cells"

    def ready(self) -> None:
        """Do nothing, because a person has put it there."""

    def place(self, plan: TrialPlan, arena: Arena, observe: Observe) -> None:
        """Have it put there."""
        if self._stand is not None:
            self._stand(plan, arena, observe)
        self.begin()
        self._plan, self._arena = plan, arena

    def look(self) -> None:
        """Do nothing, because the robot's pose is unknown."""

    def poses(self) -> NDArray[np.float64]:
        """Return no poses."""
        return np.empty((0, 3))

    def cells(self) -> tuple[int, ...]:
        """Return the cells that its line crosses."""
        while self._plan is not None and self._plan.purpose not in self._without_line:
            cells = self._pick(self._arena)
            if cells is not None:
                return tuple(cells)
        return ()

    def score(self, arena: Arena) -> Score | None:
        """Return None, because a person looks at the sheet later."""
        return None

    def settle(self, plan: TrialPlan, arena: Arena, trial: TrialRecord) -> TrialRecord | None:
        """Return the trial with its cells, if its robot had driven and the person counts it; None: it is void."""
        has_driven = trial.end == EndReason.DRIVEN
        what = f"The program ended in trial {trial.number} ({trial.purpose})"
        message = (
            f"{what}, which was driven, before you said what you saw."
            if has_driven
            else f"{what}: it is driven again."
        )
        if self._settle is None or self._settle(message, has_driven) == "void" or not has_driven:
            return None
        self._plan, self._arena = plan, arena
        cells = tuple(sorted(set(trial.cells or self.cells())))
        return replace(trial, end=str(EndReason.STEP_LIMIT), cells=cells)
