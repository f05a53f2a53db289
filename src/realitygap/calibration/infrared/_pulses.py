"""The likelihood of readings that are counts of pulses, as kernels/sim/noise.py draws them."""

from __future__ import annotations

import functools

import numpy as np
import scipy
from numpy.typing import NDArray

from realitygap.world import RangeSensor

from ._parameters import AMPLITUDE, BURST, DECAY, DROP
from ._readings import Array, Placement, Places, Readings, logistic

STRAY = 1e-6
"""Probability of any count, so that one that the model cannot make is unlikely and not impossible."""

ROWS = 16
"""Least number of sets of parameters whose probabilities are computed together."""

DISTANCES = 2**14
"""Most distances for which probabilities are computed together, unless `ROWS` sets have more. Their arrays fit into a
processor's cache."""


class PulseReadings(Readings):
    """Counts of pulses at placements.

    Args:
        placements: Placements with their readings.
        reach: Reach of the sensor [m].
        pulses: Sent for one reading.
        weight: Weight of a reading: below 1 if readings have less information than as many independent ones.
        sensor: The sensor whose parameters these are; by default one that sees `REACH` far.
    """

    def __init__(
        self,
        placements: list[Placement],
        reach: float,
        pulses: int,
        weight: float = 1.0,
        sensor: RangeSensor | None = None,
    ) -> None:
        super().__init__(placements, reach, (AMPLITUDE, DECAY, *DROP, BURST), weight, sensor)
        self.pulses = pulses
        self.counts = np.array([self.binned(placement.readings) for placement in placements])

    @property
    def bins(self) -> Array:
        """Value of each bin of readings, (b,)."""
        return np.arange(self.pulses + 1) / self.pulses

    def binned(self, readings: Array) -> NDArray[np.int64]:
        """Return the number of readings of each count, (b,)."""
        counts = np.clip(np.rint(np.asarray(readings) * self.pulses), 0, self.pulses).astype(np.int64)
        return np.bincount(counts, minlength=self.pulses + 1)

    def _at(self, places: Places, values: Array, stray: float = STRAY) -> Array:
        sent_back, missed = self._pulses(places, values)
        counts = np.arange(self.pulses + 1)
        burst = values[:, 5, None, None]
        return self._chances(sent_back[..., None], missed[..., None], counts, burst, stray)

    def _pulses(self, places: Places, values: Array) -> tuple[NDArray[np.int64], Array]:
        """Return pulses that return if none is missed, and the probability that one is missed, (m, p) each."""
        back, dim = self._response(places, values)
        back = np.clip(back, 0.0, 1.0)
        missed = np.clip(logistic(dim, *values[:, 2:5].T), 1e-12, 1.0 - 1e-12)
        return np.floor(back * self.pulses + 0.5).astype(np.int64), missed

    def _chances(
        self,
        sent_back: NDArray[np.int64],
        missed: Array,
        counts: NDArray[np.int64],
        burst: Array,
        stray: float,
    ) -> Array:
        """Return the probability of each count; the arrays are broadcast against each other."""
        left = sent_back - counts
        logs = np.log(missed) * np.maximum(left, 0) + np.log1p(-missed) * counts
        apart = np.where(left >= 0, _ways(self.pulses)[sent_back, counts] * np.exp(logs), 0.0)
        shared = np.where(left == 0, 1.0 - missed, 0.0)
        shared = shared + np.where(counts == 0, missed, 0.0)
        mixed = burst * shared + (1.0 - burst) * apart
        return np.asarray((1.0 - stray) * mixed + stray / (self.pulses + 1))

    def log_likelihood(self, values: Array, stray: float = STRAY) -> Array:
        """Return the log likelihood of parameters (m, d), (m,). A reading of any value has the probability `stray`."""
        # most placements have one reading: few counts of all were read
        which, counts = np.nonzero(self.counts)
        logs = np.empty(len(values))
        rows = max(ROWS, DISTANCES // self.places.distances.size)
        for first in range(0, len(values), rows):
            part = slice(first, first + rows)
            sent_back, missed = self._pulses(self.places, values[part])
            burst = values[part, 5, None]
            chances = self._chances(sent_back[:, which], missed[:, which], counts, burst, stray)
            logs[part] = np.einsum("mr,r->m", np.log(chances), self.counts[which, counts])
        return np.asarray(self.weight * logs)


@functools.cache
def _ways(pulses: int) -> Array:
    """Return the number of ways to detect k of e pulses, (e, k); 0 for more than e."""
    e, k = np.mgrid[: pulses + 1, : pulses + 1]
    left = np.maximum(e - k, 0)
    log_factorials = scipy.special.gammaln([e + 1, k + 1, left + 1])
    ways = np.exp(log_factorials[0] - log_factorials[1] - log_factorials[2])
    return np.asarray(np.where(k <= e, ways, 0.0))
