"""The candidate of the trial in docs/decisions/one-likelihood.md: least squares of SciPy, and Laplace's posterior."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy

from realitygap.calibration import Floats, MotionLog
from realitygap.calibration._log_model import body_steps, read_late, wheel_ways
from realitygap.calibration._log_parameters import LogNumbers
from realitygap.calibration._prior import PRIOR_PRECISION, values_at
from realitygap.calibration._simulate import Ints
from realitygap.calibration._single_commands import (
    BLOCK,
    FINEST,
    MOST_OFF,
    N_NOISE,
    N_PARTS,
    NOISE_FLOOR,
    PARTS,
    MotionOfCommands,
)
from realitygap.calibration._windows import wrapped

FREEDOM = 4.0
"""Degrees of freedom of Student's distribution of each difference."""

Slopes = Callable[[Floats], Floats]


@dataclass(frozen=True)
class Fit:
    """A minimum.

    Attributes:
        point: (p,) parameters.
        jacobian: (n, p) slopes of the differences, each times the root of its weight.
        rest: (n,) differences, likewise.
    """

    point: Floats
    jacobian: Floats
    rest: Floats


def robust_fit(
    off: Callable[[Floats], Floats],
    slopes: Slopes,
    start: Floats,
    prior: tuple[Callable[[Floats], Floats], Floats],
    bounds: tuple[Floats | float, Floats | float],
) -> Fit:
    """Return the minimum of differences with Student's distribution, and of the prior's.

    Args:
        off: (p,) to (n,) differences in standard deviations.
        slopes: (p,) to (n, p).
        start: (p,).
        prior: Differences from the prior (p,) to (p,), which are normal, and the slope of each.
        bounds: Least and most.
    """
    p = len(start)
    from_prior, steep = prior

    def loss(squares: Floats) -> Floats:
        rho = np.ones((3, len(squares)))
        rho[2] = 0.0
        rho[0] = squares
        some = squares[:-p]
        rho[0, :-p] = (FREEDOM + 1) * np.log1p(some / FREEDOM)
        rho[1, :-p] = (FREEDOM + 1) / (FREEDOM + some)
        rho[2, :-p] = -(FREEDOM + 1) / (FREEDOM + some) ** 2
        return rho

    result = scipy.optimize.least_squares(
        lambda at: np.concatenate([off(at), from_prior(at)]),
        start,
        jac=lambda at: np.concatenate([slopes(at), np.diag(steep)]),
        bounds=bounds,
        loss=loss,
        x_scale="jac",
        xtol=1e-4,
        ftol=1e-6,
        max_nfev=30,
    )
    rest = off(result.x)
    weight = np.sqrt((FREEDOM + 1) / (FREEDOM + rest**2))
    return Fit(result.x, slopes(result.x) * weight[:, None], rest * weight)


def laplace_draws(fit: Fit, precision: Floats, block: Ints, n: int, rng: np.random.Generator) -> Floats:
    """Return (n, p) draws: normal, with the sandwich covariance of blocks (n,) wherever it is the wider."""
    p = len(fit.point)
    pulls = np.stack([np.bincount(block, column) for column in (fit.jacobian * fit.rest[:, None]).T], axis=1)
    pulls = pulls[np.bincount(block) > 0]
    k = len(pulls)
    pulls = pulls - pulls.mean(axis=0)
    information = fit.jacobian.T @ fit.jacobian
    inverse = np.linalg.inv(information + np.diag(precision))
    meat = pulls.T @ pulls * (k / max(k - 1, 1)) + np.diag(precision)
    robust = inverse @ meat @ inverse
    root = np.linalg.cholesky(inverse + 1e-14 * np.eye(p))
    sizes, directions = np.linalg.eigh(np.linalg.solve(root, np.linalg.solve(root, robust).T))
    wide = root @ directions * np.sqrt(np.maximum(sizes, 1.0))
    tails = np.sqrt(max(k - 1, 3) / rng.chisquare(max(k - 1, 3), n))
    return np.asarray(fit.point + (rng.standard_normal((n, p)) * tails[:, None]) @ wide.T)


