"""Reach a goal: in a maze, however the walls lead."""

from __future__ import annotations

import math
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from realitygap.errors import TaskError
from realitygap.kernels.tasks.scores import goal_scores
from realitygap.world import Arena, Goal

from ._inputs import Inputs
from ._step_task import StepTask
from ._trajectories import Trajectories


class GoalTask(StepTask):
    """A task that rewards the distance to the goal covered by the end: 1 - d / d0, or 1 if it was reached.

    d is the straight distance from the goal at the end, and d0 is that at the start; walls do not count. The goal is
    reached if the robot is nearer than the goal's radius at the start or the end of any step. With `selection =
    "novelty"` and the distance `final`, the same trials are rewarded for ending at new positions.

    Source: Lehman & Stanley (2011), section 4. Differs: a part of the first distance, and 1 once it was reached.
    """

    kind: Literal["goal"] = Field("goal", description="Reaching a goal.")
    inputs: Inputs = (
        "range.0",
        "range.1",
        "goal_sector.0",
        "goal_sector.1",
        "goal_sector.2",
        "goal_sector.3",
        "bias",
    )

    score_name: ClassVar[str] = "share of the distance to the goal"
    score_range: ClassVar[tuple[float, float]] = (-math.inf, 1.0)

    def check_arena(self, arena: Arena) -> Goal:
        """Return the arena's goal.

        Raises:
            TaskError: The arena has no goal, or it is where trials start.
        """
        if arena.goal is None:
            raise TaskError(
                f"Task 'goal' needs a goal, but arena {arena.name!r} has none. Choose another arena, such as "
                "'goal', or put a [goal] into its file."
            )
        if np.hypot(arena.goal.x - arena.start.x, arena.goal.y - arena.start.y) <= arena.goal.radius:
            raise TaskError(
                f"Trials in arena {arena.name!r} start at its goal, expected one to be reached. Move the start."
            )
        return arena.goal

    def fitness(self, trajectories: Trajectories, arena: Arena) -> NDArray[np.float64]:
        """Return the scores, (n,), at most 1; below 0 if the robot ended farther away than it began.

        Raises:
            TaskError: The arena has no goal, or it is where trials start.
        """
        goal = self.check_arena(arena)
        x, y, radii = (
            trajectories.number(f"arena.goal.{name}", getattr(goal, name)) for name in ("x", "y", "radius")
        )
        goals = np.stack([x - arena.start.x, y - arena.start.y], axis=1)
        scores = np.empty(len(trajectories))
        goal_scores(trajectories.arrays.poses, goals, radii, scores)
        return scores
