"""Repeated trials of one controller on a target, which can be stored as they end."""

from __future__ import annotations

from pathlib import Path

from realitygap.evolution import Genome
from realitygap.records import Observe, TrialRecord
from realitygap.trials import Target, TrialPlan

from ._kept_target import KeptTarget
from ._targets import open_trials, refuse_more_than_is_seen


def try_on(
    target: Target,
    genome: Genome,
    *,
    trials: int = 1,
    steps: int = 100,
    observe: Observe = "cells",
    out: str | Path | None = None,
) -> list[TrialRecord]:
    """Drive a controller on a target.

    Args:
        target: Target of the trials.
        genome: The controller.
        trials: Number of trials. Trial k has the number k.
        steps: Commands in each.
        observe: Observation level of the trials.
        out: File for the trials, as they end. Trials in it are not driven again.

    Raises:
        StudyError: So much cannot be seen of it.
        RecordError: The file is of another controller or target, or cannot be written.
        RobotError: The robot failed; what is in the file is safe.
    """
    refuse_more_than_is_seen(target, observe)
    plans = [TrialPlan(genome=genome, steps=steps, number=k) for k in range(trials)]
    file = None if out is None else open_trials(out, target, observe)
    with KeptTarget(target, file, is_exclusive=True) as kept:
        return kept.carry_out(plans, observe)
