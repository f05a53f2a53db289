"""Readings of one range sensor of a robot in front of walls."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from realitygap.world import Arena, RangeSensor

from .._prior import Parameter
from ._parameters import BATTERY, INCIDENCE, column, scaled

Array = NDArray[np.float64]

SAME_V = 0.05
"""Voltages that differ by less say nothing of a battery [V]."""

GRAZING = 1e-3
"""Smallest cosine of the angle between a ray and a normal at which something is met."""

VARIED = 0.05
"""Difference of the cosines of a ray between placements from which on angles varied."""

SLANTED = 0.9
"""Cosine of the angle to its normal from which on a wall counts as slanted."""

SHOWN_ROWS = 8
"""Sets of parameters whose probabilities are computed together for a figure. Those of 500 take 700 MB."""


def rays_of(sensor: RangeSensor, poses: Array, arena: Arena) -> tuple[Array, Array]:
    """Return the lengths of the rays of a sensor, and the cosines at the obstacles that they meet.

    Args:
        sensor: Sensor of the robot.
        poses: (n, 3) x [m], y [m], heading [rad].
        arena: Round things count as polygons.

    Returns:
        (n, rays) distances [m], at most the sensor's reach, and cosines between ray and normal, 1 if the ray meets
        nothing.
    """
    x, y, heading = poses[:, None].T.transpose(0, 2, 1)
    cosine, sine = np.cos(heading), np.sin(heading)
    spread = np.linspace(-sensor.cone, sensor.cone, sensor.rays) if sensor.rays > 1 else np.zeros(1)
    from_x = x + cosine * sensor.x - sine * sensor.y
    from_y = y + sine * sensor.x + cosine * sensor.y
    along, beside = np.cos(heading + sensor.direction + spread), np.sin(heading + sensor.direction + spread)
    distances, cosines = np.full(along.shape, sensor.reach), np.ones(along.shape)
    for x1, y1, x2, y2 in _sides(arena):
        edge_x, edge_y = x2 - x1, y2 - y1
        length = np.hypot(edge_x, edge_y)
        if length == 0:
            continue
        facing = (along * edge_y - beside * edge_x) / length  # cosine to one of both normals
        safe = np.where(np.abs(facing) < GRAZING, GRAZING, facing)
        far = ((x1 - from_x) * edge_y - (y1 - from_y) * edge_x) / length / safe
        place = ((from_x + far * along - x1) * edge_x + (from_y + far * beside - y1) * edge_y) / length**2
        hit = (np.abs(facing) >= GRAZING) & (far >= 0) & (far < distances) & (place >= 0) & (place <= 1)
        distances, cosines = np.where(hit, far, distances), np.where(hit, np.abs(facing), cosines)
    return distances, cosines


def _sides(arena: Arena) -> list[tuple[float, float, float, float]]:
    """Return all sides of the obstacles in an arena; round ones as short lines."""
    sides = list(arena.walls)
    for obstacle in arena.obstacles:
        points = obstacle.outline()
        sides += [(*first, *second) for first, second in pairwise((*points, points[0]))]
    return sides


@dataclass(frozen=True)
class Placement:
    """One placement of the robot, and the readings of the sensor there.

    Attributes:
        distances: (rays,) along the rays to what is nearest [m], at most the reach; of `linear` `FARTHEST` times that.
        readings: (n,) one after the other, 0..1.
        battery_v: Battery voltage [V]; nan if unknown.
        cosines: (rays,) cosine between each ray and the normal of its wall; 1 for all if the wall is faced.
        place: Index of the place, equal for placements at the same place. Default: `distances` decide.
    """

    distances: Array
    readings: Array
    battery_v: float = math.nan
    cosines: Array | None = None
    place: tuple[float, ...] = ()

    @property
    def group(self) -> tuple[float, ...]:
        """Equal for placements that were to be the same."""
        return self.place or tuple(np.round(self.distances, 4).tolist())


@dataclass(frozen=True)
class Places:
    """Placements as arrays.

    Attributes:
        distances: (p, rays) [m].
        near: (p,) the least of each [m].
        weights: (rays,) weights of the lobe; their sum is 1.
        volts: (p,) battery voltage minus its mean; 0 if unknown.
        reach: Reach of the sensor [m].
        cosines: (p, rays) between each ray and the normal of what it meets.
    """

    distances: Array
    near: Array
    weights: Array
    volts: Array
    reach: float
    cosines: Array

    @classmethod
    def of(cls, placements: list[Placement], reach: float) -> Places:
        """Return the arrays of placements."""
        distances = np.array([placement.distances for placement in placements], np.float64)
        volts = np.array([placement.battery_v for placement in placements], np.float64)
        mean = volts[np.isfinite(volts)].mean() if np.isfinite(volts).any() else 0.0
        rays = distances.shape[1]
        weights = 1.0 - 0.5 * np.linspace(-1.0, 1.0, rays) ** 2 if rays > 1 else np.ones(1)
        cosines = [np.ones(rays) if each.cosines is None else each.cosines for each in placements]
        return cls(
            distances, distances.min(axis=1), weights / weights.sum(), np.nan_to_num(volts - mean), reach,
            np.array(cosines, np.float64),
        )  # fmt: skip

    @property
    def battery_varied(self) -> bool:
        """True if the battery varied enough to identify its effect."""
        return float(np.ptp(self.volts)) > SAME_V

    @property
    def slanted(self) -> bool:
        """True if walls were met at such angles that the weaker reflection at a slant is visible."""
        return float(self.cosines.min()) < SLANTED

    @property
    def slants_varied(self) -> bool:
        """True if incidence can be distinguished from amplitude: walls at several angles, some of them slanted."""
        met = self.distances < self.reach
        most = np.where(met, self.cosines, 0.0).max(axis=0)
        least = np.where(met, self.cosines, 1.0).min(axis=0)
        return self.slanted and float((most - least).max()) > VARIED

    def response(
        self, amplitude: Array, decay: Array, per_volt: Array, incidence: Array
    ) -> tuple[Array, Array]:
        """Return the unlimited response, (m, p), and the distance that determines misses, for parameters (m,).

        As kernels/sim/ranges.py.
        """
        seen = (self.distances < self.reach) * self.weights
        faced = np.exp(-self.distances[None] / decay[:, None, None]) * seen
        back, dim = faced.sum(axis=2), self.near[None]
        if self.slanted:
            c = self.cosines
            slanted = (faced * (c / (c + incidence[:, None, None] * (1.0 - c)))).sum(axis=2)
            some = slanted > 0.0
            ratio = np.where(some, back, 1.0) / np.where(some, slanted, 1.0)
            back, dim = slanted, dim + np.log(ratio) * decay[:, None]
        return np.asarray(back * amplitude[:, None] * np.exp(per_volt[:, None] * self.volts)), dim


def logistic(far: Array, most: Array, at: Array, width: Array) -> Array:
    """Return a probability that rises with distance, (m, p), at distances (m, p) or (1, p) [m]."""
    past = (far - at[:, None]) / width[:, None]
    return np.asarray(most[:, None] / (1.0 + np.exp(-np.clip(past, -500.0, 500.0))))


class Readings:
    """Base of the likelihoods of readings at places."""

    def __init__(
        self,
        placements: list[Placement],
        reach: float,
        parameters: tuple[Parameter, ...],
        weight: float,
        sensor: RangeSensor | None,
    ) -> None:
        self.places = Places.of(placements, reach)
        self.weight = weight
        self.parameters = parameters
        self.parameters += (BATTERY,) * self.places.battery_varied + (INCIDENCE,) * self.places.slants_varied
        if sensor is not None:
            self.parameters = tuple(scaled(parameter, sensor) for parameter in self.parameters)
        self._incidence = 0.0 if sensor is None else sensor.incidence

    @property
    def bins(self) -> Array:
        """Value of each bin of readings, (b,)."""
        raise NotImplementedError

    def _at(self, places: Places, values: Array) -> Array:
        """Return the probability of each bin at each of the places, (m, q, b)."""
        raise NotImplementedError

    def _shown(self, places: Places, values: Array) -> tuple[Array, Array]:
        """Return the values (b,) and probabilities (m, q, b) of bins for a figure."""
        return self.bins, self._at(places, values)

    def _response(self, places: Places, values: Array) -> tuple[Array, Array]:
        """Return `Places.response` for parameters (m, d), of which the first are amplitude and decay."""
        per_volt = column(self.parameters, values, BATTERY)
        incidence = column(self.parameters, values, INCIDENCE, self._incidence)
        return places.response(values[:, 0], values[:, 1], per_volt, incidence)

    def probabilities(self, values: Array) -> Array:
        """Return the probability of each bin at each placement, (m, p, b).

        Args:
            values: (m, d) values of the parameters, in the order of `parameters`.
        """
        return self._at(self.places, values)

    def quantiles(
        self, values: Array, distances: Array, cosines: Array, shares: Array
    ) -> tuple[Array, Array]:
        """Return means (q,) and quantiles (s, q) of readings at distances (q, rays) [m], over parameters (m, d)."""
        blank = [Placement(row, np.empty(0), cosines=c) for row, c in zip(distances, cosines, strict=True)]
        places = Places.of(blank, self.places.reach)
        chances = np.float64(0.0)
        for first in range(0, len(values), SHOWN_ROWS):
            bins, each = self._shown(places, values[first : first + SHOWN_ROWS])
            chances = chances + each.sum(axis=0) / len(values)
        summed = np.cumsum(chances, axis=1)
        place = np.array([(summed < share).sum(axis=1) for share in shares])
        return chances @ bins, bins[np.minimum(place, len(bins) - 1)]
