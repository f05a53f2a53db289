"""The likelihood of readings of sensors with the response `lorentz`, such as a Thymio's."""

from __future__ import annotations

import math

import numpy as np

from realitygap.world import RangeSensor

from ._mixture import MixtureReadings, Parts
from ._readings import Array, Placement, Places
from ._scales import AMPLITUDE, Scale

HALF_WIDTH = Scale("half_width", 0.02, 0.5, "ratio", "m", AMPLITUDE.advice)
NOISE = Scale("noise_uniform", 0.0002, 0.1, "ratio", "", "Record more readings in one place.")


class LorentzReadings(MixtureReadings):
    """Readings whose mean follows `lorentz` of kernels/sim/ranges.py, with noise of one spread at all distances.

    The noise of `sim` is even; here it is normal with the same standard deviation.

    Args:
        placements: Placements with their readings.
        sensor: Sensor, whose reach, `peak`, cone, and `keeps_edge` are not fitted.
        weight: Weight of a reading: below 1 if readings have less information than as many independent ones.
    """

    def __init__(self, placements: list[Placement], sensor: RangeSensor, weight: float = 1.0) -> None:
        super().__init__(placements, sensor.reach, weight)
        self.scales = (AMPLITUDE, HALF_WIDTH, NOISE)
        self._sensor = sensor

    def parts(self, places: Places, values: Array) -> Parts:
        """Return (m, p) mean and standard deviation; nothing is missed, and nothing is any number."""
        amplitude, half_width, noise = (values[:, k, None, None] for k in range(3))

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
        spread = np.broadcast_to(noise[..., 0] / math.sqrt(3), back.shape)
        none = np.zeros_like(back)
        return back, spread, none, none
