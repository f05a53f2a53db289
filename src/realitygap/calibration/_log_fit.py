"""The posterior of the parameters of a log: a search for its peak, and draws that trust no single part of the log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from ._log_model import (
    MotionLog,
    Numbers,
    body_steps,
    encoder_likelihood,
    pose_likelihood,
    read_late,
    wheel_ways,
)
from ._log_parameters import LogNumbers
from ._prior import Deviation
from ._simulate import Bools, Floats, Ints

FREE = 0.01
"""Weight of the prior in a first search, in which the log alone decides what it can tell."""

STEP = 1e-3
"""Step of finite differences, on the standard scale."""

WIDE = 0.05
"""Largest distance over which a curvature is taken, on the same scale."""

BEYOND = 1e12
"""Larger than what is minimized can be."""

DELAYS_S, NOISES = np.arange(-1.5, 2.0001, 0.05), (0.0, 1.5, 3.0)
"""Delays of a camera's clock [s] and noise of the drive, on the standard scale, of which the best pair begins a
search."""

N_BLOCKS, FEWEST_IN_BLOCK = 24, 8
"""Blocks of time whose slopes say how far the parts of the logs agree, and the rows of the smallest."""

UNLEARNED, LEARNED, TOGETHER = 1.0, 20.0, 0.3
"""Information along a direction below which it is not known, and about a parameter from which on it would be known if
the others were, in units of the prior's; share of a direction from which on a parameter belongs to it."""

VAGUE, CLEAR = 2.0, 3.0
"""Standard deviation on the standard scale beyond which a parameter is hardly known, and how many of them away from the
robot's own number it counts all the same."""

SWEEPS, BURN_IN, TRIES = 1200, 200, 8


