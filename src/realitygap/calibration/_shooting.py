"""Multiple shooting: parameters whose simulated windows meet what was observed, and draws from their posterior.

Source: Bock (1987), multiple shooting; White (1982), the sandwich covariance; Gelman et al. (2013), Bayesian Data
Analysis, chapters 11 and 12.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy

from realitygap.world import RobotModel

from ._posterior import BURN_IN, SWEEPS, draw_linear, walk
from ._prior import MOTION_NOISE, PRIOR_PRECISION, Known, Parameter, own_values, place_of, values_at
from ._scatter import NoisePrior, Scatter
from ._simulate import Floats, Ints, Simulate
from ._windows import Windows, differences, simulate_windows, wheel_ways, wrapped

STEP = 0.02  # of a finite difference, in parts of what was thought possible
PULL = 0.1  # towards the robot's own numbers, where nothing was learned
FIRST_NOISE = np.array([0.02, 0.03, 0.1, 0.05, 0.01, 0.001, 0.005, 0.005, 0.001])
NOISE_STEP = 0.004  # likewise of the noise
MOST_STEPS, SETTLED = 30, 1e-5  # of least squares, and the change after which they end
INSIDE = 1e-6  # of the ends, where least squares begin
N_MEAN = 40  # robots that show what early and late commands do in the mean
N_SCATTER = 200  # and how they scatter
LEAST_JITTER = 0.01  # [s] of theirs
TUNING = 160  # rounds of Metropolis steps between two fits
FEWEST_TRIALS = 4  # below which their disagreement says nothing


@dataclass(frozen=True)
class Problem:
    """Windows, and how they are simulated with parameters that are free while others keep their values.

    Attributes:
        simulate: Simulator of the trials.
        robot: Robot with the numbers that are not fitted.
        known: Priors of parameters.
        windows: Observed windows to reproduce.
        free: Parameters that are fitted.
        fixed: Values of others.
        own: (p,) places of the robot's own numbers between the ends of the free ones.
        jitter: [s] of commands: early and late ones change what windows do in the mean, too.
    """

    simulate: Simulate
    robot: RobotModel
    known: Known
    windows: Windows
    free: tuple[Parameter, ...]
    fixed: Mapping[str, float]
    own: Floats
    jitter: float = 0.0

    def off(self, places: Floats) -> Floats:
        """Return the differences at places (m, p), observed minus mean simulated, (m, w, 5)."""
        if self.jitter == 0.0:
            return self._off(places)
        return np.stack([self.jittered(place, N_MEAN).mean(axis=0) for place in places])

    def jittered(self, place: Floats, n: int) -> Floats:
        """Return the differences of n robots at one place whose commands are early or late at random, (n, w, 5)."""
        off = self.fixed_at(**{"drive.delay_jitter": self.jitter})._off(np.repeat(place[None], n, axis=0))
        off[..., 2] = off[:1, :, 2] + wrapped(off[..., 2] - off[:1, :, 2])
        return off

    def with_noise(self, places: Floats, key: int) -> Floats:
        """Return the differences with the fixed noise, (m, w, 5). A key gives the same noise at all places."""
        return self._off(places, key)

    def _off(self, places: Floats, same_noise: int | None = None) -> Floats:
        values = values_at(self.free, places)
        values |= {name: np.full(len(places), value) for name, value in self.fixed.items()}
        simulated = simulate_windows(self.simulate, self.robot, self.known, self.windows, values, same_noise)
        return differences(self.robot, self.windows, simulated, values)

    def slopes(self, place: Floats) -> Floats:
        """Return derivatives of the differences by the places, central if there is room, (w, 5, p)."""
        high = np.minimum(place + STEP, 1.0)
        low = np.maximum(place - STEP, 0.0)
        ends = np.concatenate([place + np.diag(high - place), place - np.diag(place - low)])
        off = self.off(ends)
        p = len(place)
        slopes = (off[:p] - off[p:]) / (high - low)[:, None, None]
        return np.asarray(np.nan_to_num(np.moveaxis(slopes, 0, -1)))

    def fixed_at(self, **values: float) -> Problem:
        """Return the same problem with other fixed values."""
        return replace(self, fixed={**self.fixed, **values})


def make_problem(
    simulate: Simulate, robot: RobotModel, known: Known, windows: Windows, names: Sequence[str]
) -> Problem:
    """Return windows that are to be met by parameters of these names."""
    own = own_values(robot)
    places = np.array([float(place_of(known[name], own[name])) for name in names])
    free = tuple(known[name] for name in names)
    return Problem(simulate, robot, known, windows, free, {}, places)


def scatter_of(problem: Problem, place: Floats) -> Scatter:
    """Return the scatter of windows around the simulation at a point."""
    values = values_at(problem.free, place[None])
    values |= {name: np.array([value]) for name, value in problem.fixed.items()}
    windows = problem.windows
    jitter = max(problem.jitter, LEAST_JITTER)
    ways = wheel_ways(problem.simulate, problem.robot, problem.known, windows, values, jitter)
    made = simulate_windows(problem.simulate, problem.robot, problem.known, windows, values)
    before, after, wheels = windows.seen
    seen = np.concatenate([np.repeat(np.isfinite(after[:, :1]), 3, axis=1), np.isfinite(wheels)], axis=1)
    turn = np.nan_to_num(wrapped(made.after[0, :, 2] - before[:, 2]))
    return Scatter(
        way=ways.way.mean(axis=1),
        chord=np.sinc(turn / (2 * np.pi)),
        wheel_way=ways.way,
        moving_s=ways.moving_s,
        late=_lateness(problem, place, jitter),
        seen=seen,
    )


def _lateness(problem: Problem, place: Floats, jitter: float) -> Floats:
    """Return the covariance of windows per squared second of jitter, with that of a mean of few robots, (w, 5, 5).

    As simulated: no command comes before it is given, and one that comes late enough stays for the next step.
    """
    off = np.nan_to_num(replace(problem, jitter=jitter).jittered(place, N_SCATTER))
    around = np.moveaxis(off - off.mean(axis=0), 0, 1) / jitter
    return np.asarray((1.0 + 1.0 / N_MEAN) / (N_SCATTER - 1) * np.einsum("wmc,wmd->wcd", around, around))


def best_place(problem: Problem, scatter: Scatter, noise: Floats, first: Floats) -> tuple[Floats, float]:
    """Return the minimum of the weighted squares from a point, and half their sum."""

    def off(place: Floats) -> Floats:
        rows = scatter.whitened(np.nan_to_num(problem.off(place[None])[0]), noise).ravel()
        return np.concatenate([rows, PULL * (place - problem.own)])

    def slopes(place: Floats) -> Floats:
        rows = scatter.whitened(problem.slopes(place), noise).reshape(-1, len(place))
        return np.concatenate([rows, PULL * np.eye(len(place))])

    result = scipy.optimize.least_squares(
        off, np.clip(first, INSIDE, 1.0 - INSIDE), jac=slopes, bounds=(0.0, 1.0), x_scale="jac",
        ftol=SETTLED, xtol=SETTLED, max_nfev=MOST_STEPS,
    )  # fmt: skip
    return np.asarray(result.x), float(result.cost)


def typical_noise(
    rng: np.random.Generator, scatter: Scatter, off: Floats, parameters: Sequence[Parameter], first: Floats
) -> Floats:
    """Return the median of the noise's posterior for a known motion."""
    prior = NoisePrior.of(parameters)
    here, reach = prior.inside(first), 0.3 * FIRST_NOISE
    density = partial(scatter.log_likelihood, off)
    kept = []
    for _ in range(TUNING):
        here = walk(rng, here, prior, density, reach)
        kept.append(here)
    return np.asarray(np.median(kept[TUNING // 2 :], axis=0))


def draw_posterior(
    rng: np.random.Generator,
    scatter: Scatter,
    place: Floats,
    slopes: Floats,
    off: Floats,
    noise: Floats,
    noises: Sequence[Parameter],
) -> tuple[Floats, Floats]:
    """Draw places (d, p) and noise (d, q) in turn, each given the other."""
    prior = NoisePrior.of(noises)
    made = -slopes
    base = off + made @ place
    at, scale, reach = place.copy(), prior.inside(noise), np.maximum(0.3 * noise, 1e-5)
    places, scales = [], []
    for _ in range(SWEEPS + BURN_IN):
        jacobian = scatter.whitened(made, scale).reshape(-1, len(place))
        at = draw_linear(rng, at, jacobian, scatter.whitened(base, scale).ravel())
        left = base - made @ at
        scale = walk(rng, scale, prior, partial(scatter.log_likelihood, left), reach)
        places.append(at)
        scales.append(scale)
    return np.array(places[BURN_IN:]), np.array(scales[BURN_IN:])


def widening(scatter: Scatter, slopes: Floats, off: Floats, trial: Ints, noise: Floats) -> Floats:
    """Return the factor by which variation between trials widens each interval, (p,); 1 if noise explains it."""
    rows = scatter.whitened(slopes, noise)
    left = scatter.whitened(off, noise)
    known = rows.reshape(-1, slopes.shape[-1])
    pulls = np.array([np.einsum("wcp,wc->p", rows[trial == k], left[trial == k]) for k in np.unique(trial)])
    return _sandwich(known.T @ known, pulls)


def widening_of_noise(
    scatter: Scatter, off: Floats, trial: Ints, noise: Floats, parameters: Sequence[Parameter]
) -> Floats:
    """Return the factor for the places of the simulator's own noise, (q,).

    Channels that one late command moves are no independent witnesses of how late it was.

    Args:
        scatter, off, trial: Likelihood, differences, and trial of windows.
        noise: (n,) all of it.
        parameters: (n,) parameters of the noise. The first q are the simulator's own.
    """
    prior, q = NoisePrior.of(parameters), len(MOTION_NOISE)
    here = prior.places(noise)
    here[:q] = np.clip(here[:q], 2 * NOISE_STEP, 1.0 - 2 * NOISE_STEP)
    trials = np.unique(trial, return_inverse=True)[1]
    steps = NOISE_STEP * np.eye(q, len(here))

    def pulls(place: Floats) -> Floats:
        rises = [
            scatter.log_likelihoods(off, prior.at(place + step))
            - scatter.log_likelihoods(off, prior.at(place - step))
            for step in steps
        ]
        return np.stack([np.bincount(trials, rise) for rise in rises], axis=1) / (2 * NOISE_STEP)

    falls = [(pulls(here - step) - pulls(here + step)).sum(axis=0) for step in steps]
    known = np.array(falls) / (2 * NOISE_STEP)
    sizes, vectors = np.linalg.eigh((known + known.T) / 2)
    own = pulls(here)
    return _sandwich((vectors * np.maximum(sizes, 0.0)) @ vectors.T, own - own.mean(axis=0))


def _sandwich(known: Floats, pulls: Floats) -> Floats:
    """Return the factor of each interval, (p,), from the curvature (p, p) and the score of each of n trials, (n, p)."""
    n, p = pulls.shape
    if n < FEWEST_TRIALS:
        return np.ones(p)
    prior = PRIOR_PRECISION * np.eye(p)
    inverse = np.linalg.inv(known + prior)
    meat = pulls.T @ pulls * n / (n - 1.0) + prior
    ratio = np.diag(inverse @ meat @ inverse) / np.diag(inverse)
    return np.asarray(np.sqrt(np.maximum(ratio, 1.0)))
