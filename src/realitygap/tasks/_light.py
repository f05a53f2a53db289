"""Light seeking: be near a light, and get there without being blocked."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from realitygap.errors import TaskError
from realitygap.kernels.tasks.scores import nearness_scores
from realitygap.world import Arena

from ._inputs import Inputs
from ._step_task import StepTask
from ._trajectories import Trajectories


class LightTask(StepTask):
    """A task that rewards the mean nearness to the nearest light, reduced by the time spent blocked, 0 to 1.

    The score of a step is 1 - d / d0, at least 0. d is the distance to the nearest light, and d0 is that at the start.
    The score of a trial is the mean over steps, times the share of steps that were not blocked.

    Source: light seeking and obstacle avoidance are the tasks of Jakobi, Husbands & Harvey (1995), "Noise and the
    reality gap". Differs: they evolve the two tasks separately, by formulas that were not available; this one is ours.
    """

    kind: Literal["light"] = Field("light", description="Light seeking.")
    inputs: Inputs = ("light.0", "light.1", "bias")

    score_name: ClassVar[str] = "light-seeking score"

    def check_arena(self, arena: Arena) -> None:
        """Refuse an arena in which nothing can be sought.

        Raises:
            TaskError: The arena has no light, or one at the start.
        """
        if not arena.lights:
            raise TaskError(
                f"Task 'light' needs a light, but arena {arena.name!r} has none. Choose another arena, such as "
                "'light', or put a [[light]] into its file."
            )
        if any((light.x, light.y) == (arena.start.x, arena.start.y) for light in arena.lights):
            raise TaskError(
                f"A light of arena {arena.name!r} is where trials start, expected one to be sought. Move the start or "
                "the light."
            )

    def fitness(self, trajectories: Trajectories, arena: Arena) -> NDArray[np.float64]:
        """Return the scores, (n,), 0 to 1.

        Raises:
            TaskError: The arena has no light, or one at the start.
        """
        self.check_arena(arena)
        places = np.empty((len(trajectories), len(arena.lights), 2))
        for k, light in enumerate(arena.lights):
            places[:, k, 0] = trajectories.number(f"arena.light.{k}.x", light.x) - arena.start.x
            places[:, k, 1] = trajectories.number(f"arena.light.{k}.y", light.y) - arena.start.y
        scores = np.empty(len(trajectories))
        nearness_scores(trajectories.arrays.poses, trajectories.arrays.stalled, places, scores)
        return scores