@dataclass(frozen=True)
class LogProblem:
    """Logs, each with the camera that saw its poses, and the parameters to fit.

    A point has the standard values of the p parameters of the robot, then the c of each camera.

    Attributes:
        logs: Logs.
        cameras: Index of the camera of each log.
        numbers: Parameters and own numbers.
        at_zero: Names of numbers that the logs would have below 0.
    """

    logs: tuple[MotionLog, ...]
    cameras: tuple[int, ...]
    numbers: LogNumbers
    at_zero: tuple[str, ...] = ()

    @property
    def every(self) -> tuple[Deviation, ...]:
        """Parameter of each value of a point."""
        return self.numbers.free + self.numbers.camera * (max(self.cameras) + 1)

    def places(self, camera: int) -> Ints:
        """Return the indices of the values of a point that logs of a camera need, (p + c,)."""
        p, c = len(self.numbers.free), len(self.numbers.camera)
        return np.concatenate([np.arange(p), p + camera * c + np.arange(c)])

    def rows(self, k: int, points: Floats) -> Floats:
        """Return the log likelihood of each row of a log, (m, n), at (m, p + c) points of the robot and its camera."""
        log, values = self.logs[k], self.numbers.values(points)
        with np.errstate(over="ignore", invalid="ignore"):
            ways = wheel_ways(log, values)
            logs = np.zeros(ways.shape[:2])
            if log.sees_poses:
                logs += pose_likelihood(log, ways, values)[0]
            if log.sees_wheels:
                logs += encoder_likelihood(log, ways, values)
        return logs

    def slopes(self, k: int, point: Floats, step: Floats | float = STEP) -> tuple[Floats, Floats]:
        """Return the log likelihood of each row of a log, (n,), and its slopes, (n, p + c).

        Args:
            k: Index of the log.
            point: All values.
            step: Steps of finite differences, one or (p + c,).
        """
        middle = point[self.places(self.cameras[k])]
        q = len(middle)
        steps = np.diag(np.broadcast_to(step, q))
        rows = self.rows(k, np.concatenate([middle[None], middle + steps, middle - steps]))
        return rows[0], (rows[1 : q + 1] - rows[q + 1 :]).T / (2 * np.diag(steps))

    def prior(self, point: Floats) -> tuple[float, Floats]:
        """Return the log density of the prior at a point, and its slope."""
        logs = sum(
            float(parameter.log_prior(value)) for parameter, value in zip(self.every, point, strict=True)
        )
        slopes = [
            -value if parameter.is_noise else -2 * value / (1 + value**2)
            for parameter, value in zip(self.every, point, strict=True)
        ]
        return logs, np.array(slopes)

    def down(self, point: Floats, weight: float) -> tuple[float, Floats]:
        """Return the negative log posterior at a point, and its slope."""
        log, slope = self.prior(point)
        log, slope = weight * log, weight * slope
        for k, camera in enumerate(self.cameras):
            rows, slopes = self.slopes(k, point)
            log += float(rows.sum())
            slope[self.places(camera)] += slopes.sum(axis=0)
        if not (np.isfinite(log) and np.isfinite(slope).all()):  # a step of the search beyond all numbers
            return BEYOND, point
        return -log, -slope

    def peak(self) -> Floats:
        """Return the point of the greatest posterior.

        With a prior of long tails there may be two peaks, one at the robot's own numbers and one where the log is met
        best: the search starts at both.
        """
        first = self._first()
        free, _ = self._search(first, FREE)
        return min((self._search(start, 1.0) for start in (first, free)), key=lambda at: at[1])[0]

    def _search(self, start: Floats, weight: float) -> tuple[Floats, float]:
        """Return the nearest point of least `down`, and its value."""
        from scipy.optimize import minimize

        # the first step goes as far as the slope says: no farther than about one scale of a prior
        slope = max(float(np.linalg.norm(self.down(start, weight)[1])), 1.0)

        def down(point: Floats) -> tuple[float, Floats]:
            value, slopes = self.down(point, weight)
            return value / slope, slopes / slope

        bounds = [
            (self.numbers.least(one),) * 2 if one.name in self.at_zero else one.search for one in self.every
        ]
        options = {"maxiter": 300, "ftol": 0.001 / slope}
        result = minimize(down, start, jac=True, method="SLSQP", bounds=bounds, options=options)
        return np.asarray(result.x), float(result.fun) * slope

    def _first(self) -> Floats:
        """Return a point with the robot's own numbers, and the delays and the noise that suit them best."""
        free, p = self.numbers.free, len(self.numbers.free)
        point = np.zeros(len(self.every))
        point[:p][[parameter.is_size for parameter in free]] = 0.1
        own_noise = [
            k
            for k, parameter in enumerate(free)
            if parameter.is_noise and parameter.name.startswith("drive.")
        ]
        if not self.numbers.camera:
            return point
        delay = self.numbers.camera[0]
        standard = DELAYS_S / delay.spread
        logs = np.zeros((len(NOISES), max(self.cameras) + 1, len(standard)))
        for level, noise in enumerate(NOISES):
            points = np.tile(point[self.places(0)], (len(standard), 1))
            points[:, own_noise], points[:, p] = noise, standard
            for k, camera in enumerate(self.cameras):
                if self.logs[k].sees_poses:
                    logs[level, camera] += np.nan_to_num(self.rows(k, points).sum(axis=1), nan=-BEYOND)
        logs += delay.log_prior(standard)
        level = int(np.argmax(logs.max(axis=2).sum(axis=1)))
        point[own_noise] = NOISES[level]
        point[p :: len(self.numbers.camera)] = standard[np.argmax(logs[level], axis=1)]
        return point


@dataclass(frozen=True)
class LogPosterior:
    """Draws of the parameters, given the logs.

    Attributes:
        numbers: Parameters.
        together: Names of the robot's parameters that the logs show only together.
        vague: Names of those that the logs hardly show.
        draws: (d, q) points.
        widening: (q,) by how much blocks of time disagree more than the noise explains, as a factor of the
            standard deviation.
        against: Thirds of the logs that contradict the fit. Draws are spread by as much.
        n_cameras: Number of cameras.
    """

    numbers: LogNumbers
    together: tuple[str, ...]
    vague: tuple[str, ...]
    draws: Floats
    widening: Floats
    against: Contradictions
    n_cameras: int


