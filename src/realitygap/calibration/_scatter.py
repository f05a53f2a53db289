"""How observed motions scatter around simulated ones: the noise of `sim`, and that of whoever observes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from realitygap.world import Distribution

from ._handles import MOTION_NOISE, Known
from ._prior import Parameter
from ._simulate import Bools, Floats

JITTER, TRAVEL_PER_M, HEADING_PER_M, HEADING_PER_S, ACROSS_PER_M, PLACE, ANGLE, WHEEL_PER_M, WHEEL = range(9)
"""What scatters: first the simulator's own numbers, as `MOTION_NOISE`, then what is not asked for."""

OBSERVER = (
    Parameter("skid.per_m", Distribution(uniform=(0.0, 0.1)), "m"),
    Parameter("camera.place", Distribution(uniform=(0.0, 0.02)), "m"),
    Parameter("camera.angle", Distribution(uniform=(0.0, 0.1)), "rad"),
    Parameter("encoder.noise_per_m", Distribution(uniform=(0.0, 0.05)), "m"),
    Parameter("encoder.count", Distribution(uniform=(0.0, 0.01)), "m"),
)
"""Skids sideways, errors of a camera in a place and a heading, errors of encoders that grow with the way or do not."""

LEAST = np.array([1e-4, 1e-4, 1e-4, 1e-4, 1e-4]) ** 2
"""Variance of each channel in any case [m2, rad2]: single precision, and what no camera tells."""


@dataclass(frozen=True)
class Scatter:
    """The likelihood of what differs between observed and simulated windows.

    Variances grow with the way and the time as in `sim`. A late command, or the one before it, moves all
    channels of a window together: ranks of their own in their covariance.

    Attributes:
        way: (w,) driven by the wheels, the mean of both [m].
        wheel_way: (w, 2) of each [m].
        moving_s: (w,) time in which a wheel turns [s].
        chord: (w,) share of a way that its arc leads away: 1 straight on.
        late: (w, 5) what one second of delay changes.
        carried: (w, 5) what one second of delay of the command before changes.
        seen: (w, 5) whether a channel was observed.
    """

    way: Floats
    chord: Floats
    wheel_way: Floats
    moving_s: Floats
    late: Floats
    carried: Floats
    seen: Bools

    def variances(self, noise: Floats) -> Floats:
        """(w, 5) of the channels, without what lateness does."""
        square = noise * noise
        own = np.empty(self.late.shape)
        own[:, 0] = square[TRAVEL_PER_M] * self.way * self.chord**2 + 2 * square[PLACE]
        own[:, 1] = square[ACROSS_PER_M] * self.way + 2 * square[PLACE]
        own[:, 2] = (
            square[HEADING_PER_M] * self.way + square[HEADING_PER_S] * self.moving_s + 2 * square[ANGLE]
        )
        own[:, 3:] = square[WHEEL_PER_M] * self.wheel_way + 2 * square[WHEEL]
        return np.asarray(own + LEAST)

    def log_likelihood(self, off: Floats, noise: Floats) -> float:
        """Of differences (w, 5), where those not observed are 0."""
        own = self.variances(noise)
        precise = self.seen / own
        jitter = noise[JITTER] ** 2 / 3.0  # the variance of jitter * U(-1, 1)
        (a, b), c = self._shared(precise)
        a, b, c = 1.0 + jitter * a, 1.0 + jitter * b, jitter * c
        whole = a * b - c * c
        weighed = precise * off
        one = np.einsum("wc,wc->w", weighed, self.late)
        two = np.einsum("wc,wc->w", weighed, self.carried)
        logs = np.log(own).sum(where=self.seen) + np.log(whole).sum()
        explained = (b * one * one - 2.0 * c * one * two + a * two * two) / whole
        return -0.5 * float(logs + (weighed * off).sum() - jitter * explained.sum())

    def _shared(self, precise: Floats) -> tuple[tuple[Floats, Floats], Floats]:
        """(w,) weighed squares of both kinds of lateness, and their product."""
        one = precise * self.late
        return (
            np.einsum("wc,wc->w", one, self.late),
            np.einsum("wc,wc->w", precise * self.carried, self.carried),
        ), np.einsum("wc,wc->w", one, self.carried)

    def whitened(self, rows: Floats, noise: Floats) -> Floats:
        """Differences (w, 5) or their derivatives (w, 5, p), made of variance 1 and independent.

        Both kinds of lateness are turned into principal directions, and what lies along each is shrunk.
        """
        deep = rows.reshape(*rows.shape[:2], -1)
        root = np.sqrt(self.seen / self.variances(noise))
        scaled = root[:, :, None] * deep
        (a, b), c = self._shared(root * root)
        angle = 0.5 * np.arctan2(2.0 * c, a - b)
        cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
        first = root * (cos * self.late + sin * self.carried)
        second = root * (cos * self.carried - sin * self.late)
        for direction in (first, second):
            size = np.einsum("wc,wc->w", direction, direction)
            share = 1.0 - 1.0 / np.sqrt(1.0 + noise[JITTER] ** 2 / 3.0 * size)
            along = np.einsum("wc,wcp->wp", direction, scaled) * (share / np.maximum(size, 1e-300))[:, None]
            scaled -= direction[:, :, None] * along[:, None, :]
        return np.asarray(scaled.reshape(rows.shape))


def scatter_parameters(known: Known) -> list[Parameter]:
    """What scatters, in the order of its numbers."""
    return [*(known[name] for name in MOTION_NOISE), *OBSERVER]


@dataclass(frozen=True)
class NoisePrior:
    """What is thought possible of the numbers that scatter.

    Attributes:
        low, high: (q,) ends.
        is_ratio: (q,) whether ratios are as likely, and not differences.
    """

    low: Floats
    high: Floats
    is_ratio: Bools

    @classmethod
    def of(cls, parameters: Sequence[Parameter]) -> NoisePrior:
        """That of parameters."""
        priors = [parameter.prior for parameter in parameters]
        return cls(
            np.array([prior.lowest for prior in priors]),
            np.array([prior.highest for prior in priors]),
            np.array([prior.log_uniform is not None for prior in priors]),
        )

    def log_density(self, noise: Floats) -> float:
        """Of noise within the ends."""
        return -float(np.log(noise[self.is_ratio]).sum())

    def inside(self, noise: Floats) -> Floats:
        """The nearest noise that is possible."""
        return np.clip(noise, self.low, self.high)
