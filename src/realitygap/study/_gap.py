"""The gap between two platforms, measured: the same controllers carried out on both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from realitygap.gap import GapResult
from realitygap.trials import Target

from ._controllers import Controller


def run_gap(
    source: Target,
    target: Target,
    controllers: Sequence[Controller],
    *,
    trials: int = 10,
    margin: float | None = None,
    seed: int = 1,
    tell: Callable[[int, int], None] | None = None,
    results: str | Path | None = None,
) -> GapResult:
    """Try the same controllers on a simulator and on a target, and measure the gap.

    Args:
        source: The simulator.
        target: Where trials are costly.
        controllers: At least 2, see `sample_controllers`.
        trials: Of each controller on each platform.
        margin: Of equivalence in level, in coverage.
        seed: Of the noise of trials on simulated platforms and of the bootstrap.
        tell: Called with the trials done and the trials in all.
        results: A file where the target's trials are kept as they come; those in it are not repeated.
    """
    raise NotImplementedError
