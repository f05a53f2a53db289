"""Rows of lanes for the stages of `sim`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.math.lanes import LANES, Poses

PRECISIONS = (np.float64, np.float32)
# Relative to numbers of about 1: a few roundings.
TOLERANCE: dict[Any, float] = {np.float64: 1e-13, np.float32: 1e-5}


def row(values: Any, real: Any) -> NDArray[Any]:
    """(LANES,) of numbers, or of one number in all."""
    return np.ascontiguousarray(np.broadcast_to(np.asarray(values, real), (LANES,))).copy()


def rows(values: Any, real: Any) -> NDArray[Any]:
    """(n, LANES) of n rows or n numbers."""
    return np.stack([row(value, real) for value in values])


def random_words(rng: np.random.Generator, n: int) -> NDArray[np.uint32]:
    return rng.integers(0, 2**32, (n, LANES), dtype=np.uint32)


def unit_of(words: NDArray[np.uint32], bits: int = 23) -> NDArray[np.float64]:
    """The number in (0, 1) that the upper bits of each word are."""
    return ((words >> np.uint32(32 - bits)).astype(np.float64) + 0.5) / 2**bits


def poses(x: Any, y: Any, heading: Any, real: Any) -> Poses:
    """Poses [m], [rad]."""
    angle = np.asarray(heading, np.float64)
    numbers = (x, y, angle / (2 * np.pi), np.sin(angle), np.cos(angle))
    return Poses(*(row(value, real) for value in numbers))
