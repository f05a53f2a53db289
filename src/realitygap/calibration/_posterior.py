"""Draws from posteriors with even priors between ends, and the ends of what observations do not refute.

There are three samplers. `draw_linear` and `walk` are for a model that is linear near its best fit. `sample_clusters`
is for a model that is not smooth. `sample_posterior` is for a likelihood that may be constant over a range, as with
readings that count pulses, or highest at an end of the prior. There, draws leave out an edge that may contain the true
value. A likelihood ratio does not: `level_ends` gives the ends of each parameter, by its profile likelihood.

Sources of `sample_posterior`: Del Moral, Doucet & Jasra (2006), sequential Monte Carlo samplers, with temperatures
chosen so that the effective number of particles stays at a share of them; moves by ter Braak (2006), differential
evolution. Of `level_ends`: Wilks (1938); Venzon & Moolgavkar (1988). Differs: ends are searched by random steps, as the
likelihood has steps, so that they may lie a little inside.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from ._scatter import NoisePrior
from ._simulate import Floats, Ints

N_DRAWS = 500
"""Draws that a calibration keeps."""
SWEEPS, BURN_IN = 600, 150
HEATS = (0.02, 0.06, 0.2, 0.5, 1.0, 1.0, 1.0)  # parts of the log likelihood that count, round by round
WIDER = 2.0  # times the covariance found, to look around in
FLAT = 1e-9  # precision of a direction in which nothing was learned


def draw_linear(rng: np.random.Generator, at: Floats, jacobian: Floats, off: Floats) -> Floats:
    """Return the next draw of places 0..1 whose differences are off - jacobian @ (place - 0), whitened.

    Along each principal direction of the curvature in turn: there the posterior is a normal one, cut at the ends
    (hit and run within Gibbs sampling).

    Args:
        rng: Random numbers.
        at: (p,) the draw before.
        jacobian: (n, p) derivatives of the simulated differences.
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
    """Return the distances to the ends of the prior, back and forth along a direction."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([-here / direction, (1.0 - here) / direction])
    ends = np.where(np.abs(direction) < 1e-12, [[-np.inf], [np.inf]], ends)
    return float(ends.min(axis=0).max()), float(ends.max(axis=0).min())


def _cut_normal(rng: np.random.Generator, slope: float, scale: float, room: tuple[float, float]) -> float:
    """Return a draw whose logarithm falls as slope * x - scale * x^2 / 2, within its room."""
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
    lower, upper = scipy.special.ndtr(a), scipy.special.ndtr(b)
    if upper - lower < 1e-290:
        return b
    return float(np.clip(scipy.special.ndtri(rng.uniform(lower, upper)), a, b))


def walk(
    rng: np.random.Generator,
    at: Floats,
    prior: NoisePrior,
    log_likelihood: Callable[[Floats], float],
    reach: Floats,
) -> Floats:
    """Return the next draw of noise: a round of Metropolis steps, one number after the other, whose reach adapts.

    Args:
        rng: Random numbers.
        at: (q,) the draw before.
        prior: Prior of the noise.
        log_likelihood: Log likelihood of all numbers.
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


