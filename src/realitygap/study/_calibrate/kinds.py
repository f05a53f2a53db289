"""The kinds of calibration: their trials, and the fit to them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from realitygap._wording import significant
from realitygap.calibration import (
    LEAST_PLACEMENTS,
    MOTION,
    Fit,
    Moved,
    Placement,
    SensorFit,
    contact_plans,
    fit_contact,
    fit_motion,
    fit_path,
    fit_sensor,
    motion_plans,
    moved_in,
    path_plans,
    placements_of,
    ranges_of,
    scribbler_prior,
    sensor_plans,
    step_of,
)
from realitygap.platforms import SimEnsemble, SimPlatform, SimRobot
from realitygap.records import CALIBRATES, Observe, TrialRecord
from realitygap.robots import Command
from realitygap.trials import TrialPlan
from realitygap.world import Arena, Pose, RobotModel, distance_to_segment

from .held_out_trials import Numbers, compare_on_trials
from .whole import all_plans, fit_everything


@dataclass(frozen=True)
class Kind:
    """A kind of calibration.

    Attributes:
        plans: Trials for an arena, a robot and, if it is given, a budget.
        fit: Fit to trials, with the robot to build on, the arena, the observation level, and the seed of the draws.
        least: Minimum number of trials.
        observes: Observation levels with which it works.
    """

    plans: Callable[..., Sequence[TrialPlan]]
    fit: Callable[[Sequence[TrialRecord], RobotModel, Arena, Observe, int], Fit]
    least: int = 1
    observes: tuple[Observe, ...] = CALIBRATES


def _told_of_ends(parts: Fit, *, is_cut: bool) -> Fit:
    """Add a note on the numbers of the motion that are at an end of what was thought possible.

    Noise is left out: a robot without any lies at the lower end, and what `sim` cannot make looks like more of it.

    Args:
        parts: Parts of a fit that has no predictive check.
        is_cut: Whether the fit keeps within what was thought possible, so that at an end it is misspecified.
    """
    at_end = [each for each in parts.fitted if each.is_at_end and each.name in MOTION]
    if not at_end:
        return parts
    message = ", ".join(
        f"{each.name} is {significant(each.estimate, 3)} "
        f"({significant(each.prior_low, 3)} to {significant(each.prior_high, 3)})"
        for each in at_end
    )
    note = f"At or beyond the end of what was thought possible: {message}."
    return replace(parts, misspecified=is_cut, notes=(*parts.notes, note))


# path

AT_A_WALL = 0.01
"""A wall that is less than twice this distance ahead of a robot may have stopped it [m]."""

FRONT_M = 0.03
"""Depth of a robot's front: the part of its outline behind the foremost point [m]."""

MOST_TURN = 0.9 * math.pi
"""Largest turn by one command, so that its beginning and end show how far the robot turned [rad]."""

FAR_M = 20.0
"""Nothing stands nearer where a path is simulated [m]."""


def _fit_path(
    trials: Sequence[TrialRecord], robot: RobotModel, arena: Arena, observe: Observe, seed: int
) -> Fit:
    def simulate(trial: TrialRecord) -> Moved:
        return _moved_in_sim(trial, robot, arena)

    straight = [trial for trial in trials if _is_straight(trial)]
    stopped = [id(trial) for trial in straight if _ends_at_a_wall(trial, robot, arena)]
    n = len(stopped)
    if n and n == len(straight):
        raise ValueError(
            f"All {n} straight paths ended at a wall, expected room for them: is arena {arena.name!r} the right one, "
            f"and is a command of {straight[0].step_s:g} s right?"
        )
    free = [trial for trial in trials if id(trial) not in stopped]
    fit = fit_path(free, simulate, robot, np.random.default_rng(seed))
    left_out = (f"{n} of {len(straight)} straight paths ended at a wall, and were left out.",) if n else ()
    notes = (*fit.notes, *left_out)
    return _told_of_ends(
        replace(fit, notes=notes, evidence={"path": fit.evidence}),
        is_cut=False,
    )


def _is_straight(trial: TrialRecord) -> bool:
    """Return whether it was to go straight ahead."""
    return bool(np.any(trial.commands[:, 0] > 0)) and not np.any(trial.commands[:, 1])


