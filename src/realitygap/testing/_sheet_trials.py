"""Paths for synthetic sheets: what simulated robots of an evolving population drive."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from realitygap.evolution import NeatSettings, Population
from realitygap.platforms import SimPlatform, SimTarget
from realitygap.trials import TrialPlan
from realitygap.world import Arena, Pose

PARTS = 12  # points on the arc of one command
BY_HAND = (
    0.002,
    0.002,
    0.03,
)  # accuracy of a person who places a robot: standard deviation of x, y [m] and heading [rad]


def driven_paths(
    seed: int, arena: Arena, *, generations: int = 5, steps: int = 100
) -> list[list[NDArray[np.float64]]]:
    """Return the paths of each generation of an evolution on `sim` for coverage, from starts as hands put a robot.

    Args:
        seed: Seed of the evolution and of the robot's noise.
        arena: Arena of the trials.
        generations: Number of generations. Each is a sheet of eight trials.
        steps: Commands in a trial.

    Returns:
        Eight paths for each generation, each (12 steps + 1, 2) x and y [m].
    """
    population = Population(3, 2, NeatSettings.named("rosenzweig-remy"), seed=seed)
    rng = np.random.default_rng((seed, 0x4A4D))
    sheets = []
    with SimTarget(SimPlatform(), arena, key=seed) as target:
        for generation in range(generations):
            genomes = population.ask()
            starts = np.array(arena.start) + rng.normal(size=(len(genomes), 3)) * BY_HAND
            plans = [
                TrialPlan(Pose(*start), genome, steps=steps, number=len(genomes) * generation + k)
                for k, (genome, start) in enumerate(zip(genomes, starts.tolist(), strict=True))
            ]
            trials = target.carry_out(plans, "track")
            population.tell([float(len(trial.cells)) for trial in trials])
            sheets.append([along_arcs(trial.poses) for trial in trials])
    return sheets


def along_arcs(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points on arcs through poses (t + 1, 3), (12 t + 1, 2): a command drives with constant speeds."""
    points = [poses[:1, :2]]
    share = np.arange(1, PARTS + 1) / PARTS
    for (x, y, heading), (to_x, to_y, to_heading) in pairwise(poses):
        turn = math.remainder(to_heading - heading, math.tau)
        if abs(turn) < 1e-9:
            u, v = share, 0 * share
        else:  # the chord's image under a rotation about the arc's center
            u = np.sin(share * turn) / turn
            v = (1 - np.cos(share * turn)) / turn
        chord = (
            complex(to_x - x, to_y - y) / complex(u[-1], v[-1]) if abs(complex(u[-1], v[-1])) > 1e-6 else 0
        )
        moved = chord * (u + 1j * v)
        points.append(np.column_stack([x + moved.real, y + moved.imag]))
    return np.concatenate(points)