def sample_clusters(
    rng: np.random.Generator,
    center: Floats,
    log_likelihoods: Callable[[Floats], Floats],
    n_draws: int,
    reach: float = 0.12,
    n: int = 300,
) -> Floats:
    """Return places in 0 to 1 that observations in clusters allow, (n_draws, p), for a model that is not smooth.

    Places are drawn around the best ones so far, from a t distribution that is refitted in each round (population Monte
    Carlo, Cappe et al. 2004). Each draw has new weights of the clusters (weighted likelihood bootstrap, Newton &
    Raftery 1994). So draws spread if clusters disagree by more than noise.

    Args:
        rng: Random numbers.
        center: (p,) first place.
        log_likelihoods: Function that returns the log likelihood of each of k clusters at places (m, p), (m, k).
        n_draws: Number of draws.
        reach: Standard deviation to begin with.
        n: Number of places in each round.
    """
    p = len(center)
    spread = reach**2 * np.eye(p)
    places, logs, proposed = np.empty((0, p)), np.empty((0, 0)), np.empty(0)
    for heat in HEATS:
        root = np.linalg.cholesky(spread + 1e-7 * np.eye(p))
        normal, tails = rng.standard_normal((n, p)), np.sqrt(4.0 / rng.chisquare(4.0, n))
        new = center + (normal * tails[:, None]) @ root.T
        density = -0.5 * (4.0 + p) * np.log1p(((normal * tails[:, None]) ** 2).sum(axis=1) / 4.0)
        density -= np.log(np.diag(root)).sum()
        inside = ((new >= 0.0) & (new <= 1.0)).all(axis=1)
        found = log_likelihoods(new[inside])
        places = np.concatenate([places, new[inside]])
        proposed = np.concatenate([proposed, density[inside]])
        logs = np.concatenate([logs, found]) if logs.size else found
        drawn = places[_weighed_anew(rng, heat * logs, proposed, n)]
        center, spread = drawn.mean(axis=0), WIDER * np.cov(drawn.T).reshape(p, p)
    k = logs.shape[1]
    if k == 1:
        return np.asarray(places[_weighed_anew(rng, logs, proposed, n_draws)])
    # the best by each set of weights: with draws around it, too, what is not known would count twice
    best = places[np.argmax(_shares(rng, n_draws, k) @ logs.T, axis=1)]
    middle = np.median(best, axis=0)
    return np.asarray(np.clip(middle + _few(k) * (best - middle), 0.0, 1.0))


def _shares(rng: np.random.Generator, n: int, k: int) -> Floats:
    """Return weights of clusters, (n, k)."""
    return np.asarray(k * rng.dirichlet(np.ones(k), n))


def _few(k: int) -> float:
    """Return the factor by which k reweighted clusters spread too little: Student's interval over the normal one."""
    return float(scipy.special.stdtrit(k - 1, 0.95) / scipy.special.ndtri(0.95) * np.sqrt(k / (k - 1)))


def _weighed_anew(rng: np.random.Generator, logs: Floats, proposed: Floats, n: int) -> Ints:
    """Return indices of places, (n,), each with other weights (Dirichlet) of the clusters."""
    scores = _shares(rng, n, logs.shape[1]) @ logs.T - proposed
    picks = scores + rng.gumbel(size=scores.shape)  # draws in proportion to the exponentials
    return np.asarray(np.argmax(picks, axis=1), np.int64)


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
    log_likelihood: Callable[[Floats], Floats], d: int, rng: np.random.Generator, m: int = 1000
) -> Floats:
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


def _step(values: Floats, most: float) -> float:
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


def _resampled(weights: Floats, rng: np.random.Generator) -> Ints:
    """Return places by their weights, systematically."""
    m = len(weights)
    points = (rng.random() + np.arange(m)) / m
    return np.minimum(np.searchsorted(np.cumsum(weights), points), m - 1)


def _move(
    places: Floats,
    values: Floats,
    log_likelihood: Callable[[Floats], Floats],
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


def _reflected(places: Floats) -> Floats:
    """Return places moved back into the cube, as by mirrors at its sides."""
    folded = np.mod(places, 2.0)
    return np.where(folded > 1.0, 2.0 - folded, folded)


REFUTED = 1.3528
"""Half of the 90 % quantile of chi-squared with one degree of freedom."""

CLIMBERS, ROUNDS = 24, 120
"""Points that search for one end, and the steps that each tries."""

CLIMB = 40
"""Steps by which draws first climb to the greatest likelihood."""


def level_ends(log_likelihood: Callable[[Floats], Floats], draws: Floats, rng: np.random.Generator) -> Floats:
    """Return the least and greatest place of each parameter that a likelihood ratio does not refute, shape (2, d).

    Args:
        log_likelihood: (m, d) places in the unit cube to (m,) logarithms of the likelihood, finite.
        draws: (m, d) places drawn from the posterior; their differences are the directions of the search.
        rng: Random numbers.
    """
    m, d = draws.shape

    def stepped(points: Floats) -> Floats:
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