def sample_log_posterior(problem: LogProblem, rng: np.random.Generator) -> LogPosterior:
    """Return draws from the posterior of the parameters.

    The likelihood is a normal distribution around its peak, with the curvature there, widened along the directions in
    which blocks of time disagree by more than the noise explains (sandwich covariance).

    Source: White (1982), the sandwich covariance; Gelman et al. (2013), Bayesian Data Analysis, section 11.2 (Gibbs
        sampling), with each Cauchy prior as a mixture of normal ones.
    """
    while True:
        point = problem.peak()
        below = [
            one.name
            for one, at in zip(problem.numbers.free, point, strict=False)
            if at < problem.numbers.least(one)
        ]
        if not below:
            break
        problem = replace(problem, at_zero=(*problem.at_zero, *below))
    information, pull, widening = _information(problem, point)
    draws = _draw(problem, point, information, pull, rng)
    middle = np.median(draws, axis=0)
    for_log = [problem.numbers.values(middle[None, problem.places(camera)]) for camera in problem.cameras]
    against = contradictions(problem.logs, for_log)
    _spread(problem, draws, against, rng)
    together = _inseparable(problem, information)
    vague = tuple(name for name in _vague(problem, draws) if name not in together)
    return LogPosterior(problem.numbers, together, vague, draws, widening, against, max(problem.cameras) + 1)


