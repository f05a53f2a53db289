"""Draws from the posterior of a model that is linear near its best fit, with even priors between ends."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.special import ndtr, ndtri

from ._scatter import NoisePrior
from ._simulate import Floats

SWEEPS, BURN_IN = 600, 150
FLAT = 1e-9  # precision of a direction in which nothing was learned


def draw_linear(rng: np.random.Generator, at: Floats, jacobian: Floats, off: Floats) -> Floats:
    """The next draw of places 0..1 whose differences are off - jacobian @ (place - 0), whitened.

    Along each principal direction of the curvature in turn: there the posterior is a normal one, cut at the ends
    (hit and run within Gibbs sampling).

    Args:
        rng: Random numbers.
        at: (p,) the draw before.
        jacobian: (n, p) of the simulated.
        off: (n,) differences at place 0.
    """
    curvature = jacobian.T @ jacobian
    pull = jacobian.T @ off
    scales, directions = np.linalg.eigh(curvature)
    here = at.copy()
    for scale, direction in zip(scales, directions.T, strict=True):
        room = _room(here, direction)
        slope = float(direction @ (pull - curvature @ here))
        here = np.clip(here + direction * _cut_normal(rng, slope, float(scale), room), 0.0, 1.0)
    return np.asarray(here)


def _room(here: Floats, direction: Floats) -> tuple[float, float]:
    """How far one can go back and forth along a direction until an end comes."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([-here / direction, (1.0 - here) / direction])
    ends = np.where(np.abs(direction) < 1e-12, [[-np.inf], [np.inf]], ends)
    return float(ends.min(axis=0).max()), float(ends.max(axis=0).min())


def _cut_normal(rng: np.random.Generator, slope: float, scale: float, room: tuple[float, float]) -> float:
    """A draw whose logarithm falls as slope * x - scale * x^2 / 2, within its room."""
    low, high = room
    if not high > low:
        return 0.0
    if scale < FLAT:
        return float(rng.uniform(low, high))
    mean, sd = slope / scale, 1.0 / np.sqrt(scale)
    a, b = (low - mean) / sd, (high - mean) / sd
    if a > 0:  # the upper tail is the more exact from the other side
        return float(mean - sd * _between(rng, -b, -a))
    return float(mean + sd * _between(rng, a, b))


def _between(rng: np.random.Generator, a: float, b: float) -> float:
    lower, upper = ndtr(a), ndtr(b)
    if upper - lower < 1e-290:
        return b
    return float(np.clip(ndtri(rng.uniform(lower, upper)), a, b))


def walk(
    rng: np.random.Generator,
    at: Floats,
    prior: NoisePrior,
    log_likelihood: Callable[[Floats], float],
    reach: Floats,
) -> Floats:
    """The next draw of noise: a round of Metropolis steps, one number after the other, whose reach adapts.

    Args:
        rng: Random numbers.
        at: (q,) the draw before.
        prior: Of noise.
        log_likelihood: Of all numbers.
        reach: (q,) standard deviations of proposals; changed.
    """
    here, now = at.copy(), log_likelihood(at) + prior.log_density(at)
    for k in range(len(at)):
        new = here.copy()
        new[k] = abs(here[k] + reach[k] * rng.standard_normal())
        if not prior.low[k] <= new[k] <= prior.high[k]:
            reach[k] *= 0.95
            continue
        value = log_likelihood(new) + prior.log_density(new)
        if np.log(rng.uniform()) < value - now:
            here, now = new, value
            reach[k] = min(reach[k] * 1.1, prior.high[k])
        else:
            reach[k] *= 0.94
    return here
