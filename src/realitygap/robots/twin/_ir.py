"""A twin's infrared sensors: light sent in a cone, the part that returns, and the counted pulses."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ._model import LIGHT, TwinModel, numbers_for
from ._physics import Physics

DARK = 1e-12  # light below which no pulse is seen


def places_of(model: TwinModel) -> list[tuple[float, float]]:
    """Return the place of each sensor, x and y [m], scaled with the shell."""
    body = model.body
    return [(mount.x * body.length_scale, mount.y * body.width_scale) for mount in model.ir.mount]


class IrSensors:
    """The infrared sensors of one twin in one trial.

    The light of a ray that meets a wall after d comes back as gain * (half / d)^2 * cos(angle)^incidence, weighted by a
    lobe with half its strength at the edge of the cone. The detected share of the pulses is a logistic function of the
    light's logarithm. Each sensor counts its own pulses, so that three sensors with the same emitter differ.

    Args:
        model: The twin.
        number: Number of the trial.
    """

    def __init__(self, model: TwinModel, number: int) -> None:
        ir = self._ir = model.ir
        self._seed, self._number = model.seed, number
        self._full, self._odd = model.battery.full, model.oddities
        self._places = places_of(model)
        parts = np.linspace(-1.0, 1.0, ir.rays) if ir.rays > 1 else np.zeros(1)
        self._spread = parts * ir.cone
        weights = 1 - 0.5 * parts**2
        self._weights = weights / weights.sum()
        self._stray = 0.0
        self._held: tuple[int, NDArray[np.float64]] | None = None

    def light(self, physics: Physics, volts: float) -> NDArray[np.float64]:
        """Return the light that returns to each sensor, (s,); 1 if half of the pulses are detected."""
        ir = self._ir
        found: dict[tuple[float, float, float], float] = {}
        values = []
        for mount, (x, y) in zip(ir.mount, self._places, strict=True):
            where = (x, y, mount.direction)
            if where not in found:
                far, cosine = physics.look(x, y, mount.direction + self._spread, ir.reach)
                back = (ir.half / np.maximum(far, 1e-3)) ** 2 * cosine**ir.incidence
                found[where] = float(self._weights @ np.where(far < ir.reach, back, 0.0))
            values.append(mount.gain * found[where])
        light: NDArray[np.float64] = np.array(values) * (max(volts, 0.0) / self._full) ** ir.supply
        return light

    def readings(
        self, physics: Physics, volts: float, step: int, stronger: float = 1.0
    ) -> NDArray[np.float64]:
        """Return the share of pulses counted before command `step`, 0..1, (s,). Light may reach farther than usual."""
        odd = self._odd
        if odd.latch and self._held is not None and step - self._held[0] <= odd.latch:
            return self._held[1]
        counts = self.count(self.light(physics, volts) * stronger**2, step)
        readings = counts / self._ir.pulses
        if odd.inverted:
            readings = 1.0 - readings
        self._held = (step, readings)
        return readings

    def count(self, light: NDArray[np.float64], step: int) -> NDArray[np.int64]:
        """Return the pulses counted for light (s,), with the noise of a step, (s,)."""
        ir = self._ir
        random = numbers_for(self._seed, self._number, LIGHT, step)
        bright = light
        if ir.noise:
            common = math.sqrt(ir.memory)
            own = random.standard_normal(len(light) + 1)
            self._stray = ir.memory * self._stray + math.sqrt(1 - ir.memory**2) * float(own[0])
            bright = light * np.exp(ir.noise * (common * self._stray + math.sqrt(1 - ir.memory) * own[1:]))
        share = 1.0 / (1.0 + np.maximum(bright, DARK) ** -ir.steepness)
        if ir.spread:
            strength = 1 / ir.spread - 1
            share = random.beta(np.maximum(share * strength, 1e-9), np.maximum((1 - share) * strength, 1e-9))
        counts = random.binomial(ir.pulses, share)
        if ir.missed:
            counts[random.random(len(counts)) < ir.missed] = 0
        return np.asarray(counts, np.int64)
