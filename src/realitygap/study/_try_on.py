"""Repeated trials of one controller on a target, which can be stored as they end."""

from __future__ import annotations

from pathlib import Path

from realitygap.errors import RecordError
from realitygap.evolution import Genome
from realitygap.records import ObservationsFile, Observe, TrialRecord
from realitygap.trials import Target, TrialPlan, is_whole

from ._targets import carry_out_missing, observations_head, refuse_more_than_is_seen


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
    file = None if out is None else ObservationsFile(out, observations_head(target, observe))
    done = {} if file is None else {trial.number: trial for trial in file.trials if is_whole(trial)}
    if any(trial.genome != genome.to_json() for trial in done.values()):
        raise RecordError(f"{out} has trials of another controller. Name another file.")
    plans = [TrialPlan(genome=genome, steps=steps, number=k) for k in range(trials)]
    return carry_out_missing(target, plans, observe, done, range(trials), file=file)
