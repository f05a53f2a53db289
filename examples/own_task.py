"""A task of one's own: drive far away and come back.

    realitygap run examples/own_task.toml

`there_and_back` gets the trials as arrays in meters, trials first. `there_and_back_compiled` says the same in a loop
that Numba compiles, over the arrays that the simulation itself wrote: nothing is converted for it. The study file names
the one or the other.
"""

from __future__ import annotations

import math

import numba
import numpy as np


def there_and_back(trajectories):
    """(n,) the farthest that each robot was from its start, less how far from it it ended [m]."""
    from_start = trajectories.poses[:, :, :2] - trajectories.poses[:, :1, :2]
    away = np.hypot(from_start[..., 0], from_start[..., 1])
    return away.max(axis=1) - away[:, -1]


@numba.njit
def there_and_back_compiled(arrays, step_s, fitness):
    """The same, written to `fitness` (n,); `arrays.poses` is (t + 1, 3, n), from the start."""
    for trial in range(len(fitness)):
        farthest = 0.0
        away = 0.0
        for step in range(arrays.poses.shape[0]):
            away = math.hypot(arrays.poses[step, 0, trial], arrays.poses[step, 1, trial])
            farthest = max(farthest, away)
        fitness[trial] = farthest - away
