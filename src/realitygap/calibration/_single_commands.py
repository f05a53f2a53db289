"""The fit of motion to the effect of each command from its observed pose.

First, the mean is fitted without noise by damped least squares. The weights fall with the size of a difference, because
a robot near a border may align or stall. Then the noise is fitted to the residuals. Each draw has new weights of blocks
of commands, so that draws spread if blocks disagree. So effects that `sim` cannot model do not count as information.

Sources: multiple shooting, Bock 1983; t-distributed differences, Lange, Little & Taylor, JASA 84 (1989); damping,
Marquardt 1963; weighted likelihood bootstrap, Newton & Raftery, JRSS B 56 (1994), with a draw from the prior each
(randomize then optimize, Bardsley et al. 2014).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ._posterior import sample_posterior
from ._prior import MAD, PRIOR_PRECISION, Floats, values_at
from ._shots import Shooter
from ._windows import wrapped

NOISE = (
    "drive.delay_jitter",
    "drive.heading_noise_per_m",
    "drive.heading_noise_per_s",
    "drive.travel_noise_per_m",
)
SLIP = "drive.slip"
DEAD_BAND = "drive.dead_band"
FREEDOM = 4.0  # degrees, of the t distribution
FINEST = np.array([3e-4, 3e-4, 2e-3])  # [m, m, rad] added to the scale of differences of free robots
COARSE = np.array([6e-3, 6e-3, 6e-2])  # likewise where robots touch something: there `sim` errs most
STEP = 0.02  # of slopes, in places
BLOCK = 10  # commands that are weighed together
MOST_ROUNDS, LEAST_ROUNDS = 40, 8
CONVERGED = 1e-3
N_PARTS = 80  # robots that show what a kind of noise does
N_NOISE = 200  # draws of noise
MOST_OFF = 5.0  # standard deviations beyond which a difference tells of no noise
SCAN = (0.002, 0.05, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9, 0.998)  # places of each parameter that are tried first
SCANS = 2
BANDS = (np.arange(60) + 0.5) / 60  # places of the dead band that are compared
N_SHIFT = 100  # robots that show by how much noise moves the mean
NOISE_FLOOR = np.array([1e-4, 1e-3])  # [m, rad]
PARTS = {"drive.delay_jitter": 0.05, "drive.heading_noise_per_m": 0.05,
         "drive.heading_noise_per_s": 0.02, "drive.travel_noise_per_m": 0.01}  # fmt: skip
"""Size of each kind of noise in the simulations that measure its effect."""


def is_motion(name: str) -> bool:
    """Return whether a parameter determines the mean motion of a robot and can be distinguished from the others.

    Slip cannot, because it reduces a wheel's distance in the same way as a lower gain.
    """
    return not name.startswith(("range.", "stall.")) and name not in (*NOISE, SLIP)


class MotionOfCommands:
    """The fit of motion to single commands.

    Args:
        shooter: Carries them out.
        rng: Random numbers.
    """

    def __init__(self, shooter: Shooter, rng: np.random.Generator) -> None:
        self.shooter = shooter
        self.rng = rng
        self.mean = [p for p in shooter.prior if is_motion(p.name)]
        self.noise = [p for p in shooter.prior if p.name in NOISE]
        self.n_simulated = 0
        names = [p.name for p in self.mean]
        self.band = names.index(DEAD_BAND) if DEAD_BAND in names else None
        self.own_scales: Floats | None = None  # (k, t, 3) of the noise, once it is known
        self.shift: Floats = np.zeros(3)  # by which noise moves the mean, likewise

    def fit(self, start: Floats, n: int) -> dict[str, Floats]:
        """Return draws of each parameter, (n,), starting at places (p,) of `mean`."""
        places, off = self._best(self._scanned(start))
        if self.noise:
            noise = self._noise(places, off)
            self._note_shift(places, noise)
            places, off = self._best(places)
        values = values_at(self.mean, self._draws(places, off, n))
        if self.noise:
            which = self.rng.integers(len(noise), size=n)
            values |= {p.name: noise[which, k] for k, p in enumerate(self.noise)}
        return values

    def _scanned(self, start: Floats) -> Floats:
        """Return places from which to begin: the best of some of each parameter in turn."""
        places = start.copy()
        for _ in range(SCANS):
            for k in range(len(places)):
                tried = np.repeat(places[None], len(SCAN) + 1, axis=0)
                tried[1:, k] = SCAN
                off = self._off(tried)
                scales = self._scales(off[0])
                costs = [_cost(row / scales, at) for row, at in zip(off, tried, strict=True)]
                places = tried[int(np.argmin(costs))]
        return places

    def _off(self, places: Floats, noise: Floats | None = None, key: int = 1) -> Floats:
        """Return differences of robots at places (m, p) with noise (m, q), or without noise, (m, k, t, 3)."""
        m = len(places)
        self.n_simulated += m
        none = np.zeros((m, len(self.noise))) if noise is None else noise
        values = values_at(self.mean, places) | {p.name: none[:, k] for k, p in enumerate(self.noise)}
        others = {
            p.name: np.full(m, 0.0 if p.name == SLIP else float(p.prior.of(np.array([0.5]))[0]))
            for p in self.shooter.prior
            if p.name not in values
        }
        return self.shooter.off(values | others, key) - self.shift

    def _note_shift(self, places: Floats, noise: Floats) -> None:
        some = noise[self.rng.integers(len(noise), size=N_SHIFT)]
        with_noise = self._off(np.repeat(places[None], N_SHIFT, axis=0), some, key=11).mean(axis=0)
        self.shift = self._off(places[None])[0] - with_noise

    def _slopes(self, places: Floats) -> Floats:
        """Return the derivatives of the differences by each place, (p, k, t, 3)."""
        p = len(places)
        ends = np.clip([places - STEP, places + STEP], 0.0, 1.0)
        tried = np.repeat(places[None], 2 * p, axis=0)
        at = np.arange(p)
        tried[at, at], tried[p + at, at] = ends
        off = self._off(tried)
        fall = off[:p] - off[p:]
        fall[..., 2] = wrapped(fall[..., 2])
        if self.band is not None:
            fall[self.band] = 0.0
        return np.asarray(fall / (ends[1] - ends[0])[:, None, None, None])

    def _scales(self, off: Floats) -> Floats:
        """Return typical differences, (k, t, 3): of robots that touch something, and of others."""
        shots = self.shooter.shots
        scales = np.ones_like(off)
        for which, least in ((shots.touching, COARSE), (~shots.touching, FINEST)):
            some = which & shots.known
            if some.any():
                own = np.ones_like(off) if self.own_scales is None else self.own_scales
                typical = MAD * np.median(np.abs(off[some] / own[some]), axis=0)
                scales[some] = typical * own[some] + least
        return scales

    def _best(self, start: Floats) -> tuple[Floats, Floats]:
        """Return the places with the smallest differences, and these differences."""
        places, off = self._smoothly_best(start)
        if self.band is not None:
            best = self._bands(places, self._scales(off))[1].argmin()
            band = places[self.band]
            places[self.band] = BANDS[best]
            if abs(BANDS[best] - band) > STEP:
                places, off = self._smoothly_best(places)
        return places, off

    def _bands(self, places: Floats, scales: Floats) -> tuple[Floats, Floats]:
        """Return the costs of each block of commands, (n_blocks, b), and their sums, (b,), for each dead band.

        A dead band only decides which commands move a wheel. So differences change in steps, and their slopes tell
        nothing of its likely values.
        """
        tried = np.repeat(places[None], len(BANDS), axis=0)
        tried[:, self.band] = BANDS
        off = self._off(tried) / scales
        costs = 0.5 * (FREEDOM + 3.0) * np.log1p((off**2).sum(axis=-1) / FREEDOM)
        block, n_blocks = self.shooter.shots.blocks(BLOCK)
        sums = np.zeros((n_blocks, len(BANDS)))
        np.add.at(sums, block.reshape(-1), costs.reshape(len(BANDS), -1).T)
        return sums, sums.sum(axis=0)

    def _smoothly_best(self, start: Floats) -> tuple[Floats, Floats]:
        """Return the places with the smallest differences for the dead band at the start, and these differences.

        SciPy's robust losses weigh each difference by itself. Here, all three of a command have one weight: a robot
        that takes another path differs in all of them.
        """
        places, off = start, self._off(start[None])[0]
        scales, damping = self._scales(off), 1e-2
        for turn in range(MOST_ROUNDS):
            if turn % 4 == 0:
                scales = self._scales(off)
            slopes = self._slopes(places) / scales
            weight = np.sqrt(_weights(off / scales))[..., None]
            flat = (slopes * weight).reshape(len(places), -1)
            curvature = flat @ flat.T + PRIOR_PRECISION * np.eye(len(places))
            pull = flat @ (off / scales * weight).reshape(-1) + PRIOR_PRECISION * (0.5 - places)
            if self.band is not None:
                pull[self.band] = 0.0
            cost = _cost(off / scales, places)
            for _ in range(6):
                damped = curvature + damping * np.diag(np.diag(curvature))
                new = _within(places, damped, pull)
                new_off = self._off(new[None])[0]
                if _cost(new_off / scales, new) < cost:
                    break
                damping *= 4
            else:
                break
            step = np.abs(new - places).max()
            places, off, damping = new, new_off, max(damping / 3, 1e-5)
            if step < CONVERGED and turn >= LEAST_ROUNDS:
                break
        return places, off

    def _draws(self, places: Floats, off: Floats, n: int) -> Floats:
        """Return places, (n, p), each with other weights of blocks of commands and another draw from the prior."""
        p, scales = len(places), self._scales(off)
        weight = np.sqrt(_weights(off / scales))[..., None]
        slopes, left = self._slopes(places) / scales * weight, off / scales * weight
        block, n_blocks = self.shooter.shots.blocks(BLOCK)
        curvatures, pulls = np.zeros((n_blocks, p, p)), np.zeros((n_blocks, p))
        for number in range(n_blocks):
            some = slopes[:, block == number].reshape(p, -1)
            curvatures[number], pulls[number] = some @ some.T, some @ left[block == number].reshape(-1)
        draws = np.empty((n, p))
        for k in range(n):
            shares = self.rng.exponential(size=n_blocks)
            curvature = np.tensordot(shares, curvatures, 1) + PRIOR_PRECISION * np.eye(p)
            draws[k] = _within(
                places, curvature, shares @ pulls + PRIOR_PRECISION * (self.rng.uniform(size=p) - places)
            )
        if self.band is not None:
            draws[:, self.band] = self._draws_of_band(places, scales, n)
        return draws

    def _draws_of_band(self, places: Floats, scales: Floats, n: int) -> Floats:
        """Return places of the dead band, (n,), each with other weights of blocks; even between two commands."""
        costs, _ = self._bands(places, scales)
        logs = -self.rng.exponential(size=(n, len(costs))) @ costs
        best = np.argmax(logs + self.rng.gumbel(size=logs.shape), axis=1)
        return np.asarray(BANDS[best] + (self.rng.uniform(size=n) - 0.5) / len(BANDS))

    def _noise(self, places: Floats, off: Floats) -> Floats:
        """Return draws of the noise of robots that touch nothing, (N_NOISE, q).

        Variances of different kinds of noise add up; what each makes of every command is simulated by itself.
        """
        shots, q = self.shooter.shots, len(self.noise)
        free = shots.known & ~shots.touching
        if not free.any():
            free = shots.known
        own = self._off(places[None])[0]
        parts, made_by = np.empty((q, 2 * int(free.sum()))), np.empty((q, *off.shape))
        for k, parameter in enumerate(self.noise):
            size = PARTS[parameter.name]
            only = np.zeros((N_PARTS, q))
            only[:, k] = size
            made = self._off(np.repeat(places[None], N_PARTS, axis=0), only, key=17 + k) - own
            made[..., 2] = wrapped(made[..., 2])
            made_by[k] = (made**2).mean(axis=0) / size**2
            parts[k] = made_by[k][free][:, [0, 2]].reshape(-1)
        squares = (off[free][:, [0, 2]] ** 2).reshape(-1)
        floor = np.tile(NOISE_FLOOR**2, int(free.sum()))

        def log_likelihood(places: Floats) -> Floats:
            values = values_at(self.noise, places)
            sizes = np.stack([values[p.name] for p in self.noise], axis=1)
            variance = sizes**2 @ parts + floor
            capped = np.minimum(squares / variance, MOST_OFF**2)
            return np.asarray(-0.5 * (np.log(variance) + capped).sum(axis=1))

        drawn = values_at(self.noise, sample_posterior(log_likelihood, q, self.rng, N_NOISE))
        draws = np.stack([drawn[p.name] for p in self.noise], axis=1)
        self.own_scales = np.sqrt(np.einsum("q,qkts->kts", (draws**2).mean(axis=0), made_by) + FINEST**2)
        return draws


def _weights(off: Floats) -> Floats:
    """Return weights of differences (k, t, 3), in units of their scales, (k, t)."""
    return np.asarray((FREEDOM + 3.0) / (FREEDOM + (off**2).sum(axis=-1)))


def _cost(off: Floats, places: Floats) -> float:
    logs = np.log1p((off**2).sum(axis=-1) / FREEDOM).sum()
    return float(0.5 * (FREEDOM + 3.0) * logs + 0.5 * PRIOR_PRECISION * ((places - 0.5) ** 2).sum())


def _within(places: Floats, curvature: Floats, pull: Floats) -> Floats:
    """Return the minimum of a quadratic cost for positions in 0..1."""
    free = np.ones(len(places), np.bool_)
    new: Floats = places + np.linalg.solve(curvature, pull)
    for _ in range(len(places)):
        beyond: NDArray[np.bool_] = free & ((new < 0.0) | (new > 1.0))
        if not beyond.any():
            break
        free &= ~beyond
        step = np.where(free, 0.0, np.clip(new, 0.0, 1.0) - places)
        rest = pull[free] - curvature[np.ix_(free, ~free)] @ step[~free]
        step[free] = np.linalg.solve(curvature[np.ix_(free, free)], rest)
        new = places + step
    return np.clip(new, 0.0, 1.0)
