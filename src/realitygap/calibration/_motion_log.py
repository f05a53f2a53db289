"""The fit of a drive to logs of wheel commands, with the observations of a camera or encoders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from realitygap._numbers import fixed
from realitygap.errors import finite_numbers
from realitygap.world import Fitted, RobotModel

from ._held_out import HeldOut, HeldOutFit
from ._log_model import MotionLog, encoder_likelihood, seen_rows, track, wheel_steps
from ._simulate import Floats

N_DRAWS = 200
ENDS = (0.05, 0.95)
LEAST_ROWS = 10
IDENTIFIED = 0.35
"""A parameter is identified if its standard deviation is below this, in scales of its prior: half of what the prior has
at its peak."""

WIDE = 0.05
"""Distance over which a curvature is taken, in the same scales."""

FREE = 0.01
"""Weight of the prior in a first search, in which the log alone decides what it can tell."""

LEAST_CURVATURE = 0.03
"""Minimum curvature of a log posterior on the standard scale, so that an interval is no wider than its prior's."""

BEYOND = 1e12
"""Larger than what is minimized can be."""

STEP = 1e-3
"""Step of finite differences, in standard deviations of the prior."""

METHOD = (
    "Maximum a posteriori with a Cauchy prior around the robot file's numbers (Gelman et al. 2008); likelihood of the "
    "poses by an extended Kalman filter (Särkkä 2013, sections 5.2 and 12.2) and of the distances between encoder "
    "readings; intervals from the curvature (Laplace)."
)


@dataclass(frozen=True)
class Spread:
    """A parameter of a log with its prior.

    Attributes:
        name: Name, the same as in a calibration.
        kind: plus: spread around the robot's own number; ratio: its logarithm is; size: only its absolute value
            counts.
        spread: Scale of the prior, chosen for a robot whose file is nearly right: a Cauchy distribution, whose tails
            let go of a file that is wrong (Gelman et al. 2008); with `is_normal`, the standard deviation.
        unit: Unit of its values.
        advice: Data to record if it is not identified.
    """

    name: str
    kind: Literal["plus", "ratio", "size"]
    spread: float
    unit: str
    advice: str
    is_normal: bool = False

    def log_prior(self, standard: Floats) -> Floats:
        """Return log densities at points of the standard scale, less a constant."""
        return np.asarray(-0.5 * standard**2 if self.is_normal else -np.log1p(standard**2))

    @property
    def most(self) -> float:
        """The 95 % quantile of the prior on the standard scale."""
        return 1.645 if self.is_normal else 6.314

    def of(self, own: float, standard: Floats) -> Floats:
        """Return values at points of the standard scale."""
        if self.kind == "ratio":
            return np.asarray(own * np.exp(self.spread * standard))
        values = own + self.spread * standard
        return np.abs(values) if self.kind == "size" else values


DRIVE = (
    Spread("drive.gain", "ratio", 0.01, "", "Drive straight for longer."),
    Spread("drive.asymmetry", "plus", 0.005, "", "Drive straight, ahead and back."),
    Spread("drive.track", "ratio", 0.01, "m", "Turn in place, in both directions, with poses."),
    Spread("drive.axle", "plus", 0.002, "m", "Turn in place, in both directions, with poses."),
    Spread("drive.drift_per_m", "plus", 0.01, "rad/m", "Drive straight, ahead and back, with poses."),
    Spread("drive.soft_dead_band", "size", 0.02, "", "Drive at slow commands."),
    Spread("drive.lag", "size", 0.02, "s", "Start and stop suddenly, and often."),
)
"""Numbers of the drive; the spreads are chosen."""

OWN_NOISE = (
    Spread("drive.travel_noise_per_m", "ratio", 1.0, "m", "Record poses for longer.", is_normal=True),
    Spread("drive.heading_noise_per_m", "ratio", 1.0, "rad", "Record poses for longer.", is_normal=True),
)
SEEN_NOISE = {"place": 0.003, "angle": 0.01, "wheel": 0.0005, "wheel_per_m": 0.003}
"""Typical errors of a camera and of encoders [m, rad, m, m]. A factor of e is one standard deviation."""

LEAST_NOISE = 0.002
"""Noise of the drive that a fit begins from, if the robot's file has less."""


@dataclass(frozen=True)
class MotionLogFit(HeldOutFit):
    """A drive fitted to logs; attributes as in `HeldOutFit`, and one more.

    `evidence` has the predicted and seen path of the unseen part of the first log with one.

    Attributes:
        by_log: Errors on the unseen part of each log; None for a log that the fit saw wholly.
    """

    method: str = METHOD
    by_log: tuple[HeldOut | None, ...] = ()


