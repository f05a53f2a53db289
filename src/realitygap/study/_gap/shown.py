"""Trials of one controller on both platforms, to be shown in motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from realitygap.errors import RealityGapError
from realitygap.platforms import SimTarget, base_robot_of
from realitygap.playback import MovingTrial, RobotShape
from realitygap.records import TrialRecord
from realitygap.trials import Target, TrialPlan
from realitygap.world import load_robot

from .study import MOST_TRIALS, TARGET_FROM, GapStudy, ShownTrials

MOST_SHOWN = 10
"""Maximum number of trials on each platform."""


def with_shown(
    gap: GapStudy, source: Target, target: Target, *, controller: int | None = None, steps: int
) -> GapStudy:
    """Return a gap with trials of one controller to show in motion, if the poses of the robot are known.

    Trials without poses are computed again if the platform computes them. A robot does not drive again.

    Args:
        gap: The gap.
        source, target: Its platforms.
        controller: Index of the controller. Default: the one with the highest score in simulation.
        steps: Commands in each trial.
    """
    k = int(np.argmax(gap.source.means)) if controller is None else controller
    if isinstance(source, SimTarget) and source.step_s != gap.step_s:
        source = source.lasting(gap.step_s)
    sides = ((source, gap.source_trials, 0), (target, gap.target_trials, TARGET_FROM))
    try:
        records = [_with_poses(gap, k, *side, steps) for side in sides]
    except RealityGapError:  # the result does not depend on it
        return gap
    if not all(records):
        return gap
    shapes = [_shape_of(platform) for platform, *_ in sides]
    known = next((shape for shape in shapes if shape is not None), RobotShape((), (), ()))
    moving = [
        tuple(_moving(platform, shape or known, record) for record in some)
        for (platform, *_), shape, some in zip(sides, shapes, records, strict=True)
    ]
    return replace(gap, shown=ShownTrials(k, *moving))


def _with_poses(
    gap: GapStudy, k: int, platform: Target, trials: Sequence[TrialRecord], first: int, steps: int
) -> Sequence[TrialRecord]:
    """Return trials of controller k with poses; none if they are unknown."""
    n = len(trials) // len(gap.controllers)
    some = trials[n * k : n * (k + 1)][:MOST_SHOWN]
    if all(len(trial.poses) for trial in some):
        return some
    if platform.label not in ("SIM", "TWIN") or platform.observes != "track":
        return ()
    genome = gap.controllers[k].genome
    plans = [
        TrialPlan(
            genome=genome, steps=steps, number=first + MOST_TRIALS * k + j, sees_end=gap.task.needs_trace
        )
        for j in range(len(some))
    ]
    return platform.carry_out(plans, "track")


def _shape_of(platform: Target) -> RobotShape | None:
    """Return the shape of a platform's robot; None if it is unknown."""
    if isinstance(platform, SimTarget):
        return RobotShape.of(platform.platform)
    try:
        return RobotShape.of(load_robot(base_robot_of(platform.name)))
    except RealityGapError:
        return None


def _moving(platform: Target, shape: RobotShape, record: TrialRecord) -> MovingTrial:
    """Return a trial without rays, because the readings of some robots are no distances."""
    rays = np.full((len(record.poses), len(shape.mounts)), np.nan)
    stalled = np.zeros(len(record.poses), np.bool_)
    stalled[: len(record.stalled)] = record.stalled[: len(stalled)]
    return MovingTrial.of_rows(
        platform.name, platform.label, platform.arena, shape, record.step_s, record.poses, rays, stalled
    )
