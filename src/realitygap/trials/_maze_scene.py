"""The published mazes and their agent in the form that kernels read."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from realitygap.kernels.tasks.maze import MazeRules, MazeScene
from realitygap.tasks import MazeAgent
from realitygap.world import Arena, Goal

from ._batch import REAL


def maze_exit(arena: Arena) -> Goal:
    """Return the exit of a maze.

    Raises:
        ValueError: The arena has no goal.
    """
    if arena.goal is None:
        raise ValueError(f"Arena {arena.name!r} has no goal, expected one: it is the exit of the maze.")
    return arena.goal


def maze_scene(
    arena: Arena, agent: MazeAgent, precision: Literal["single", "double"] = "single"
) -> MazeScene:
    """Return a maze as kernels read it, from the start of its trials.

    Args:
        arena: Arena with walls, a start, and a goal.
        agent: Agent whose range finders see the walls.
        precision: Precision of the arithmetic.

    Raises:
        ValueError: The arena has no goal.
    """
    goal, origin, real = maze_exit(arena), np.array([arena.start.x, arena.start.y]), REAL[precision]
    # Rounded, so that quarters of a turn are that and the last bit of a library's cosine does not count.
    rays = [(round(math.cos(ray), 15), round(math.sin(ray), 15)) for ray in agent.rays]
    return MazeScene(
        walls=(np.array(arena.walls) - np.tile(origin, 2)).astype(real),
        rays=np.array(rays, real),
        exit=(np.array([goal.x, goal.y]) - origin).astype(real),
        heading=np.array([arena.start.heading / math.tau], real),
    )


def maze_rules(arena: Arena, agent: MazeAgent, bias_value: float) -> MazeRules:
    """Return the agent's limits, and how near to the exit it has arrived.

    Raises:
        ValueError: The arena has no goal.
    """
    return MazeRules(
        n_steps=agent.steps,
        radius=agent.radius,
        reach=agent.reach,
        arrival=maze_exit(arena).radius,
        push=agent.push,
        top_speed=agent.top_speed,
        twist=agent.twist / math.tau,
        top_spin=agent.top_spin / math.tau,
        bias_value=bias_value,
    )