def fit_motion_log(
    time_s: ArrayLike,
    commands: ArrayLike,
    robot: RobotModel,
    *,
    poses: ArrayLike | None = None,
    encoders: ArrayLike | None = None,
    hold_out: float = 0.5,
    seed: int = 0,
) -> MotionLogFit:
    """Fit the drive of a robot to a log, and predict the part that the fit does not see.

    The prior is narrow around the robot's own numbers and has long tails. So a short log changes them little, and a
    file that is wrong does not hold the fit back.

    Args:
        time_s: (n,) ascending times [s].
        commands: (n, 2) commands of the left and right wheel as shares of `drive.speed`. Row k holds from time k to
            time k + 1. Values beyond -1..1 are faster than `drive.speed`.
        robot: The robot with its nominal numbers.
        poses: (n, 2) x, y [m] or (n, 3) x, y, heading [rad] of the body's origin; nan if not seen.
        encoders: (n, 2) distance of the left and right wheel since the start [m]; nan if not seen.
        hold_out: Share of the log's time, at its end, that the fit does not see; 0 to fit to everything.
        seed: Seed of the draws.

    Returns:
        The fit, with the error of nominal and fitted numbers on the unseen part. With poses the error is the mean
        distance between seen and predicted positions [m]; without, that of the wheels' speeds [m/s].

    Raises:
        ValueError: The arrays do not fit together, or show too little.

    Source: Särkkä (2013), Bayesian Filtering and Smoothing, sections 5.2 and 12.2; Gelman, Jakulin, Pittau & Su (2008),
        a weakly informative default prior distribution.
    """
    return fit_motion_logs(
        [motion_log(time_s, commands, poses=poses, encoders=encoders)], robot, hold_out=hold_out, seed=seed
    )


