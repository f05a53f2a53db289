"""One trial on anything that meets the contract of a robot, observed as far as somebody looks."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from realitygap.errors import RobotError
from realitygap.records import Observe, ObservedTrial, sees
from realitygap.robots import Command, Robot, check_command
from realitygap.world import Pose

from ._ending import EndReason
from ._loop import Controller, DrivenTrial, TrialInterrupted, controller_of, replaying, run_trial
from ._observer import Observer
from ._target import TrialPlan


class TrialStopped(KeyboardInterrupt):
    """The program is being stopped in the middle of a trial; the motors are stopped as far as the wire allows.

    Attributes:
        trial: What was seen of it up to there.
    """

    def __init__(self, trial: ObservedTrial) -> None:
        super().__init__("the program was stopped in the middle of a trial")
        self.trial = trial


@dataclass
class _Looks:
    """What an observer sees of a trial while it runs."""

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
    robot: Robot, plan: TrialPlan, observe: Observe, observer: Observer, start: Pose
) -> tuple[ObservedTrial, str]:
    """Carry out one trial on a robot, and keep what is to be observed and nothing more.

    A controller sees and answers what its interface names. The motors are stopped on every way out.

    Args:
        robot: Connected. A simulated one is put at the start, a physical one has been put there.
        plan: What to do.
        observe: How much to look at.
        observer: Who looks.
        start: Where the robot is put.

    Returns:
        The trial, and what went wrong with it. A robot that fails, or an observer, ends it as LOST: then it has what
        was seen whole.

    Raises:
        ValueError: Commands that no robot takes.
        TrialStopped: In place of a KeyboardInterrupt or SystemExit, which is its cause.

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
        raise TrialStopped(_kept(plan, start, robot, error.driven, looks)) from error
    trial = _kept(plan, start, robot, driven, looks)
    try:
        return _with_what_is_seen(trial, observe, observer), driven.problem
    except RobotError as error:
        return replace(trial, end=str(EndReason.LOST)), driven.problem or str(error)
    except (KeyboardInterrupt, SystemExit) as error:  # while somebody is asked for cells
        raise TrialStopped(replace(trial, end=str(EndReason.INTERRUPTED))) from error


def _controller(plan: TrialPlan) -> tuple[Controller, int]:
    """Return what drives the robot, and for how many steps."""
    if plan.genome is None:
        commands = [check_command(Command(*map(float, row))) for row in plan.commands]
        return replaying(commands), len(commands)
    return controller_of(plan.genome.network(), plan.genome.interface, plan.steps), plan.steps


def _kept(plan: TrialPlan, start: Pose, robot: Robot, driven: DrivenTrial, looks: _Looks) -> ObservedTrial:
    """Return a trial as far as the robot itself reported it: only commands whose end was seen, too."""
    steps = driven.steps[: max(looks.n - 1, 0)]
    t = len(steps)
    return ObservedTrial(
        start=(start.x, start.y, start.heading),
        step_s=robot.step_s,
        commands=np.array([(step.move, step.turn) for step in steps], np.float64).reshape(t, 2),
        readings=np.array([step.readings for step in steps]).reshape(t, robot.n_sensors),
        stalled=np.array([step.stalled for step in steps], np.bool_),
        cells=(),
        wheels=np.array(looks.wheels[: t + 1], np.float64).reshape(-1, 2),
        genome="" if plan.genome is None else plan.genome.to_json(),
        number=plan.number,
        purpose=plan.purpose,
        battery_v=looks.battery_v,
        end=str(driven.end),
        last_readings=np.array([] if driven.last is None else driven.last.readings, np.float64),
        last_stalled=driven.last is not None and driven.last.stalled,
    )


def _with_what_is_seen(trial: ObservedTrial, observe: Observe, observer: Observer) -> ObservedTrial:
    """A trial with what the observer saw of it."""
    poses = observer.poses()[: len(trial.commands) + 1] if observe == "track" else np.empty((0, 3))
    cells = observer.cells() if sees(observe, "cells") else ()
    return replace(trial, cells=tuple(sorted(set(cells))), poses=poses)
