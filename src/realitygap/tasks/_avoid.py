"""Obstacle avoidance: drive fast and straight, and keep away from what is near."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from realitygap.kernels.tasks.scores import avoid_scores
from realitygap.records import Observe
from realitygap.world import Arena

from ._inputs import Inputs
from ._step_task import StepTask
from ._trajectories import Trajectories


class AvoidTask(StepTask):
    """Floreano & Mondada's product V (1 - sqrt(dv)) (1 - i), as its mean over steps, 0 to 1.

    V is the mean of the absolute wheel speeds, and dv is half of the absolute difference of the signed speeds. Both are
    parts of full speed. i is the largest reading of the range sensors after the step. The speeds are the commanded
    ones: left = move - turn, right = move + turn, each within -1 to 1.

    Source: Floreano & Mondada (1994), "Automatic creation of an autonomous agent". Differs: a network by NEAT instead
    of theirs, a mean over steps instead of a sum, and commanded instead of measured speeds.
    """

    kind: Literal["avoid"] = Field("avoid", description="Obstacle avoidance.")
    inputs: Inputs = ("range.0", "range.1", "bias")
    backward: bool = Field(
        True,
        description="Count driving backward like driving forward, as published. Then going to and fro in one place "
        "pays, too. If false, V is the mean of the wheels' speeds, and at least 0.",
    )

    observe: ClassVar[Observe] = "readings"
    score_name: ClassVar[str] = "avoidance score"

    def fitness(self, trajectories: Trajectories, arena: Arena) -> NDArray[np.float64]:
        """Return the scores, (n,): 0 (still, turning on the spot, or pressed to a wall) to 1 (straight in the open)."""
        scores = np.empty(len(trajectories))
        arrays = trajectories.arrays
        ranges = np.array(
            [k for k, name in enumerate(trajectories.sensors) if name.startswith("range.")], np.int64
        )
        avoid_scores(arrays.commands, arrays.readings, ranges, self.backward, scores)
        return scores
