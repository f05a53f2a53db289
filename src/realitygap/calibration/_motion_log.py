"""The fit of a drive to logs of wheel commands, with the observations of a camera or encoders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from realitygap._wording import fixed
from realitygap.errors import finite_numbers
from realitygap.world import Fitted, RobotModel

from ._fit import HeldOut, HeldOutFit
from ._log_fit import LogPosterior, LogProblem, rows_of, sample_log_posterior
from ._log_model import MotionLog, Numbers, body_steps, read_late, seen_rows, wheel_ways
from ._log_parameters import LogNumbers
from ._log_prediction import PathErrors, Steps, last_seen, path_errors, positions, summary_of
from ._one_thread import one_blas_thread
from ._prior import ENDS, Deviation, is_identified
from ._simulate import Floats

N_DRAWS = 200
LEAST_ROWS = 10
PEAK = 0.7
"""Standard deviation of a normal prior with the curvature of a Cauchy one at its peak, in scales of the prior."""

MAIN = ("drive.gain", "drive.asymmetry", "drive.track", "drive.axle", "encoder.gain", "encoder.asymmetry")
DISAGREE = 2.0
"""Widening of the intervals of the main parameters beyond which the parts of a log contradict each other."""

METHOD = (
    "Posterior with Cauchy priors around the robot file's numbers (Gelman et al. 2008); likelihood of the poses by an "
    "extended Kalman filter (Särkkä 2013, sections 5.2 and 12.2) and of the distances between encoder readings; "
    "widened where blocks of time disagree (sandwich covariance, White 1982)."
)


@dataclass(frozen=True)
class LogPrediction:
    """Predictions of the unseen part of a log.

    Attributes:
        split: First row of the unseen part.
        nominal: Motion by the robot's own numbers.
        fitted: Motion by the fitted numbers.
        errors: Errors of both positions, by the names nominal and fitted; None without poses.
        wheels: Errors of both speeds of the wheels; None with poses.
    """

    split: int
    nominal: Steps
    fitted: Steps
    errors: PathErrors | None
    wheels: HeldOut | None


@dataclass(frozen=True)
class MotionLogFit(HeldOutFit):
    """A drive fitted to logs; attributes as in `HeldOutFit`, and more.

    `evidence` has the predicted and seen path of the unseen part of the first log with one.

    Attributes:
        by_log: Predictions of the unseen part of each log; None for a log that the fit saw wholly.
    """

    by_log: tuple[LogPrediction | None, ...] = ()


@one_blas_thread()
def fit_motion_log(
    time_s: ArrayLike,
    commands: ArrayLike | None,
    robot: RobotModel,
    *,
    poses: ArrayLike | None = None,
    encoders: ArrayLike | None = None,
    hold_out: float = 0.5,
    seed: int = 0,
) -> MotionLogFit:
    """Fit the drive of a robot to a log, and predict the part that the fit does not see.

    The prior is narrow around the robot's own numbers and has long tails. So a short log changes them little, and a
    robot file that is wrong does not hold the fit back. Parameters that the log shows only together keep the file's
    numbers. The place of the camera's marker to the left of the axle's middle, the heading that it shows, and the delay
    of its clock are fitted, too. `drive.drift_per_m` is not: with an unknown marker, it cannot be distinguished from
    `drive.asymmetry`. Without commands, the scales of the encoders are fitted in place of the gains.

    Args:
        time_s: (n,) ascending times [s].
        commands: (n, 2) commands of the left and right wheel as shares of `drive.speed`. Row k holds from time k to
            time k + 1. Values beyond -1..1 are faster than `drive.speed`. None: the encoders show what the wheels did.
        robot: The robot with its nominal numbers.
        poses: (n, 2) x, y [m] or (n, 3) x, y, heading [rad] of the body's origin; nan if not seen.
        encoders: (n, 2) distance of the left and right wheel since the start [m]; nan if not seen.
        hold_out: Share of the log's time, at its end, that the fit does not see; 0 to fit to everything.
        seed: Seed of the draws.

    Returns:
        The fit, with the error of nominal and fitted numbers on the unseen part. With poses the error is the mean
        distance between seen and predicted positions [m]; without, that of the wheels' speeds [m/s]. Predictions start
        from a pose that was seen, and use the fitted place and clock of the camera.

    Raises:
        ValueError: The arrays do not fit together, or show too little.

    Source: Särkkä (2013), Bayesian Filtering and Smoothing, sections 5.2 and 12.2; Gelman, Jakulin, Pittau & Su (2008),
        a weakly informative default prior distribution.
    """
    return fit_motion_logs(
        [motion_log(time_s, commands, poses=poses, encoders=encoders)], robot, hold_out=hold_out, seed=seed
    )


@one_blas_thread()
def fit_motion_logs(
    logs: Sequence[MotionLog],
    robot: RobotModel,
    *,
    cameras: Sequence[int] | None = None,
    hold_out: float = 0.5,
    seed: int = 0,
) -> MotionLogFit:
    """Fit the drive of a robot to several logs together, and predict the parts that the fit does not see.

    Args:
        logs: Logs of `motion_log`, of the same robot.
        robot: The robot with its nominal numbers.
        cameras: (k,) index of the camera that saw each log's poses, from 0: its place, heading, and clock. Default:
            each log has its own.
        hold_out: Share of each log's time, at its end, that the fit does not see; 0 to fit to everything. A log that is
            too short to be split is seen wholly, if another one is long enough.
        seed: Seed of the draws.

    Returns:
        The fit, as in `fit_motion_log`. Errors of several logs are averaged, weighted by their observations.

    Raises:
        ValueError: There is no log, or none is long enough for its unseen part.
    """
    if not logs:
        raise ValueError("There is no log, expected at least one.")
    if not 0.0 <= hold_out <= 0.9:
        raise ValueError(f"hold_out is {hold_out:g}, expected a share of the log from 0 to 0.9.")
    splits = _splits(logs, hold_out)
    seen = tuple(log.until(split) for log, split in zip(logs, splits, strict=True))
    at = tuple(range(len(logs)) if cameras is None else cameras)
    rng = np.random.default_rng(seed)
    problem = LogProblem(seen, at, LogNumbers.of(robot, seen))
    posterior = sample_log_posterior(problem, rng)
    best = _best(posterior)
    draws = posterior.draws[rows_of(posterior.draws, N_DRAWS, rng)]
    by_log = tuple(
        None
        if split == len(log.time_s)
        else _predict(log, split, posterior.numbers, best[problem.places(camera)])
        for log, split, camera in zip(logs, splits, at, strict=True)
    )
    held_out = _held_out([each for each in by_log if each is not None])
    fitted = _fitted(posterior, best)
    any_camera = problem.places(0)
    drawn = _robot_numbers(posterior.numbers.values(draws[:, any_camera]), robot, posterior)
    notes, misspecified = _notes(posterior, fitted)
    numbers = _robot_numbers(posterior.numbers.values(best[None, any_camera]), robot, posterior)
    return MotionLogFit(
        fitted,
        {name: float(value[0]) for name, value in numbers.items()},
        {name: tuple(value.tolist()) for name, value in drawn.items()},
        METHOD,
        held_out=held_out,
        notes=(*notes, *posterior.against.lines),
        by_log=by_log,
        misspecified=misspecified or bool(posterior.against.lines),
        evidence=_evidence(logs, by_log),
    )


def _best(posterior: LogPosterior) -> Floats:
    """Return the median of the posterior, (q,), on the standard scale.

    Numbers that the logs do not show are the robot's own.
    """
    best = np.median(posterior.draws, axis=0)
    for k, parameter in enumerate(posterior.numbers.free):
        if parameter.name in (*posterior.together, *posterior.vague):
            best[k] = 0.0
    return np.asarray(best)


def _fitted(posterior: LogPosterior, best: Floats) -> tuple[Fitted, ...]:
    """Return the parameters of the robot, of its encoders, and of the camera, with intervals."""
    numbers = posterior.numbers
    rows = []
    for k, parameter in enumerate(numbers.free):
        own = numbers.own[parameter.name]
        if parameter.name in (*posterior.together, *posterior.vague):
            rows.append(_unknown(parameter, own))
        elif "." in parameter.name:  # others are noise of what was seen
            rows.append(_row(parameter, own, float(best[k]), posterior.draws[:, k]))
    seen = list(numbers.camera) * (posterior.n_cameras if numbers.camera else 0)
    for k, parameter in enumerate(seen, len(numbers.free)):
        row = _row(parameter, 0.0, float(best[k]), posterior.draws[:, k])
        if posterior.n_cameras > 1:
            number = (k - len(numbers.free)) // len(numbers.camera) + 1
            row = row.model_copy(update={"name": parameter.name.replace("camera.", f"camera.{number}.")})
        rows.append(row)
    return tuple(rows)


def _unknown(parameter: Deviation, own: float) -> Fitted:
    """Return a parameter that keeps the robot's own number, with the interval of its prior."""
    low, high = _ends(parameter, own)
    return Fitted(
        name=parameter.name, estimate=own, low=low, high=high, prior_low=low, prior_high=high, identified=False,
        unit=parameter.unit, advice=parameter.advice,
    )  # fmt: skip