def _information(problem: LogProblem, point: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the information of the logs at a point, (q, q), their slope at numbers that are 0, and the widening.

    The slope, (q,), is as much smaller than that of the likelihood as the information. The widening, (q,), is that of
    the standard deviations by the disagreement of blocks.
    """
    p, q = len(problem.numbers.free), len(problem.every)
    steady = [*range(problem.numbers.n_steady), *range(p, q)]
    curvature, pull = np.zeros((q, q)), np.zeros(q)
    blocks = []
    n_rows = sum(len(log.time_s) for log in problem.logs)
    for k, log in enumerate(problem.logs):
        own = problem.places(problem.cameras[k])
        _, slopes = problem.slopes(k, point)
        known = 1.0 / np.sqrt(np.maximum((slopes**2).sum(axis=0), 1.0))  # about the standard deviation
        step = np.minimum(known / 30, STEP)
        slopes = problem.slopes(k, point, step)[1]
        pull[own] += slopes.sum(axis=0)
        for index, wide in zip(own, np.minimum(known / 3, WIDE), strict=True):
            ends = []
            for sign in (1.0, -1.0):
                moved = point.copy()
                moved[index] += sign * wide
                ends.append(problem.slopes(k, moved, step)[1].sum(axis=0))
            curvature[own, index] -= (ends[0] - ends[1]) / (2 * wide)
        n = max(min(round(N_BLOCKS * len(log.time_s) / n_rows), len(log.time_s) // FEWEST_IN_BLOCK), 1)
        for part in np.array_split(slopes, n):
            row = np.zeros(q)
            row[own] = part.sum(axis=0)
            blocks.append(row)
    curvature = (curvature + curvature.T) / 2
    sizes, directions = np.linalg.eigh(curvature)
    curvature = (directions * np.maximum(sizes, 0.0)) @ directions.T
    pull /= np.maximum(np.diag(curvature), 1e-9)
    widening = np.ones(q)
    robust, widening[steady] = _widened(curvature[np.ix_(steady, steady)], np.array(blocks)[:, steady])
    curvature[np.ix_(steady, steady)] = robust
    noise = [k for k in range(q) if k not in steady]
    curvature[np.ix_(noise, steady)], curvature[np.ix_(steady, noise)] = 0.0, 0.0
    pull = np.minimum(pull * np.diag(curvature), 0.0)
    is_zero = np.array([one.name in problem.at_zero for one in problem.every])
    return curvature, np.where(is_zero, pull, 0.0), widening


def _widened(information: Floats, blocks: Floats) -> tuple[Floats, Floats]:
    """Return information (q, q) less what blocks (b, q) of slopes contradict, and the widening of each parameter."""
    b, q = blocks.shape
    sizes, directions = np.linalg.eigh(information)
    known = sizes >= LEARNED  # of other directions the blocks' slopes are those of these, by rounding
    root = np.sqrt(sizes[known])
    slopes = (blocks - blocks.mean(axis=0)) @ directions[:, known] / root
    factors, turned = np.linalg.eigh(slopes.T @ slopes * (b / max(b - 1, 1)))
    turned = directions[:, known] * root @ turned
    robust = (turned / np.maximum(factors, 1.0)) @ turned.T
    robust += (directions[:, ~known] * sizes[~known]) @ directions[:, ~known].T
    before, after = (np.diag(np.linalg.inv(matrix + np.eye(q))) for matrix in (information, robust))
    return np.asarray(robust), np.sqrt(after / before)


def _inseparable(problem: LogProblem, information: Floats) -> tuple[str, ...]:
    """Return the names of the robot's parameters that the logs show only together."""
    free = problem.numbers.free[: problem.numbers.n_steady]
    mine = [k for k, parameter in enumerate(free) if parameter.name.startswith("drive.")]
    if not mine:
        return ()
    others = [k for k in range(len(information)) if k not in mine]
    known = information[np.ix_(others, others)] + np.eye(len(others))
    cross = information[np.ix_(mine, others)]
    # what is left of the information if camera, encoders, and noise are unknown, too
    left = information[np.ix_(mine, mine)] - cross @ np.linalg.solve(known, cross.T)
    alone = np.diag(information)[mine]
    sizes, directions = np.linalg.eigh(left)
    unknown = directions[:, sizes < UNLEARNED]
    group = (np.linalg.norm(unknown, axis=1) >= TOGETHER) & (alone >= LEARNED)
    return tuple(free[mine[k]].name for k in np.flatnonzero(group)) if group.sum() > 1 else ()


def _spread(problem: LogProblem, draws: Floats, against: Contradictions, rng: np.random.Generator) -> None:
    """Spread the draws (d, q) of gains and of the track by as much as thirds of the logs contradict the fit."""
    shares = {"drive.gain": against.drives, "encoder.gain": against.drives, "drive.track": against.turns}
    for k, parameter in enumerate(problem.numbers.free):
        if shares.get(parameter.name):
            draws[:, k] += (
                shares[parameter.name] / parameter.spread / np.sqrt(3.0) * rng.standard_normal(len(draws))
            )


def _vague(problem: LogProblem, draws: Floats) -> tuple[str, ...]:
    """Return the names of the robot's parameters that the logs hardly show, unless they are clearly others."""
    low, middle, high = np.quantile(draws, (0.05, 0.5, 0.95), axis=0)
    spread = (high - low) / 3.29
    return tuple(
        parameter.name
        for parameter, at, wide in zip(problem.numbers.free, middle, spread, strict=False)
        if parameter.name.startswith("drive.")
        and not parameter.is_noise
        and wide > VAGUE
        and abs(at) < CLEAR * wide
    )


def _draw(
    problem: LogProblem, point: Floats, information: Floats, pull: Floats, rng: np.random.Generator
) -> Floats:
    """Return draws (d, q) for a likelihood that is normal around a point, by Gibbs sampling.

    Differs: the peak of the posterior stands for that of the likelihood, so that a direction of which the logs show
    nothing has no slope.
    """
    is_noise = np.array([parameter.is_noise for parameter in problem.every])
    least = np.full(len(point), -np.inf)
    least[: len(problem.numbers.free)] = [
        problem.numbers.least(parameter) for parameter in problem.numbers.free
    ]
    linear = information @ point + pull
    at, draws = point.copy(), []
    for sweep in range(SWEEPS + BURN_IN):
        # a Cauchy distribution is a normal one whose precision has a gamma distribution
        precision = information + np.diag(np.where(is_noise, 1.0, rng.gamma(1.0, 2.0 / (1.0 + at**2))))
        at = _draw_above(at, precision, linear, least, rng)
        if sweep >= BURN_IN:
            draws.append(at)
    return np.array(draws)


def _draw_above(
    at: Floats, precision: Floats, linear: Floats, least: Floats, rng: np.random.Generator
) -> Floats:
    """Return a draw from a normal distribution (q,) above lower ends: of all together, or of one after the other."""
    root = np.linalg.cholesky(precision)
    mean = np.linalg.solve(root.T, np.linalg.solve(root, linear))
    for _ in range(TRIES):
        new = mean + np.linalg.solve(root.T, rng.standard_normal(len(at)))
        if (new >= least).all():
            return np.asarray(new)
    new = np.maximum(at, least)
    for k in rng.permutation(len(at)):
        size = precision[k, k]
        middle = new[k] + (linear[k] - precision[k] @ new) / size
        new[k] = middle + _normal_above((least[k] - middle) * np.sqrt(size), rng) / np.sqrt(size)
    return np.asarray(new)


def _normal_above(low: float, rng: np.random.Generator) -> float:
    """Return a draw from a standard normal distribution above `low`."""
    if low < 4.0:
        below = float(scipy.special.ndtr(low))
        return float(scipy.special.ndtri(below + (1.0 - below) * rng.uniform(1e-12, 1.0 - 1e-12)))
    return low + float(rng.exponential(1.0 / low))


def rows_of(draws: Floats, n: int, rng: np.random.Generator) -> Ints:
    """Return which of the draws to keep, (n,)."""
    return rng.choice(len(draws), n, replace=False)


THIRDS = {
    "speed": ("slowest", "middle", "fastest"),
    "turn": ("straightest", "middle", "sharpest"),
    "time": ("first", "middle", "last"),
}
CLEAR, LARGE = 4.0, 0.03
"""Standard errors, and share of the motion, beyond which a rest contradicts the fit."""
LEAST_SHARE = 0.05
"""Share of the whole motion that a third must have."""


@dataclass(frozen=True)
class Contradictions:
    """Thirds of logs that contradict a fit.

    Attributes:
        lines: The third that contradicts it most, by speed, by turn, and by time, in words.
        drives: Largest share by which the robot drives more or less.
        turns: Largest share by which it turns more or less.
    """

    lines: tuple[str, ...] = ()
    drives: float = 0.0
    turns: float = 0.0


def contradictions(logs: Sequence[MotionLog], numbers: Sequence[Numbers]) -> Contradictions:
    """Return what thirds of logs, by speed, by turn, and by time, say against a fit.

    Args:
        logs: Logs with poses.
        numbers: Fitted numbers for each log, as arrays of one value.
    """
    rows = [_rests(log, values) for log, values in zip(logs, numbers, strict=True) if log.sees_poses]
    if not rows:
        return Contradictions()
    length, turn, lasts, along, about = (np.concatenate(columns) for columns in zip(*rows, strict=True))
    lines, largest = [], {"drives": 0.0, "turns": 0.0}
    for name, order in (
        ("speed", np.abs(length) / lasts),
        ("turn", np.abs(turn) / lasts),
        ("time", np.arange(len(length), dtype=np.float64)),
    ):
        third = np.searchsorted(np.quantile(order, (1 / 3, 2 / 3)), order)
        worst, line = 0.0, ""
        for k, which in enumerate(THIRDS[name]):
            for verb, rest, motion in (("drives", along, length), ("turns", about, turn)):
                share = _share(rest, motion, third == k)
                largest[verb] = max(largest[verb], abs(share))
                if abs(share) > abs(worst):
                    more = "more" if share > 0 else "less"
                    where = f"In the {which} third of the log by {name}"
                    worst, line = share, f"{where}, the robot {verb} {abs(share):.0%} {more} than the fit."
        lines += [line] if line else []
    return Contradictions(tuple(lines), **largest)


def _rests(log: MotionLog, values: Numbers) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Return the predicted distance and turn of each seen row, its time, and the rest of its pose."""
    ways = wheel_ways(log, values)
    off = pose_likelihood(log, ways, values)[1][0, 1:]
    length, turn = body_steps(read_late(log, ways, values["camera.delay"]), values)
    seen = np.isfinite(off[:, 0]) & np.isfinite(log.poses[:-1, 0])
    return length[0, seen], turn[0, seen], np.diff(log.time_s)[seen], off[seen, 0], off[seen, 2]


def _share(rest: Floats, motion: Floats, part: Bools) -> float:
    """Return the share of the motion in a part by which the fit is clearly off there; 0 if it is not."""
    part = part & np.isfinite(rest)
    size = float(np.abs(motion[part]).sum())
    if size < LEAST_SHARE * float(np.abs(motion).sum()) or size == 0.0:
        return 0.0
    share = float((rest[part] * np.sign(motion[part])).sum()) / size
    error = float(np.sqrt((rest[part] ** 2).sum())) / size
    return share if abs(share) > max(LARGE, CLEAR * error) else 0.0
