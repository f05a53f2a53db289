"""The fit of contact to encounters with walls: friction, and the resistance to being pushed and turned."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from realitygap.records import Observe, TrialRecord
from realitygap.world import Arena, RobotModel

from ._fit import Fit
from ._identify import identify_from
from ._motion import N_DRAWS, fitted_parameter, nothing_known, observed_as
from ._one_thread import one_blas_thread
from ._posterior import sample_clusters
from ._prior import CONTACT, MAD, Parameter, parameters_of, values_at
from ._shooting import Problem, make_problem
from ._simulate import Bools, Floats, Simulate, motor_noise
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


@one_blas_thread()
def fit_contact(
    trials: Sequence[TrialRecord],
    simulate: Simulate,
    robot: RobotModel,
    arena: Arena,
    *,
    observe: Observe | None = None,
    prior: Sequence[Parameter] | None = None,
    seed: int = 0,
) -> Fit:
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
) -> Fit:
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
    identified = identify_from(draws, problem.known, slopes, problem.free)
    fitted = tuple(
        fitted_parameter(problem.known[name], best[name], draws[name], identified[name], "track")
        for name in draws
    )
    agree = encounters.agreeing(best["contact.friction"])
    other = int((np.abs(off) > FLIPS * scale).any(axis=1).sum())
    return Fit(
        fitted,
        best,
        {name: tuple(value.tolist()) for name, value in draws.items()},
        METHOD,
        (
            f"{len(off)} windows near walls, {other} of which took another path than simulated",
            f"{agree} of {len(encounters.aligned)} encounters align or stall as the fitted friction has it",
        ),
        evidence={"windows": len(off), "flips": other, "typical": dict(zip(CHANNELS[:3], typical, strict=True)),
         "encounters": len(encounters.aligned), "agreeing": agree},
    )  # fmt: skip


TOUCHES_M = 0.006
ALIGNED = math.radians(1.0)  # turned by so much in the step after the first touch
HEAD_ON = math.radians(85.0)  # nearer to head on two corners touch


@dataclass(frozen=True)
class Encounters:
    """First touches of robots that drove straight on.

    Attributes:
        margin: (e,) atan(c_x / |c_y|) - a [rad]. The robot aligns if the angle of friction is smaller.
        aligned: (e,) True if it turned towards the wall.
    """

    margin: Floats
    aligned: Bools

    def agreeing(self, friction: float) -> int:
        """Return the number of robots that the rule predicts correctly at this friction."""
        return int(((self.margin > math.atan(friction)) == self.aligned).sum())


def encounters_of(trials: Sequence[TrialRecord], robot: RobotModel, arena: Arena) -> Encounters:
    """Return all first touches in trials with poses, on which another step of the same command follows."""
    outline = np.array([point for part in robot.body for point in part.outline()])
    axle = robot.centers()["drive.axle"]
    margins, aligned = [], []
    for trial in trials:
        for row in _straight_rows(trial):
            touch = _touch(trial.poses[row], outline, arena)
            if touch is None or _touch(trial.poses[row - 1], outline, arena) is not None:
                continue
            ahead = math.copysign(1.0, trial.commands[row, 0]) * robot.drive.ahead
            wall, (x, y) = touch
            angle = abs(wall)
            if ahead * (x - axle) <= 0 or angle > HEAD_ON:
                continue
            margins.append(math.atan2(abs(x - axle), abs(y)) - angle)
            turned = trial.poses[row + 1, 2] - trial.poses[row, 2]
            aligned.append(abs(math.remainder(wall + turned, math.pi)) < angle - ALIGNED)
    return Encounters(np.array(margins), np.array(aligned, np.bool_))


def _straight_rows(trial: TrialRecord) -> list[int]:
    """Return rows before which and after which the same straight command was given."""
    if not len(trial.poses):
        return []
    move, turn = trial.commands.T
    same = (turn[1:] == 0) & (turn[:-1] == 0) & (move[1:] == move[:-1]) & (np.abs(move[1:]) > 0.5)
    return [int(k) + 1 for k in np.flatnonzero(same)]


def _touch(pose: Floats, outline: Floats, arena: Arena) -> tuple[float, tuple[float, float]] | None:
    """Return the heading against the touched wall [rad, -pi / 2..pi / 2], and the touching point in its frame [m]."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    points = pose[:2] + outline @ np.array([[cos, sin], [-sin, cos]])
    for x1, y1, x2, y2 in arena.segments:
        way = np.array([x2 - x1, y2 - y1])
        length = float(np.hypot(*way))
        off = points - (x1, y1)
        away = np.abs(off[:, 0] * way[1] - off[:, 1] * way[0]) / length
        nearest = int(np.argmin(away))
        if away[nearest] < TOUCHES_M:
            angle = math.remainder(pose[2] - math.atan2(way[1], way[0]), math.pi)
            return angle, (float(outline[nearest, 0]), float(outline[nearest, 1]))
    return None