def _ends(parameter: Deviation, own: float) -> tuple[float, float]:
    """Return the 90 % interval of a parameter's prior."""
    low, high = parameter.at(own, np.array([-parameter.most, parameter.most])).tolist()
    return max(low, 0.0) if parameter.is_size else low, high


def _row(parameter: Deviation, own: float, best: float, draws: Floats) -> Fitted:
    prior_low, prior_high = _ends(parameter, own)
    low, high = np.quantile(parameter.at(own, draws), ENDS)
    estimate = float(parameter.at(own, np.array([best]))[0])
    identified = is_identified(float(np.std(draws)), PEAK) and prior_low <= estimate <= prior_high
    return Fitted(
        name=parameter.name,
        estimate=estimate,
        low=float(low),
        high=float(high),
        prior_low=prior_low,
        prior_high=prior_high,
        identified=identified,
        unit=parameter.unit,
        advice="" if identified else parameter.advice,
    )


def _notes(posterior: LogPosterior, fitted: Sequence[Fitted]) -> tuple[tuple[str, ...], bool]:
    """Return what else the fit shows, and whether the model contradicts the logs."""
    notes = []
    if posterior.together:
        notes.append(
            f"The log shows {listed(posterior.together)} only together, so they keep the robot file's numbers. Drive "
            "at several speeds, straight on, and turn in place, in both directions."
        )
    if posterior.vague:
        notes.append(
            f"The log hardly shows {listed(posterior.vague)}, so the robot file's numbers stay. Record more."
        )
    left = [
        row.name for row in fitted if row.name in MAIN and not row.prior_low <= row.estimate <= row.prior_high
    ]
    if left:
        notes.append(
            f"Beyond what is plausible: {', '.join(left)}. Check the units and columns of the mapping."
        )
    known = [
        wide
        for one, wide in zip(posterior.numbers.free, posterior.widening, strict=False)
        if one.name in MAIN and one.name not in (*posterior.together, *posterior.vague)
    ]
    widest = max(known, default=1.0)
    if widest > DISAGREE:
        notes.append(
            f"Parts of the log contradict each other: intervals are up to {widest:.1f} times as wide as by the noise "
            "alone."
        )
    return tuple(notes), bool(left) or widest > DISAGREE