def fit_motion_logs(
    logs: Sequence[MotionLog], robot: RobotModel, *, hold_out: float = 0.5, seed: int = 0
) -> MotionLogFit:
    """Fit the drive of a robot to several logs together, and predict the parts that the fit does not see.

    Args:
        logs: Logs of `motion_log`, of the same robot.
        robot: The robot with its nominal numbers.
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
    problem = _Problem.of([log.until(split) for log, split in zip(logs, splits, strict=True)], robot)
    best, spread = problem.solve()
    rng = np.random.default_rng(seed)
    draws = best + rng.standard_normal((N_DRAWS, len(best))) @ np.linalg.cholesky(spread).T
    values, drawn = problem.values(best[None]), problem.values(draws)
    predicted = [
        None if split == len(log.time_s) else _predict(problem, log, split, best)
        for log, split in zip(logs, splits, strict=True)
    ]
    by_log = tuple(None if each is None else each[0] for each in predicted)
    held_out = _joined([each for each in by_log if each is not None])
    numbers = _robot_numbers(values)
    return MotionLogFit(
        tuple(problem.fitted(best, spread, drawn)),
        {name: float(value[0]) for name, value in numbers.items()},
        {name: tuple(value.tolist()) for name, value in _robot_numbers(drawn).items()},
        held_out,
        held_out.recommended if held_out else "fitted",
        by_log=by_log,
        evidence=next((each[1] for each in predicted if each is not None), {}),
    )


def _joined(errors: Sequence[HeldOut]) -> HeldOut | None:
    """Return the mean errors of several logs, weighted by their observations."""
    if len(errors) < 2:
        return errors[0] if errors else None
    weights = [each.n for each in errors]

    def mean(values: Sequence[float]) -> float:
        return float(np.average(values, weights=weights))

    first = errors[0]
    return HeldOut(
        f"{first.measure}, mean of {len(errors)} logs",
        first.unit,
        mean([each.nominal for each in errors]),
        mean([each.fitted for each in errors]),
        n=sum(weights),
        more={
            name: (
                mean([each.more[name][0] for each in errors]),
                mean([each.more[name][1] for each in errors]),
            )
            for name in first.more
        },
    )


def motion_log(
    time_s: ArrayLike,
    commands: ArrayLike,
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
    asked = finite_numbers("commands", _rows("commands", commands, n, (2,)))
    if not np.any(asked):
        raise ValueError("All commands are 0, expected a robot that drives.")
    seen = np.full((n, 3), np.nan)
    if poses is not None:
        given = _rows("poses", poses, n, (2, 3))
        seen[:, : given.shape[1]] = given
        seen[~np.isfinite(seen[:, :2]).all(axis=1)] = np.nan
    wheels = np.full((n, 2), np.nan) if encoders is None else _rows("encoders", encoders, n, (2,))
    log = MotionLog(time, asked, seen, wheels)
    if seen_rows(log).sum() < LEAST_ROWS:
        raise ValueError(
            f"Poses or encoders were recorded at {seen_rows(log).sum()} times, expected at least {LEAST_ROWS}."
        )
    return log


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


@dataclass(frozen=True)
class _Problem:
    """Logs, the free numbers, and their prior."""

    logs: tuple[MotionLog, ...]
    own: Mapping[str, float]
    free: tuple[Spread, ...]

    @classmethod
    def of(cls, logs: Sequence[MotionLog], robot: RobotModel) -> _Problem:
        now = robot.centers()
        left, right = now["drive.gain_left"], now["drive.gain_right"]
        own = {name: value for name, value in now.items() if name.startswith("drive.")}
        own |= {"drive.gain": (left + right) / 2, "drive.asymmetry": left - right}
        own |= {s.name: max(own[s.name], LEAST_NOISE) for s in OWN_NOISE} | SEEN_NOISE
        by_poses = ("drive.track", "drive.axle", "drive.drift_per_m")
        sees_poses = any(log.sees_poses for log in logs)
        free = tuple(s for s in DRIVE if sees_poses or s.name not in by_poses)
        names: tuple[str, ...] = ()
        if sees_poses:
            free += OWN_NOISE
            names += ("place", "angle") if any(log.sees_heading for log in logs) else ("place",)
        if any(log.sees_wheels for log in logs):
            names += ("wheel", "wheel_per_m")
        free += tuple(Spread(name, "ratio", 1.0, "m", "", is_normal=True) for name in names)
        return cls(tuple(logs), own, free)

    def values(self, standard: Floats) -> dict[str, Floats]:
        """Return (m,) of everything at (m, p) points on the standard scales of the parameters."""
        m = len(standard)
        values = {name: np.full(m, value) for name, value in self.own.items()}
        for k, one in enumerate(self.free):
            values[one.name] = one.of(self.own[one.name], standard[:, k])
        values["drive.gain_left"] = values["drive.gain"] + values["drive.asymmetry"] / 2
        values["drive.gain_right"] = values["drive.gain"] - values["drive.asymmetry"] / 2
        return values

    def log_posterior(self, standard: Floats, weight: float = 1.0) -> Floats:
        """Return (m,) of (m, p) points, with a weight of the prior."""
        values = self.values(standard)
        priors = [one.log_prior(standard[:, k]) for k, one in enumerate(self.free)]
        logs = weight * np.sum(priors, axis=0)
        for log in self.logs:
            steps = wheel_steps(log, values)
            if log.sees_poses:
                logs = logs + track(log, steps, values, _noise(values)).log_likelihood
            if log.sees_wheels:
                logs = logs + encoder_likelihood(log, steps, _noise(values))
        return np.asarray(logs)

    def down(self, point: Floats, weight: float = 1.0) -> tuple[float, Floats]:
        """Return the negative log posterior at a point (p,), and its slope."""
        p = len(point)
        ends = np.concatenate([point[None], point + STEP * np.eye(p), point - STEP * np.eye(p)])
        with np.errstate(over="ignore", invalid="ignore"):
            logs = self.log_posterior(ends, weight)
        if not np.isfinite(
            logs
        ).all():  # a step of the search that went beyond all numbers: back to the middle
            return BEYOND, point
        return -float(logs[0]), -(logs[1 : p + 1] - logs[p + 1 :]) / (2 * STEP)

    def solve(self) -> tuple[Floats, Floats]:
        """Return the point of greatest posterior, (p,), and the covariance there, (p, p).

        With a prior of long tails there may be two peaks, one at the robot's own numbers and one where the log is met
        best: the search starts at both.
        """
        first = np.zeros(len(self.free))
        first[[one.kind == "size" for one in self.free]] = 0.1
        free, _ = self._search(first, FREE)
        best = min((self._search(start, 1.0) for start in (first, free)), key=lambda found: found[1])[0]
        slopes = np.array(
            [
                (self.down(best + WIDE * row)[1] - self.down(best - WIDE * row)[1]) / (2 * WIDE)
                for row in np.eye(len(best))
            ]
        )
        sizes, directions = np.linalg.eigh((slopes + slopes.T) / 2)
        return best, (directions / np.maximum(sizes, LEAST_CURVATURE)) @ directions.T

    def _search(self, start: Floats, weight: float) -> tuple[Floats, float]:
        """Return the nearest point of least `down`, and its value."""
        from scipy.optimize import minimize

        found = minimize(self.down, start, (weight,), jac=True, method="BFGS", options={"gtol": 0.02})
        return np.asarray(found.x), float(found.fun)

    def fitted(self, best: Floats, spread: Floats, drawn: Mapping[str, Floats]) -> list[Fitted]:
        """Return the robot's parameters with intervals."""
        rows = []
        for k, one in enumerate(self.free):
            if not one.name.startswith("drive."):
                continue
            ends = one.of(self.own[one.name], np.array([-one.most, one.most]))
            low, high = np.quantile(drawn[one.name], ENDS)
            identified = bool(np.sqrt(spread[k, k]) < IDENTIFIED)
            rows.append(
                Fitted(
                    name=one.name,
                    estimate=float(one.of(self.own[one.name], best[k : k + 1])[0]),
                    low=float(low),
                    high=float(high),
                    prior_low=0.0 if one.kind == "size" else float(ends.min()),
                    prior_high=float(ends.max()),
                    identified=identified,
                    unit=one.unit,
                    advice="" if identified else one.advice,
                )
            )
        return rows


