"""The numbers sampled for a trial of the robot and the arena, as a pure function of the key and the trial."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.math.philox import PURPOSE_MODEL, draw_units
from realitygap.world import Distribution


class Draws:
    """The numbers that are drawn, each a function of the key, of its name and of the trial, the run or the study.

    A number does not depend on the other drawn numbers, so that two conditions of a study draw the same values. Numbers
    that are drawn `together` share one random number.

    Args:
        numbers: Numbers by dotted name. Only distributions are drawn.
    """

    def __init__(self, numbers: Mapping[str, float | Distribution]) -> None:
        self._drawn = {name: value for name, value in numbers.items() if isinstance(value, Distribution)}
        self.names = tuple(self._drawn)

    def draw(self, key: int, counters: NDArray[np.uint32]) -> NDArray[np.float64]:
        """Return the numbers that are drawn for n trials, (n, d).

        Args:
            key: Key of the random numbers.
            counters: (n, 3) the fixed words of each trial's random numbers.
        """
        words = {per: _counters(counters, per) for per in {drawn.per for drawn in self._drawn.values()}}
        drawn = np.empty((len(counters), len(self.names)))
        units = np.empty(len(counters))
        for k, (name, distribution) in enumerate(self._drawn.items()):
            draw_units(
                _block_of(distribution.together or name), np.uint64(key), words[distribution.per], units
            )
            drawn[:, k] = distribution.of(units)
        return drawn


def _block_of(name: str) -> np.uint32:
    """Return the word of the counter for a number."""
    return np.uint32(int.from_bytes(hashlib.blake2b(name.encode(), digest_size=4).digest(), "little"))


def _counters(counters: NDArray[np.uint32], per: str) -> NDArray[np.uint32]:
    """Return the words of the counter for draws that hold for a trial, a run or the study."""
    words = np.zeros_like(counters)
    if per == "trial":
        words[:] = counters
        words[:, 0] &= np.uint32(0xFFFFFF00)
    elif per == "run":
        words[:, 2] = counters[:, 2]
    words[:, 0] |= np.uint32(PURPOSE_MODEL)
    return words
