"""Motors fitted to observed motion: gains, track, lag, delay, slip, drift and noise, by multiple shooting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from realitygap.records import Observe, TrialRecord
from realitygap.world import Arena, Fitted, RobotModel

from ._fit import Fit
from ._identify import Identified, advice_for, identify_from
from ._one_thread import one_blas_thread
from ._prior import (
    ENDS,
    MOTION,
    MOTION_NOISE,
    Known,
    Parameter,
    own_values,
    parameters_of,
    robot_numbers,
    values_at,
)
from ._scatter import JITTER, NoisePrior, Scatter, scatter_parameters
from ._shooting import (
    FIRST_NOISE,
    Problem,
    best_place,
    draw_posterior,
    make_problem,
    scatter_of,
    typical_noise,
    widening,
    widening_of_noise,
)
from ._simulate import Bools, Floats, Ints, Simulate
from ._windows import CHANNELS, make_windows

METHOD = (
    "Multiple shooting (Bock 1987): each window is simulated from where the robot was seen; least squares by "
    "trust regions, draws from the posterior of the model that is linear there, with noise as `sim` has it; "
    "widened where trials disagree by more than that (sandwich covariance, clustered by trial)."
)
N_DRAWS = 200
MOST_ROUNDS = 8  # of weights and least squares in turn
DEAD_BANDS = 2  # rounds in which commands are told that move no wheel
SETTLED = 0.004  # move of a place after which no further round is needed
DELAYS = (0.0, 0.15, 0.3, 0.5)  # from which a fit begins, as parts of the range: it may have several minima


def observed_as(trials: Sequence[TrialRecord], observe: Observe | None) -> list[TrialRecord]:
    """Return trials of which no more than this is known."""
    return [trial if observe is None else trial.seen_as(observe) for trial in trials]


@one_blas_thread()
def fit_motion(
    trials: Sequence[TrialRecord],
    simulate: Simulate,
    robot: RobotModel,
    arena: Arena,
    *,
    observe: Observe | None = None,
    prior: Sequence[Parameter] | None = None,
    seed: int = 0,
) -> Fit:
    """Fit the drive of a robot to windows of trials in which it touched nothing.

    Args:
        trials: Recorded trials with poses, with the distance of the wheels, or with both.
        simulate: Simulator of trials in the arena, such as `SimEnsemble(...).replay`.
        robot: Robot with the numbers that are not fitted.
        arena: Arena of the trials.
        observe: Use no more than this of the trials.
        prior: Prior of each parameter. Default: `scribbler_prior`.
        seed: Seed of the draws.

    Raises:
        ValueError: No trial, trials with commands of different lengths, or none in which the robot moved freely and
            was seen.

    Source: Bock (1987), multiple shooting. Noise and intervals: Gelman et al. (2013), Bayesian Data Analysis, ch. 11
        and 12; White (1982), the sandwich. Differs: even priors between ends.
    """
    seen = observed_as(trials, observe)
    known = parameters_of(robot, prior)
    if seen and all(trial.observe == "cells" for trial in seen):
        return nothing_known((*MOTION, *MOTION_NOISE, "drive.dead_band"), known, robot, METHOD)
    windows = make_windows(seen, robot, arena)
    windows = windows.only(
        ~windows.touching & np.isfinite(np.concatenate([windows.seen[1], windows.seen[2]], 1)).any(1)
    )
    if not len(windows.trial):
        raise ValueError(
            "No trial shows motion away from walls, expected poses (observe = track) or distances of the "
            "wheels (observe = encoders). Record such trials of motion_plans."
        )
    problem = make_problem(simulate, robot, known, windows, MOTION)
    problem, place, dead_band, noise = _solve(problem)
    return _report(problem, place, noise, dead_band, np.random.default_rng(seed))


@dataclass(frozen=True)
class DeadBand:
    """Between which commands a wheel begins to turn: the posterior is even within parts of the range."""

    estimate: float
    edges: Floats
    weights: Floats

    def draws(self, rng: np.random.Generator, n: int) -> Floats:
        """Return draws from its posterior, (n,)."""
        part = rng.choice(len(self.weights), n, p=self.weights)
        return np.asarray(rng.uniform(self.edges[part], self.edges[part + 1]))


def nothing_known(names: Sequence[str], known: Known, robot: RobotModel, method: str) -> Fit:
    """Return parameters of which cells alone tell nothing to a fit of windows, with what to record."""
    own = own_values(robot)
    fitted = []
    for name in names:
        low, high = known[name].prior.lowest, known[name].prior.highest
        fitted.append(
            Fitted(
                name=name, estimate=min(max(own[name], low), high), low=low, high=high, prior_low=low,
                prior_high=high, identified=False, unit=known[name].unit, advice=advice_for(name, "cells"),
            )
        )  # fmt: skip
    notes = (
        "Cells, readings and stalls do not show where it was at each command: fit all parameters to whole trials.",
    )
    return Fit(tuple(fitted), {}, {}, method, notes)


def _solve(problem: Problem) -> tuple[Problem, Floats, DeadBand, Floats]:
    noise = FIRST_NOISE
    problem = problem.fixed_at(**{"drive.dead_band": problem.robot.centers()["drive.dead_band"]})
    scatter = scatter_of(problem, problem.own)
    place = _first_place(problem, scatter, noise)
    for turn in range(MOST_ROUNDS):
        problem = replace(problem, jitter=float(noise[JITTER]))
        scatter = scatter_of(problem, place)
        if turn < DEAD_BANDS:
            dead_band = _dead_band(problem, scatter, noise, place)
            problem = problem.fixed_at(**{"drive.dead_band": dead_band.estimate})
        before = place
        place, _ = best_place(problem, scatter, noise, place)
        off = np.nan_to_num(problem.off(place[None])[0])
        # the same random numbers in each round, so that rounds come to an end
        noise = typical_noise(
            np.random.default_rng(0), scatter, off, scatter_parameters(problem.known), noise
        )
        if turn >= DEAD_BANDS and np.abs(place - before).max() < SETTLED:
            break
    return problem, place, dead_band, noise


def _first_place(problem: Problem, scatter: Scatter, noise: Floats) -> Floats:
    names = [parameter.name for parameter in problem.free]
    candidates = []
    for delay in DELAYS if "drive.delay" in names else DELAYS[:1]:
        first = problem.own.copy()
        if "drive.delay" in names:
            first[names.index("drive.delay")] = delay
        candidates.append(best_place(problem, scatter, noise, first))
    return min(candidates, key=lambda pair: pair[1])[0]


def _dead_band(problem: Problem, scatter: Scatter, noise: Floats, place: Floats) -> DeadBand:
    """Return a dead band between the given commands: results depend only on which commands move a wheel."""
    prior = problem.known["drive.dead_band"].prior
    low, high = prior.lowest, prior.highest
    windows = problem.windows
    move, turn = windows.commands[windows.trial, windows.first].T
    wheels = np.abs(np.clip(np.concatenate([move - turn, move + turn]), -1, 1))
    given = np.unique(np.round(wheels, 6))
    edges = np.unique(np.concatenate([[low], given[(given > low) & (given < high)], [high]]))
    middles = (edges[:-1] + edges[1:]) / 2
    logs = np.array([_log_likelihood(problem, scatter, noise, place, float(at)) for at in middles])
    weights = np.exp(np.maximum(logs - logs.max(), -500.0)) * np.diff(edges)
    weights /= weights.sum()
    own = own_values(problem.robot)["drive.dead_band"]
    best = int(np.argmax(weights))
    inside = edges[best] <= own <= edges[best + 1]
    return DeadBand(float(own if inside else middles[best]), edges, weights)


def _log_likelihood(
    problem: Problem, scatter: Scatter, noise: Floats, place: Floats, dead_band: float
) -> float:
    off = problem.fixed_at(**{"drive.dead_band": dead_band}).off(place[None])[0]
    return scatter.log_likelihood(np.nan_to_num(off), noise)


def _report(
    problem: Problem,
    place: Floats,
    noise: Floats,
    dead_band: DeadBand,
    rng: np.random.Generator,
) -> Fit:
    slopes = problem.slopes(place)
    scatter = scatter_of(problem, place)
    off = np.nan_to_num(problem.off(place[None])[0])
    noises = scatter_parameters(problem.known)
    places, scatters = draw_posterior(rng, scatter, place, slopes, off, noise, noises)
    wide = widening(scatter, slopes, off, problem.windows.trial, np.median(scatters, axis=0))
    places = np.clip(place + (places - place) * wide, 0.0, 1.0)
    scatters = _widened(scatters, noises, scatter, off, problem.windows.trial)
    draws = values_at(problem.free, places)
    draws |= {parameter.name: scatters[:, k] for k, parameter in enumerate(noises[: len(MOTION_NOISE)])}
    draws["drive.dead_band"] = dead_band.draws(rng, len(places))
    best = {name: float(value[0]) for name, value in values_at(problem.free, place[None]).items()}
    own = own_values(problem.robot)
    best["drive.dead_band"] = dead_band.estimate
    observe = problem.windows.trials[0].observe
    found = identify_from(draws, problem.known, scatter.whitened(slopes, noise), problem.free)
    for name in MOTION_NOISE:
        best[name] = float(np.median(draws[name])) if found[name].identified else own[name]
    fitted = tuple(
        fitted_parameter(problem.known[name], best[name], draws[name], found[name], observe) for name in draws
    )
    numbers = robot_numbers(
        problem.known, problem.robot, {name: np.array([value]) for name, value in best.items()}
    )
    kept = rng.choice(len(places), N_DRAWS, replace=False)
    drawn = robot_numbers(problem.known, problem.robot, {name: value[kept] for name, value in draws.items()})
    return Fit(
        fitted,
        {name: float(value[0]) for name, value in numbers.items()},
        {name: tuple(value.tolist()) for name, value in drawn.items()},
        METHOD,
        notes=_notes(problem, noises, scatters),
        evidence={"windows": len(off), "rms": dict(zip(CHANNELS, _rms(off, scatter.seen), strict=True))},
    )


def _widened(
    scatters: Floats, noises: Sequence[Parameter], scatter: Scatter, off: Floats, trial: Ints
) -> Floats:
    """Return the simulator's own noise, spread around its median, (d, q)."""
    prior, middle = NoisePrior.of(noises), np.median(scatters, axis=0)
    wide = np.ones(len(noises))
    wide[: len(MOTION_NOISE)] = widening_of_noise(scatter, off, trial, middle, noises)
    places, at = prior.places(scatters), prior.places(middle)
    return prior.at(at + (places - at) * wide)