class UnifiedMotion(MotionOfCommands):
    """The motion of single commands by this fit: the same simulations, another optimizer, another posterior."""

    last: Fit

    def _best(self, start: Floats) -> tuple[Floats, Floats]:
        places = np.clip(start, 1e-3, 1 - 1e-3)
        for _ in range(3):
            scales = self._scales(self._off(places[None])[0])
            self.last = robust_fit(
                lambda at, scales=scales: (self._off(at[None])[0] / scales)[self.shooter.shots.known].ravel(),
                lambda at, scales=scales: (
                    -np.moveaxis((self._slopes(at) / scales)[:, self.shooter.shots.known], 0, -1).reshape(
                        -1, len(at)
                    )
                ),
                places,
                (
                    lambda at: np.sqrt(PRIOR_PRECISION) * (at - 0.5),
                    np.full(len(places), np.sqrt(PRIOR_PRECISION)),
                ),
                (0.0, 1.0),
            )
            moved = np.abs(self.last.point - places).max()
            places = np.clip(self.last.point, 1e-6, 1 - 1e-6)
            if moved < 1e-3:
                break
        return places, self._off(places[None])[0]

    def _draws(self, places: Floats, off: Floats, n: int) -> Floats:
        block = np.repeat(self.shooter.shots.blocks(BLOCK)[0][self.shooter.shots.known], 3)
        drawn = laplace_draws(self.last, np.full(len(places), PRIOR_PRECISION), block, 4 * n, self.rng)
        inside = drawn[((drawn >= 0) & (drawn <= 1)).all(axis=1)]
        return inside[:n] if len(inside) >= n else np.clip(drawn[:n], 0.0, 1.0)

    def _noise(self, places: Floats, off: Floats) -> Floats:
        shots, q = self.shooter.shots, len(self.noise)
        free = shots.known & ~shots.touching if (shots.known & ~shots.touching).any() else shots.known
        own = self._off(places[None])[0]
        made_by = np.empty((q, *off.shape))
        for k, parameter in enumerate(self.noise):
            only = np.zeros((N_PARTS, q))
            only[:, k] = PARTS[parameter.name]
            made = self._off(np.repeat(places[None], N_PARTS, axis=0), only, key=17 + k) - own
            made[..., 2] = wrapped(made[..., 2])
            made_by[k] = (made**2).mean(axis=0) / PARTS[parameter.name] ** 2
        parts = made_by[:, free][..., [0, 2]].reshape(q, -1)
        squares = (off[free][:, [0, 2]] ** 2).reshape(-1)
        floor = np.tile(NOISE_FLOOR**2, int(free.sum()))

        def down(at: Floats) -> float:
            values = values_at(self.noise, at[None])
            variance = np.array([values[p.name][0] for p in self.noise]) ** 2 @ parts + floor
            return float(0.5 * (np.log(variance) + np.minimum(squares / variance, MOST_OFF**2)).sum())

        starts = [np.full(q, at) for at in (0.3, 0.6)]
        results = [
            scipy.optimize.minimize(down, at, bounds=[(0.0, 1.0)] * q, method="L-BFGS-B") for at in starts
        ]
        best = min(results, key=lambda result: result.fun).x
        step = 0.01
        middle = np.clip(best, 2 * step, 1 - 2 * step)
        eye = step * np.eye(q)
        second = np.array([
            [(down(middle + a + b) - down(middle + a - b) - down(middle - a + b) + down(middle - a - b)) for b in eye]
            for a in eye
        ]) / (4 * step**2)  # fmt: skip
        sizes, directions = np.linalg.eigh((second + second.T) / 2)
        spread = directions / np.sqrt(np.maximum(sizes, 0.0) + PRIOR_PRECISION)
        at = np.clip(best + self.rng.standard_normal((N_NOISE, q)) @ spread.T, 0.0, 1.0)
        drawn = values_at(self.noise, at)
        draws = np.stack([drawn[p.name] for p in self.noise], axis=1)
        self.own_scales = np.sqrt(np.einsum("q,qkts->kts", (draws**2).mean(axis=0), made_by) + FINEST**2)
        return draws


WINDOW_S = 1.0
STEP = 1e-3


