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
    """Floreano & Mondada's product V (1 - sqrt(dv)) (1 - i), its mean over steps, 0 to 1.

    V is the mean of the wheels' speeds without their signs and dv half of their difference with them, both as parts of
    full speed, and i the largest reading of the range sensors after the step. The wheels' speeds are those asked for:
    left = move - turn, right = move + turn, each within -1 to 1.

    Source: Floreano & Mondada (1994), "Automatic creation of an autonomous agent". Differs: a network with NEAT's
    structure in place of theirs, a mean over steps in place of their sum, and speeds as asked for, not as measured.
    """

    kind: Literal["avoid"] = Field("avoid", description="Obstacle avoidance.")
    inputs: Inputs = ("range.0", "range.1", "bias")
    backward: bool = Field(
        True,
        description="Whether driving backward counts as driving forward does, as published; going to and fro in one "
        "place then pays, too. Without it V is the mean of the wheels' speeds, and at least 0.",
    )

    observe: ClassVar[Observe] = "readings"
    score_name: ClassVar[str] = "avoidance score"

    def fitness(self, trajectories: Trajectories, arena: Arena) -> NDArray[np.float64]:
        """(n,) the product, 0 (still, turning on the spot or pressed to a wall) to 1 (straight on in the open)."""
        scores = np.empty(len(trajectories))
        arrays = trajectories.arrays
        ranges = np.array(
            [k for k, name in enumerate(trajectories.sensors) if name.startswith("range.")], np.int64
        )
        avoid_scores(arrays.commands, arrays.readings, ranges, self.backward, scores)
        return scores
