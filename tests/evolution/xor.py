"""XOR, as Stanley & Miikkulainen (2002) evolve it (section 4.2)."""

from __future__ import annotations

import numpy as np

from realitygap.evolution import NeatSettings, Population

CASES = [((0.0, 0.0), 0.0), ((0.0, 1.0), 1.0), ((1.0, 0.0), 1.0), ((1.0, 1.0), 0.0)]


def evaluations_to_solve(seed: int, settings: NeatSettings, most_generations: int = 100) -> int | None:
    """Networks tried up to and with the first whose four outputs lie on the right side of one half."""
    population = Population(2, 1, settings, seed=seed)
    tried = 0
    for _ in range(most_generations):
        fitness = []
        for genome in population.ask():
            network = genome.network()
            outputs = np.array([network.activate(inputs)[0] for inputs, _ in CASES])
            wanted = np.array([answer for _, answer in CASES])
            tried += 1
            if ((outputs > 0.5) == (wanted > 0.5)).all():
                return tried
            fitness.append((4.0 - np.abs(outputs - wanted).sum()) ** 2)
        population.tell(fitness)
    return None
