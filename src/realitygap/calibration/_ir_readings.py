"""Readings of one range sensor of a robot that stands before walls."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap.world import RobotModel

Array = NDArray[np.float64]

SAME_V = 0.05
"""Voltages that differ by less say nothing of a battery [V]."""


def refuse_response(robot: RobotModel, number: int, response: str) -> None:
    """Return where a range sensor is an infrared one.

    Raises:
        ValueError: It is another.
    """
    if response not in ("ir", "pulses"):
        raise ValueError(
            f"range.{number} of robot {robot.name!r} has the response {response!r}, expected ir or pulses: of others "
            "there is no noise to fit."
        )


@dataclass(frozen=True)
class Placement:
    """Where the robot was put once, and what the sensor read there.

    Attributes:
        distances: (rays,) along the sensor's rays to what is nearest [m], at most its reach.
        readings: (n,) one after the other, 0..1.
        battery_v: [V]; nan where it is not known.
    """

    distances: Array
    readings: Array
    battery_v: float = math.nan


@dataclass(frozen=True)
class Places:
    """Placements as arrays.

    Attributes:
        distances: (p, rays) [m].
        near: (p,) the least of each [m].
        weights: (rays,) of the lobe; they add up to 1.
        volts: (p,) battery less its mean; 0 where it is not known.
        reach: Of the sensor [m].
    """

    distances: Array
    near: Array
    weights: Array
    volts: Array
    reach: float

    @classmethod
    def of(cls, placements: list[Placement], reach: float) -> Places:
        """Those of placements."""
        distances = np.array([placement.distances for placement in placements], np.float64)
        volts = np.array([placement.battery_v for placement in placements], np.float64)
        mean = volts[np.isfinite(volts)].mean() if np.isfinite(volts).any() else 0.0
        rays = distances.shape[1]
        weights = 1.0 - 0.5 * np.linspace(-1.0, 1.0, rays) ** 2 if rays > 1 else np.ones(1)
        return cls(
            distances, distances.min(axis=1), weights / weights.sum(), np.nan_to_num(volts - mean), reach
        )

    @property
    def battery_varied(self) -> bool:
        """Whether the battery can be told from everything else."""
        return float(np.ptp(self.volts)) > SAME_V

    def response(self, amplitude: Array, decay: Array, per_volt: Array) -> Array:
        """(m, p) what comes back, not limited, for (m,) parameters: as kernels/_sim_range.py."""
        seen = (self.distances < self.reach) * self.weights
        back = np.exp(-self.distances[None] / decay[:, None, None]) * seen
        return np.asarray(back.sum(axis=2) * amplitude[:, None] * np.exp(per_volt[:, None] * self.volts))

    def logistic(self, most: Array, at: Array, width: Array) -> Array:
        """(m, p) a probability that rises with distance."""
        past = (self.near[None] - at[:, None]) / width[:, None]
        return np.asarray(most[:, None] / (1.0 + np.exp(-np.clip(past, -500.0, 500.0))))
