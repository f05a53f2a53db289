"""The likelihood of infrared readings that are any number in 0..1, as kernels/sim/noise.py draws them.

A reading is the response times 1 + gain * N; what would be below 0 or above 1 is 0 or 1: it is censored there. With a
probability that rises with distance it is 0 instead, and with another it is anything.
"""

from __future__ import annotations

import math

import numpy as np
import scipy
from numpy.typing import NDArray

from realitygap.world import RangeSensor

from .._prior import Parameter
from ._parameters import (
    AMPLITUDE,
    DECAY,
    DROP,
    FARTHEST,
    GAIN,
    HALF_WIDTH,
    NOISE,
    OUTLIER,
    SCALE,
    WIDE_NOISE,
    column,
    reach_of,
)
from ._readings import Array, Placement, Places, Readings, logistic

Parts = tuple[Array, Array, Array, Array]

STRAY = 1e-6
"""Probability of any reading, so that one that the model cannot make is unlikely and not impossible."""

FINEST = 1e-5
"""Readings are taken to be rounded at least to multiples of this."""

COARSE = 1e-3
"""A step below this is none: readings that happen to be near each other have it, too."""

ROWS = 32
"""Sets of parameters whose likelihoods are computed together: their arrays fit into a processor's cache."""

BINS = 20
"""Number of bins between 0 and 1, for checks and figures, if a sensor answers in finer steps."""

FAR = 9.0
"""Number of standard deviations beyond which a normal probability differs from 0 or 1 by less than 1e-18."""

SHOWN_BINS = 500
"""Number of bins in figures of a sensor with even noise."""


def resolution_of(readings: Array) -> float:
    """Return the step in which a sensor answers: what all readings are multiples of, at least `FINEST`."""
    values = np.unique(np.asarray(readings, np.float64))
    apart = np.diff(values)
    step = float(apart[apart > FINEST].min(initial=1.0))
    is_coarse = step > COARSE and np.allclose(np.rint(values / step) * step, values, atol=FINEST)
    return step if is_coarse else FINEST


class MixtureReadings(Readings):
    """Infrared readings at placements.

    Args:
        placements: Placements with their readings.
        reach: Reach of the sensor [m].
        weight: Weight of a reading: below 1 if readings have less information than as many independent ones.
        sensor: The sensor whose parameters and compression these are; by default one that sees `REACH` far and does not
            compress.
    """

    def __init__(
        self,
        placements: list[Placement],
        reach: float,
        weight: float = 1.0,
        sensor: RangeSensor | None = None,
    ) -> None:
        super().__init__(placements, reach, (AMPLITUDE, DECAY, GAIN, *DROP, *OUTLIER), weight, sensor)
        self._compression = 0.0 if sensor is None else sensor.compression
        self.step = resolution_of(np.concatenate([placement.readings for placement in placements]))
        self._edges = _inner_edges(self.step)
        self.counts = np.array([self.binned(placement.readings) for placement in placements])
        self._rows = self._told_apart(placements)

    def _told_apart(self, placements: list[Placement]) -> tuple[Array, Array, Array]:
        """Return distinct readings: their placement, their bins, and their number."""
        which: list[int] = []
        readings: list[float] = []
        counts: list[int] = []
        for k, placement in enumerate(placements):
            clipped = np.clip(placement.readings, 0.0, 1.0)
            rounded = np.where(clipped < 1.0, np.rint(clipped / self.step) * self.step, 1.0)
            values, n = np.unique(np.minimum(rounded, 1.0), return_counts=True)
            which += [k] * len(values)
            readings += values.tolist()
            counts += n.tolist()
        return np.array(which), np.array(readings), np.array(counts, np.float64)

    @property
    def bins(self) -> Array:
        """Value of each bin of readings, (b,): 0, parts of the range between, and 1."""
        return np.concatenate([[0.0], (self._edges[1:] + self._edges[:-1]) / 2, [1.0]])

    def binned(self, readings: Array) -> NDArray[np.int64]:
        """Return the number of readings in each bin, (b,)."""
        place = np.searchsorted(self._edges, np.clip(readings, 0.0, 1.0))
        return np.bincount(place, minlength=len(self._edges) + 1)

    def _light(self, readings: Array) -> Array:
        """Return the light of readings: noise is on it, before it is compressed."""
        c = self._compression
        return np.asarray(np.expm1(c * readings) / c) if c else readings

    def _at(self, places: Places, values: Array) -> Array:
        back, spread, drop, out = self.parts(places, values)
        edges = self._light(self._edges)
        below = scipy.special.ndtr((edges - back[..., None]) / spread[..., None])
        below = np.concatenate([np.zeros_like(below[..., :1]), below, np.ones_like(below[..., :1])], axis=2)
        normal = np.diff(below, axis=2)
        even = np.concatenate([[0.0], np.diff(self._edges), [0.0]])
        rest = 1.0 - drop - out
        mixed = rest[..., None] * normal + out[..., None] * even
        mixed[..., 0] += drop
        return np.asarray((1.0 - STRAY) * mixed + STRAY / mixed.shape[2])

    def log_likelihood(self, values: Array, stray: float = STRAY) -> Array:
        """Return the log likelihood of parameters (m, d), (m,). A reading of any value has the probability `stray`."""
        which, readings, counts = self._rows
        half = self.step / 2
        upper = np.where(readings >= 1.0, np.inf, self._light(readings + half))
        lower = np.where(readings <= 0.0, -np.inf, self._light(readings - half))
        is_inside = (readings > 0.0) & (readings < 1.0)
        logs = np.empty(len(values))
        for first in range(0, len(values), ROWS):
            rows = slice(first, first + ROWS)
            back, spread, drop, out = (part[:, which] for part in self.parts(self.places, values[rows]))
            normal = scipy.special.ndtr((upper - back) / spread) - scipy.special.ndtr((lower - back) / spread)
            chance = (1.0 - drop - out) * normal + out * np.where(is_inside, self.step, half)
            chance = chance + drop * (readings <= 0.0)
            chance = (1.0 - stray) * chance + stray * self.step
            logs[rows] = np.log(chance) @ counts
        return np.asarray(self.weight * logs)

    def parts(self, places: Places, values: Array) -> Parts:
        """Return (m, p) each: response, standard deviation, and probability of nothing and of anything."""
        back, dim = self._response(places, values)
        spread = np.maximum(values[:, 2, None] * back, 1e-9)
        drop = logistic(dim, *values[:, 3:6].T)
        out = np.minimum(logistic(dim, *values[:, 6:9].T), 1.0 - drop)
        return back, spread, drop, out


