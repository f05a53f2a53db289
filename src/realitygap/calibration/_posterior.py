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


def sample_around(
    rng: np.random.Generator,
    center: Floats,
    spread: Floats,
    log_likelihoods: Callable[[Floats], Floats],
    rounds: int = 3,
    n: int = 300,
) -> Floats:
    """(n, p) draws from the posterior over places 0..1 of a model that need not be linear.

    Importance sampling from a t distribution with 4 degrees of freedom, which each round fits anew to the draws that
    the round before weighed (population Monte Carlo, Cappe et al. 2004).

    Args:
        rng: Random numbers.
        center: (p,) where to begin.
        spread: (p, p) covariance to begin with.
        log_likelihoods: (m,) at places (m, p).
        rounds, n: How often, and of how many draws.
    """
    p = len(center)
    places, weights = np.tile(center, (n, 1)), np.full(n, 1.0 / n)
    for _ in range(rounds):
        root = np.linalg.cholesky(spread + 1e-10 * np.eye(p))
        normal = rng.standard_normal((n, p))
        tails = np.sqrt(4.0 / rng.chisquare(4.0, n))
        places = center + (normal * tails[:, None]) @ root.T
        inside = ((places >= 0.0) & (places <= 1.0)).all(axis=1)
        places = np.clip(places, 0.0, 1.0)
        proposed = -0.5 * (4.0 + p) * np.log1p((normal**2).sum(axis=1) * tails**2 / 4.0)
        logs = np.where(inside, log_likelihoods(places) - proposed, -np.inf)
        if not np.isfinite(logs).any():
            break
        weights = np.exp(logs - logs.max())
        weights /= weights.sum()
        tempered = np.sqrt(weights) / np.sqrt(weights).sum()  # so that few heavy draws do not decide alone
        center = tempered @ places
        off = places - center
        spread = (tempered[:, None] * off).T @ off
    return np.asarray(places[rng.choice(n, n, p=weights)])
