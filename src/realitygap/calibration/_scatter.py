"""The scatter of observed motions around simulated ones: the noise of `sim` and of the observer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from realitygap.world import Distribution

from ._prior import MOTION_NOISE, Known, Parameter
from ._simulate import Bools, Floats

JITTER, TRAVEL_PER_M, HEADING_PER_M, HEADING_PER_S, ACROSS_PER_M, PLACE, ANGLE, WHEEL_PER_M, WHEEL = range(9)
"""Indices of the sources of scatter: first the simulator's own numbers, as in `MOTION_NOISE`, then nuisance
parameters."""

OBSERVER = (
    Parameter("skid.per_m", Distribution(uniform=(0.0, 0.1)), "m"),
    Parameter("camera.place", Distribution(uniform=(0.0, 0.02)), "m"),
    Parameter("camera.angle", Distribution(uniform=(0.0, 0.1)), "rad"),
    Parameter("encoder.noise_per_m", Distribution(uniform=(0.0, 0.05)), "m"),
    Parameter("encoder.count", Distribution(uniform=(0.0, 0.01)), "m"),
)
"""Nuisance parameters: sideways skids, errors of a camera's place and heading, and errors of encoders, relative and
fixed."""

LEAST = np.array([3e-5, 3e-5, 3e-5, 3e-5, 3e-5]) ** 2
"""Variance of each channel in any case [m2, rad2]: single precision, and what no camera tells."""


@dataclass(frozen=True)
class Scatter:
    """The likelihood of what differs between observed and simulated windows.

    Variances grow with the way and the time as in `sim`. Early and late commands move all channels of a window
    together.

    Attributes:
        way: (w,) driven by the wheels, the mean of both [m].
        wheel_way: (w, 2) distance of each wheel [m].
        moving_s: (w,) time in which a wheel turns [s].
        chord: (w,) length of the chord divided by that of the arc: 1 straight on.
        late: (w, 5, 5) covariance that early and late commands make, by the square of a second of jitter.
        seen: (w, 5) True if a channel was observed.
    """

    way: Floats
    chord: Floats
    wheel_way: Floats
    moving_s: Floats
    late: Floats
    seen: Bools

    def variances(self, noise: Floats) -> Floats:
        """Return the variances of the channels, (5, w), without the effect of late commands."""
        square = noise * noise
        own = np.empty((5, len(self.way)))
        own[0] = square[TRAVEL_PER_M] * self.way * self.chord**2 + 2 * square[PLACE]
        own[1] = square[ACROSS_PER_M] * self.way + 2 * square[PLACE]
        own[2] = square[HEADING_PER_M] * self.way + square[HEADING_PER_S] * self.moving_s + 2 * square[ANGLE]
        own[3:] = square[WHEEL_PER_M] * self.wheel_way.T + 2 * square[WHEEL]
        return np.asarray(own + LEAST[:, None])

    def log_likelihood(self, off: Floats, noise: Floats) -> float:
        """Return the log-likelihood of differences, (w, 5), with 0 for missing ones."""
        return float(self.log_likelihoods(off, noise).sum())

    def log_likelihoods(self, off: Floats, noise: Floats) -> Floats:
        """Return the log likelihood of each window, (w,)."""
        root = self._root(noise)
        white = _solved(root, off.T)
        sizes = np.einsum("ccw->cw", root)
        return np.asarray(-0.5 * np.einsum("cw,cw->w", white, white) - np.log(sizes).sum(axis=0))

    def whitened(self, rows: Floats, noise: Floats) -> Floats:
        """Return differences (w, 5) or their derivatives (w, 5, p), made of variance 1 and independent."""
        deep = np.moveaxis(rows, 0, -1)
        seen = np.where(self.seen.T.reshape(5, *(1,) * (deep.ndim - 2), -1), deep, 0.0)
        return np.asarray(np.moveaxis(_solved(self._root(noise), seen), -1, 0))

    def _root(self, noise: Floats) -> Floats:
        """Return lower triangles whose squares are the covariances, (5, 5, w); 1 for unobserved channels."""
        seen = self.seen.T
        covariance = noise[JITTER] ** 2 * np.moveaxis(self.late, 0, -1) * (seen[:, None] & seen)
        at = np.arange(5)
        covariance[at, at] = np.where(seen, covariance[at, at] + self.variances(noise), 1.0)
        return _cholesky(covariance)


def _cholesky(matrices: Floats) -> Floats:
    """Decompose small matrices, (n, n, w), in one call: this is far faster than one by one."""
    root = np.zeros_like(matrices)
    for k in range(len(matrices)):
        root[k, k] = np.sqrt(matrices[k, k] - np.einsum("jw,jw->w", root[k, :k], root[k, :k]))
        for i in range(k + 1, len(matrices)):
            root[i, k] = (matrices[i, k] - np.einsum("jw,jw->w", root[i, :k], root[k, :k])) / root[k, k]
    return root


def _solved(root: Floats, rows: Floats) -> Floats:
    """Return the solution x of root (n, n, w) times x = `rows`, (n, ..., w)."""
    solution = np.empty_like(rows)
    for k in range(len(root)):
        solution[k] = rows[k]
        for j in range(k):
            solution[k] -= root[k, j] * solution[j]
        solution[k] /= root[k, k]
    return solution


def scatter_parameters(known: Known) -> list[Parameter]:
    """Return the noise parameters, in the order of their numbers."""
    return [*(known[name] for name in MOTION_NOISE), *OBSERVER]


@dataclass(frozen=True)
class NoisePrior:
    """The prior of the noise parameters.

    Attributes:
        low, high: (q,) ends.
        is_ratio: (q,) True for a prior that is uniform in the logarithm.
    """

    low: Floats
    high: Floats
    is_ratio: Bools

    @classmethod
    def of(cls, parameters: Sequence[Parameter]) -> NoisePrior:
        """Return the prior of parameters."""
        priors = [parameter.prior for parameter in parameters]
        return cls(
            np.array([prior.lowest for prior in priors]),
            np.array([prior.highest for prior in priors]),
            np.array([prior.log_uniform is not None for prior in priors]),
        )

    def log_density(self, noise: Floats) -> float:
        """Return the log-density of noise within its limits."""
        return -float(np.log(noise[self.is_ratio]).sum())

    def inside(self, noise: Floats) -> Floats:
        """Return the nearest noise that is possible."""
        return np.clip(noise, self.low, self.high)

    def places(self, noise: Floats) -> Floats:
        """Return places between the ends, 0 to 1, on the scale on which the prior is uniform, (..., q)."""
        low, high = self._ends()
        scaled = np.where(self.is_ratio, np.log(np.maximum(noise, 1e-300)), noise)
        return np.asarray((scaled - low) / (high - low))

    def at(self, places: Floats) -> Floats:
        """Return the noise at places, (..., q). Places outside count as the nearest end."""
        low, high = self._ends()
        scaled = low + np.clip(places, 0.0, 1.0) * (high - low)
        return np.where(self.is_ratio, np.exp(scaled), scaled)

    def _ends(self) -> tuple[Floats, Floats]:
        with np.errstate(divide="ignore"):
            logs = np.log([self.low, self.high])
        return np.where(self.is_ratio, logs[0], self.low), np.where(self.is_ratio, logs[1], self.high)
