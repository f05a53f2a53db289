"""Draws from the posterior of a model that is linear near its best fit, with even priors between ends."""

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
