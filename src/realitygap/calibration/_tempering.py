"""Draws from a posterior over a unit cube, and the ends of what observations do not refute.

Particles go from the prior to the posterior by steps of temperature. A likelihood can be constant over a range, as with
readings that count pulses, or highest at an end of the prior. Then draws leave out an edge that may contain the true
value. A likelihood ratio does not: it gives the ends of each parameter, by its profile likelihood.

Sources: Del Moral, Doucet & Jasra (2006), sequential Monte Carlo samplers, with temperatures chosen so that the
effective number of particles stays at a share of them. Moves: ter Braak (2006), differential evolution. Ends: Wilks
(1938); intervals by the profile likelihood, Venzon & Moolgavkar (1988). Differs: ends are searched by random steps, as
the likelihood has steps, so that they may lie a little inside.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]

KEPT = 0.6
"""Effective share of particles that a step of temperature leaves."""

MOVES, LAST_MOVES = 5, 20
"""Moves of each particle after a step, and once the temperature is that of the posterior."""

LEAST_SCALE, MOST_SCALE = 0.05, 4.0
"""Minimum and maximum of the size of a move, relative to differences of two draws times 2.38 / sqrt(2 d)."""

FINEST = 3.0
"""Powers of ten by which a short move, or a step of a search, is shorter, at most."""

MOST_STAGES = 200


def sample_posterior(
    log_likelihood: Callable[[Array], Array], d: int, rng: np.random.Generator, m: int = 1000
) -> Array:
    """Return draws from the posterior under a uniform prior over the unit cube, (m, d).

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
    """Return the largest step of temperature, up to `most`, that leaves the share KEPT of particles."""

    def kept(step: float) -> float:
        logs = step * values
        return float(np.exp(2 * scipy.special.logsumexp(logs) - scipy.special.logsumexp(2 * logs))) / len(
            values
        )

    if kept(most) >= KEPT:
        return most
    low, high = 0.0, most
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if kept(middle) >= KEPT else (low, middle)
    return max(low, most * 1e-12)


def _resampled(weights: Array, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return places by their weights, systematically."""
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
    """Move each particle once, in place; the share of long moves that were taken.

    A move is a difference of two other particles: where the posterior has parts of different widths, differences have
    them, too. A third of the moves are along one axis, as corners of a likelihood that is level inside are narrow, and
    half of them are shorter, for a part that few particles have found yet.
    """
    m, d = places.shape
    first, second = rng.integers(m, size=(2, m))
    jumps = (places[first] - places[second]) * (2.38 / np.sqrt(2 * d)) + rng.normal(0, 1e-9, (m, d))
    axes = rng.integers(d, size=(m, 1)) == np.arange(d)
    jumps = np.where(rng.random((m, 1)) < 1 / 3, np.where(axes, jumps * np.sqrt(d), 0.0), jumps)
    short = rng.random((m,)) < 1 / 2
    jumps[short] *= 10.0 ** -rng.uniform(0, FINEST, (int(short.sum()), 1))
    proposed = _reflected(places + scale * jumps)
    news = log_likelihood(proposed)
    accepted = np.log(rng.random(m)) < temperature * (news - values)
    places[accepted], values[accepted] = proposed[accepted], news[accepted]
    return float(accepted[~short].mean())


def _reflected(places: Array) -> Array:
    """Return places moved back into the cube, as by mirrors at its sides."""
    folded = np.mod(places, 2.0)
    return np.where(folded > 1.0, 2.0 - folded, folded)


REFUTED = 1.3528
"""Half of the 90 % quantile of chi-squared with one degree of freedom."""

CLIMBERS, ROUNDS = 24, 120
"""Points that search for one end, and the steps that each tries."""

CLIMB = 40
"""Steps by which draws first climb to the greatest likelihood."""


def level_ends(log_likelihood: Callable[[Array], Array], draws: Array, rng: np.random.Generator) -> Array:
    """Return the least and greatest place of each parameter that a likelihood ratio does not refute, shape (2, d).

    Args:
        log_likelihood: (m, d) places in the unit cube to (m,) logarithms of the likelihood, finite.
        draws: (m, d) places drawn from the posterior; their differences are the directions of the search.
        rng: Random numbers.
    """
    m, d = draws.shape

    def stepped(points: Array) -> Array:
        first, second = rng.integers(m, size=(2, len(points)))
        size = 10.0 ** -rng.uniform(-0.3, FINEST, (len(points), 1))
        jumps = (draws[first] - draws[second]) * size
        axes = rng.integers(d, size=(len(points), 1)) == np.arange(d)
        jumps = np.where(rng.random((len(points), 1)) < 1 / 3, np.where(axes, jumps, 0.0), jumps)
        return np.asarray(np.clip(points + jumps, 0.0, 1.0))

    places, values = draws.copy(), log_likelihood(draws)
    for _ in range(CLIMB):
        new = stepped(places)
        news = log_likelihood(new)
        better = news > values
        places[better], values[better] = new[better], news[better]
    near = np.argsort(-values)
    best = values[near[0]]
    # those that are left at a lower peak start from the best
    start = places[np.where(values[near] >= best - REFUTED, near, near[0])][:CLIMBERS]
    points = np.tile(start, (2 * d, 1))
    axis = np.repeat(np.tile(np.arange(d), 2), len(start))
    sign = np.repeat([-1.0, 1.0], d * len(start))
    at = np.arange(len(points))
    for _ in range(ROUNDS):
        new = stepped(points)
        farther = sign * (new[at, axis] - points[at, axis]) >= 0
        news = np.full(len(points), -np.inf)
        news[farther] = log_likelihood(new[farther])
        moved = news >= best - REFUTED
        points[moved] = new[moved]
    reached = points[at, axis].reshape(2, d, len(start))
    return np.stack([reached[0].min(axis=1), reached[1].max(axis=1)])