def _rms(off: Floats, seen: Bools) -> list[float]:
    return [
        float(np.sqrt(np.mean(off[seen[:, k], k] ** 2))) if seen[:, k].any() else 0.0
        for k in range(off.shape[1])
    ]


def fitted_parameter(
    parameter: Parameter, estimate: float, draws: Floats, identified: Identified, observe: Observe
) -> Fitted:
    """Return a parameter with its 90 % interval, and with advice if it is not identified.

    The interval also holds the estimate, which may lie at an end of a ridge that the draws fill.
    """
    low, high = np.quantile(draws, ENDS)
    return Fitted(
        name=parameter.name,
        estimate=estimate,
        low=min(float(low), estimate),
        high=max(float(high), estimate),
        prior_low=parameter.prior.lowest,
        prior_high=parameter.prior.highest,
        identified=identified.identified,
        unit=parameter.unit,
        advice="" if identified.identified else advice_for(parameter.name, observe, identified.partners),
    )


def _notes(problem: Problem, noises: Sequence[Parameter], scatters: Floats) -> tuple[str, ...]:
    scatter = {parameter.name: float(np.median(scatters[:, k])) for k, parameter in enumerate(noises)}
    notes = [
        f"{len(problem.windows.trial)} windows of {problem.windows.step_s:g} s in {len(problem.windows.trials)} trials"
    ]
    if problem.windows.trials[0].observe == "track":
        notes.append(
            f"camera: about {1000 * scatter['camera.place']:.1f} mm and {scatter['camera.angle']:.4f} rad; "
            f"skid sideways: {1000 * scatter['skid.per_m']:.1f} mm after a meter"
        )
    return tuple(notes)
