"""The mean of a robot's motion and readings, from whole trials without poses.

`sim` repeats each trial from its start with the commands that were given, and the readings, stalls, and wheels of each
step are compared. A small error of a parameter soon puts the simulated robot elsewhere, so a fit to whole trials has
many local minima. Therefore the fit begins with the first steps of the trials, whose minimum is wide, and adds steps
from round to round.

Sources: the covariance matrix adaptation evolution strategy, Hansen, The CMA Evolution Strategy: A Tutorial (2016);
t-distributed differences, Lange, Little & Taylor, JASA 84 (1989); draws by the weighted likelihood bootstrap, Newton &
Raftery, JRSS B 56 (1994), each with a draw from the prior (randomize then optimize, Bardsley et al. 2014). Differs: few
reweighted fits are made, and draws are from the t distribution with their covariance.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray

from realitygap.platforms import Play, Rehearsal, SimEnsemble
from realitygap.records import TrialRecord
from realitygap.world import Arena, RobotModel

from ._all_from_poses import WITH_SLIP, own_places, sensors_of
from ._all_from_simulation import Effort, Posterior
from ._one_thread import one_blas_thread
from ._posterior import N_DRAWS, sample_posterior
from ._prior import OFF_ENDS, PRIOR_PRECISION, Floats, Parameter, numbers_of, place_of, standard_of, values_at
from ._shots import shots_of
from ._single_commands import MOST_OFF, NOISE, PARTS, SLIP

if TYPE_CHECKING:
    from cmaes import CMA

F = TypeVar("F", bound=np.floating)

SCATTER = (*NOISE, "range.burst", "range.noise_gain", "range.outlier_most")
"""Parameters that scatter observations and hardly move their mean."""

OF_MEAN = ("drive.gain", "drive.asymmetry", "stall.share")
"""Parameters of the mean that compensate for slip."""

HORIZONS = (0.1, 0.2, 0.4, 0.7, 1.0)
"""Shares of the steps that the rounds see."""

GENERATIONS, SIZE = 40, 32  # of each round
WIDE = 0.2  # first standard deviation of places
LEAST_SPREAD = 0.01  # of places, with which a fit begins
N_REFITS = {"least": 6, "small": 10, "full": 16}
REFITS = {"encoders": (0.08, 25), "without": (0.12, 40)}
"""First standard deviation of places of reweighted fits, and generations: minima are flatter without encoders."""

PREDICTED = 0.4  # share of the steps whose poses are predicted well enough for the sensors
N_READINGS = 500  # few, as an error of a pose makes the readings of many steps wrong alike
SPREAD = 1.4  # times that of reweighted fits, which are few
ALIKE = 30  # differences that noise makes alike, as it moves the robot for all later steps
N_NOISE = 200  # draws of noise
N_TRIES = 50  # of slips, of which the first is taken with which the gain is within its prior
N_SHAPE = 400  # places that show the shape of the minimum
N_NOISY = 40  # robots that show the scatter of observations
FREEDOM = 4.0  # degrees, of the t distribution
FINEST = {"readings": 0.03, "stall": 0.3, "wheels": 2e-3}
"""Differences that are taken for none: of readings and stalls, and of the way of a wheel in a step [m]."""


@dataclass(frozen=True)
class _Seen:
    """The observations of k trials, padded to t steps.

    Attributes:
        starts: (k, 3) poses.
        commands: (k, t, 2).
        values: (k, t, d) observations in each step: readings, stall, and ways of the wheels if they are observed.
        finest: (d,) differences that are taken for none.
        weights: (k, t, d) 0 where nothing was seen, and together 1 for all sensors of a step.
    """

    starts: Floats
    commands: Floats
    values: NDArray[np.float32]
    finest: NDArray[np.float32]
    weights: NDArray[np.float32]

    @property
    def has_wheels(self) -> bool:
        """True if wheels are observed."""
        return bool(self.finest[-1] == np.float32(FINEST["wheels"]))


@one_blas_thread()
def fit_from_commands(
    trials: Sequence[TrialRecord],
    ensemble: SimEnsemble,
    prior: Sequence[Parameter],
    robot: RobotModel,
    arena: Arena,
    whole: Posterior,
    *,
    seed: int,
    effort: Effort = "full",
) -> Posterior:
    """Return the posterior of all parameters.

    Args:
        trials: Trials whose starts are known; commands that controllers gave are given again.
        ensemble: Simulates the trials.
        prior: Prior of the parameters.
        robot: Robot whose numbers they change.
        arena: Arena of the trials.
        whole: Posterior of whole trials by simulation: the sensors' noise is as in its draws while the mean is fitted.
            Without encoders, a second fit begins with it, and half of the draws of all noise are from it.
        seed: Seed of all random numbers.
        effort: Number of fits of which the draws are made.
    """
    fit = _Fit(_seen(trials), ensemble, prior, robot, whole, seed)
    center, shape = fit.grown()
    values = {
        **values_at(fit.free, fit.draws(center, shape, N_REFITS[effort])),
        **fit.noise_draws(),
        **_sensors(fit, center, trials, arena, whole),
    }
    if SLIP in values and not fit.seen.has_wheels:
        values |= _respread_slip(prior, values, fit.rng)
    values = {parameter.name: values[parameter.name] for parameter in prior}
    return Posterior(standard_of(prior, values), values, np.zeros(len(prior)), fit.n_simulated)


def _respread_slip(
    prior: Sequence[Parameter], values: Mapping[str, Floats], rng: np.random.Generator
) -> dict[str, Floats]:
    """Return draws of slip from its prior, and of the parameters that compensate for it, (N_DRAWS,) each.

    Without encoders, only the product of (1 - slip) and the gain is known, and the fits spread too little along it.
    """
    priors = {parameter.name: parameter.prior for parameter in prior}
    gain = priors["drive.gain"]
    before = values[SLIP]
    slip = before.copy()
    is_left = np.ones(len(slip), np.bool_)
    for _ in range(N_TRIES):
        proposed = priors[SLIP].of(rng.uniform(size=len(slip)))
        scaled = values["drive.gain"] * (1 - before) / (1 - proposed)
        is_taken = is_left & (gain.lowest <= scaled) & (scaled <= gain.highest)
        slip[is_taken] = proposed[is_taken]
        is_left &= ~is_taken
    kept = (1 - slip) / (1 - before)
    respread = {name: values[name] * kept ** WITH_SLIP[name] for name in OF_MEAN if name in values}
    return {SLIP: slip, **respread}


def _sensors(
    fit: _Fit, center: Floats, trials: Sequence[TrialRecord], arena: Arena, whole: Posterior
) -> dict[str, Floats]:
    """Return draws of the parameters of the sensors, (N_DRAWS,).

    One half has likelihoods at the poses that the fit predicts for the first steps, where it predicts them well. It
    does not know of their errors, so its draws spread too little. The other half is of whole trials by simulation.
    """
    parameters = [parameter for parameter in fit.prior if parameter.name.startswith("range.")]
    if not parameters:
        return {}
    poses = fit.poses(center)
    n = max(1, round(PREDICTED * poses.shape[1]))
    early = [
        replace(
            trial,
            commands=trial.commands[:n],
            readings=trial.readings[:n],
            stalled=trial.stalled[:n],
            wheels=trial.wheels[: n + 1],
            poses=poses[k, : min(n, len(trial.commands)) + 1].astype(np.float64),
        )
        for k, trial in enumerate(trials)
    ]
    shots = shots_of(early, fit.robot, arena)
    at_poses = sensors_of(shots, parameters, fit.robot, arena, fit.rng, N_READINGS)
    of_whole = _some_of({p.name: whole.values[p.name] for p in parameters}, N_DRAWS, fit.rng)
    is_at_pose = fit.rng.random(N_DRAWS) < 0.5
    return {name: np.where(is_at_pose, value, of_whole[name]) for name, value in at_poses.items()}


def _some_of(draws: Mapping[str, Floats], n: int, rng: np.random.Generator) -> dict[str, Floats]:
    """Return n of the draws of each parameter, (n,); draws of one length are joint."""
    which = {k: rng.integers(k, size=n) for k in sorted({len(value) for value in draws.values()})}
    return {name: value[which[len(value)]] for name, value in draws.items()}


class _Fit:
    """The fit of the parameters that move the mean; arguments as of `fit_from_commands`."""

    def __init__(
        self,
        seen: _Seen,
        ensemble: SimEnsemble,
        prior: Sequence[Parameter],
        robot: RobotModel,
        whole: Posterior,
        seed: int,
    ) -> None:
        self.seen, self.ensemble, self.prior, self.robot = seen, ensemble, prior, robot
        self.whole, self.seed = whole, seed
        self.free = [p for p in prior if p.name not in SCATTER]
        self.noise = {p.name: whole.values[p.name] for p in prior if p.name in SCATTER}
        self.rng = np.random.default_rng([seed, 3])
        self.n_simulated = 0

    def grown(self) -> tuple[Floats, Floats]:
        """Return (p,) places of the fit, and (p, p) the shape of its minimum.

        It begins with the robot's own numbers. Without encoders, a second fit begins with the draws from whole trials,
        and the one with the better minimum is taken: each is worse than the true numbers for some robots of `sim`.
        """
        noise = self.noise
        fit = self._grown_from(own_places(self.robot, self.free), WIDE, np.eye(len(self.free)))
        if self.seen.has_wheels:
            return fit
        fits, noises = [fit], [self.noise]
        self.noise = noise
        fits.append(self._grown_from(*self._spread_of_whole()))
        noises.append(self.noise)
        t = self.seen.commands.shape[1]
        scales = [self._scales(center, t) for center, _ in fits]
        weights, pull = np.ones(len(self.seen.starts)), np.full(len(self.free), 0.5)
        centers = np.stack([center for center, _ in fits])
        best = int(np.argmin(self._costs(centers, t, np.mean(scales, axis=0), weights, pull)))
        self.noise = noises[best]
        return fits[best]

    def _spread_of_whole(self) -> tuple[Floats, float, Floats]:
        """Return the mean place (p,) of the draws from whole trials, their standard deviation, and its shape (p, p)."""
        draws = np.stack(
            [np.clip(place_of(p, self.whole.values[p.name]), *OFF_ENDS) for p in self.free], axis=1
        )
        spread = np.cov(draws, rowvar=False) + LEAST_SPREAD**2 * np.eye(len(self.free))
        width = float(np.sqrt(np.diag(spread).mean()))
        return draws.mean(axis=0), width, spread / width**2

    def _grown_from(self, center: Floats, width: float, shape: Floats) -> tuple[Floats, Floats]:
        """Return a fit as of `grown` that begins at places (p,), with a standard deviation and its shape (p, p)."""
        strategy = self._strategy(center, width, shape)
        weights, pull = np.ones(len(self.seen.starts)), np.full(len(self.free), 0.5)
        for share in HORIZONS:
            t = max(1, round(share * self.seen.commands.shape[1]))
            # the noise is not known before the first round
            is_first = share == HORIZONS[0]
            scales = self.seen.finest if is_first else self._scales(np.clip(strategy.mean, 0.0, 1.0), t)
            self._descend(strategy, t, scales, weights, GENERATIONS, pull)
            self._note_noise(np.clip(strategy.mean, 0.0, 1.0), t)
        return np.clip(strategy.mean, 0.0, 1.0), np.cov(
            [strategy.ask() for _ in range(N_SHAPE)], rowvar=False
        )

    def draws(self, center: Floats, shape: Floats, n: int) -> Floats:
        """Return (N_DRAWS, p) places around the fit, from n reweighted fits."""
        t, k = self.seen.commands.shape[1], len(self.seen.starts)
        scales = self._scales(center, t)
        narrow, generations = REFITS["encoders" if self.seen.has_wheels else "without"]
        spread = narrow / np.sqrt(np.diag(shape).mean())
        refits = []
        for _ in range(n):
            strategy = self._strategy(center, spread, shape)
            weights, pull = k * self.rng.dirichlet(np.ones(k)), self.rng.uniform(size=len(center))
            self._descend(strategy, t, scales, weights, generations, pull)
            # a fit may have left for a worse minimum
            both = np.stack([np.clip(strategy.mean, 0.0, 1.0), center])
            refits.append(both[np.argmin(self._costs(both, t, scales, weights, pull))])
        off = SPREAD * (np.stack(refits) - np.mean(refits, axis=0)) / np.sqrt(n - 1)
        normal = self.rng.standard_normal((N_DRAWS, n)) @ off
        tails = np.sqrt((n - 1) / self.rng.chisquare(n - 1, N_DRAWS))
        return np.asarray(np.clip(center + normal * tails[:, None], 0.0, 1.0))

    def noise_draws(self) -> dict[str, Floats]:
        """Return draws of the noise, (N_DRAWS,) of each kind.

        They are fitted to the differences that the mean leaves. Without encoders, these hold few true numbers, as the
        mean hides noise; then one half is of whole trials by simulation.
        """
        fitted = _some_of(self.noise, N_DRAWS, self.rng)
        if self.seen.has_wheels:
            return fitted
        of_whole = _some_of({name: self.whole.values[name] for name in self.noise}, N_DRAWS, self.rng)
        is_fitted = self.rng.random(N_DRAWS) < 0.5
        return {name: np.where(is_fitted, value, of_whole[name]) for name, value in fitted.items()}

    def _strategy(self, center: Floats, spread: float, shape: Floats) -> CMA:
        """Return a strategy that begins at places (p,), with a spread and a shape (p, p) of its steps."""
        from cmaes import CMA  # imports SciPy's statistics, which most commands can do without

        return CMA(
            mean=np.clip(center, 1e-3, 1 - 1e-3), sigma=spread, cov=shape, population_size=SIZE,
            bounds=np.tile([0.0, 1.0], (len(center), 1)), seed=int(self.rng.integers(2**31)),
        )  # fmt: skip

    def _descend(
        self,
        strategy: CMA,
        t: int,
        scales: NDArray[np.float32],
        weights: Floats,
        generations: int,
        pull: Floats,
    ) -> None:
        """Move a strategy to places of less cost in the first t steps.

        Args:
            strategy: The strategy.
            t: Steps.
            scales: (k, t, d) of differences.
            weights: (k,) of trials.
            generations: Generations.
            pull: (p,) places to which the prior pulls.
        """
        for _ in range(generations):
            places = np.array([strategy.ask() for _ in range(SIZE)])
            costs = self._costs(places, t, scales, weights, pull)
            strategy.tell(list(zip(places, costs.tolist(), strict=True)))

    def _costs(
        self, places: Floats, t: int, scales: NDArray[np.float32], weights: Floats, pull: Floats
    ) -> Floats:
        """Return (m,) costs of robots at places (m, p) that have no noise; other arguments as of `_descend`."""
        seen, some = self.seen.values[:, :t], self.seen.weights[:, :t]

        def of(made: NDArray[np.float32]) -> Floats:
            squares = np.log1p(((made - seen) / scales) ** 2 / FREEDOM) * some
            return np.asarray(squares.sum(axis=(2, 3), dtype=np.float64) @ weights)

        logs = self._made(places, t, of)
        from_prior = ((places - pull) ** 2).sum(axis=1)
        return np.asarray(0.5 * (FREEDOM + 1.0) * logs + 0.5 * PRIOR_PRECISION * from_prior)

    def _scales(self, center: Floats, t: int) -> NDArray[np.float32]:
        """Return (k, t, d) typical differences: those that are taken for none, and the scatter by noise."""
        noise = _some_of(self.noise, N_NOISY, self.rng)
        made = self._made(np.tile(center, (N_NOISY, 1)), t, _as_it_is, noise)
        return np.asarray(np.sqrt(made.var(axis=0) + self.seen.finest**2))

    def _note_noise(self, center: Floats, t: int) -> None:
        """Fit the noise of the motion to the differences in the first t steps.

        Variances of different kinds of noise add up; each kind is simulated alone.
        """
        parameters = [p for p in self.prior if p.name in NOISE]
        if not parameters:
            return
        places = np.tile(center, (N_NOISY, 1))
        own = self._made(places, t, _as_it_is)
        parts = np.empty((len(parameters), own[0].size), np.float32)
        for k, parameter in enumerate(parameters):
            size = PARTS[parameter.name]
            made = self._made(places, t, _as_it_is, {parameter.name: np.full(N_NOISY, size)})
            parts[k] = (((made - own) ** 2).mean(axis=0) / size**2).reshape(-1)
        squares = ((own[0] - self.seen.values[:, :t]) ** 2).reshape(-1)
        weights = (self.seen.weights[:, :t] / ALIKE).reshape(-1)
        floor = np.broadcast_to(self.seen.finest**2, own[0].shape).reshape(-1)

        def log_likelihood(places: Floats) -> Floats:
            drawn = values_at(parameters, places)
            sizes = np.stack([drawn[p.name] for p in parameters], axis=1)
            variance = sizes**2 @ parts + floor
            return np.asarray(
                -0.5 * (np.log(variance) + np.minimum(squares / variance, MOST_OFF**2)) @ weights
            )

        fitted = sample_posterior(log_likelihood, len(parameters), self.rng, N_NOISE)
        self.noise = self.noise | values_at(parameters, fitted)

    def poses(self, center: Floats) -> NDArray[np.float32]:
        """Return (k, t + 1, 3) poses of a robot without noise."""
        seen, numbers = self.seen, self._numbers(center[None], {})
        played = self.ensemble.replay(seen.starts, seen.commands, numbers, self.seed, keep=("poses",))
        return np.asarray(played.poses[0])

    def _numbers(self, places: Floats, noise: Mapping[str, Floats]) -> dict[str, Floats]:
        """Return the numbers of m robots at places (m, p). Kinds of noise that are not given are 0."""
        still = {name: np.zeros(len(places)) for name in self.noise}
        return numbers_of(self.prior, {**values_at(self.free, places), **still, **noise}, self.robot)

    def _made(
        self,
        places: Floats,
        t: int,
        of: Callable[[NDArray[np.float32]], NDArray[F]],
        noise: Mapping[str, Floats] | None = None,
    ) -> NDArray[F]:
        """Return the results of `of` for the observations of m robots at places (m, p) in t steps, (m, ...).

        The robots have no noise, or noise of their own of the given sizes, (m,) of each kind.
        """
        self.n_simulated += len(places)
        seen = self.seen
        play = Play(seen.starts, t, np.ascontiguousarray(seen.commands[:, :t]))
        keep = ("readings", "stalled", "wheels") if seen.has_wheels else ("readings", "stalled")
        return self.ensemble.summarize(
            play,
            self._numbers(places, noise or {}),
            self.seed,
            lambda rehearsal: of(_values(rehearsal, t, seen.has_wheels)),
            keep=keep,
            same_noise=noise is None,
        )


def _as_it_is(made: NDArray[np.float32]) -> NDArray[np.float32]:
    return made


def _values(rehearsal: Rehearsal, t: int, has_wheels: bool) -> NDArray[np.float32]:
    """Return the observations of m robots, (m, k, t, d)."""
    parts = [rehearsal.readings[:, :, :t], rehearsal.stalled[:, :, :t, None].astype(np.float32)]
    if has_wheels:
        parts.append(np.diff(rehearsal.wheels[:, :, : t + 1], axis=2))
    return np.concatenate(parts, axis=-1)


def _seen(trials: Sequence[TrialRecord]) -> _Seen:
    """Return the observations of trials, padded to the longest one."""
    t = max(len(trial.commands) for trial in trials)
    s = trials[0].readings.shape[1]
    has_wheels = all(len(trial.wheels) for trial in trials)
    d = s + 1 + 2 * has_wheels
    commands = np.zeros((len(trials), t, 2))
    values, weights = np.zeros((2, len(trials), t, d), np.float32)
    for k, trial in enumerate(trials):
        n = len(trial.commands)
        commands[k, :n] = trial.commands
        values[k, :n, :s], values[k, :n, s] = trial.readings[:n], trial.stalled[:n]
        if has_wheels:
            values[k, :n, s + 1 :] = np.diff(trial.wheels[: n + 1], axis=0)
        weights[k, :n] = 1.0 / max(s, 1)
    kinds = ["readings"] * s + ["stall"] + ["wheels", "wheels"] * has_wheels
    finest = np.array([FINEST[kind] for kind in kinds], np.float32)
    return _Seen(np.array([trial.start for trial in trials]), commands, values, finest, weights)
