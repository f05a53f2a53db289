"""A target that saves its trials and does not repeat saved ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from realitygap.errors import RecordError
from realitygap.records import ObservationsFile, Observe, TrialRecord, sees
from realitygap.trials import Target, TellTrial, TrialPlan, is_whole

from .._targets import carry_out_missing, observations_head
from .._wrapped_targets import WrappedTarget


class KeptTarget(WrappedTarget):
    """A target with a file of trials and a limit to their number.

    A trial is known by its number: who asks for the same trials in the same order, after whatever interruption, gets
    what is in the file, and the rest is carried out. One that was cut off is kept, too, and carried out again.

    Args:
        target: Target that runs the trials.
        path: File, in an existing folder.
        budget: Number of trials that it allows.
        first_number: Number added to that of each plan, so that parts of a study draw other random numbers.
        observe: Highest observation level; stored as `looks_at`.
    """

    def __init__(
        self, target: Target, path: Path, budget: int, first_number: int, *, observe: Observe
    ) -> None:
        super().__init__(target)
        self.budget = budget
        self.spent = 0
        self.looks_at: Observe = observe
        self._first_number = first_number
        self._file = ObservationsFile(path, observations_head(target, observe), within=path.parent)
        self._kept = {trial.number: trial for trial in self._file.trials if is_whole(trial)}

    def carry_out(
        self, plans: Sequence[TrialPlan], observe: Observe, tell: TellTrial | None = None
    ) -> list[TrialRecord]:
        """As `Target.carry_out`.

        Raises:
            ValueError: More trials than the budget has.
            RecordError: The file has another trial of this number.
            RobotError: A trial was lost for good.
        """
        if self.spent + len(plans) > self.budget:
            raise ValueError(
                f"There are {len(plans)} trials to run after {self.spent}, expected at most {self.budget} in "
                "total."
            )
        self.spent += len(plans)
        numbered = [replace(plan, number=self._first_number + plan.number) for plan in plans]
        for plan in numbered:
            if plan.number in self._kept:  # before anything more is spent
                self._checked(plan, observe)
        keys = [plan.number for plan in numbered]
        carry_out_missing(self.target, numbered, observe, self._kept, keys, file=self._file, tell=tell)
        return [self._checked(plan, observe) for plan in numbered]

    def _checked(self, plan: TrialPlan, observe: Observe) -> TrialRecord:
        """Return the trial of a plan, if it is that."""
        trial = self._kept[plan.number]
        genome = "" if plan.genome is None else plan.genome.to_json()
        enough = sees(trial.observe, observe)
        is_driven_so = genome or (
            trial.commands.shape == np.shape(plan.commands)
            and np.allclose(trial.commands, plan.commands, atol=1e-6)
        )
        if trial.genome != genome or not is_driven_so or not enough:
            what = "another controller or other commands" if enough else f"only {trial.observe} observed"
            raise RecordError(
                f"{self._file.path}: trial {plan.number} there has {what}; nothing was lost. Name another folder."
            )
        return trial

    def close(self) -> None:
        """Close the file. The code that opened the target closes the target."""
        self._file.close()
