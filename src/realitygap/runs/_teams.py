"""Teams, for conditions in which each robot of an arena has another network."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.math.philox import PURPOSE_TEAM, draw_units


def draw_teams(
    key: int, replicate: int, generation: int, population: int, n_robots: int
) -> NDArray[np.int32]:
    """Return the individuals that drive the robots of each trial of a generation, shape (population, n_robots).

    The first robot of trial i has individual i. Individuals are in a circle in random order, and the other robots have
    the next ones in the circle. So each individual drives once from each start, and never twice in a trial.
    """
    counters = np.empty((population, 3), np.uint32)
    counters[:, 0] = np.arange(population, dtype=np.uint32) << 8 | np.uint32(PURPOSE_TEAM)
    counters[:, 1] = generation << 12
    counters[:, 2] = replicate
    units = np.empty(population)
    draw_units(np.uint32(0), np.uint64(key), counters, units)
    order = np.argsort(units, kind="stable").astype(np.int32)
    places = np.arange(population)[:, None] + np.arange(n_robots)
    teams = np.empty((population, n_robots), np.int32)
    teams[order] = order[places % population]
    return teams


def mean_of_teams(scores: NDArray[np.float64], teams: NDArray[np.int32]) -> NDArray[np.float64]:
    """Return the mean score of the trials in which each individual drove, shape (n,).

    Args:
        scores: (n,) score of each trial.
        teams: (n, r) teams of `draw_teams`.
    """
    means = np.zeros(len(scores))
    for robot in teams.T:
        means[robot] += scores
    means /= teams.shape[1]
    return means
