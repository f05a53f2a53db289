"""A robot on a port as a target: an emulated one alone, a physical one with an operator."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from realitygap._closed_on_exit import ClosedOnExit
from realitygap.errors import RobotError
from realitygap.evolution import inputs_of_robot
from realitygap.records import EndReason, Observe, TrialRecord
from realitygap.robots import Clock, Command, Label, Observation, Robot, channels_of, select_channels
from realitygap.world import Arena, Pose

from ._carry_out import carry_out_on_robot
from ._loop import TrialInterrupted
from ._observer import PortObserver
from ._target import TellTrial, TrialPlan, check_plans

OnLost = Literal["retry", "skip", "stop"]
"""Reaction to a trial in which the link was lost: repeat it once, continue with the next one, or stop."""

Pulse = Callable[[bool], None]
"""Called with True when a trial begins and whenever the robot has answered in it, and with False after the trial. There
is no False after a trial in which the link was lost: the robot is silent until it answers again."""

LATE = 0.02
"""Share by which the median duration of commands may exceed the nominal one before it replaces that in the record."""


class PacedRobot(ClosedOnExit):
    """A robot whose commands follow each other in time: what its readings take counts as a part of the command.

    So a command takes effect after its readings, and still lasts `step_s`. If readings take longer than that, commands
    last longer, too.

    Args:
        robot: Robot to pace.
        step_s: Duration of a command [s].
        clock: Clock of the robot.
        pulse: Called when the robot has answered.
    """

    def __init__(self, robot: Any, step_s: float, clock: Clock, pulse: Pulse | None = None) -> None:
        self._robot, self._clock, self._pulse = robot, clock, pulse
        self._robot.step_s = 0.0  # it is waited here
        if hasattr(robot, "lasts_s"):  # its motors stop by themselves after a command
            robot.lasts_s = step_s
        self.label: Label = robot.label
        self.step_s = step_s
        self.n_sensors: int = robot.n_sensors
        self.channels = channels_of(robot)
        self._due = 0.0
        self._lasted: list[float] = []

    def select(self, names: Sequence[str]) -> None:
        """Choose the sensors to read besides range sensors."""
        select_channels(self._robot, names)

    def reset(self, pose: Pose | None = None) -> None:
        """Reset like `Robot.reset`. A robot on a port stays at its place."""
        self._robot.reset()
        self._lasted = []

    def observe(self) -> Observation:
        """Observe like `Robot.observe`. The first observation starts the time."""
        if not self._lasted:
            self._due = self._clock.now()
        seen: Observation = self._robot.observe()
        self._has_answered()
        return seen

    def drive(self, command: Command) -> None:
        """Drive like `Robot.drive`, and return at the end of the command's time, which includes its readings."""
        self._robot.drive(command)
        self._has_answered()
        self._due += self.step_s
        late = self._clock.now() - self._due
        if late < 0:
            self._clock.sleep(-late)
        else:
            self._due += late
        self._lasted.append(self.step_s + max(late, 0.0))

    def _has_answered(self) -> None:
        if self._pulse is not None:
            self._pulse(True)

    @property
    def lasted_s(self) -> float:
        """Median duration of the commands of the trial [s]; `step_s` if durations were recorded."""
        median = float(np.median(self._lasted)) if self._lasted else self.step_s
        return median if median > self.step_s * (1 + LATE) else self.step_s

    @property
    def facts(self) -> dict[str, str]:
        """Facts that the robot reported when it was connected, such as its model and the version of its firmware."""
        facts = getattr(getattr(self._robot, "info", None), "__dict__", {})
        return {
            name: str(value)
            for name, value in facts.items()
            if isinstance(value, str | int) and name not in ("port", "label")
        }

    @property
    def least_battery_v(self) -> float | None:
        """Smallest voltage of its battery [V]; None if the robot has no such limit."""
        return getattr(self._robot, "least_battery_v", None)

    def stop(self) -> None:
        """Stop the motors."""
        self._robot.stop()

    def close(self) -> None:
        """Stop the motors and let go of it."""
        self._robot.close()


