"""Trials on a target: what can be observed, those that are missing, and those that were lost."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import TypeVar

from realitygap.errors import RobotError, StudyError
from realitygap.platforms import DEFAULT_ROBOT, platform_class, platform_names, split_spec
from realitygap.records import OBSERVATIONS, ObservationsFile, ObservationsHead, Observe, TrialRecord, sees
from realitygap.tasks import Task
from realitygap.trials import Target, TellTrial, TrialPlan, is_taken_back, is_whole, taken_back
from realitygap.world import Arena

Key = TypeVar("Key", bound=Hashable)


def observations_head(target: Target, observe: Observe, robot: str | None = None) -> ObservationsHead:
    """Return the head of a file of trials on a target. Default robot: that of its platform."""
    name, _ = split_spec(target.name)
    if robot is None:
        robot = platform_class(name).base_robot if name in platform_names() else DEFAULT_ROBOT
    arena = target.arena.to_dict()
    return ObservationsHead(target.name, target.label, robot, arena, target.step_s, observe, target.identity)


def refuse_more_than_is_seen(target: Target, observe: Observe) -> None:
    """Raise an error if a target does not support an observation level.

    Raises:
        StudyError: The target does not support it.
    """
    if not sees(target.observes, observe):
        raise StudyError(
            f"observe is {observe!r}, but {target.name} supports at most {target.observes!r}. Choose that, or name a "
            "witness that observes more."
        )


def check_task(task: Task, arena: Arena) -> None:
    """Refuse an arena in which a task cannot be scored, before trials are spent.

    Raises:
        TaskError: It lacks what the task wants, such as a light.
    """
    check = getattr(task, "check_arena", None)
    if check is not None:
        check(arena)


def refuse_too_little(task: Task, target: Target, observe: Observe | None = None) -> Observe:
    """Return how much is observed of a target so that a task can be scored.

    Args:
        task: The task.
        target: Target of the trials.
        observe: Level that the user asked for. If None, the level that the task needs, and the crossed cells if no
            person has to count them.

    Raises:
        StudyError: So much cannot be seen of the target, or the task needs more than was asked for.
    """
    if observe is not None and not sees(observe, task.observe):
        raise StudyError(
            f"--observe is {observe}, but task {task.name!r} is scored by {SEEN_AS[task.observe]}. Use --observe "
            f"{task.observe}."
        )
    if not sees(target.observes, task.observe):
        raise StudyError(
            f"Task {task.name!r} is scored by {SEEN_AS[task.observe]}, but {target.name} supports at most "
            f"{target.observes!r}. {WOULD_SEE[task.observe]}"
        )
    if observe is None:
        are_cells_free = sees(target.observes, "track")
        return max(task.observe, "cells", key=OBSERVATIONS.index) if are_cells_free else task.observe
    refuse_more_than_is_seen(target, observe)
    return observe


SEEN_AS: dict[Observe, str] = {
    "readings": "the robot's own readings",
    "cells": "the cells that it crosses",
    "encoders": "its encoders",
    "track": "its poses",
}
WOULD_SEE: dict[Observe, str] = {
    "readings": "Record new trials.",
    "cells": "Use an operator who counts them, a camera, or the witness of an emulated robot.",
    "encoders": "A Scribbler 2, a real Thymio, and a simulated robot have encoders.",
    "track": "Use a camera, or the witness of an emulated robot.",
}


def refuse_lost(n: int, name: str, kept: str = "") -> None:
    """Raise an error if a trial was lost for good, unless lost trials are skipped.

    Raises:
        RobotError: A trial was lost. The message has the number of lost trials.
    """
    if n:
        lost = f"{n} trials on {name} were" if n > 1 else f"A trial on {name} was"
        raise RobotError(f"{lost} lost, but all are needed.{kept} Run the missing trials.")


def carry_out_missing(
    target: Target,
    plans: Sequence[TrialPlan],
    observe: Observe,
    kept: dict[Key, TrialRecord],
    keys: Sequence[Key],
    *,
    file: ObservationsFile | None = None,
    tell: TellTrial | None = None,
) -> list[TrialRecord]:
    """Return the trials in the order of their plans: stored trials, and the others, which are driven now.

    Args:
        target: Runs the trials that are missing.
        plans: All trials.
        observe: Observation level of the trials.
        kept: Whole trials by key; those that are run are added.
        keys: Key of each plan's trial.
        file: File that gets each trial as it ends, also an interrupted one. The target settles the trials in it that
            never ended.
        tell: Called with the place and the trial, for each whole one that is run.

    Raises:
        RobotError: A trial was lost.
    """

    def keep(k: int, trial: TrialRecord) -> None:
        if file is not None:
            file.append(trial)
        if is_whole(trial):
            kept[keys[k]] = trial
            if tell is not None:
                tell(k, trial)
        elif is_taken_back(trial):
            kept.pop(keys[k], None)

    if file is not None and file.under_way:
        for k, plan in enumerate(plans):
            name = plan.purpose, plan.number, "" if plan.genome is None else plan.genome.to_json()
            if (trial := file.under_way.get(name)) is not None:
                keep(k, target.settle(plan, trial) or taken_back(trial, "void: the program ended in it"))
    missing = [k for k, key in enumerate(keys) if key not in kept]
    if missing:
        target.carry_out([plans[k] for k in missing], observe, lambda i, trial: keep(missing[i], trial))
    where = "" if file is None else f" The others are saved in {file.path}."
    refuse_lost(sum(key not in kept for key in keys), target.name, where)
    return [kept[key] for key in keys]
