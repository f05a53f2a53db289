"""Point estimates by methods of others, from the trials with poses that our own fits have.

Both minimize the error of trajectories: the commands of each trial are given to the simulated robot, without noise of
motion, and its poses and readings are compared with those observed. It begins anew at the observed pose after each
window of `WINDOW` commands, because over whole trials of 50 s small errors grow to any size. An arc tangent limits what
one lost window counts. Neither method fits noise, which has no place in such an error. Noise keeps the robot file's
numbers. Each may simulate at most `MOST_SETS` sets of numbers.

`cma-es`: Hansen (2016), as in the package cmaes, with its default population.
`least-squares`: bounded least squares by trust regions (Branch, Coleman & Li 1999, in SciPy) from the robot file's
numbers and then from random starts until the sets are spent, with differences for the derivatives, which is the method
of mujoco.sysid.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from cmaes import CMA
from numpy.typing import NDArray

from realitygap.calibration import numbers_of, ranges_of, scribbler_prior
from realitygap.calibration._all_from_poses import own_places
from realitygap.calibration._prior import MOTION_NOISE, values_at
from realitygap.platforms import SimEnsemble, SimPlatform
from realitygap.records import TrialRecord, write_whole
from realitygap.world import Arena, Calibration, Fitted, RobotModel

from .twin import TwinOfStudy

Floats = NDArray[np.float64]
MOST_SETS = 24_500
"""Sets that a fit may simulate. The part of our own fit that simulates whole trials has 7 · 1,500 + 6 · 1,500 + 5,000,
and its other parts simulate more, so the budgets are alike and not equal."""

WINDOW = 20  # commands after which the robot is put back to where it was observed
EVERY = 5  # steps between compared poses
POSITION_M, HEADING_RAD, READING = 0.05, 0.2, 0.3
"""Errors that weigh the same."""

STEP = 0.005  # of a place, for derivatives: the simulation is in single precision and in steps
NOISE = (*MOTION_NOISE, "range.drop_width", "range.burst", "range.noise_gain", "range.outlier_most")


@dataclass(frozen=True)
class TrajectoryError:
    """The error of simulated trajectories, at places 0 to 1 between the ends of the prior of each fitted parameter."""

    trials: Sequence[TrialRecord]
    robot: RobotModel
    arena: Arena
    seed: int

    @cached_property
    def parameters(self) -> list:
        """The fitted parameters."""
        return [parameter for parameter in scribbler_prior(self.robot) if parameter.name not in NOISE]

    @cached_property
    def own(self) -> Floats:
        """The places of the robot file's numbers, (p,)."""
        return own_places(self.robot, self.parameters)

    @cached_property
    def _ensemble(self) -> SimEnsemble:
        platform = SimPlatform(robot=self.robot, step_s=self.trials[0].step_s)
        return SimEnsemble(platform, self.arena, ranges=ranges_of(scribbler_prior(self.robot), self.robot))

    @cached_property
    def _without_noise(self) -> dict[str, float]:
        return {name: 0.0 for name in MOTION_NOISE if name in self.robot.centers()}

    @cached_property
    def _anchors(self) -> Floats:
        """Observed poses at the beginnings of windows, nan elsewhere, (k, t + 1, 3)."""
        poses = np.stack([trial.poses for trial in self.trials])
        anchors = np.full_like(poses, np.nan)
        anchors[:, ::WINDOW] = poses[:, ::WINDOW]
        return anchors

    def numbers(self, places: Floats) -> dict[str, Floats]:
        """Return the robot's numbers (m,) at places (m, p)."""
        return numbers_of(self.parameters, values_at(self.parameters, np.atleast_2d(places)), self.robot)

    def residuals(self, places: Floats) -> Floats:
        """Return (m, d) scaled differences between simulated and observed trials, at places (m, p)."""
        numbers = self.numbers(places)
        m = len(np.atleast_2d(places))
        numbers |= {name: np.full(m, value) for name, value in self._without_noise.items()}
        found = self._ensemble.replay(
            [trial.poses[0] for trial in self.trials],
            [trial.commands for trial in self.trials],
            numbers, self.seed, anchors=self._anchors, keep=("poses", "readings"), same_noise=True,
        )  # fmt: skip
        poses = np.stack([trial.poses for trial in self.trials])
        readings = np.stack([trial.readings for trial in self.trials])
        off = (found.poses - poses)[:, :, ::EVERY]
        off[..., 2] = (off[..., 2] + np.pi) % (2 * np.pi) - np.pi
        off /= [POSITION_M, POSITION_M, HEADING_RAD]
        read = (found.readings[:, :, : readings.shape[1]] - readings)[:, :, ::EVERY] / READING
        parts = [np.arctan(part).reshape(m, -1) for part in (off, read)]  # one lost trial must not decide
        return np.concatenate([part / np.sqrt(part.shape[1]) for part in parts], axis=1)


