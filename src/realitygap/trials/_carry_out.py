"""One trial on anything with the interface of a robot, observed at the level requested."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from realitygap.errors import RobotError
from realitygap.records import EndReason, Observe, TrialRecord, sees
from realitygap.robots import Command, Robot, check_command
from realitygap.world import Pose

from ._loop import Controller, TrialInterrupted, controller_of, replaying, run_trial
from ._observer import Observer
from ._target import TrialPlan


@dataclass
class _Looks:
    """The observations of a trial while it runs."""

    observer: Observer
    observe: Observe
    battery_v: float = float("nan")
    wheels: list[tuple[float, float]] = field(default_factory=list)
    n: int = 0

    def look(self, step: int) -> None:
        """Look once more, before a command or after the last."""
        if sees(self.observe, "encoders") and (wheels := self.observer.wheels()) is not None:
            self.wheels.append(wheels)
        if self.observe == "track":
            self.observer.look()
        self.n += 1

    def begin(self) -> None:
        """Read the battery, once the robot was reset."""
        self.battery_v = self.observer.battery_v()


def carry_out_on_robot(
    robot: Robot,
    plan: TrialPlan,
    observe: Observe,
    observer: Observer,
    start: Pose,
    keep: Callable[[TrialRecord], None] | None = None,
) -> TrialRecord:
    """Run one trial on a robot, and record only the requested observations.

    A controller sees and answers what its interface names. The motors are stopped on every way out.

    Args:
        robot: Connected. A simulated one is put at the start, a physical one has been put there.
        plan: Plan of the trial.
        observe: Observation level.
        observer: Observer of the robot.
        start: Start of the robot.
        keep: Function that gets the trial after the robot has driven it, before the observer is asked for a report.
            None if a trial without the report is of no use.

    Returns:
        The trial. If the robot or the observer fails, it ends as LOST and has its completely observed part.

    Raises:
        ValueError: Commands that no robot takes.
        TrialInterrupted: In place of a KeyboardInterrupt or SystemExit, which is its cause.

    Source: Rosenzweig & Remy, sections 2.1 to 2.3.
    """
    controller, n_steps = _controller(plan)
    looks = _Looks(observer, observe)
    try:
        driven = run_trial(
            robot,
            controller,
            n_steps,
            start=start,
            begin=looks.begin,
            look=looks.look,
            sees_end=plan.sees_end,
            channels=() if plan.genome is None else plan.genome.interface.channels,
        )
    except TrialInterrupted as error:
        error.trial = _kept(plan, robot, error.trial, looks)
        raise
    trial = _kept(plan, robot, driven, looks)
    try:
        if keep is not None and sees(observe, "cells") and trial.end == EndReason.STEP_LIMIT:
            keep(replace(trial, end=str(EndReason.DRIVEN)))
        return _with_what_is_seen(trial, observe, observer)
    except RobotError as error:
        return replace(trial, end=str(EndReason.LOST), problem=trial.problem or str(error))
    except (KeyboardInterrupt, SystemExit) as error:  # while a person is asked for cells
        end = EndReason.INTERRUPTED if keep is None else EndReason.DRIVEN
        raise TrialInterrupted(replace(trial, end=str(end))) from error


def _controller(plan: TrialPlan) -> tuple[Controller, int]:
    """Return what drives the robot, and for how many steps."""
    if plan.genome is None:
        commands = [check_command(Command(*map(float, row))) for row in plan.commands]
        return replaying(commands), len(commands)
    return controller_of(plan.genome.network(), plan.genome.interface, plan.steps), plan.steps


def _kept(plan: TrialPlan, robot: Robot, driven: TrialRecord, looks: _Looks) -> TrialRecord:
    """Return the part of a trial that the robot itself reported: only commands whose end was observed."""
    t = min(len(driven.commands), max(looks.n - 1, 0))
    n = t + len(driven.times) - len(driven.commands)
    is_simulated = robot.label in ("SIM", "TWIN")
    return replace(
        driven,
        commands=driven.commands[:t],
        readings=driven.readings[:t],
        stalled=driven.stalled[:t],
        wheels=np.array(looks.wheels[: t + 1], np.float64).reshape(-1, 2),
        genome="" if plan.genome is None else plan.genome.to_json(),
        number=plan.number,
        purpose=plan.purpose,
        battery_v=looks.battery_v,
        times=np.empty(0) if is_simulated else driven.times[:n],
        raw=np.empty((0, 0)) if is_simulated else driven.raw[:n],
    )


def _with_what_is_seen(trial: TrialRecord, observe: Observe, observer: Observer) -> TrialRecord:
    """Return a trial with what the observer saw of it."""
    poses = observer.poses()[: len(trial.commands) + 1] if observe == "track" else np.empty((0, 3))
    cells = observer.cells() if sees(observe, "cells") else ()
    return replace(trial, cells=tuple(sorted(set(cells))), poses=poses)
