"""Scores on a target, predicted trial by trial from the scores of the same controllers in simulation."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from realitygap.errors import finite_numbers, whole_number

Floats = NDArray[np.float64]

LENGTH = 0.4
"""Distance of descriptors, each from 0 to 1, over which differences to the simulation are alike."""
KAPPA = 0.05
"""Weight of the standard deviation in the choice of the next trial."""
ENOUGH = 0.9
"""Share of the highest prediction at which the best trial so far ends the search."""


class Predicted(NamedTuple):
    """Predicted mean scores of m controllers on the target.

    Attributes:
        mean: (m,) expected values.
        deviation: (m,) standard deviations.
    """

    mean: Floats
    deviation: Floats


class PriorProcess:
    """A Gaussian process over descriptors, whose prior mean is what the simulation says.

        process = PriorProcess(descriptors, simulated)
        for _ in range(10):
            k = process.choose()
            process.tell(k, score_of(k))
        best = process.predict().mean.argmax()

    Difference to the simulation: k(r) = offset² + spread² Matern(r / length) of the distance r between two
    descriptors, with smoothness 5/2. Several simulations, such as one for each suspected damage, have a process each
    with the same kernel. The prediction is their mixture, weighted by the likelihood of the trials under each.

    Source: Cully, Clune, Tarapore & Mouret (2015), Nature 521, "Intelligent Trial and Error" (offset 0, spread 1, one
    simulation); several priors as in Pautrat, Chatzilygeroudis & Mouret (2018), ICRA, which weighs the acquisition
    where this weighs the prediction.
    """

    def __init__(
        self,
        descriptors: ArrayLike,
        simulated: ArrayLike,
        *,
        length: float = LENGTH,
        spread: float = 1.0,
        offset: float = 0.0,
        noise: ArrayLike = 0.001,
    ) -> None:
        """Begin without a trial.

        Args:
            descriptors: (m, d) descriptors of the controllers, each from 0 to 1.
            simulated: (m,) their scores in simulation, or (h, m) in each of h simulations.
            length: Distance over which differences to the simulation are alike, > 0.
            spread: Standard deviation of these differences, > 0.
            offset: Standard deviation of a difference that all controllers share, >= 0.
            noise: Variance of one trial, > 0, or (m,) of each controller.

        Raises:
            ValueError: A number is out of its range, or shapes do not fit.
        """
        self._x = finite_numbers("descriptors", descriptors)
        self._prior = np.atleast_2d(finite_numbers("simulated", simulated))
        if self._x.ndim != 2 or not self._x.size:
            raise ValueError(
                f"descriptors have shape {self._x.shape}, expected (m, d) with m and d of at least 1."
            )
        if self._prior.ndim != 2 or self._prior.shape[1] != len(self._x) or not len(self._prior):
            raise ValueError(
                f"simulated has shape {np.shape(simulated)}, expected one score for each of {len(self._x)} controllers."
            )
        variances = finite_numbers("noise", noise)
        if variances.shape not in ((), (len(self._x),)):
            raise ValueError(
                f"noise has shape {variances.shape}, expected one number, or one for each controller."
            )
        self._noise = np.broadcast_to(variances, len(self._x))
        length, spread, offset = (
            float(finite_numbers(name, value))
            for name, value in (("length", length), ("spread", spread), ("offset", offset))
        )
        for name, value, is_right in (
            ("length", length, length > 0),
            ("spread", spread, spread > 0),
            ("offset", offset, offset >= 0),
            ("noise", self._noise.min(), self._noise.min() > 0),
        ):
            if not is_right:
                raise ValueError(
                    f"{name} is {value}, expected a number {'>=' if name == 'offset' else '>'} 0."
                )
        self._length, self._spread, self._offset = length, spread, offset
        self._evidence = np.zeros(len(self._prior))
        self._tried: list[int] = []
        self._scores: list[float] = []

    @property
    def tried(self) -> tuple[int, ...]:
        """Controllers that were tried, in order."""
        return tuple(self._tried)

    @property
    def scores(self) -> tuple[float, ...]:
        """Their scores."""
        return tuple(self._scores)

    def tell(self, controller: int, score: float) -> None:
        """Take in the score of a controller in one trial on the target.

        Raises:
            ValueError: There is no such controller, or the score is not finite.
        """
        which, value = (
            whole_number("controller", controller, 0, len(self._x) - 1),
            finite_numbers("score", score),
        )
        self._tried.append(which)
        self._scores.append(float(value))

    def weigh(self, evidence: ArrayLike) -> None:
        """Take in what else speaks for each simulation, such as where the robot was in the trial.

        Args:
            evidence: (h,) logarithms of likelihoods, up to a constant.

        Raises:
            ValueError: A number is not finite, or there is not one for each simulation.
        """
        given = finite_numbers("evidence", evidence)
        if given.shape != self._evidence.shape:
            raise ValueError(f"evidence has shape {given.shape}, expected {self._evidence.shape}.")
        self._evidence = self._evidence + given

    @property
    def weights(self) -> Floats:
        """(h,) probability of each simulation after the trials and other evidence; before, all are equally probable."""
        return self._solve()[0]

    def predict(self) -> Predicted:
        """Return the predicted mean score of each controller."""
        weights, means, variance = self._solve()
        mean = weights @ means
        between = weights @ (means - mean) ** 2
        return Predicted(mean, np.sqrt(np.maximum(variance + between, 0.0)))

    def choose(self, kappa: float = KAPPA) -> int:
        """Return the controller to be tried next: that of the highest mean + kappa * standard deviation."""
        mean, deviation = self.predict()
        return int(np.argmax(mean + kappa * deviation))

    def is_enough(self, share: float = ENOUGH) -> bool:
        """Return whether the best trial so far has this share of the highest predicted mean.

        Scores are from 0 on, as in the source.
        """
        return bool(self._scores) and max(self._scores) >= share * float(self.predict().mean.max())

    def _kernel(self, one: Floats, other: Floats) -> Floats:
        apart = np.sqrt(((one[:, None] - other[None]) ** 2).sum(axis=2)) * (math.sqrt(5) / self._length)
        matern = (1 + apart + apart**2 / 3) * np.exp(-apart)
        return np.asarray(self._offset**2 + self._spread**2 * matern)

    def _solve(self) -> tuple[Floats, Floats, Floats]:
        """Return (h,) weights, (h, m) means, and (m,) variance of each mean."""
        own = self._offset**2 + self._spread**2
        if not self._tried:
            return _shares(self._evidence), self._prior, np.full(len(self._x), own)
        at = np.array(self._tried)
        # a little more, so that repeated trials without noise can be solved
        among = self._kernel(self._x[at], self._x[at]) + np.diag(self._noise[at] + 1e-10 * own)
        factor = scipy.linalg.cho_factor(among, lower=True)
        across = self._kernel(self._x, self._x[at])
        residuals = np.array(self._scores) - self._prior[:, at]
        solved = scipy.linalg.cho_solve(factor, residuals.T)
        fit = -0.5 * (residuals.T * solved).sum(axis=0)
        weights = _shares(fit + self._evidence)
        variance = own - (across.T * scipy.linalg.cho_solve(factor, across.T)).sum(axis=0)
        return weights, self._prior + (across @ solved).T, variance


def _shares(logarithms: Floats) -> Floats:
    shares = np.exp(logarithms - logarithms.max())
    return np.asarray(shares / shares.sum())
