"""Trials that tell much of a robot: commands that change often, from many places, and controllers."""

from __future__ import annotations

import math

import numpy as np

from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.trials import TrialPlan
from realitygap.world import Arena, Pose, distance_to_segment

CLEAR = 0.015  # between a robot at its start and what is nearest [m]
LONGEST = 8  # steps of one command
TRIES = 10_000


def random_controllers(n: int, seed: int) -> list[Genome]:
    """Return n unrelated networks with a constant input, as in NEAT's first generation with the paper's settings."""
    settings = NeatSettings.named("rosenzweig-remy")
    return [Population(3, 2, settings, seed=seed, replicate=k).ask()[0] for k in range(n)]


def random_start(arena: Arena, radius: float, rng: np.random.Generator) -> Pose:
    """Return a pose in which a robot of this radius touches nothing, in whole centimeters and twelfths of a turn.

    Raises:
        ValueError: There seems to be no room for it.
    """
    grid = arena.grid
    for _ in range(TRIES):
        x = round(grid.x + rng.uniform() * grid.columns * grid.cell, 2)
        y = round(grid.y + rng.uniform() * grid.rows * grid.cell, 2)
        if _clearance(arena, x, y) > radius + CLEAR:
            return Pose(x, y, math.remainder(int(rng.integers(12)) * math.tau / 12, math.tau))
    raise ValueError(
        f"No place in arena {arena.name!r} where a robot of radius {radius:.3g} m touches nothing."
    )


def _clearance(arena: Arena, x: float, y: float) -> float:
    gaps = [distance_to_segment(x, y, wall) for wall in arena.walls]
    gaps += [obstacle.distance(x, y) for obstacle in arena.obstacles]
    return min(gaps, default=math.inf)


def excitation(arena: Arena, radius: float, n: int, steps: int, rng: np.random.Generator) -> list[TrialPlan]:
    """Return n trials of straight, turning, slow, and arc commands, each for 1 to 8 steps, from anywhere.

    Args:
        arena: Arena of the trials.
        radius: Distance of the robot's farthest point [m].
        n: Number of trials.
        steps: Commands in each.
        rng: Random numbers.
    """
    return [
        TrialPlan(
            start=random_start(arena, radius, rng),
            commands=_commands(steps, rng),
            steps=steps,
            number=k,
            purpose="excitation",
        )
        for k in range(n)
    ]


def _commands(steps: int, rng: np.random.Generator) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    commands = np.zeros((steps, 2))
    at = 0
    while at < steps:
        length = int(rng.integers(1, LONGEST + 1))
        side = float(rng.choice([-1.0, 1.0]))
        kind = int(rng.integers(4))
        one = (
            (side, 0.0),
            (0.0, side * rng.uniform(0.2, 1.0)),
            (rng.uniform(-1, 1), rng.uniform(-1, 1)),
            (side * rng.uniform(0.1, 1.0), rng.uniform(-0.3, 0.3)),
        )[kind]
        commands[at : at + length] = np.round(one, 2)
        at += length
    return commands
