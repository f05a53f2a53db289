"""Two one-sided tests: whether two platforms are as good as equal in level."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from realitygap import _special as special
from realitygap.errors import check_finite

from ._bounded import UNBOUNDED, Range, bounded_interval, distance_on_scale, range_of_differences
from ._side import Values

ALPHA = 0.05
POWER = 0.8
MOST_CONTROLLERS = 100_000


@dataclass(frozen=True)
class Equivalence:
    """The result of two one-sided tests.

    Attributes:
        difference: Mean difference.
        low: Lower end of its 90 % interval. Equivalence is shown if the interval lies within the margin.
        high: Upper end.
        p: The larger of both p; nan without a margin.
        equivalent: True if it is shown; None without a margin.
        power: Probability that this number of controllers shows it if there is no difference; nan without a margin.
        needed: Number of controllers that shows it in 80 of 100 studies if there is no difference. None if no number
            up to 100,000 does, or without a margin.
    """

    difference: float
    low: float
    high: float
    p: float
    equivalent: bool | None
    power: float
    needed: int | None


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
    mean, spread = float(differences.mean()), float(differences.std(ddof=1))
    error = spread / math.sqrt(n)
    within = range_of_differences(score_range)
    reach = float(special.stdtrit(n - 1, 1 - ALPHA))
    low, high = map(float, bounded_interval(mean, error, reach, within))
    if margin is None:
        return Equivalence(mean, low, high, math.nan, None, math.nan, None)
    p = _p(mean, error, margin, n, within)
    power = equivalence_power(margin, spread, n)
    return Equivalence(mean, low, high, p, p < ALPHA, power, controllers_for_margin(margin, spread))


def _p(mean: float, error: float, margin: float, n: int, within: Range) -> float:
    if error == 0 or margin >= within[1]:
        return 0.0 if abs(mean) < margin else 1.0
    return float(special.stdtr(n - 1, -distance_on_scale(abs(mean), margin, within) / error))


def equivalence_power(margin: float, spread: float, n: int, difference: float = 0.0) -> float:
    """Return the probability that n controllers show equivalence.

    Args:
        margin: Margin above 0.
        spread: Standard deviation of differences over controllers.
        n: Controllers, at least 2.
        difference: The true one.

    Source: Owen (1965), approximated: the noncentral t distributions of both tests, as if they never missed together
    (Phillips 1990); within 0.01 of the truth for a power of 0.5 and more.
    """
    check_finite({"margin": margin, "spread": spread, "difference": difference})
    if spread <= 0:
        return float(abs(difference) < margin)
    critical = float(special.stdtrit(n - 1, 1 - ALPHA))
    scale = math.sqrt(n) / spread
    passes = 0.0
    for side in (margin - difference, margin + difference):
        found = 1 - float(special.nctdtr(n - 1, side * scale, critical))
        passes += found if math.isfinite(found) else float(special.ndtr(side * scale - critical))
    return float(np.clip(passes - 1, 0.0, 1.0))


def controllers_for_margin(margin: float, spread: float, power: float = POWER) -> int | None:
    """Return the smallest number of controllers that shows equivalence with this power; None if 100,000 do not."""
    return fewest(lambda n: equivalence_power(margin, spread, n), power)


def fewest(
    power_of: Callable[[int], float], power: float, smallest: int = 2, most: int = MOST_CONTROLLERS
) -> int | None:
    """Return the smallest n, from `smallest` on, of which a growing function reaches a power; None if above `most`."""
    low, high = smallest - 1, smallest
    while power_of(high) < power:
        low, high = high, 2 * high
        if low > most:
            return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if power_of(middle) < power else (low, middle)
    return high
