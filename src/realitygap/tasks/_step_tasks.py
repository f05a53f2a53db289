"""The tasks that score single steps: avoid obstacles, seek light, follow walls, and reach a goal."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from realitygap.errors import TaskError
from realitygap.kernels.tasks.scores import avoid_scores, goal_scores, nearness_scores, wall_scores
from realitygap.records import Observe
from realitygap.settings import Settings
from realitygap.world import Arena, Goal

from ._inputs import Inputs
from ._trajectories import Trajectories


class StepTask(Settings):
    """A task whose score depends on each step of a trial; its attributes are described at `Task`."""

    kind: str

    needs_trace: ClassVar[bool] = True
    observe: ClassVar[Observe] = "track"
    score_name: ClassVar[str]
    score_range: ClassVar[tuple[float, float]] = (0.0, 1.0)

    @property
    def name(self) -> str:
        """Name of the task, the same as `[task] kind`."""
        return self.kind


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
        walls += [(*first, *second) for first, second in zip(points, (*points[1:], points[0]), strict=True)]
    start = (arena.start.x, arena.start.y)
    return np.asarray(np.array(walls, np.float64).reshape(-1, 4) - np.array(start * 2))


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


STEP_TASKS: dict[str, type[StepTask]] = {
    "avoid": AvoidTask,
    "light": LightTask,
    "wall": WallTask,
    "goal": GoalTask,
}
"""The tasks of this file by their kind."""
