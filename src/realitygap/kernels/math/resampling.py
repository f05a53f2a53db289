"""Counting what resamples of a bootstrap hold."""

from __future__ import annotations

from realitygap.kernels.compile.decorators import kernel


@kernel
def count_drawn(draws, places, counts):
    """Add to `counts` how often each value is in each resample.

    Args:
        draws: (b, n) int64, which members of a sample are in each of b resamples.
        places: (m,) int64, the place of each member's value among u values.
        counts: (b, u) float64, changed.
    """
    for resample in range(draws.shape[0]):
        for k in range(draws.shape[1]):
            counts[resample, places[draws[resample, k]]] += 1.0
