"""All measures of the gap between two platforms."""

from __future__ import annotations

from ._result import GapResult
from ._side import GapSide

SEED = 7
"""Of every random draw in a measure, so that the same trials give the same numbers."""


def measure_gap(
    source: GapSide,
    target: GapSide,
    *,
    margin: float | None = None,
    misspecified: bool | None = None,
    resamples: int = 2_000,
    seed: int = SEED,
) -> GapResult:
    """Measure the gap between a simulator and a target from trials of the same controllers on both.

    Args:
        source: The simulator's; row k is controller k.
        target: The target's, of the same controllers; the number of trials may differ.
        margin: Of equivalence in level, in units of quality; without one there is no test of it.
        misspecified: Whether a check found that the simulator cannot make what was observed.
        resamples: Of the bootstrap.
        seed: Of all random draws.

    Raises:
        ValueError: The sides differ in controllers, or a number is out of range.
    """
    raise NotImplementedError