def by_cma_es(error: TrajectoryError) -> Floats:
    """Return the best places, (p,)."""
    p = len(error.own)
    bounds = np.tile([0.0, 1.0], (p, 1))
    search = CMA(mean=error.own, sigma=0.2, bounds=bounds, seed=error.seed % 2**31)
    best, least, spent = error.own, np.inf, 0
    while spent + search.population_size <= MOST_SETS and not search.should_stop():
        asked = np.array([search.ask() for _ in range(search.population_size)])
        costs = np.square(error.residuals(asked)).sum(axis=1)
        spent += len(asked)
        search.tell(list(zip(asked, costs.tolist(), strict=True)))
        if costs.min() < least:
            best, least = asked[costs.argmin()], float(costs.min())
    return best


def by_least_squares(error: TrajectoryError) -> Floats:
    """Return the best places, (p,)."""
    p = len(error.own)
    rng = np.random.default_rng(error.seed)
    best, least, spent, start = error.own, np.inf, 0, error.own

    def residuals(place: Floats) -> Floats:
        nonlocal spent
        spent += 1
        return error.residuals(place)[0]

    def jacobian(place: Floats) -> Floats:
        nonlocal spent
        spent += p + 1
        step = np.where(place + STEP <= 1.0, STEP, -STEP)
        found = error.residuals(np.vstack([place, place + np.diag(step)]))
        return ((found[1:] - found[0]) / step[:, None]).T

    while spent < MOST_SETS:
        most = max(1, (MOST_SETS - spent) // (p + 2))
        fit = scipy.optimize.least_squares(
            residuals, np.clip(start, 0.01, 0.99), jac=jacobian, bounds=(0.0, 1.0), max_nfev=most
        )
        if fit.cost < least:
            best, least = fit.x, float(fit.cost)
        start = rng.uniform(0.1, 0.9, p)
    return best


METHODS: dict[str, Callable[[TrajectoryError], Floats]] = {
    "cma-es": by_cma_es,
    "least-squares": by_least_squares,
}


def fit_outside(twin: TwinOfStudy, method: str) -> None:
    """Write the calibration of a twin by a method."""
    plan = twin.plan
    with twin.open() as target:
        trials = twin.calibrating(target, plan.budget)
        robot = twin.condition("coverage", "x").on.robot  # type: ignore[attr-defined]
        error = TrajectoryError(trials, robot, target.arena, plan.seed_of(twin.twin, method))
    try:
        place = METHODS[method](error)
    except (ValueError, ArithmeticError) as problem:
        write_whole(twin.failure_path(plan.arm[method]), str(problem).encode(), within=twin.folder)
        return
    own, least = np.square(error.residuals(np.vstack([error.own, place]))).sum(axis=1)
    values = {name: float(each[0]) for name, each in values_at(error.parameters, place[None]).items()}
    numbers = {name: float(each[0]) for name, each in error.numbers(place).items()}
    write_outside(
        twin, method, numbers, {}, values, f"error {own:.4f} with the robot file's numbers, {least:.4f} here"
    )


def write_outside(
    twin: TwinOfStudy,
    arm: str,
    numbers: dict[str, float],
    draws: dict[str, Floats],
    values: dict[str, float],
    note: str = "",
) -> None:
    """Write the calibration of an outside arm: the robot's numbers, draws if there are any, and the parameters."""
    robot = twin.condition("coverage", "x").on.robot  # type: ignore[attr-defined]
    priors = {parameter.name: parameter for parameter in scribbler_prior(robot)}
    made = Calibration(
        kind="all", robot=robot.name, target=f"twin:{twin.twin}", label="TWIN", observe="track",
        trials=twin.plan.budget, date="", method=arm, numbers=numbers, notes=(note,) if note else (),
        draws={name: tuple(map(float, each)) for name, each in draws.items()},
        fitted=tuple(
            Fitted(
                name=name, estimate=value, low=value, high=value, identified=True, unit=priors[name].unit,
                prior_low=priors[name].prior.lowest, prior_high=priors[name].prior.highest,
            )
            for name, value in values.items()
        ),
    )  # fmt: skip
    write_whole(twin.fit_path(twin.plan.arm[arm]), made.to_toml().encode(), within=twin.folder)
