"""Multiple shooting: parameters whose simulated windows meet what was observed, and draws from their posterior.

Source: Bock (1987), multiple shooting; White (1982), the sandwich covariance; Gelman et al. (2013), Bayesian Data
Analysis, chapters 11 and 12.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.optimize import least_squares

from realitygap.world import RobotModel

from ._handles import Handle, place_of, values_at
from ._posterior import BURN_IN, SWEEPS, draw_linear, walk
from ._scatter import Scatter
from ._simulate import Bools, Floats, Ints, Simulate, plain_numbers
from ._windows import Windows, differences, simulate_windows, ways_driven

STEP = 0.02  # of a finite difference, in parts of what was thought possible
PULL = 0.1  # towards the robot's own numbers, where nothing was learned
LEAST_WAY = 1e-4  # [m] of a wheel in a window in which it stands
FIRST_NOISE = np.array([0.02, 0.03, 0.1, 0.05, 0.01, 0.001, 0.005, 0.005, 0.001])
PRIOR_PRECISION = 12.0  # of an even prior over 0..1
FEWEST_TRIALS = 4  # below which their disagreement says nothing


@dataclass(frozen=True)
class Problem:
    """Windows, and how they are simulated with parameters that are free while others keep their values.

    Attributes:
        simulate: What carries out trials.
        robot: On whose numbers it builds.
        windows: What is to be met.
        free: Parameters that are fitted.
        fixed: Values of others.
        own: (p,) where the robot's own numbers lie between the ends of the free ones.
    """

    simulate: Simulate
    robot: RobotModel
    windows: Windows
    free: tuple[Handle, ...]
    fixed: Mapping[str, float]
    own: Floats

    def off(self, places: Floats) -> Floats:
        """(m, w, 5) observed less simulated at places (m, p)."""
        values = values_at(self.free, places)
        values |= {name: np.full(len(places), value) for name, value in self.fixed.items()}
        simulated = simulate_windows(self.simulate, self.robot, self.windows, values)
        return differences(self.robot, self.windows, simulated, values)

    def slopes(self, place: Floats) -> Floats:
        """(w, 5, p) derivatives of the differences by the places, from both sides where there is room."""
        high = np.minimum(place + STEP, 1.0)
        low = np.maximum(place - STEP, 0.0)
        ends = np.concatenate([place + np.diag(high - place), place - np.diag(place - low)])
        off = self.off(ends)
        p = len(place)
        slopes = (off[:p] - off[p:]) / (high - low)[:, None, None]
        return np.asarray(np.nan_to_num(np.moveaxis(slopes, 0, -1)))

    def fixed_at(self, **values: float) -> Problem:
        """The same with other fixed values."""
        return replace(self, fixed={**self.fixed, **values})


def make_problem(simulate: Simulate, robot: RobotModel, windows: Windows, free: Sequence[Handle]) -> Problem:
    now = plain_numbers(robot)
    own = {**now, "drive.gain": (now["drive.gain_left"] + now["drive.gain_right"]) / 2,
           "drive.asymmetry": now["drive.gain_left"] - now["drive.gain_right"]}  # fmt: skip
    places = np.array([place_of(handle, own[handle.name]) for handle in free])
    return Problem(simulate, robot, windows, tuple(free), {}, places)


def scatter_of(problem: Problem, place: Floats, slopes: Floats) -> Scatter:
    """How windows scatter around what is simulated at a place."""
    values = values_at(problem.free, place[None])
    values |= {name: np.array([value]) for name, value in problem.fixed.items()}
    windows = problem.windows
    way = ways_driven(problem.simulate, problem.robot, windows, values)
    span = (windows.last - windows.first) * windows.step_s
    names = [handle.name for handle in problem.free]
    late = np.zeros((len(way), 5))
    if "drive.delay" in names:
        k = names.index("drive.delay")
        late = slopes[:, :, k] / problem.free[k].width
    _, after, wheels = windows.seen
    seen = np.concatenate([np.repeat(np.isfinite(after[:, :1]), 3, axis=1), np.isfinite(wheels)], axis=1)
    stands = way.max(axis=1) < LEAST_WAY
    seen[stands & has_moved(windows), :3] = False
    return Scatter(way.mean(axis=1), way, np.where(stands, 0.0, span), late, seen)


def has_moved(windows: Windows) -> Bools:
    """(w,) whether a command other than to stand came before the window: while wheels run down, noise goes on."""
    moves = np.abs(windows.commands).max(axis=2) > 0
    return np.asarray(np.maximum.accumulate(moves, axis=1)[windows.trial, windows.first])


def best_place(problem: Problem, scatter: Scatter, noise: Floats, first: Floats) -> tuple[Floats, float]:
    """Where weighed squares are least from here, and their sum."""

    def off(place: Floats) -> Floats:
        rows = scatter.whitened(np.nan_to_num(problem.off(place[None])[0]), noise).ravel()
        return np.concatenate([rows, PULL * (place - problem.own)])

    def slopes(place: Floats) -> Floats:
        rows = scatter.whitened(problem.slopes(place), noise).reshape(-1, len(place))
        return np.concatenate([rows, PULL * np.eye(len(place))])

    inside = np.clip(first, 1e-3, 1.0 - 1e-3)
    found = least_squares(
        off, inside, jac=slopes, bounds=(0.0, 1.0), x_scale=1.0, max_nfev=25, xtol=1e-6, ftol=1e-6
    )
    return np.asarray(found.x), float(found.cost)


def typical_noise(
    rng: np.random.Generator, scatter: Scatter, off: Floats, handles: Sequence[Handle], first: Floats
) -> Floats:
    """The median of the noise's posterior where the motion is taken as known."""
    high = np.array([handle.high for handle in handles])
    here, reach, free = first, 0.3 * FIRST_NOISE, np.arange(len(handles), dtype=np.float64)
    density = partial(scatter.log_likelihood, off)
    now = density(here)
    kept = []
    for _ in range(250):
        here, now = walk(rng, here, high, density, now, reach, free)
        kept.append(here)
    return np.asarray(np.median(kept[100:], axis=0))