def _ends_at_a_wall(trial: TrialRecord, robot: RobotModel, arena: Arena) -> bool:
    """Return whether something ahead stopped the robot; where nobody saw its end, by what it said itself.

    One that went back has been told wrongly which of its ends is ahead: that is said elsewhere.
    """
    moved = moved_in(trial)
    if moved is not None and moved.ahead < 0:
        return False
    end = trial.poses[-1] if len(trial.poses) else trial.end_pose
    if end is None:
        return bool(len(trial.stalled)) and float(np.mean(trial.stalled)) > 0.5
    outline = np.array([point for part in robot.body for point in part.outline()])
    front = outline[outline[:, 0] > outline[:, 0].max() - FRONT_M]
    ahead, sine, cosine = outline[:, 0].max() + AT_A_WALL, math.sin(end[2]), math.cos(end[2])
    return any(
        distance_to_segment(end[0] + ahead * cosine - y * sine, end[1] + ahead * sine + y * cosine, wall)
        < AT_A_WALL
        for y in np.linspace(front[:, 1].min(), front[:, 1].max(), 9)
        for wall in arena.segments
    )


def _moved_in_sim(trial: TrialRecord, robot: RobotModel, arena: Arena) -> Moved:
    """Simulate the motion of a robot in a trial, without noise and without obstacles.

    Raises:
        ValueError: A command turns it by so much that turns cannot be counted.
    """
    platform = SimPlatform(robot=robot, noise=False, step_s=trial.step_s, precision="double")
    most = float(np.abs(trial.commands[:, 1]).max(initial=0.0))
    turned_by = 2 * robot.drive.speed * trial.step_s / robot.drive.track * most
    if turned_by > MOST_TURN:
        raise ValueError(
            f"A command of {trial.step_s:g} s turns the robot by {math.degrees(turned_by):.0f} degrees, expected at "
            f"most {math.degrees(MOST_TURN):.0f}: turns cannot be counted. Let commands be shorter."
        )
    walls = [x for wall in arena.walls for x in wall] or [0.0]
    low, high = min(walls) - FAR_M, max(walls) + FAR_M
    around = ((low, low, high, low), (high, low, high, high), (high, high, low, high), (low, high, low, low))
    with SimRobot(platform, replace(arena, walls=around, obstacles=(), vary={})) as simulated:
        simulated.reset(Pose(*trial.start))
        headings = [trial.start[2]]
        for move, turn in trial.commands:
            simulated.drive(Command(float(move), float(turn)))
            headings.append(simulated.pose.heading)
        x, y, _ = simulated.pose
    turned = float(np.ptp(np.unwrap(headings)[[0, -1]]) * np.sign(np.diff(np.unwrap(headings)[[0, -1]]))[0])
    east, north = x - trial.start[0], y - trial.start[1]
    sine, cosine = math.sin(trial.start[2]), math.cos(trial.start[2])
    return Moved(east * cosine + north * sine, north * cosine - east * sine, turned)


# sensors

_SENSORS_METHOD = (
    "Readings of a robot that stands before a wall (Rosenzweig & Remy, section 2.3): likelihood of the mixture of "
    "`sim`, censored at 0 and 1, for each sensor; posterior under even priors by tempered particles (Del Moral, "
    "Doucet & Jasra 2006); intervals also hold what the profile likelihood does not refute (Venzon & Moolgavkar 1988); "
    "posterior predictive check (Gelman, Meng & Stern 1996); readings count less where "
    "consecutive ones, or those of a placement, are alike."
)

MISFIT = 0.05
"""A check's p below which the sensor's model does not make what was read, over all sensors."""

MISPLACED = 0.1
"""Share of a sensor's readings that have to be elsewhere for the fit before it is said not to make them: with enough
readings any model is found wrong somewhere."""


def _fit_sensors(
    trials: Sequence[TrialRecord], robot: RobotModel, arena: Arena, observe: Observe, seed: int
) -> Fit:
    standing = [trial for trial in trials if len(trial.commands) and not np.any(trial.commands)]
    if not standing:
        raise ValueError(
            "The robot is never still: expected trials with readings in front of a wall, as `realitygap "
            "calibrate sensors` records them."
        )
    n_readings = {trial.readings.shape[1] for trial in standing}
    if n_readings != {len(robot.range)}:
        raise ValueError(
            f"The trials have {min(n_readings)} range sensors and robot {robot.name!r} {len(robot.range)}. Build on "
            "the robot that it was (--base ROBOT)."
        )
    rng = np.random.default_rng(seed)
    placements = placements_of(standing, robot, arena)
    fits = [fit_sensor(robot, k, each, rng) for k, each in enumerate(placements)]
    p = min(1.0, len(fits) * min(fit.p for fit in fits))
    farthest = max(fit.misfit for fit in fits)
    return Fit(
        fitted=tuple(fitted for fit in fits for fitted in fit.fitted),
        numbers={name: value for fit in fits for name, value in fit.numbers.items()},
        draws={name: values for fit in fits for name, values in fit.draws.items()},
        method=_SENSORS_METHOD,
        notes=tuple(_said_of(fit) for fit in fits) + _said_of_placements(placements[0]),
        misspecified=p < MISFIT and farthest > MISPLACED,
        misspecification_p=p,
        evidence={"sensors": [_drawn_of(fit, each) for fit, each in zip(fits, placements, strict=True)]},
    )


