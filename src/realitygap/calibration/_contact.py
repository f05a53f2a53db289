"""How a robot gives way at walls, fitted to observed encounters: friction, and how easily it is pushed and turned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from realitygap.records import Observe, ObservedTrial
from realitygap.world import Arena, Fitted, RobotModel

from ._align_or_stall import Encounters, encounters_of
from ._handles import CONTACT, parameters_of, values_at
from ._identify import advice_for, identify_from
from ._motion import N_DRAWS, MotionFit, fitted_parameter, observed_as
from ._posterior import sample_around
from ._prior import Parameter
from ._scatter import OBSERVER, Scatter, scatter_parameters
from ._shooting import (
    FIRST_NOISE,
    PRIOR_PRECISION,
    Problem,
    best_place,
    make_problem,
    scatter_of,
    typical_noise,
    widening,
)
from ._simulate import Bools, Floats, Simulate
from ._windows import CHANNELS, make_windows

METHOD = (
    "Multiple shooting from poses near walls, as for motion, with the drive as given; windows that end far from any "
    "simulated one are left out, as encounters near the border between aligning and stalling flip."
)
WINDOW = 1  # commands: pushes are not linear, and longer ones less so
UNEVEN = (
    1.6  # by which intervals grow: noise near walls is not normal; found on data of `sim`, as a test has it
)
DOUBT = 3.0  # times what a linear model has for a spread, to look for the posterior in
PLACES = (0.15, 0.4, 0.65, 0.9)  # of each parameter, from which a fit begins where they come closest
FLIPS = 5.0  # robust standard deviations: beyond it a window took the other way at a border
CAP = 3.0  # robust standard deviations from which a difference counts no more, in the search for a beginning
MAD = 1.4826  # of a median absolute deviation, to a standard deviation of a normal one
POSES = slice(0, 3)  # of the channels


def fit_contact(
    trials: Sequence[ObservedTrial],
    simulate: Simulate,
    robot: RobotModel,
    arena: Arena,
    *,
    motion: Mapping[str, float] | None = None,
    observe: Observe | None = None,
    prior: Sequence[Parameter] | None = None,
    window: int = WINDOW,
    seed: int = 0,
) -> MotionFit:
    """Fit contact to windows of trials in which the robot was near a wall.

    Only ratios of how easily it is pushed count: `contact.long` stays as it is.

    Args:
        trials: As observed, with poses.
        simulate: Carries out trials in the arena, such as `SimEnsemble(...).replay`.
        robot: On whose numbers the fit builds.
        arena: Where it drove.
        motion: Numbers of the drive by dotted name, such as those of `fit_motion`; the robot's own when not given.
        observe: Use no more than this of the trials; without poses nothing is identified.
        prior: What is thought possible; `scribbler_prior` when not given.
        window: Commands from one observed pose to the next that is compared.
        seed: Of the draws.

    Raises:
        ValueError: No trial, trials with commands of different lengths, or none in which a robot with poses met a wall.
    """
    known = parameters_of(robot, prior)
    seen = observed_as(trials, observe)
    if not any(len(trial.poses) for trial in seen):
        return _nothing(known, robot, seen[0].observe if seen else "cells")
    windows = make_windows(seen, robot, arena, window)
    windows = windows.only(windows.touching & np.isfinite(windows.seen[1]).all(axis=1))
    if not len(windows.trial):
        raise ValueError(
            "In no trial the robot was seen to meet a wall, expected some. Record trials of contact_plans."
        )
    problem = replace(make_problem(simulate, robot, known, windows, CONTACT), fixed=dict(motion or {}))
    place = _first_place(problem)
    near = _stays(problem, place)
    problem = replace(problem, windows=windows.only(near))
    noises = scatter_parameters(known)[:1] + _wide(scatter_parameters(known)[1:])
    noise, rng = FIRST_NOISE, np.random.default_rng(seed)
    for _ in range(2):
        scatter = _poses_only(scatter_of(problem, place))
        noise = typical_noise(rng, scatter, _off(problem, place), noises, noise)
        place, _ = best_place(problem, scatter, noise, place)
    return _report(problem, place, noise, rng, int((~near).sum()), encounters_of(seen, robot, arena))


def _nothing(known: Mapping[str, Parameter], robot: RobotModel, observe: Observe) -> MotionFit:
    """What is known of contact without poses."""
    own = robot.contact.model_dump()
    fitted = tuple(
        Fitted(
            name=name, estimate=own[name.rpartition(".")[2]], low=known[name].prior.lowest,
            high=known[name].prior.highest, prior_low=known[name].prior.lowest, prior_high=known[name].prior.highest,
            identified=False, unit=known[name].unit, advice=advice_for(name, observe),
        )
        for name in CONTACT
    )  # fmt: skip
    return MotionFit(fitted, {}, {}, METHOD)


def _wide(parameters: Sequence[Parameter]) -> list[Parameter]:
    """The same noise with ends that allow for what walls do to it."""
    wide = OBSERVER[1].prior.model_copy(update={"uniform": (0.0, 0.5)})
    return [replace(parameter, prior=wide) for parameter in parameters]


def _off(problem: Problem, place: Floats) -> Floats:
    return np.nan_to_num(problem.off(place[None])[0])


def _poses_only(scatter: Scatter) -> Scatter:
    """Wheels turn the same whatever a wall does: only poses tell of contact."""
    seen = scatter.seen.copy()
    seen[:, 3:] = False
    seen[:, POSES] = True
    return replace(
        scatter, seen=seen, late=np.zeros_like(scatter.late), carried=np.zeros_like(scatter.carried)
    )


def _first_place(problem: Problem) -> Floats:
    """Of some places all over the prior, the one from which most windows end close to where they were seen to."""
    places = np.array([*product(PLACES, repeat=len(problem.free)), tuple(problem.own)])
    off = np.nan_to_num(problem.off(places)[..., POSES])
    scale = MAD * np.median(np.abs(off), axis=1, keepdims=True).min(axis=0, keepdims=True) + 1e-3
    cost = np.minimum(np.abs(off) / scale, CAP).mean(axis=(1, 2))
    return np.asarray(places[int(np.argmin(cost))])


def _stays(problem: Problem, place: Floats) -> Bools:
    """(w,) whether a window ends near where it is simulated to."""
    off = np.abs(_off(problem, place)[:, POSES])
    return np.asarray((off < FLIPS * (MAD * np.median(off, axis=0) + 1e-3)).all(axis=1))


def _report(
    problem: Problem,
    place: Floats,
    noise: Floats,
    rng: np.random.Generator,
    n_flips: int,
    encounters: Encounters,
) -> MotionFit:
    slopes, off = problem.slopes(place), _off(problem, place)
    scatter = _poses_only(scatter_of(problem, place))
    rows = scatter.whitened(slopes, noise).reshape(-1, len(place))
    spread = np.linalg.inv(rows.T @ rows + PRIOR_PRECISION * np.eye(len(place)))

    def log_likelihoods(at: Floats) -> Floats:
        return np.array([scatter.log_likelihood(one, noise) for one in np.nan_to_num(problem.off(at))])

    places = sample_around(rng, place, DOUBT**2 * spread, log_likelihoods)
    middle = np.median(places, axis=0)
    wide = widening(scatter, slopes, off, problem.windows.trial, noise)
    places = np.clip(middle + (places - middle) * UNEVEN * wide, 0.0, 1.0)
    place = np.median(places, axis=0)
    draws = values_at(problem.free, places)
    best = {name: float(value[0]) for name, value in values_at(problem.free, place[None]).items()}
    found = identify_from(draws, problem.known, scatter.whitened(slopes, noise), problem.free)
    fitted = tuple(
        fitted_parameter(problem.known[name], best[name], draws[name], found[name], "track") for name in draws
    )
    kept = rng.choice(len(places), N_DRAWS, replace=False)
    agree = encounters.agreeing(best["contact.friction"])
    rms = np.sqrt(np.mean(off**2, axis=0))
    return MotionFit(
        fitted,
        best,
        {name: tuple(value[kept].tolist()) for name, value in draws.items()},
        METHOD,
        (
            f"{len(off)} windows near walls, {n_flips} left out that went another way",
            f"{agree} of {len(encounters.aligned)} encounters align or stall as the fitted friction has it",
        ),
        {"windows": len(off), "flips": n_flips, "rms": dict(zip(CHANNELS[:3], rms[POSES].tolist(), strict=True)),
         "encounters": len(encounters.aligned), "agreeing": agree},
    )  # fmt: skip