def listed(names: Sequence[str]) -> str:
    """Return names as a list in words."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _robot_numbers(values: Numbers, robot: RobotModel, posterior: LogPosterior) -> dict[str, Floats]:
    """Return the numbers of the robot's file that were fitted."""
    names = {one.name for one in posterior.numbers.free} - {*posterior.together, *posterior.vague}
    for part in ("drive", "encoder"):
        if names & {f"{part}.gain", f"{part}.asymmetry"}:
            names |= {f"{part}.gain_left", f"{part}.gain_right"}
    known = robot.centers()
    return {name: values[name] for name in sorted(names) if name in known}


def _held_out(predictions: Sequence[LogPrediction]) -> HeldOut | None:
    """Return the errors on all unseen parts: of positions, or of the wheels' speeds if no poses were seen."""
    paths = [each.errors for each in predictions if each.errors is not None]
    if paths:
        errors = summary_of(paths, "logs")
        more = {key: (row["nominal"], row["fitted"]) for key, row in errors.more.items()}
        return HeldOut(
            errors.measure, "m", errors.mean["nominal"], errors.mean["fitted"], n=errors.n, more=more
        )
    wheels = [each.wheels for each in predictions if each.wheels is not None]
    if len(wheels) < 2:
        return wheels[0] if wheels else None
    weights = [each.n for each in wheels]

    def mean(values: Sequence[float]) -> float:
        return float(np.average(values, weights=weights))

    return HeldOut(
        f"{wheels[0].measure}, mean of {len(wheels)} logs",
        wheels[0].unit,
        mean([each.nominal for each in wheels]),
        mean([each.fitted for each in wheels]),
        n=sum(weights),
        more={
            name: (
                mean([each.more[name][0] for each in wheels]),
                mean([each.more[name][1] for each in wheels]),
            )
            for name in wheels[0].more
        },
    )