class RobotTarget(ClosedOnExit):
    """A robot on a port, and its observer.

    If the link is lost in a trial, its observed part is reported as a trial that ended as LOST, and the link is
    reopened. The motors are always stopped at the end.

    Args:
        open_robot: Function that opens the robot.
        arena: Arena of the trials.
        observer: Observer, who places it and reports what it drew.
        name: Name of the target, as the user gave it.
        step_s: Duration of a command [s].
        on_lost: Reaction to a trial in which the link was lost.
        pulse: Called when a trial begins or ends, and when the robot has answered in it.

    Raises:
        RobotError: The robot cannot be reached, or not observed.
    """

    is_paced = True

    def __init__(
        self,
        open_robot: Callable[[], Robot],
        arena: Arena,
        observer: PortObserver,
        *,
        name: str,
        step_s: float = 0.5,
        on_lost: OnLost = "retry",
        pulse: Pulse | None = None,
    ) -> None:
        self.name, self.arena, self.step_s = name, arena, step_s
        self._open_robot, self._observer, self._on_lost = open_robot, observer, on_lost
        self._pulse = pulse
        self._robot: PacedRobot | None = None
        robot = self._ready()
        self.label: Label = robot.label
        self.n_sensors = robot.n_sensors
        self._inputs = inputs_of_robot(robot.n_sensors, robot.channels)
        self.observes: Observe = observer.observes
        self.identity = observer.identity
        self.robot_facts = robot.facts
        self.least_battery_v = robot.least_battery_v

    def _ready(self) -> PacedRobot:
        """Return the robot, and open it if necessary."""
        if self._robot is None:
            robot = self._open_robot()
            try:
                self._observer.meet(robot, self.arena)
                clock = self._observer.clock(robot)
            except BaseException:
                robot.close()
                raise
            self._robot = PacedRobot(robot, self.step_s, clock, self._pulse)
        return self._robot

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of what networks can see."""
        return self._inputs

    def carry_out(
        self, plans: Sequence[TrialPlan], observe: Observe, tell: TellTrial | None = None
    ) -> list[TrialRecord]:
        """Run trials like `Target.carry_out`. `tell` also gets trials that begin, were driven, or were lost."""
        check_plans(plans, observe, self)
        trials = []
        try:
            for k, plan in enumerate(plans):
                tell_trial = None if tell is None else functools.partial(tell, k)
                trials.append(self._carry_out(plan, observe, tell_trial))
        except BaseException:
            self.close()
            raise
        return trials

    def _carry_out(
        self, plan: TrialPlan, observe: Observe, tell: Callable[[TrialRecord], None] | None
    ) -> TrialRecord:
        """Run one trial, and repeat a lost one if requested."""
        attempts = 2 if self._on_lost == "retry" else 1
        for _ in range(attempts):
            trial = self._try(plan, observe, tell)
            if tell is not None:
                tell(trial)
            if trial.end != EndReason.LOST:
                return trial
            self.close()
        if self._on_lost == "skip":
            return trial
        again = "twice " if attempts > 1 else ""
        raise RobotError(
            f"Trial {plan.number} on {self.name} was lost {again}after {len(trial.commands)} commands: "
            f"{trial.problem} Trials saved in a file are safe. Fix the robot, then run the rest."
        )

    def _try(
        self, plan: TrialPlan, observe: Observe, tell: Callable[[TrialRecord], None] | None
    ) -> TrialRecord:
        robot, start = self._ready(), plan.start or self.arena.start
        self._observer.place(plan, self.arena, observe)
        if tell is not None:
            tell(self._begun(plan, start))
        self._tell_pulse(is_driving=True)
        keep = tell if self._observer.asks else None
        try:
            trial = carry_out_on_robot(robot, plan, observe, self._observer, start, keep)
        except TrialInterrupted as stopped:
            if tell is not None:
                tell(stopped.trial)
            raise
        if trial.end != EndReason.LOST:
            self._tell_pulse(is_driving=False)
        return replace(trial, step_s=robot.lasted_s)

    def _tell_pulse(self, *, is_driving: bool) -> None:
        if self._pulse is not None:
            self._pulse(is_driving)

    def _begun(self, plan: TrialPlan, start: Pose) -> TrialRecord:
        """Return the record of a trial before its robot moves."""
        nothing = np.empty((0, self.n_sensors))
        return TrialRecord(
            start=start,
            step_s=self.step_s,
            commands=np.empty((0, 2)),
            readings=nothing,
            stalled=np.empty(0, np.bool_),
            genome="" if plan.genome is None else plan.genome.to_json(),
            number=plan.number,
            purpose=plan.purpose,
            end=str(EndReason.RUNNING),
        )

    def settle(self, plan: TrialPlan, trial: TrialRecord) -> TrialRecord | None:
        """Settle a trial like `Target.settle`; the observer decides."""
        return self._observer.settle(plan, self.arena, trial)

    def close(self) -> None:
        """Stop the motors and let go of the robot; safe to call twice."""
        if self._robot is not None:
            robot, self._robot = self._robot, None
            with contextlib.suppress(RobotError):
                robot.close()
