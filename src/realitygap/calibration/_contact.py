"""The fit of contact to encounters with walls: friction, and the resistance to being pushed and turned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import product

import numpy as np

from realitygap.records import Observe, TrialRecord
from realitygap.world import Arena, RobotModel

from ._align_or_stall import Encounters, encounters_of
from ._handles import CONTACT, parameters_of, values_at
from ._identify import identify_from
from ._motion import N_DRAWS, MotionFit, fitted_parameter, nothing_known, observed_as
from ._posterior import sample_clusters
from ._prior import Parameter
from ._shooting import Problem, make_problem
from ._simulate import Floats, Simulate, motor_noise
from ._windows import CHANNELS, make_windows, wrapped

METHOD = (
    "Each window near a wall is simulated from where the robot was seen, with the drive and its noise as given; "
    "differences have a t distribution, as encounters near the border between aligning and stalling flip. Population "
    "Monte Carlo (Cappe et al. 2004); intervals from trials weighed anew (Newton & Raftery 1994)."
)
FREEDOM = 4.0  # degrees, of the t distribution
REACHES = (0.12, 0.04, 0.02)  # from where draws begin, in turn with what noise makes of windows
N_PLACES = 300  # of each look around
N_NOISY = 100  # robots that show it
N_MEAN = 6  # and what it does in the mean
LEAST = np.array([3e-4, 3e-4, 2e-3])  # [m, m, rad] of that scale
PLACES = (0.15, 0.4, 0.65, 0.9)  # of each parameter, from which a fit begins where they come closest
FLIPS = 5.0  # robust standard deviations: beyond it a window took the other way at a border
CAP = 3.0  # robust standard deviations from which a difference counts no more, in the search for a beginning
MAD = 1.4826  # of a median absolute deviation, to a standard deviation of a normal one


def fit_contact(
    trials: Sequence[TrialRecord],
    simulate: Simulate,
    robot: RobotModel,
    arena: Arena,
    *,
    observe: Observe | None = None,
    prior: Sequence[Parameter] | None = None,
    seed: int = 0,
) -> MotionFit:
    """Fit contact to windows of trials in which the robot was near a wall.

    Only ratios of how easily it is pushed count: `contact.long` stays as it is.

    Args:
        trials: Recorded trials with poses.
        simulate: Simulator of trials in the arena, such as `SimEnsemble(...).replay`.
        robot: Robot with the numbers that are not fitted.
        arena: Arena of the trials.
        observe: Use no more than this of the trials; without poses nothing is identified.
        prior: Prior of each parameter. Default: `scribbler_prior`.
        seed: Seed of the draws.

    Raises:
        ValueError: No trial, trials with commands of different lengths, or none in which a robot with poses met a wall.
    """
    known = parameters_of(robot, prior)
    seen = observed_as(trials, observe)
    if not any(len(trial.poses) for trial in seen):
        return nothing_known(CONTACT, known, robot, METHOD)
    windows = make_windows(seen, robot, arena)
    windows = windows.only(windows.touching & np.isfinite(windows.seen[1]).all(axis=1))
    if not len(windows.trial):
        raise ValueError(
            "In no trial the robot was seen to meet a wall, expected some. Record trials of contact_plans."
        )
    own = robot.centers()
    noise = {name: own[name] for name in motor_noise(robot)}
    problem = make_problem(simulate, robot, known, windows, CONTACT)
    return _report(problem, noise, np.random.default_rng(seed), encounters_of(seen, robot, arena))


def _off(problem: Problem, places: Floats) -> Floats:
    """Return the errors of poses, (m, w, 3)."""
    return np.nan_to_num(problem.off(places)[..., :3])


def _first_place(problem: Problem) -> Floats:
    """Return the point of the prior from which most windows end as observed."""
    places = np.array([*product(PLACES, repeat=len(problem.free)), tuple(problem.own)])
    off = np.abs(_off(problem, places))
    scales = MAD * np.median(off, axis=1) + LEAST
    cost = np.minimum(off / scales.min(axis=0), CAP).mean(axis=(1, 2))
    return np.asarray(places[int(np.argmin(cost))])


def _mean_off(noisy: Problem, places: Floats) -> Floats:
    """Return the mean errors of poses, (m, w, 3): a wall that is met by chance turns a robot to one side only."""
    all_off = (np.nan_to_num(noisy.with_noise(places, key)[..., :3]) for key in range(1, N_MEAN + 1))
    mean = next(all_off)
    for n, off in enumerate(all_off, 2):
        further = off - mean
        further[..., 2] = wrapped(further[..., 2])
        mean += further / n
    return mean


def _scale(noisy: Problem, place: Floats) -> Floats:
    """Return (w, 3) scales of differences: the effect of noise on windows, and their additional deviation."""
    off = _mean_off(noisy, place[None])[0]
    around = _off(noisy, np.repeat(place[None], N_NOISY, axis=0)) - off
    around[..., 2] = wrapped(around[..., 2])
    scale = np.sqrt((1.0 + 1.0 / N_MEAN) * (around**2).mean(axis=0) + LEAST**2)
    return np.asarray(scale * np.maximum(MAD * np.median(np.abs(off) / scale, axis=0), 1.0))


def _log_likelihoods(noisy: Problem, scale: Floats, places: Floats) -> Floats:
    """Return the log likelihoods of trials, (m, k), with a t distribution, because some windows differ completely."""
    squares = ((_mean_off(noisy, places) / scale) ** 2).sum(axis=-1)
    logs = -0.5 * (FREEDOM + 3.0) * np.log1p(squares / FREEDOM)
    trials = np.unique(noisy.windows.trial)
    return np.stack([logs[:, noisy.windows.trial == k].sum(axis=1) for k in trials], axis=1)


def _report(
    problem: Problem, noise: Mapping[str, float], rng: np.random.Generator, encounters: Encounters
) -> MotionFit:
    place = _first_place(problem)
    noisy = problem.fixed_at(**noise)
    scale = _scale(noisy, place)
    for reach in REACHES:
        places = sample_clusters(
            rng, place, partial(_log_likelihoods, noisy, scale), N_DRAWS, reach, N_PLACES
        )
        place = np.median(places, axis=0)
        scale = _scale(noisy, place)
    off = _mean_off(noisy, place[None])[0]
    typical = np.median(scale, axis=0).tolist()
    draws = values_at(problem.free, places)
    best = {name: float(value[0]) for name, value in values_at(problem.free, place[None]).items()}
    slopes = np.nan_to_num(problem.slopes(place)[:, :3]) / scale[:, :, None]
    found = identify_from(draws, problem.known, slopes, problem.free)
    fitted = tuple(
        fitted_parameter(problem.known[name], best[name], draws[name], found[name], "track") for name in draws
    )
    agree = encounters.agreeing(best["contact.friction"])
    other = int((np.abs(off) > FLIPS * scale).any(axis=1).sum())
    return MotionFit(
        fitted,
        best,
        {name: tuple(value.tolist()) for name, value in draws.items()},
        METHOD,
        (
            f"{len(off)} windows near walls, {other} of which took another path than simulated",
            f"{agree} of {len(encounters.aligned)} encounters align or stall as the fitted friction has it",
        ),
        {"windows": len(off), "flips": other, "typical": dict(zip(CHANNELS[:3], typical, strict=True)),
         "encounters": len(encounters.aligned), "agreeing": agree},
    )  # fmt: skip
