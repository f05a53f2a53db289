"""Trials on a target: what can be observed of it, and the file that stores them."""

from __future__ import annotations

from pathlib import Path

from realitygap.errors import StudyError
from realitygap.platforms import DEFAULT_ROBOT, base_robot_of, platform_names, split_spec
from realitygap.records import OBSERVATIONS, Ledger, ObservationsHead, Observe, open_saved_trials, sees
from realitygap.tasks import Task
from realitygap.trials import Target
from realitygap.world import Arena


def observations_head(target: Target, observe: Observe, robot: str | None = None) -> ObservationsHead:
    """Return the head of a file of trials on a target. Default robot: that of its platform."""
    name, _ = split_spec(target.name)
    if robot is None:
        robot = base_robot_of(target.name) if name in platform_names() else DEFAULT_ROBOT
    arena = target.arena.to_dict()
    return ObservationsHead(target.name, target.label, robot, arena, target.step_s, observe, target.identity)


def open_trials(
    path: Path | str,
    target: Target,
    observe: Observe,
    *,
    robot: str | None = None,
    within: Path | None = None,
) -> Ledger:
    """Open the file of a target's trials, or make it.

    Args:
        path: Path of the file.
        target: Target of the trials.
        observe: Observation level of the trials.
        robot: Name or file of the robot. Default: that of the target's platform.
        within: The folder that the user named, if the name of the file in it is not the user's.

    Raises:
        RecordError: It is another file, of another target, damaged, or cannot be written.
    """
    return open_saved_trials(path, observations_head(target, observe, robot), within=within)


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
    "encoders": "Simulated robots and some real ones have encoders.",
    "track": "Use a camera, or the witness of an emulated robot.",
}