def draw_posterior(
    rng: np.random.Generator,
    scatter: Scatter,
    place: Floats,
    slopes: Floats,
    off: Floats,
    noise: Floats,
    noises: Sequence[Handle],
) -> tuple[Floats, Floats]:
    """Draws of places (d, p) and noise (d, q), in turn: the one where the other is known."""
    high = np.array([handle.high for handle in noises])
    made = -slopes
    base = off + made @ place
    at, scale = place.copy(), noise.copy()
    reach, free = np.maximum(0.3 * noise, 1e-5), np.arange(len(noises), dtype=np.float64)
    places, scales = [], []
    for _ in range(SWEEPS + BURN_IN):
        jacobian = scatter.whitened(made, scale).reshape(-1, len(place))
        at = draw_linear(rng, at, jacobian, scatter.whitened(base, scale).ravel())
        left = base - made @ at
        density = partial(scatter.log_likelihood, left)
        scale, _ = walk(rng, scale, high, density, density(scale), reach, free)
        places.append(at)
        scales.append(scale)
    return np.array(places[BURN_IN:]), np.array(scales[BURN_IN:])


def widening(scatter: Scatter, slopes: Floats, off: Floats, trial: Ints, noise: Floats) -> Floats:
    """(p,) by how much intervals grow because trials differ by more than the noise says; 1 where they do not."""
    p = slopes.shape[-1]
    rows = scatter.whitened(slopes, noise)
    left = scatter.whitened(off, noise)
    prior = PRIOR_PRECISION * np.eye(p)
    known = rows.reshape(-1, p)
    inverse = np.linalg.inv(known.T @ known + prior)
    trials = np.unique(trial)
    if len(trials) < FEWEST_TRIALS:
        return np.ones(p)
    pulls = np.array([np.einsum("wcp,wc->p", rows[trial == k], left[trial == k]) for k in trials])
    meat = pulls.T @ pulls * len(trials) / (len(trials) - 1.0) + prior
    ratio = np.diag(inverse @ meat @ inverse) / np.diag(inverse)
    return np.asarray(np.sqrt(np.maximum(ratio, 1.0)))
