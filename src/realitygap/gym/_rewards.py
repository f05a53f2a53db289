"""Rewards of single steps, which add up to the task's fitness of the trial."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import TaskError
from realitygap.kernels.tasks.scores import avoid_scores, wall_scores
from realitygap.platforms import Array, Fleet
from realitygap.tasks import WALL_SIDES, AvoidTask, CoverageTask, GoalTask, LightTask, WallTask, wall_outlines
from realitygap.trials import maze_exit


class Reward(Protocol):
    """Rewards of n robots for one task."""

    def start(self, fleet: Fleet) -> None:
        """Begin trials; the robots are at their starts."""
        ...

    def step(self, fleet: Fleet, commands: Array) -> Array:
        """Return the reward of the step that these commands (n, 2) caused, (n,)."""
        ...


class CoverageReward:
    """The share of the reachable cells that a step visits for the first time."""

    def __init__(self, task: CoverageTask) -> None:
        self._column = 0 if task.cells == "line" else 1

    def start(self, fleet: Fleet) -> None:
        """See `Reward.start`."""
        self._before = fleet.counts[:, self._column].copy()

    def step(self, fleet: Fleet, commands: Array) -> Array:
        """See `Reward.step`."""
        now = fleet.counts[:, self._column].copy()
        gained, self._before = now - self._before, now
        reward: Array = np.divide(gained, fleet.arena.grid.n_cells)
        return reward


class AvoidReward:
    """Floreano & Mondada's product after a step, divided by the number of steps."""

    def __init__(self, task: AvoidTask) -> None:
        self._task = task

    def start(self, fleet: Fleet) -> None:
        """See `Reward.start`."""

    def step(self, fleet: Fleet, commands: Array) -> Array:
        """See `Reward.step`."""
        readings = np.repeat(fleet.ranges.T[None], 2, axis=0)
        scores = np.empty(len(commands))
        every = np.arange(readings.shape[1])
        avoid_scores(
            np.ascontiguousarray(commands.T)[None], readings, every, bool(self._task.backward), scores
        )
        return scores / fleet.n_steps


class WallReward:
    """The distance that a step went along walls on the task's side [m].

    Raises:
        TaskError: The arena has neither walls nor obstacles.
    """

    def __init__(self, task: WallTask, fleet: Fleet) -> None:
        task.check_arena(fleet.arena, tuple(fleet.arena.vary))
        self._side, self._within = WALL_SIDES[task.side], float(task.within)
        self._walls = wall_outlines(fleet.arena)

    def start(self, fleet: Fleet) -> None:
        """See `Reward.start`."""
        self._before = self._poses(fleet)

    def step(self, fleet: Fleet, commands: Array) -> Array:
        """See `Reward.step`."""
        now = self._poses(fleet)
        scores = np.empty(len(commands))
        wall_scores(np.stack([self._before, now]), self._walls, self._side, self._within, scores)
        self._before = now
        return scores

    @staticmethod
    def _poses(fleet: Fleet) -> Array:
        """Return poses from the start, (3, n)."""
        start = fleet.arena.start
        return np.ascontiguousarray((fleet.facts()["pose"] - [start.x, start.y, 0.0]).T)


class GrowingReward:
    """The worth of the trial so far, less its worth a step before."""

    def start(self, fleet: Fleet) -> None:
        """See `Reward.start`."""
        self._worth = np.zeros(len(fleet.cells))
        self._begin(fleet)

    def step(self, fleet: Fleet, commands: Array) -> Array:
        """See `Reward.step`."""
        now = self._worth_now(fleet)
        gained, self._worth = now - self._worth, now
        return gained

    def _begin(self, fleet: Fleet) -> None:
        raise NotImplementedError

    def _worth_now(self, fleet: Fleet) -> Array:
        raise NotImplementedError


class LightReward(GrowingReward):
    """Nearness to a light over all steps, times the share of steps that are not blocked, as far as they are over.

    Raises:
        TaskError: The arena has no light, or one at the start.
    """

    def __init__(self, task: LightTask, fleet: Fleet) -> None:
        task.check_arena(fleet.arena)

    def _begin(self, fleet: Fleet) -> None:
        lights = fleet.arena.lights
        self._x, self._y = (
            np.stack(
                [
                    fleet.number(f"arena.light.{k}.{axis}", getattr(light, axis))
                    for k, light in enumerate(lights)
                ],
                axis=1,
            )
            for axis in ("x", "y")
        )
        self._first = self._away(fleet)
        self._total, self._blocked = np.zeros((2, len(self._first)))

    def _worth_now(self, fleet: Fleet) -> Array:
        self._total += np.maximum(1.0 - self._away(fleet) / self._first, 0.0)
        self._blocked += fleet.stalled
        worth: Array = self._total / fleet.n_steps * (1.0 - self._blocked / fleet.n_steps)
        return worth

    def _away(self, fleet: Fleet) -> Array:
        """Return distances from the nearest light, (n,) [m]."""
        pose = fleet.facts()["pose"]
        away: Array = np.hypot(self._x - pose[:, :1], self._y - pose[:, 1:2]).min(axis=1)
        return away


class GoalReward(GrowingReward):
    """The share of the distance to the goal that the robot has covered; 1 once it has reached the goal.

    Raises:
        TaskError: The arena has no goal, or it is where trials start.
    """

    def __init__(self, task: GoalTask, fleet: Fleet) -> None:
        self._goal = task.check_arena(fleet.arena)

    def _begin(self, fleet: Fleet) -> None:
        self._x, self._y, self._radius = (
            fleet.number(f"arena.goal.{name}", getattr(self._goal, name)) for name in ("x", "y", "radius")
        )
        self._first = self._away(fleet)
        self._reached = self._first < self._radius
        self._worth[self._reached] = 1.0

    def _worth_now(self, fleet: Fleet) -> Array:
        away = self._away(fleet)
        self._reached |= away < self._radius
        return np.where(self._reached, 1.0, 1.0 - away / self._first)

    def _away(self, fleet: Fleet) -> Array:
        pose = fleet.facts()["pose"]
        away: Array = np.hypot(self._x - pose[:, 0], self._y - pose[:, 1])
        return away


class ExitReward(GrowingReward):
    """The distance to the exit of a maze that a step saved [m]."""

    def _begin(self, fleet: Fleet) -> None:
        self._first = self._away(fleet)

    def _worth_now(self, fleet: Fleet) -> Array:
        nearer: Array = self._first - self._away(fleet)
        return nearer

    @staticmethod
    def _away(fleet: Fleet) -> NDArray[Any]:
        goal = maze_exit(fleet.arena)
        pose = fleet.facts()["pose"]
        return np.hypot(goal.x - pose[:, 0], goal.y - pose[:, 1])


def reward_of(task: Any, fleet: Fleet) -> Reward:
    """Return the rewards of a task.

    Raises:
        TaskError: The arena lacks what the task needs, or the task has no rewards of single steps.
    """
    if isinstance(task, CoverageTask):
        return CoverageReward(task)
    if isinstance(task, AvoidTask):
        return AvoidReward(task)
    if isinstance(task, WallTask):
        return WallReward(task, fleet)
    if isinstance(task, LightTask):
        return LightReward(task, fleet)
    if isinstance(task, GoalTask):
        return GoalReward(task, fleet)
    raise TaskError(f"Task {task.name!r} scores whole trials, expected one with a reward of each step.")
