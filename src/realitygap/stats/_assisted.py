"""The mean of few expensive values, assisted by cheap values of the same units and of many others."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from realitygap.errors import finite_numbers

from ._estimate import CONFIDENCE, Estimate, Values
from ._means import SMALLEST_N, UNBOUNDED, Range, t_interval
from ._shares import root

FEW_UNITS = 10
"""Fewer units give an assisted interval of 95 % that skewed scores may miss more often; it comes with a warning."""


MOST_UNITS = 1_000_000
"""Largest number of units that a simulation is said to be worth."""


@dataclass(frozen=True)
class Assisted:
    """A mean on the target, from few trials there and many in simulation.

    Attributes:
        estimate: The mean, with the interval of the regression estimator; refused with the reason.
        real_only: The mean and its interval from the target alone, which is always valid.
        correlation: Pearson's correlation of both scores over the driven units; None if one of them is constant.
        n_simulated: Units in simulation: the driven ones, and those that were only simulated.
        worth: Further units on the target that would narrow the real-only interval as much; below 0 if the assisted
            interval is wider. None if there is no interval.
        helps: False if such a correlation is as likely as not to make the interval wider.
    """

    estimate: Estimate
    real_only: Estimate
    correlation: float | None
    n_simulated: int
    worth: float | None
    helps: bool

    @property
    def width_ratio(self) -> float | None:
        """Width of the assisted interval in widths of the real-only one; None if there is none, or its width is 0."""
        mine, other = self.estimate.ends, self.real_only.ends
        if mine is None or other is None or other[0] == other[1]:
            return None
        return (mine[1] - mine[0]) / (other[1] - other[0])


def least_correlation(n: int) -> float:
    """Return the correlation of n units, 3 or more, above which simulated scores narrow the interval of a mean.

    Source: Mani et al. (2025), arXiv 2505.20178, for normal values.
    """
    return min(1.0, 1 / math.sqrt(n - 2))


def assisted_mean(
    real: Values,
    simulated: Values,
    others: Values,
    *,
    fleet: bool = False,
    noise: float | None = None,
    within: Range = UNBOUNDED,
    level: float = CONFIDENCE,
    noun: str = "units",
) -> Assisted:
    """Return the mean score on the target of a population or of a fleet, assisted by a simulator.

    Units are independent: controllers, or starts, or blocks. The driven units must be a random sample of all units,
    and no score of theirs on the target may have served to calibrate the simulator. Then the interval is valid
    whatever the simulator's error, because the scores in simulation only shift the mean of the driven units by the
    regression of one score on the other.

    Args:
        real: (n,) mean score of each driven unit on the target.
        simulated: (n,) mean score of the same units in simulation.
        others: (m,) mean score of the units that were only simulated.
        fleet: True for the mean of these n + m units, False for the mean of the population that they are drawn from.
        noise: For a fleet, variance of the n values of `real` that is noise of trials. If it is None, the interval has
            no finite-population correction, and is too wide.
        within: Range of the scores, in which intervals end.
        level: Probability that the interval covers the mean.
        noun: Plural name of the units, for reasons of refusals.

    Raises:
        ValueError: Arrays have other shapes, or values that are not finite, or there are no driven units.

    Source: the regression estimator for double sampling, Cochran (1977), Sampling Techniques, sections 7.3 and 12.6,
    with the variance for n units of which the slope is estimated, and n - 2 degrees of freedom. The same idea with a
    normal quantile is PPI++ (Angelopoulos, Duchi & Zrnic 2023, arXiv 2311.01453), which covers less often for small n.
    Differs: the interval ends within the range of scores (`bounded_interval`).
    """
    real, simulated, others = (np.asarray(values, float) for values in (real, simulated, others))
    if real.ndim != 1 or real.shape != simulated.shape or others.ndim != 1 or not len(real):
        raise ValueError(
            f"Shapes are {real.shape}, {simulated.shape} and {others.shape}, expected (n,), (n,) and (m,) with n > 0."
        )
    for name, values in (("real", real), ("simulated", simulated), ("others", others)):
        finite_numbers(name, values)
    n, everything = len(real), np.concatenate([simulated, others])
    corrected = noise if fleet else None
    alone = _real_only(real, len(everything), corrected, within, level, noun)
    spread = float(((simulated - simulated.mean()) ** 2).sum())
    constant = spread == 0 or float(np.ptp(real)) == 0
    correlation = None if constant else float(np.corrcoef(real, simulated)[0, 1])
    if refused := _refusal(simulated, everything, n, spread, noun):
        return Assisted(Estimate.refusal(n, refused), alone, correlation, len(everything), None, False)
    slope = float(((simulated - simulated.mean()) * (real - real.mean())).sum()) / spread
    shift = float(everything.mean() - simulated.mean())
    residuals = real - real.mean() - slope * (simulated - simulated.mean())
    residual = float((residuals**2).sum()) / (n - 2)
    variance = residual * (_share(n, len(everything), corrected) + shift**2 / spread)
    if not fleet:
        variance += slope**2 * float(everything.var(ddof=1)) / len(everything)
    elif corrected is not None:
        variance += corrected / len(everything)
    value = float(np.clip(real.mean() + slope * shift, *within))
    low, high = t_interval(value, math.sqrt(variance), n - 2, within, level)
    estimate = Estimate(value, float(low), float(high), n, level=level, method="regression")
    worth = _worth(real, math.sqrt(variance), len(everything), corrected, level)
    helps = correlation is not None and abs(correlation) > least_correlation(n)
    return Assisted(estimate, alone, correlation, len(everything), worth, helps)


def _refusal(driven: Values, everything: Values, n: int, spread: float, noun: str) -> str:
    """Return why there is no assisted interval; empty if there is one."""
    if n < SMALLEST_N:
        return f"{n} {noun} on the target are too few; at least {SMALLEST_N} are needed."
    if len(everything) == n:
        return (
            f"All {noun} were tried on the target, so the simulator has nothing to add. Simulate more {noun}."
        )
    if spread == 0:
        return f"All driven {noun} have the same score in simulation, so it says nothing about their order."
    mean = float(everything.mean())
    if not driven.min() <= mean <= driven.max():
        return (
            f"The mean score of all {noun} in simulation, {mean:.3f}, is outside the scores of the driven ones, "
            f"{driven.min():.3f} to {driven.max():.3f}. Were they drawn at random? Try more of them on the target."
        )
    return ""


def _share(n: float, size: int, noise: float | None) -> float:
    """Return the factor of the variance of a mean of n units; with the correction for a fleet if noise is known."""
    return 1 / n if noise is None else 1 / n - 1 / size


def _error(variance: float, n: float, size: int, noise: float | None) -> float:
    """Return the standard error of the mean of n units on the target alone."""
    return math.sqrt(variance * _share(n, size, noise) + (noise or 0.0) / size)


def _real_only(
    real: Values, size: int, noise: float | None, within: Range, level: float, noun: str
) -> Estimate:
    n, mean = len(real), float(real.mean())
    if n < SMALLEST_N:
        return Estimate.of_few(mean, n, SMALLEST_N, noun)
    error = _error(float(real.var(ddof=1)), n, size, noise)
    low, high = t_interval(mean, error, n - 1, within, level)
    return Estimate(mean, float(low), float(high), n, level=level, method="t")


def _worth(real: Values, error: float, size: int, noise: float | None, level: float) -> float | None:
    """Return the further units with which the target alone would give as short an interval."""
    n, variance = len(real), float(real.var(ddof=1))
    most = float(MOST_UNITS if noise is None else size)

    def excess(units: float) -> float:
        reach = float(scipy.special.stdtrit(units - 1, (1 + level) / 2))
        return reach * _error(variance, units, size, noise) - wanted

    wanted = float(scipy.special.stdtrit(n - 2, (1 + level) / 2)) * error
    if variance == 0 or wanted == 0:
        return None
    return (2.0 if excess(2.0) < 0 else most if excess(most) > 0 else root(excess, 2.0, most)) - n
