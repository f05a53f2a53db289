"""Draws from a posterior over a unit cube: particles go from the prior to it by steps of temperature.

Source: Del Moral, Doucet & Jasra (2006), sequential Monte Carlo samplers, with temperatures chosen so that the
effective number of particles stays at a share of them. Differs: moves are random walks with the particles' own
covariance.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

Array = NDArray[np.float64]

KEPT = 0.6
"""Effective share of particles that a step of temperature leaves."""

MOVES, LAST_MOVES = 5, 20
"""Moves of each particle after a step, and once the temperature is that of the posterior."""

LEAST_SCALE, MOST_SCALE = 0.05, 4.0
"""Of a move, against 2.38 / sqrt(d) standard deviations."""

MOST_STAGES = 200


def sample_posterior(
    log_likelihood: Callable[[Array], Array], d: int, rng: np.random.Generator, m: int = 1000
) -> Array:
    """(m, d) draws from the posterior under a uniform prior over the unit cube.

    Args:
        log_likelihood: (m, d) places in the cube to (m,) logarithms of the likelihood, finite.
        d: Parameters.
        rng: Random numbers.
        m: Draws.
    """
    places = (rng.permuted(np.tile(np.arange(m), (d, 1)), axis=1).T + rng.random((m, d))) / m
    values = log_likelihood(places)
    temperature, scale = 0.0, 1.0
    for _ in range(MOST_STAGES):
        step = _step(values, 1.0 - temperature)
        temperature += step
        weights = np.exp(step * (values - values.max()))
        chosen = _resampled(weights / weights.sum(), rng)
        places, values = places[chosen], values[chosen]
        is_last = temperature >= 1.0
        for _ in range(LAST_MOVES if is_last else MOVES):
            share = _move(places, values, log_likelihood, temperature, scale, rng)
            scale = float(np.clip(scale * np.exp(share - 0.25), LEAST_SCALE, MOST_SCALE))
        if is_last:
            break
    return places


def _step(values: Array, most: float) -> float:
    """The largest step of temperature, up to `most`, that leaves the share KEPT of particles."""

    def kept(step: float) -> float:
        logs = step * values
        return float(np.exp(2 * logsumexp(logs) - logsumexp(2 * logs))) / len(values)

    if kept(most) >= KEPT:
        return most
    low, high = 0.0, most
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if kept(middle) >= KEPT else (low, middle)
    return max(low, most * 1e-12)


def _resampled(weights: Array, rng: np.random.Generator) -> NDArray[np.int64]:
    """Places by their weights, systematically."""
    m = len(weights)
    points = (rng.random() + np.arange(m)) / m
    return np.minimum(np.searchsorted(np.cumsum(weights), points), m - 1)


def _move(
    places: Array,
    values: Array,
    log_likelihood: Callable[[Array], Array],
    temperature: float,
    scale: float,
    rng: np.random.Generator,
) -> float:
    """Move each particle once, in place; the share that moved.

    A third of the moves are along one axis: corners of a likelihood that is level inside are narrow.
    """
    m, d = places.shape
    spread: Array = np.cov(places.T).reshape(d, d) + 1e-12 * np.eye(d)
    root = np.linalg.cholesky(spread)
    jumps = (rng.standard_normal((m, d)) @ root.T) * (2.38 / np.sqrt(d))
    alone = rng.random((m, 1)) < 1 / 3
    axis = rng.integers(d, size=m)
    single = np.zeros((m, d))
    single[np.arange(m), axis] = rng.standard_normal(m) * np.sqrt(np.diag(spread))[axis] * 2.0
    proposed = _reflected(places + scale * np.where(alone, single, jumps))
    news = log_likelihood(proposed)
    accepted = np.log(rng.random(m)) < temperature * (news - values)
    places[accepted], values[accepted] = proposed[accepted], news[accepted]
    return float(accepted.mean())


def _reflected(places: Array) -> Array:
    """Back into the cube, as from mirrors at its sides."""
    folded = np.mod(places, 2.0)
    return np.where(folded > 1.0, 2.0 - folded, folded)
