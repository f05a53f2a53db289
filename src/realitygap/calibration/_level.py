"""Ends of the values that observations do not refute: of each parameter, by its profile likelihood.

A likelihood can be constant over a range, as with readings that count pulses, or highest at an end of the prior. Then
draws from a posterior leave out an edge that may contain the true value. A likelihood ratio does not.

Source: Wilks (1938); intervals by the profile likelihood, Venzon & Moolgavkar (1988). Differs: ends are searched by
random steps, as the likelihood has steps, so that they may lie a little inside.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REFUTED = 1.3528
"""Half of the 90 % quantile of chi-squared with one degree of freedom."""

CLIMBERS, ROUNDS = 24, 120
"""Points that search for one end, and the steps that each tries."""

CLIMB = 40
"""Steps by which draws first climb to the greatest likelihood."""

FINEST = 3.0
"""Powers of ten by which a step is shorter than a difference of two draws, at most."""


def level_ends(log_likelihood: Callable[[Array], Array], draws: Array, rng: np.random.Generator) -> Array:
    """Return the least and greatest place of each parameter that a likelihood ratio does not refute, shape (2, d).

    Args:
        log_likelihood: (m, d) places in the unit cube to (m,) logarithms of the likelihood, finite.
        draws: (m, d) places drawn from the posterior; their differences are the directions of the search.
        rng: Random numbers.
    """
    m, d = draws.shape

    def stepped(points: Array) -> Array:
        one, other = rng.integers(m, size=(2, len(points)))
        size = 10.0 ** -rng.uniform(-0.3, FINEST, (len(points), 1))
        jumps = (draws[one] - draws[other]) * size
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
