"""A target that saves its trials, does not repeat saved ones, and leads its operator through the others."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from realitygap._closed_on_exit import ClosedOnExit
from realitygap.calibration import ruled
from realitygap.errors import RecordError, RobotError, StudyError
from realitygap.records import (
    EndReason,
    Ledger,
    Observe,
    TrialRecord,
    is_taken_back,
    is_whole,
    sees,
    taken_back,
    those_that_count,
)
from realitygap.trials import Operator, Target, TellTrial, TrialPlan
from realitygap.world import Arena

PATH = "path"
"""Purpose of trials whose end is measured with a ruler if there is no camera."""

Key = tuple[str, int, tuple[float, ...], str | bytes]
"""Identity of a trial: purpose, number, start, and controller or commands."""


class StoppedByPerson(Exception):  # noqa: N818 - nothing is wrong
    """The operator stopped; recorded trials are saved."""


class KeptTarget(ClosedOnExit):
    """A target that saves its trials, and does not repeat saved ones.

    Code that requests the same trials again, after whatever interruption, gets saved ones from the file, and the others
    are run. A trial that was under way when the program ended is settled by the target and the operator.

    Args:
        target: Target that runs the trials. It stays open when this one is closed.
        file: File of the trials, which is closed with this target. None if they are not saved.
        operator: Person who puts the robot at each start, and measures what no camera sees. None if the target places
            itself.
        budget: Maximum number of trials. None for no limit.
        first_number: Number added to that of each plan, so that parts of a study draw other random numbers.
        is_exclusive: True to refuse a file in which a number belongs to another controller or other commands, or to a
            trial of which less was observed. Otherwise such a trial is run.
    """

    def __init__(
        self,
        target: Target,
        file: Ledger | None = None,
        *,
        operator: Operator | None = None,
        budget: int | None = None,
        first_number: int = 0,
        is_exclusive: bool = False,
    ) -> None:
        self.target = target
        self.name, self.label, self.arena = target.name, target.label, target.arena
        self.identity = target.identity
        self.step_s, self.n_sensors, self.observes = target.step_s, target.n_sensors, target.observes
        self.is_paced, self.inputs = target.is_paced, target.inputs
        self.budget, self.spent = budget, 0
        self._file, self._operator = file, operator
        self._first_number, self._is_exclusive = first_number, is_exclusive
        self._saved: dict[Key, TrialRecord] = {}
        self._under_way: dict[tuple[str, int, str], TrialRecord] = {}
        if file is not None:
            self._read(file)
        self._by_number = {trial.number: trial for trial in self._saved.values()}

    def carry_out(
        self, plans: Sequence[TrialPlan], observe: Observe, tell: TellTrial | None = None
    ) -> list[TrialRecord]:
        """Run trials like `Target.carry_out`. `tell` gets each whole trial, those that were saved before first.

        Raises:
            ValueError: More trials than the budget has.
            RecordError: The file has another trial of this number, or cannot be written.
            RobotError: A trial was lost, or the robot failed; saved trials are safe.
            StoppedByPerson: The operator stopped; saved trials are safe.
        """
        if self.budget is not None and self.spent + len(plans) > self.budget:
            raise ValueError(
                f"There are {len(plans)} trials to run after {self.spent}, expected at most {self.budget} in "
                "total."
            )
        self.spent += len(plans)
        numbered = [replace(plan, number=self._first_number + plan.number) for plan in plans]
        if self._is_exclusive:
            for plan in numbered:  # before anything more is spent
                self._refuse_other(plan, observe)
        keys = [_key_of_plan(plan, self.arena) for plan in numbered]

        def save(k: int, trial: TrialRecord) -> None:
            if self._file is not None:
                self._file.append(trial)
            if is_whole(trial):
                self._saved[keys[k]] = trial
                if tell is not None:
                    tell(k, trial)
            elif is_taken_back(trial):
                self._saved.pop(keys[k], None)

        if tell is not None:
            for k, key in enumerate(keys):
                if key in self._saved:
                    tell(k, self._saved[key])
        for k, plan in enumerate(numbered):
            name = plan.purpose, plan.number, _genome_of(plan)
            if (trial := self._under_way.pop(name, None)) is not None:
                save(k, self.settle(plan, trial) or taken_back(trial, "the program ended in it"))
        missing = [k for k, key in enumerate(keys) if key not in self._saved]
        if missing:
            self._drive([numbered[k] for k in missing], observe, lambda i, trial: save(missing[i], trial))
        if (
            self._file is not None and self._file.has_changed()
        ):  # a person has scored or voided trials meanwhile
            self._read(self._file)
        self._refuse_lost(sum(key not in self._saved for key in keys))
        return [self._saved[key] for key in keys]

    def read_again(self) -> None:
        """Take note of what was scored or declared void in the file meanwhile."""
        if self._file is not None:
            self._read(self._file)

    def _read(self, file: Ledger) -> None:
        """Take note of the trials that count, and of those that were under way."""
        observations = file.observations()
        self._saved = {_key_of_trial(trial): trial for trial in those_that_count(observations.trials)}
        self._under_way = {
            (trial.purpose, trial.number, trial.genome): trial for trial in observations.under_way
        }

    def settle(self, plan: TrialPlan, trial: TrialRecord) -> TrialRecord | None:
        """Settle a trial like `Target.settle`. If an operator measures trials, one that counts is measured now."""
        driven = self.target.settle(plan, trial)
        return driven if driven is None or self._operator is None else self._operator.measure(plan, driven)

    def close(self) -> None:
        """Close the file. The code that opened the target closes the target."""
        if self._file is not None:
            self._file.close()

    def _drive(self, plans: Sequence[TrialPlan], observe: Observe, tell: TellTrial) -> None:
        if self._operator is not None:
            _drive_with_operator(self.target, self._operator, plans, observe, tell)
        elif observe != "track" and any(plan.purpose == PATH for plan in plans):
            _drive_with_ruler(self.target, plans, observe, tell)
        else:
            self.target.carry_out(plans, observe, tell)

    def _refuse_other(self, plan: TrialPlan, observe: Observe) -> None:
        trial = self._by_number.get(plan.number)
        if trial is None:
            return
        is_enough = sees(trial.observe, observe)
        if _driven_by(trial) != _driver_of(plan) or not is_enough:
            what = "another controller or other commands" if is_enough else f"only {trial.observe} observed"
            where = "" if self._file is None else f"{self._file.path}: "
            raise RecordError(
                f"{where}trial {plan.number} there has {what}; nothing was lost. Name another file or folder."
            )

    def _refuse_lost(self, n: int) -> None:
        if n:
            lost = f"{n} trials on {self.name} were" if n > 1 else f"A trial on {self.name} was"
            where = "" if self._file is None else f" The others are saved in {self._file.path}."
            raise RobotError(f"{lost} lost, but all are needed.{where} Run the missing trials.")


def _drive_with_operator(
    target: Target, operator: Operator, plans: Sequence[TrialPlan], observe: Observe, tell: TellTrial
) -> None:
    """Run trials that a person prepares and measures. A withdrawn trial is reported, and again after its repetition.

    Raises:
        StoppedByPerson: The person stopped.
    """
    trials: dict[int, TrialRecord] = {}
    k = 0
    while k < len(plans):
        answer = operator.lead(plans[k], k, len(plans))
        if answer == "stop":
            raise StoppedByPerson
        if answer == "redo":
            k = max(k - 1, 0)
            if k in trials:  # in case of a stop before it is driven again
                tell(k, taken_back(trials.pop(k)))
            continue
        (trial,) = target.carry_out([plans[k]], observe, functools.partial(_tell_driven, tell, k))
        measured = operator.measure(plans[k], trial)
        if measured is None:
            tell(k, taken_back(trial))
            continue
        trials[k] = measured
        tell(k, measured)
        k += 1


def _drive_with_ruler(target: Target, plans: Sequence[TrialPlan], observe: Observe, tell: TellTrial) -> None:
    """Run trials, and read the ends of paths with a ruler, because less than their poses is observed.

    Raises:
        StudyError: Nobody can measure them.
    """
    if target.observes != "track":
        raise StudyError(
            f"Nobody can measure where paths of {target.name} end. Name the emulator's witness (--witness "
            "HOST:PORT), or be led through at a terminal."
        )
    for k, plan in enumerate(plans):
        is_path = plan.purpose == PATH
        begun = functools.partial(
            _tell_begun, tell, k
        )  # and no more: a ruler sees less than is observed here
        (trial,) = target.carry_out([plan], "track" if is_path else observe, begun)
        tell(k, ruled(trial).seen_as(observe) if is_path else trial)


def _tell_begun(tell: TellTrial, k: int, _: int, trial: TrialRecord) -> None:
    """Tell that trial k begins."""
    if trial.end == EndReason.RUNNING:
        tell(k, trial)


def _tell_driven(tell: TellTrial, k: int, _: int, trial: TrialRecord) -> None:
    """Tell of trial k before a person measures it: a whole one is driven, so far."""
    tell(k, replace(trial, end=str(EndReason.DRIVEN)) if is_whole(trial) else trial)


def _key_of_trial(trial: TrialRecord) -> Key:
    return trial.purpose, trial.number, _rounded(trial.start), _driven_by(trial)


def _key_of_plan(plan: TrialPlan, arena: Arena) -> Key:
    return plan.purpose, plan.number, _rounded(plan.start or arena.start), _driver_of(plan)


def _rounded(start: Sequence[float]) -> tuple[float, ...]:
    return tuple(round(float(value), 6) for value in start)


def _driven_by(trial: TrialRecord) -> str | bytes:
    return trial.genome or trial.commands.tobytes()


def _driver_of(plan: TrialPlan) -> str | bytes:
    return _genome_of(plan) or np.asarray(plan.commands, np.float64).tobytes()


def _genome_of(plan: TrialPlan) -> str:
    return "" if plan.genome is None else plan.genome.to_json()
