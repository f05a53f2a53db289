"""Targets that wrap targets: they store trials, guide an operator, or measure with a ruler."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from realitygap._closing import ClosedOnExit
from realitygap.calibration import ruled
from realitygap.errors import StudyError
from realitygap.records import ObservationsFile, Observe, TrialRecord
from realitygap.trials import EndReason, Operator, Target, TrialPlan, is_taken_back, is_whole, taken_back

from ._targets import carry_out_missing

Tell = Callable[[int, TrialRecord], None]

PATH = "path"
"""Purpose of trials whose end is measured with a ruler if there is no camera."""


class StoppedByPerson(Exception):  # noqa: N818 - nothing is wrong
    """The operator stopped; recorded trials are saved."""


class WrappedTarget(ClosedOnExit):
    """A target that passes everything on."""

    def __init__(self, target: Target) -> None:
        self.target = target
        self.name, self.label, self.arena = target.name, target.label, target.arena
        self.identity = target.identity
        self.step_s, self.n_sensors, self.observes = target.step_s, target.n_sensors, target.observes
        self.is_paced, self.inputs = target.is_paced, target.inputs

    def carry_out(
        self, plans: Sequence[TrialPlan], observe: Observe, tell: Tell | None = None
    ) -> list[TrialRecord]:
        """Run trials like `Target.carry_out`."""
        return self.target.carry_out(plans, observe, tell)

    def settle(self, plan: TrialPlan, trial: TrialRecord) -> TrialRecord | None:
        """Settle a trial like `Target.settle`."""
        return self.target.settle(plan, trial)

    def close(self) -> None:
        """Let go of the platform."""
        self.target.close()


class CountingTarget(WrappedTarget):
    """A target that reports the number of finished trials after each trial.

    Args:
        target: Target that runs the trials.
        n: Total number of trials.
        count: Called with the number of finished trials, and n.
    """

    def __init__(self, target: Target, n: int, count: Callable[[int, int], None] | None) -> None:
        super().__init__(target)
        self._n, self._count, self._done = n, count, 0

    def carry_out(
        self, plans: Sequence[TrialPlan], observe: Observe, tell: Tell | None = None
    ) -> list[TrialRecord]:
        """Run trials like `Target.carry_out`."""

        def one_more(k: int, trial: TrialRecord) -> None:
            if is_whole(trial):
                self._done += 1
                if self._count is not None:
                    self._count(min(self._done, self._n), self._n)
            if tell is not None:
                tell(k, trial)

        return self.target.carry_out(plans, observe, one_more)


class RuledTarget(WrappedTarget):
    """A target whose ends of paths are read with a ruler if the observation level is below a camera's."""

    def carry_out(
        self, plans: Sequence[TrialPlan], observe: Observe, tell: Tell | None = None
    ) -> list[TrialRecord]:
        """Run trials like `Target.carry_out`."""
        if observe == "track" or not any(plan.purpose == PATH for plan in plans):
            return self.target.carry_out(plans, observe, tell)
        if self.target.observes != "track":
            raise StudyError(
                f"Nobody can measure where paths of {self.name} end. Name the emulator's witness (--witness "
                "HOST:PORT), or be led through at a terminal."
            )

        trials = []
        for k, plan in enumerate(plans):
            is_path = plan.purpose == PATH
            begun = functools.partial(
                _tell_begun, tell, k
            )  # and no more: a ruler sees less than is observed here
            (trial,) = self.target.carry_out([plan], "track" if is_path else observe, begun)
            trials.append(ruled(trial).seen_as(observe) if is_path else trial)
            if tell is not None:
                tell(k, trials[-1])
        return trials


class OperatedTarget(WrappedTarget):
    """A person puts the robot at each start, and measures what no camera sees."""

    def __init__(self, target: Target, operator: Operator) -> None:
        super().__init__(target)
        self._operator = operator

    def carry_out(
        self, plans: Sequence[TrialPlan], observe: Observe, tell: Tell | None = None
    ) -> list[TrialRecord]:
        """Run trials as `Target.carry_out`. A withdrawn trial is reported, and again after its repetition.

        Raises:
            StoppedByPerson: What was told of is all that was recorded.
        """
        trials: dict[int, TrialRecord] = {}
        k = 0
        while k < len(plans):
            answer = self._operator.lead(plans[k], k, len(plans))
            if answer == "stop":
                raise StoppedByPerson
            if answer == "redo":
                k = max(k - 1, 0)
                if k in trials and tell is not None:  # in case of a stop before it is driven again
                    tell(k, taken_back(trials.pop(k)))
                continue
            (trial,) = self.target.carry_out([plans[k]], observe, functools.partial(_tell_driven, tell, k))
            measured = self._operator.measure(plans[k], trial)
            if measured is None:
                if tell is not None:
                    tell(k, taken_back(trial))
                continue
            trials[k] = measured
            if tell is not None:
                tell(k, measured)
            k += 1
        return [trials[k] for k in range(len(plans))]

    def settle(self, plan: TrialPlan, trial: TrialRecord) -> TrialRecord | None:
        """Settle a trial like `Target.settle`. A trial that counts is measured now."""
        driven = self.target.settle(plan, trial)
        return None if driven is None else self._operator.measure(plan, driven)


def _tell_begun(tell: Tell | None, k: int, _: int, trial: TrialRecord) -> None:
    """Tell that trial k begins."""
    if tell is not None and trial.end == EndReason.RUNNING:
        tell(k, trial)


def _tell_driven(tell: Tell | None, k: int, _: int, trial: TrialRecord) -> None:
    """Tell of trial k before a person measures it: a whole one is driven, so far."""
    if tell is not None:
        tell(k, replace(trial, end=str(EndReason.DRIVEN)) if is_whole(trial) else trial)


class ResumableTarget(WrappedTarget):
    """A target that saves each trial and does not repeat those in its file.

    If a plan has several trials, the last one counts.
    """

    def __init__(self, target: Target, file: ObservationsFile) -> None:
        super().__init__(target)
        self._file = file
        self.trials: dict[tuple[object, ...], TrialRecord] = {}
        for trial in file.trials:
            if is_whole(trial):
                self.trials[_what(trial)] = trial
            elif is_taken_back(trial):
                self.trials.pop(_what(trial), None)

    def carry_out(
        self, plans: Sequence[TrialPlan], observe: Observe, tell: Tell | None = None
    ) -> list[TrialRecord]:
        """Run trials like `Target.carry_out`."""
        wanted = [_what_of(plan, self.arena.start) for plan in plans]
        if tell is not None:
            for k, what in enumerate(wanted):
                if what in self.trials:
                    tell(k, self.trials[what])
        return carry_out_missing(self.target, plans, observe, self.trials, wanted, file=self._file, tell=tell)


def _what(trial: TrialRecord) -> tuple[object, ...]:
    """Return the identity of a plan's trial."""
    start = tuple(round(value, 6) for value in trial.start)
    driven = trial.genome or trial.commands.tobytes()
    return trial.purpose, trial.number, start, driven


def _what_of(plan: TrialPlan, start: tuple[float, float, float]) -> tuple[object, ...]:
    begins = tuple(round(float(value), 6) for value in plan.start or start)
    driven = np.asarray(plan.commands, np.float64).tobytes() if plan.genome is None else plan.genome.to_json()
    return plan.purpose, plan.number, begins, driven