def _said_of(fit: SensorFit) -> str:
    apart = fit.independence
    return (
        f"{fit.name}: {apart.readings} readings in {apart.placements} placements count as {apart.effective:.0f}; "
        f"correlation of consecutive ones {apart.correlation:.2f} (p {apart.correlation_p:.3f}), share of the variance "
        f"between placements {apart.between:.2f} (p {apart.between_p:.3f}); posterior predictive p {fit.p:.3f}, "
        f"{fit.misfit:.0%} of the readings are not where the fit has them."
    )


def _said_of_placements(placements: Sequence[Placement]) -> tuple[str, ...]:
    if min(Counter(placement.group for placement in placements).values()) >= LEAST_PLACEMENTS:
        return ()
    return (
        f"Some distances have fewer than {LEAST_PLACEMENTS} placements, so the variation between placements is "
        "unknown there. Intervals may be too narrow.",
    )


def _drawn_of(fit: SensorFit, placements: Sequence[Placement]) -> dict[str, Any]:
    """Return the data of a sensor for Figure 3."""
    return {
        "name": fit.name,
        "distances_m": [float(placement.distances.min()) for placement in placements],
        "readings": [np.round(placement.readings, 5).tolist() for placement in placements],
        "curve": {key: np.round(values, 5).tolist() for key, values in fit.curve.items()},
        "p": fit.p,
    }


# motion and contact

OF_MOTION = ("ahead", "turn", "wheels")
"""Kinds of observation that a fit of motors can predict."""


def _fit_motion(
    trials: Sequence[TrialRecord], robot: RobotModel, arena: Arena, observe: Observe, seed: int
) -> Fit:
    moving = _of_purpose(trials, "motion")
    ensemble = _ensemble(moving, robot, arena)

    def fit(some: Sequence[TrialRecord]) -> Fit:
        return fit_motion(some, ensemble.replay, robot, arena, observe=observe, seed=seed)

    def numbers(some: Sequence[TrialRecord]) -> Numbers:
        made = fit(some)
        return made.numbers, made.draws

    parts = _told_of_ends(fit(moving), is_cut=True)
    return compare_on_trials(parts, moving, numbers, ensemble, kinds=OF_MOTION, seed=seed)


def _fit_contact(
    trials: Sequence[TrialRecord], robot: RobotModel, arena: Arena, observe: Observe, seed: int
) -> Fit:
    met = _of_purpose(trials, "contact")
    simulate = _ensemble(met, robot, arena).replay
    return fit_contact(met, simulate, robot, arena, observe=observe, seed=seed)


def _of_purpose(trials: Sequence[TrialRecord], purpose: str) -> list[TrialRecord]:
    """Return the trials of a purpose, or all with commands if none has it."""
    return [trial for trial in trials if trial.purpose == purpose] or [
        trial for trial in trials if len(trial.commands)
    ]


def _ensemble(trials: Sequence[TrialRecord], robot: RobotModel, arena: Arena) -> SimEnsemble:
    """Return robots of `sim` with other numbers, for trials."""
    step_s = step_of(trials) if trials else robot.step_s
    ranges = ranges_of(scribbler_prior(robot), robot)
    return SimEnsemble(SimPlatform(robot=robot, step_s=step_s), arena, ranges=ranges)


# all


def _fit_all(
    trials: Sequence[TrialRecord], robot: RobotModel, arena: Arena, observe: Observe, seed: int
) -> Fit:
    return fit_everything(trials, robot, arena, seed)


KINDS: dict[str, Kind] = {
    "path": Kind(lambda arena, _, *budget: path_plans(arena, *budget), _fit_path, least=2),
    "sensors": Kind(sensor_plans, _fit_sensors),
    "motion": Kind(motion_plans, _fit_motion, observes=("encoders", "track")),
    "contact": Kind(contact_plans, _fit_contact, observes=("track",)),
    "all": Kind(all_plans, _fit_all),
}
