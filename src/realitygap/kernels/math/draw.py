"""Uniform random numbers for the numbers of a robot or an arena that are drawn."""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import kernel

from .philox import philox, unit


@kernel
def draw_units(block, key, counters, units):
    """One number for each counter.

    Args:
        block: uint32, which number of the robot or arena is meant.
        key: uint64, of the random numbers.
        counters: (n, 3) uint32, the other words of each counter.
        units: (n,) float64, written: 0 < u < 1, each multiple of 2^-32 and a half as likely.
    """
    k0 = np.uint32(np.uint64(key) & np.uint64(0xFFFFFFFF))
    k1 = np.uint32(np.uint64(key) >> np.uint64(32))
    for row in range(units.size):
        words = philox(np.uint32(block), counters[row, 0], counters[row, 1], counters[row, 2], k0, k1)
        units[row] = unit(words[0])