def fit_log(log: MotionLog, numbers: LogNumbers, rng: np.random.Generator) -> Floats:
    """Return (d, q) draws of the parameters of a log: windows of a second begin at poses that were seen."""
    steady = [k for k, one in enumerate(numbers.free) if one.kind != "noise"]
    steady += [len(numbers.free) + k for k in range(len(numbers.camera))]
    every = [*numbers.free, *numbers.camera]
    q = len(every)
    known = np.flatnonzero(np.isfinite(log.poses[:, 0]))
    starts = [int(known[0])]
    for row in known:
        if log.time_s[row] - log.time_s[starts[-1]] >= WINDOW_S:
            starts.append(int(row))
    seen = log.poses[:, 0] + 1j * log.poses[:, 1]

    def off(points: Floats) -> Floats:
        """Return differences (m, n) [m, m, rad]: at all rows of each window."""
        full = np.zeros((len(points), q))
        full[:, steady] = points
        values = numbers.values(full)
        length, turn = body_steps(read_late(log, wheel_ways(log, values), values["camera.delay"]), values)
        point = values["camera.left"] * 1j - values["drive.axle"]
        parts = []
        for first, last in pairwise(starts):
            rows = known[(known > first) & (known <= last)]
            heading = np.cumsum(turn[:, first:last], axis=1)
            path = np.cumsum(length[:, first:last] * np.exp(1j * (heading - turn[:, first:last] / 2)), axis=1)
            path = (path + point[:, None] * (np.exp(1j * heading) - 1.0))[:, rows - first - 1]
            moved = seen[rows] - seen[first]
            if np.isfinite(log.poses[first, 2]):
                begin = log.poses[first, 2] - values["camera.heading"]
                turned = wrapped(log.poses[rows, 2] - log.poses[first, 2] - heading[:, rows - first - 1])
            else:
                begin = np.angle((np.conj(path) * moved).sum(axis=1))
                turned = np.zeros((len(points), 0))
            rest = moved * np.exp(-1j * begin)[:, None] - path
            parts.append((rest.real, rest.imag, np.nan_to_num(turned)))
        sizes.append([[part.shape[1] for part in some] for some in parts])
        return np.concatenate([np.concatenate([some[c] for some in parts], axis=1) for c in range(3)], axis=1)

    sizes: list[list[list[int]]] = []
    least = np.array([numbers.least(one) if one in numbers.free else -np.inf for one in every])[steady]
    start = np.zeros(len(steady))
    start[[every[k].kind == "size" for k in steady]] = 0.1
    start = np.maximum(start, least + 1e-3)
    if numbers.camera:
        delay = steady.index(len(numbers.free))
        tried = np.repeat(start[None], 71, axis=0)
        tried[:, delay] = np.arange(-1.5, 2.0001, 0.05) / every[steady[delay]].spread
        start = tried[int(np.argmin(np.log1p((off(tried) / 0.02) ** 2).sum(axis=1)))]

    def slopes(at: Floats) -> Floats:
        steps = STEP * np.eye(len(at))
        ends = off(np.concatenate([at + steps, at - steps]))
        return (ends[: len(at)] - ends[len(at) :]).T / (2 * STEP)

    floor = np.array([2e-4, 2e-4, 1e-3])
    steep = np.ones(len(steady))
    for _ in range(4):
        rest = off(start[None])[0]
        channel = np.repeat(np.arange(3), [sum(some[c] for some in sizes[-1]) for c in range(3)])
        scale = np.array([
            1.4826 * np.median(np.abs(rest[channel == c])) + floor[c] if (channel == c).any() else 1.0 for c in range(3)
        ])[channel]  # fmt: skip
        # a Cauchy prior as a normal one that is refitted in each round
        steep = np.sqrt(2.0 / (1.0 + start**2))
        fit = robust_fit(
            lambda at, scale=scale: off(at[None])[0] / scale,
            lambda at, scale=scale: slopes(at) / scale[:, None],
            np.maximum(start, least + 1e-6),
            (lambda at, steep=steep: steep * at, steep),
            (least, np.inf),
        )
        start = fit.point
    window = np.concatenate([
        np.repeat(np.arange(len(sizes[-1])), [some[c] for some in sizes[-1]]) for c in range(3)
    ])  # fmt: skip
    n_blocks = max(min(24, len(sizes[-1]) // 2), 4)
    draws = np.zeros((1000, q))
    drawn = laplace_draws(fit, steep**2, window * n_blocks // len(sizes[-1]), 1000, rng)
    draws[:, steady] = np.maximum(drawn, least)
    draws[:, [k for k in range(q) if k not in steady]] = 0.0
    return draws