def motion_log(
    time_s: ArrayLike,
    commands: ArrayLike | None,
    *,
    poses: ArrayLike | None = None,
    encoders: ArrayLike | None = None,
) -> MotionLog:
    """Return a log to fit a drive to; arguments and errors as in `fit_motion_log`."""
    time = np.asarray(time_s, np.float64)
    n = len(time) if time.ndim == 1 else 0
    if n < LEAST_ROWS:
        raise ValueError(f"time_s has shape {time.shape}, expected (n,) with at least {LEAST_ROWS} times.")
    late = np.flatnonzero(~(np.diff(time) > 0))
    if len(late):
        k = int(late[0])
        raise ValueError(
            f"time_s is {time[k]:g} s in row {k} and {time[k + 1]:g} s in row {k + 1}, expected ascending times. Sort "
            "the log, and leave out repeated rows."
        )
    commanded = _commands(commands, n)
    seen = np.full((n, 3), np.nan)
    if poses is not None:
        given = _rows("poses", poses, n, (2, 3))
        seen[:, : given.shape[1]] = given
        seen[~np.isfinite(seen[:, :2]).all(axis=1)] = np.nan
    wheels = np.full((n, 2), np.nan) if encoders is None else _rows("encoders", encoders, n, (2,))
    if not len(commanded):
        wheels = _without_gaps(time, wheels)
    log = MotionLog(time, commanded, seen, wheels)
    if seen_rows(log).sum() < LEAST_ROWS:
        raise ValueError(
            f"Poses or encoders were recorded at {seen_rows(log).sum()} times, expected at least {LEAST_ROWS}."
        )
    return log


def _commands(commands: ArrayLike | None, n: int) -> Floats:
    """Return checked commands, (n, 2); no rows if there are none."""
    if commands is None:
        return np.empty((0, 2))
    checked = finite_numbers("commands", _rows("commands", commands, n, (2,)))
    if not np.any(checked):
        raise ValueError("All commands are 0, expected a robot that drives.")
    return checked


def _without_gaps(time: Floats, wheels: Floats) -> Floats:
    """Return the distances of wheels that stand for the commands, with straight lines over times without one."""
    known = np.isfinite(wheels).all(axis=1)
    if known.sum() < LEAST_ROWS or not np.ptp(wheels[known], axis=0).any():
        raise ValueError(
            f"There are no commands, and encoders were recorded at {known.sum()} times, expected at least {LEAST_ROWS} "
            "of a robot that drives."
        )
    return np.stack([np.interp(time, time[known], wheel) for wheel in wheels[known].T], axis=1)


def _rows(name: str, values: ArrayLike, n: int, widths: Sequence[int]) -> Floats:
    rows = np.asarray(values, np.float64)
    if rows.ndim != 2 or len(rows) != n or rows.shape[1] not in widths:
        expected = " or ".join(f"({n}, {width})" for width in widths)
        raise ValueError(f"{name} has shape {rows.shape}, expected {expected}: one row for each of time_s.")
    return rows


