"""The fitness of Kheperax: the negative sum of the squared speeds of both wheels over the steps [m2 a step2]."""

import numba

SPEED = 0.025


@numba.njit
def energy(arrays, step_s, fitness):
    """Write the fitness of each trial."""
    for trial in range(fitness.size):
        total = 0.0
        for step in range(arrays.commands.shape[0]):
            move = arrays.commands[step, 0, trial]
            turn = arrays.commands[step, 1, trial]
            total += min(max(move - turn, -1.0), 1.0) ** 2 + min(max(move + turn, -1.0), 1.0) ** 2
        fitness[trial] = -SPEED * SPEED * total