def _inner_edges(step: float) -> Array:
    """Return edges of the bins between 0 and 1: what rounds to 0 is 0, and what rounds to 1 is 1."""
    if step > 0.5 / BINS:
        return np.arange(step / 2, 1.0, step)
    edges = np.arange(BINS + 1) / BINS
    edges[0], edges[-1] = step / 2, 1.0 - step / 2
    return edges


class EvenReadings(MixtureReadings):
    """Base of readings with even noise of one width at all distances, and normal noise in proportion to the response.

    They are `noise_uniform` and `noise_gain` of a sensor. The likelihood takes normal noise of the same standard
    deviation, so that a few readings farther out than even noise allows do not decide its width. Bins, and so the check
    and the figure, have the sum of both, as `sim` draws it.

    Args:
        placements: Placements with their readings.
        reach: Reach of the sensor [m].
        sensor: Sensor, whose `noise_gain` counts unless it is fitted.
        parameters: Parameters that are fitted.
        weight: Weight of a reading: below 1 if readings have less information than as many independent ones.
    """

    def __init__(
        self,
        placements: list[Placement],
        reach: float,
        sensor: RangeSensor,
        parameters: tuple[Parameter, ...],
        weight: float,
    ) -> None:
        super().__init__(placements, reach, weight)
        self.parameters = parameters
        self._sensor = sensor

    def _mean(self, places: Places, values: Array) -> Array:
        """Return the mean readings before the noise, (m, p), for parameters (m, d)."""
        raise NotImplementedError

    def _noise(self, values: Array) -> tuple[Array, Array]:
        """Return half widths and gains (m, 1): the first positive, so that readings without noise have a likelihood."""
        width = np.maximum(column(self.parameters, values, NOISE), FINEST)
        return width[:, None], column(self.parameters, values, GAIN, self._sensor.noise_gain)[:, None]

    def parts(self, places: Places, values: Array) -> Parts:
        """Return (m, p) mean and standard deviation; nothing is missed, and nothing is any number."""
        back, (width, gain) = self._mean(places, values), self._noise(values)
        none = np.zeros_like(back)
        return back, np.hypot(width / math.sqrt(3), gain * back), none, none

    def _at(self, places: Places, values: Array) -> Array:
        return self._chances(places, values, self._edges)

    def _shown(self, places: Places, values: Array) -> tuple[Array, Array]:
        """As `Readings`, with finer bins: the noise of a distance is less than a bin of the check."""
        edges = np.linspace(0.0, 1.0, SHOWN_BINS + 1)[1:-1]
        bins = np.concatenate([[0.0], (edges[1:] + edges[:-1]) / 2, [1.0]])
        return bins, self._chances(places, values, edges)

    def _chances(self, places: Places, values: Array, edges: Array) -> Array:
        """Return the probability of each bin between edges at each of the places, (m, q, b)."""
        back, (width, gain) = self._mean(places, values)[..., None], self._noise(values)
        width, spread = width[..., None], np.maximum(gain[..., None] * back, FINEST)
        past = (edges - back) / spread
        below = (_summed_normal(past + width / spread) - _summed_normal(past - width / spread)) * spread
        below = np.clip(below / (2 * width), 0.0, 1.0)
        below = np.concatenate([np.zeros_like(back), below, np.ones_like(back)], axis=2)
        return np.asarray((1.0 - STRAY) * np.diff(below, axis=2) + STRAY / (below.shape[2] - 1))


