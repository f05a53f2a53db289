"""Random numbers of a twin: a pure function of its seed, the number of a trial, a purpose and a step."""

from __future__ import annotations

import numpy as np

DELAYS, WHEELS, LIGHT, ENCODERS, FAMILY, AMBIENT = range(6)
"""Purposes of the random numbers."""


def numbers_for(seed: int, number: int, purpose: int, step: int = 0) -> np.random.Generator:
    """Return a generator that draws the same on every machine."""
    words = np.array([seed, number], np.uint64)
    return np.random.Generator(np.random.Philox(key=words, counter=[0, 0, step, purpose]))
