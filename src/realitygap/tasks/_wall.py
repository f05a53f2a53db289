"""Wall following: go along the walls with them on one side."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from realitygap.errors import TaskError
from realitygap.kernels.tasks.scores import wall_scores
from realitygap.world import Arena

from ._inputs import Inputs
from ._step_task import StepTask
from ._trajectories import Trajectories

WALL_SIDES = {"left": 1.0, "right": -1.0}
"""The kernels' number for the side on which a robot keeps the wall."""


class WallTask(StepTask):
    """A task that rewards the distance driven along walls that are near and on one side of the robot [m].

    A step counts with its component along the nearest wall or obstacle. The sign is positive if the robot moves with
    the wall on `side`, and negative in the other direction. So going to and fro, or in a circle, adds up to 0.

    Source: ours.
    """

    kind: Literal["wall"] = Field("wall", description="Wall following.")
    inputs: Inputs = ("range.0", "range.1", "bias")
    side: Literal["left", "right"] = Field("right", description="Side of the robot on which the wall is.")
    within: float = Field(
        0.15, gt=0, le=100, description="Largest distance of a near wall from the robot's origin [m]."
    )

    score_name: ClassVar[str] = "distance along walls [m]"
    score_range: ClassVar[tuple[float, float]] = (-math.inf, math.inf)

    def check_arena(self, arena: Arena, drawn: Iterable[str] = ()) -> None:
        """Refuse an arena without walls and obstacles, or one in which they move between trials.

        Args:
            arena: Arena of the trials.
            drawn: Names of the numbers that are drawn for each trial.

        Raises:
            TaskError: The arena has neither walls nor obstacles, or they are drawn.
        """
        moved = [name for name in drawn if name.startswith(("arena.wall.", "arena.obstacle."))]
        if moved:
            raise TaskError(
                f"Task 'wall' needs walls and obstacles at the same place in all trials, but {moved[0]} is drawn. Set "
                "it to a number."
            )
        if not arena.walls and not arena.obstacles:
            raise TaskError(
                f"Task 'wall' needs walls, but arena {arena.name!r} has none. Choose another arena, such as "
                "'wall'."
            )

    def fitness(self, trajectories: Trajectories, arena: Arena) -> NDArray[np.float64]:
        """Return the scores, (n,) [m]. A score is below 0 if the robot kept the wall on the other side.

        Raises:
            TaskError: The arena has neither walls nor obstacles, or they are drawn.
        """
        self.check_arena(arena, trajectories.drawn)
        scores = np.empty(len(trajectories))
        walls, side, within = wall_outlines(arena), WALL_SIDES[self.side], float(self.within)
        wall_scores(trajectories.arrays.poses, walls, side, within, scores)
        return scores


def wall_outlines(arena: Arena) -> NDArray[np.float64]:
    """Return walls and sides of obstacles, round ones in short lines, (w, 4) from the start [m]."""
    walls = [*arena.walls]
    for obstacle in arena.obstacles:
        points = obstacle.outline()
        walls += [(*one, *other) for one, other in zip(points, (*points[1:], points[0]), strict=True)]
    start = (arena.start.x, arena.start.y)
    return np.asarray(np.array(walls, np.float64).reshape(-1, 4) - np.array(start * 2))