def _splits(logs: Sequence[MotionLog], hold_out: float) -> list[int]:
    """Return the first row of each log that the fit does not see; the number of its rows if it is too short."""
    splits, error = [], None
    for log in logs:
        try:
            splits.append(_split(log, hold_out))
        except ValueError as problem:
            splits.append(len(log.time_s))
            error = error or problem
    if error is not None and all(split == len(log.time_s) for log, split in zip(logs, splits, strict=True)):
        raise error
    return splits


def _split(log: MotionLog, hold_out: float) -> int:
    """Return the first row that the fit does not see."""
    n = len(log.time_s)
    if hold_out == 0.0:
        return n
    end = log.time_s[-1] - hold_out * (log.time_s[-1] - log.time_s[0])
    split = int(np.searchsorted(log.time_s, end, side="right"))
    for part, rows in (("seen", slice(None, split)), ("held-out", slice(split, None))):
        found = int(seen_rows(log)[rows].sum())
        if found < LEAST_ROWS:
            raise ValueError(
                f"The {part} part of the log has {found} rows with poses or encoders, expected at least {LEAST_ROWS}. "
                "Choose another hold_out, or 0 to fit to everything."
            )
    return split


def _steps_of(log: MotionLog, values: Numbers) -> list[Steps]:
    """Return the motion of the body between the times of its poses, by m sets of numbers."""
    ways = read_late(log, wheel_ways(log, values), values["camera.delay"])
    length, turn = body_steps(ways, values)
    seen = values["camera.left"] * 1j - values["drive.axle"]
    return [
        Steps(*each)
        for each in zip(length, turn, seen.tolist(), values["camera.heading"].tolist(), strict=True)
    ]


def _predict(log: MotionLog, split: int, numbers: LogNumbers, best: Floats) -> LogPrediction:
    """Predict the unseen part of a log with the robot's own and with the fitted numbers, and the fitted camera."""
    points = np.stack([best, best])
    points[0, : len(numbers.free)] = 0.0
    values = numbers.values(points)
    if log.sees_poses:
        nominal, fitted = _steps_of(log, values)
        errors = path_errors(log, {"nominal": nominal, "fitted": fitted}, split)
        return LogPrediction(split, nominal, fitted, errors, None)
    nothing = Steps(np.empty(0), np.empty(0))
    wheels = _wheel_errors(log, wheel_ways(log, values), split, numbers)
    return LogPrediction(split, nothing, nothing, None, wheels)


def _wheel_errors(log: MotionLog, ways: Floats, split: int, numbers: LogNumbers) -> HeldOut:
    """Return the errors of the wheels' speeds by two sets of numbers, nominal and fitted."""
    rows = np.flatnonzero(np.isfinite(log.encoders).all(axis=1))
    rows = rows[rows >= split]
    speeds = np.diff(ways[:, rows], axis=1) / np.diff(log.time_s[rows])[:, None]
    seen = np.diff(log.encoders[rows], axis=0) / np.diff(log.time_s[rows])[:, None]
    off = np.sqrt(((speeds - seen) ** 2).mean(axis=(1, 2)))
    full = numbers.own["drive.speed"]
    return HeldOut(
        f"root mean square error of the wheels' speeds over the last {fixed(log.time_s[-1] - log.time_s[split], 1)} s",
        "m/s",
        float(off[0]),
        float(off[1]),
        n=2 * len(seen),
        more={"as a share of full speed (1)": (float(off[0] / full), float(off[1] / full))},
    )


def _evidence(logs: Sequence[MotionLog], by_log: Sequence[LogPrediction | None]) -> dict[str, Any]:
    """Return the predicted and the seen path of the unseen part of the first log with one."""
    for log, made in zip(logs, by_log, strict=True):
        if made is not None and log.sees_poses:
            rows = made.split + np.flatnonzero(np.isfinite(log.poses[made.split :, 0]))
            paths = {
                name: np.round(positions(log, steps, last_seen(log, made.split), rows), 5).tolist()
                for name, steps in (("nominal", made.nominal), ("fitted", made.fitted))
            }
            return {"held_out": {"seen": np.round(log.poses[rows, :2], 5).tolist(), **paths}}
    return {}