def _noise(values: Mapping[str, Floats]) -> dict[str, Floats]:
    short = {
        "travel_per_m": "drive.travel_noise_per_m",
        "heading_per_m": "drive.heading_noise_per_m",
        "heading_per_s": "drive.heading_noise_per_s",
    }
    return {name: values[short.get(name, name)] for name in (*short, *SEEN_NOISE)}


def _robot_numbers(values: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return the numbers that a robot's file has."""
    names = [one.name for one in (*DRIVE, *OWN_NOISE) if one.name not in ("drive.gain", "drive.asymmetry")]
    return {name: values[name] for name in ("drive.gain_left", "drive.gain_right", *names)}


def _predict(problem: _Problem, log: MotionLog, split: int, best: Floats) -> tuple[HeldOut, dict[str, Any]]:
    """Predict the unseen part of a log with the robot's own and with the fitted numbers."""
    values = problem.values(np.stack([best, best]))
    for one in DRIVE:
        values[one.name][0] = problem.own[one.name]
    for side in ("left", "right"):
        values[f"drive.gain_{side}"][0] = problem.own[f"drive.gain_{side}"]
    steps = wheel_steps(log, values)
    if log.sees_poses:
        predicted = track(log.until(split), steps, values, _noise(values)).poses
        rows = split + np.flatnonzero(np.isfinite(log.poses[split:, 0]))
        off = np.hypot(*np.moveaxis(predicted[:, rows, :2] - log.poses[rows, :2], -1, 0))
        lasts = log.time_s[rows[-1]] - log.time_s[split - 1]
        held_out = HeldOut(
            f"mean distance between seen and predicted positions over the last {fixed(lasts, 1)} s",
            "m",
            float(off[0].mean()),
            float(off[1].mean()),
            n=len(rows),
            more={"at the end": (float(off[0, -1]), float(off[1, -1]))},
        )
        path = {
            name: np.round(predicted[k, rows, :2], 5).tolist() for k, name in enumerate(("nominal", "fitted"))
        }
        return held_out, {"held_out": {"seen": np.round(log.poses[rows, :2], 5).tolist(), **path}}
    rows = np.flatnonzero(np.isfinite(log.encoders).all(axis=1))
    rows = rows[rows >= split]
    total = np.concatenate([np.zeros_like(steps[:, :1]), np.cumsum(steps, axis=1)], axis=1)
    speeds = np.diff(total[:, rows], axis=1) / np.diff(log.time_s[rows])[:, None]
    seen = np.diff(log.encoders[rows], axis=0) / np.diff(log.time_s[rows])[:, None]
    off = np.sqrt(((speeds - seen) ** 2).mean(axis=(1, 2)))
    full = problem.own["drive.speed"]
    held_out = HeldOut(
        f"root mean square error of the wheels' speeds over the last {fixed(log.time_s[-1] - log.time_s[split], 1)} s",
        "m/s",
        float(off[0]),
        float(off[1]),
        n=2 * len(seen),
        more={"as a share of full speed (1)": (float(off[0] / full), float(off[1] / full))},
    )
    return held_out, {}