def _summed_normal(z: Array) -> Array:
    """Return the integral of the normal distribution function up to z."""
    total = np.maximum(z, 0.0)
    is_near = np.abs(z) < FAR  # beyond, the integral is 0 or z
    near = z[is_near]
    total[is_near] = near * scipy.special.ndtr(near) + np.exp(-(near**2) / 2) / math.sqrt(2 * math.pi)
    return np.asarray(total)


class LorentzReadings(EvenReadings):
    """Readings whose mean follows `lorentz` of kernels/sim/ranges.py.

    Args:
        placements: Placements with their readings.
        sensor: Sensor, whose reach, `peak`, cone, and `keeps_edge` are not fitted.
        weight: Weight of a reading: below 1 if readings have less information than as many independent ones.
    """

    def __init__(self, placements: list[Placement], sensor: RangeSensor, weight: float = 1.0) -> None:
        super().__init__(placements, sensor.reach, sensor, (AMPLITUDE, HALF_WIDTH, NOISE), weight)

    def _mean(self, places: Places, values: Array) -> Array:
        amplitude, half_width = (values[:, k, None, None] for k in range(2))
        peak = self._sensor.peak

        def uncut(distances: Array) -> Array:
            past = distances - peak
            width = half_width**2 - peak**2
            return amplitude * np.where(past <= 0, 1.0, width / (np.maximum(past, 0.0) ** 2 + width))

        def response(distances: Array) -> Array:
            return np.asarray(np.where(distances < places.reach, uncut(distances), 0.0))

        back = response(places.distances[None]).sum(axis=2)
        n_rays = places.distances.shape[1]
        if n_rays > 1:
            middle = places.distances[None, :, n_rays // 2, None] / math.cos(self._sensor.cone)
            back = back - 2 * response(middle)[..., 0]
        if self._sensor.keeps_edge:
            meets = places.distances < places.reach
            lost = np.where(meets.any(axis=1), (~meets).sum(axis=1), 0)
            back = back + lost * uncut(np.full((1, 1, 1), places.reach))[..., 0]
        return np.asarray(back)


class NearestReadings(EvenReadings):
    """Readings of what is nearest, whose mean follows `linear` or `table` of kernels/sim/ranges.py.

    Fitted are both kinds of noise and one factor of all distances: the reach of `linear`, and `table_distance` of
    `table`. A sensor that measures a time of flight has no other number in a robot file.

    Args:
        placements: Placements with their readings.
        sensor: Sensor, whose table and cone are not fitted.
        weight: Weight of a reading: below 1 if readings have less information than as many independent ones.
    """

    def __init__(self, placements: list[Placement], sensor: RangeSensor, weight: float = 1.0) -> None:
        is_linear = sensor.response == "linear"
        reach = FARTHEST * sensor.reach if is_linear else sensor.reach
        size = reach_of(sensor) if is_linear else SCALE
        super().__init__(placements, reach, sensor, (size, *WIDE_NOISE), weight)
        self._table = np.array([(sample.distance, sample.reading) for sample in sensor.table], np.float64)

    def _mean(self, places: Places, values: Array) -> Array:
        size = values[:, :1]
        if len(self._table):
            return np.interp(places.near / size, *self._table.T)
        return np.maximum(1.0 - places.near / size, 0.0)
