"""Two one-sided tests: whether two platforms are as good as equal in level."""

from __future__ import annotations

import math
from dataclasses import dataclass

import scipy

from ._estimate import Estimate, Values
from ._means import UNBOUNDED, Range, distance_on_scale, mean_interval, range_of_differences
from ._permutation import ALPHA
from ._planning import controllers_for_margin, equivalence_power


@dataclass(frozen=True)
class Equivalence:
    """The result of two one-sided tests.

    Attributes:
        difference: Mean difference with its 90 % interval. Equivalence is shown if that lies within the margin.
        p: The larger of both p; None without a margin.
        equivalent: True if it is shown; None without a margin.
        power: Probability that this number of controllers shows it if there is no difference; None without a margin.
        needed: Number of controllers that shows it in 80 of 100 studies if there is no difference. None if no number
            up to 100,000 does, or without a margin.
    """

    difference: Estimate
    p: float | None = None
    equivalent: bool | None = None
    power: float | None = None
    needed: int | None = None


def prove_equivalence(
    differences: Values, margin: float | None, score_range: Range = UNBOUNDED
) -> Equivalence:
    """Test whether the mean of differences, one of each controller, lies within the margin on both sides.

    Args:
        differences: (c,) differences of means, target minus source; c is at least 2.
        margin: Margin above 0, in the unit of the values; None for the interval alone.
        score_range: Range of the values whose differences these are. The interval ends within the range of their
            differences, and p has the same scale (`bounded_interval`).

    Raises:
        ValueError: One controller, or a margin that is not above 0.

    Source: Schuirmann (1987), Journal of Pharmacokinetics and Biopharmaceutics 15(6), 657-680, with paired t tests
    at 5 %.
    """
    n = len(differences)
    if n < 2:
        raise ValueError(f"Equivalence needs at least 2 controllers, got {n}.")
    if margin is not None and not (math.isfinite(margin) and margin > 0):
        raise ValueError(f"margin is {margin}, expected a number above 0, such as 0.05.")
    within = range_of_differences(score_range)
    estimate = mean_interval(differences, within, level=1 - 2 * ALPHA, smallest=2)
    if margin is None:
        return Equivalence(estimate)
    mean, spread = float(differences.mean()), float(differences.std(ddof=1))
    p = _p(mean, spread / math.sqrt(n), margin, n, within)
    power = equivalence_power(margin, spread, n)
    return Equivalence(estimate, p, p < ALPHA, power, controllers_for_margin(margin, spread))


def _p(mean: float, error: float, margin: float, n: int, within: Range) -> float:
    if error == 0 or margin >= within[1]:
        return 0.0 if abs(mean) < margin else 1.0
    return float(scipy.special.stdtr(n - 1, -distance_on_scale(abs(mean), margin, within) / error))
