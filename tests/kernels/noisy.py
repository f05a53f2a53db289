"""What networks see of sensors that stay where they are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.jyro.trial import largest_noisy_readings
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.math.philox import PURPOSE_NOISE


def largest_noisy(
    fractions: Sequence[float], noise: float, n_steps: int, *, clip: bool = False, individual: int = 0
) -> NDArray[np.float64]:
    """(n_steps,) largest noisy reading of one individual, in lane 3 of a block; distances as parts of the range."""
    sensors = np.repeat(np.array(fractions, np.float64)[:, None], LANES, axis=1)
    counters = np.zeros((3, LANES), np.uint32)
    counters[0] = np.arange(individual - 3, individual - 3 + LANES) % 2**24 * 256 + int(PURPOSE_NOISE)
    counters[2] = 77
    words, value = np.empty((4, LANES), np.uint32), np.empty(LANES)
    level = np.full(LANES, noise)
    seen = np.empty(n_steps)
    for step in range(n_steps):
        largest_noisy_readings(sensors, level, clip, np.int64(step), counters, np.uint64(9), words, value)
        seen[step] = value[3]
    return seen
