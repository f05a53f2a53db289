"""The numbers of controllers and trials needed for an effect, for equivalence, or for a correlation."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap import _special as special

from ._bootstrap import SMALLEST_N
from ._correlation import attenuated, spearman
from ._equivalence import controllers_for_margin, fewest
from ._side import Values

ALPHA = 0.05
MOST = 100_000
SIMULATED = 2_000
"""Studies that are simulated to check a number: the interval of a power of 0.8 is then ±0.02."""

SHORT_OF = 0.02
"""Largest amount by which the lower end of that interval may be below the requested power."""

_MOST_PAIRS = 2_000_000
"""Controllers in all studies that are simulated for a correlation: beyond 1,000 controllers there are fewer studies."""


@dataclass(frozen=True)
class Needed:
    """The number of controllers needed, for a number of trials of each on each platform.

    Attributes:
        trials: Number of trials of each controller on each platform.
        controllers: Number of controllers; None if 100,000 are not enough.
        power: Share of simulated studies of this size that detect the effect.
        low: Lower end of its interval of 95 %.
        high: Upper end.
    """

    trials: int
    controllers: int | None
    power: float | None = None
    low: float | None = None
    high: float | None = None

    @property
    def on_target(self) -> int | None:
        """Total number of trials on the target."""
        return None if self.controllers is None else self.controllers * self.trials


def spread_of_differences(spread: float, noise: float, trials: int) -> float:
    """Return the standard deviation over controllers of the difference of means.

    Args:
        spread: Standard deviation of the true differences.
        noise: Standard deviation of one trial about its controller's mean, on both platforms.
        trials: Number of trials of each controller on each platform.
    """
    return math.sqrt(spread**2 + 2 * noise**2 / trials)


def plan_effect(
    effect: float, *, spread: float, noise: float, trials: int, power: float = 0.8, seed: int = 1
) -> Needed:
    """Return controllers with which a paired t test at 5 % finds a mean difference.

    Args:
        effect: Mean difference to find, in units of quality.
        spread, noise, trials: Arguments of `spread_of_differences`.
        power: Statistical power: the probability of detecting the effect.
        seed: Seed of the simulated studies.

    Source: Cohen (1988), chapter 2, by the noncentral t distribution.
    """
    check_plan(power, effect=effect)
    _check(noise=noise + spread)
    sd = spread_of_differences(spread, noise, trials)
    n = fewest(lambda n: _t_power(effect / sd, n), power, smallest=SMALLEST_N)
    if n is None:
        return Needed(trials, None)
    means, errors = _simulated(effect, sd, n, seed)
    found = np.abs(means) > float(special.stdtrit(n - 1, 1 - ALPHA / 2)) * errors
    return Needed(trials, n, *_share(found))


def detectable_difference(n: int, *, spread: float, noise: float, trials: int, power: float = 0.8) -> float:
    """Return the mean difference that a paired t test at 5 % detects with n controllers, in units of quality.

    Args:
        n: Number of controllers, 2 or more.
        spread, noise, trials: Arguments of `spread_of_differences`.
        power: Probability of detecting it.

    Raises:
        ValueError: n is below 2, or a number is out of range.

    Source: Cohen (1988), chapter 2, by the noncentral t distribution.
    """
    check_plan(power)
    _check(noise=noise + spread)
    if n < 2:
        raise ValueError(f"n is {n}, expected 2 or more.")
    low, high = 0.0, 1.0
    while _t_power(high, n) < power:
        low, high = high, 2 * high
    for _ in range(40):  # far below the digits that anybody reads
        middle = (low + high) / 2
        low, high = (middle, high) if _t_power(middle, n) < power else (low, middle)
    return high * spread_of_differences(spread, noise, trials)


def plan_margin(
    margin: float, *, spread: float, noise: float, trials: int, power: float = 0.8, seed: int = 1
) -> Needed:
    """Return the controllers with which TOST at 5 % shows the equivalence of equal means; as `plan_effect`."""
    check_plan(power, margin=margin)
    _check(noise=noise + spread)
    sd = spread_of_differences(spread, noise, trials)
    n = controllers_for_margin(margin, sd, power=power)
    if n is None:
        return Needed(trials, None)
    means, errors = _simulated(0.0, sd, n, seed)
    reach = float(special.stdtrit(n - 1, 1 - ALPHA)) * errors
    return Needed(trials, n, *_share(np.abs(means) + reach < margin))


def plan_correlation(
    correlation: float, *, least: float, reliability: float, trials: int, power: float = 0.8, seed: int = 1
) -> Needed:
    """Return controllers with which a rank correlation is shown to be above a least one.

    It is shown if the correlation of means is above the one that `least` gives with this noise, one-sided at 5 %. The
    normal formula gives a first number of controllers. Then studies of normal controllers with noise on both platforms
    are simulated, and the number is raised until the share `power` of them shows it.

    Args:
        correlation: True correlation, of controllers without noise.
        least: Correlation that the true one is shown to exceed; below `correlation`.
        reliability: Reliability of the means of both platforms with this number of trials [0..1]. It lowers both
            observed correlations.
        trials: Number of trials of each controller on each platform.
        power: Statistical power: the probability of showing it.
        seed: Seed of the simulated studies.

    Source: Fisher's transformation with the standard error of Bonett & Wright (2000), Psychometrika 65(1), 23-28,
    for Spearman's correlation.
    """
    check_plan(power, correlation=correlation, least=least)
    seen, floor = (attenuated(each, reliability, reliability) for each in (correlation, least))
    n = fewest(lambda n: _z_power(seen, floor, n), power, smallest=SMALLEST_N)
    while n is not None and n <= MOST:
        found = _simulated_correlations(correlation, reliability, floor, n, seed)
        share, low, high = _share(found)
        # fewer studies give a wider interval, which is no reason for more controllers
        if low >= power - SHORT_OF * math.sqrt(SIMULATED / len(found)):
            return Needed(trials, n, share, low, high)
        n = max(n + 1, math.ceil(n * min((_reach(power) / _reach(share)) ** 2, 2.0)))
    return Needed(trials, None)


def check_plan(
    power: float = 0.8,
    *,
    effect: float | None = None,
    margin: float | None = None,
    correlation: float | None = None,
    least: float | None = None,
) -> None:
    """Refuse what no number of controllers can answer, before anything is tried.

    Raises:
        ValueError: `power` or `correlation` is not between 0 and 1, `effect` or `margin` not finite or not above 0, or
            `least` not between -1 and `correlation`.
    """
    _check(power=power)
    _check(**{name: value for name, value in (("effect", effect), ("margin", margin)) if value is not None})
    if correlation is None:
        return
    _check(correlation=correlation)
    if least is not None and not -1 < least < correlation:
        raise ValueError(
            f"least is {least} and correlation {correlation}, expected -1 < least < correlation < 1."
        )


def trial_reliability(controllers_spread: float, noise: float, trials: int) -> float:
    """Return the reliability of the mean of n trials [0..1], for a given spread of controllers."""
    between = controllers_spread**2
    total = between + noise**2 / trials
    return between / total if total > 0 else 0.0


def _check(**values: float) -> None:
    for name, value in values.items():
        above = 1.0 if name in ("power", "correlation") else math.inf
        if not (math.isfinite(value) and 0 < value < above):
            limit = " and below 1" if above == 1.0 else ""
            raise ValueError(f"{name} is {value}, expected a number above 0{limit}.")


def _t_power(effect: float, n: int) -> float:
    critical = float(special.stdtrit(n - 1, 1 - ALPHA / 2))
    center = abs(effect) * math.sqrt(n)
    found = 1 - float(special.nctdtr(n - 1, center, critical))
    return found if math.isfinite(found) else float(special.ndtr(center - critical))


def _error(correlation: float, n: int) -> float:
    return math.sqrt((1 + correlation**2 / 2) / (n - 3))


def _z_power(seen: float, floor: float, n: int) -> float:
    apart = (math.atanh(seen) - math.atanh(floor)) / _error(seen, n)
    return float(special.ndtr(apart - special.ndtri(1 - ALPHA)))


def _reach(power: float) -> float:
    """Return the distance of a correlation from the floor for a power, in standard errors; it grows with sqrt(n)."""
    return float(special.ndtri(max(power, 2 * ALPHA)) + special.ndtri(1 - ALPHA))


def _simulated(mean: float, sd: float, n: int, seed: int) -> tuple[Values, Values]:
    """Return means and standard errors of simulated studies of n controllers."""
    rng = np.random.default_rng(seed)
    means = rng.normal(mean, sd / math.sqrt(n), SIMULATED)
    spreads = sd * np.sqrt(rng.chisquare(n - 1, SIMULATED) / (n - 1))
    return means, spreads / math.sqrt(n)


def _simulated_correlations(
    correlation: float, reliability: float, floor: float, n: int, seed: int
) -> NDArray[np.bool_]:
    """Return whether each of many studies of n normal controllers with noise shows a correlation above the floor."""
    rng = np.random.default_rng(seed)
    pearson = 2 * math.sin(math.pi * correlation / 6)
    studies = max(100, min(SIMULATED, _MOST_PAIRS // n))
    source = rng.normal(size=(studies, n))
    target = pearson * source + math.sqrt(1 - pearson**2) * rng.normal(size=(studies, n))
    noise = math.sqrt(1 / reliability - 1)  # of a mean of trials; controllers spread by 1
    seen = spearman(*(side + noise * rng.normal(size=side.shape) for side in (source, target)))
    seen = np.clip(seen, -1 + 1e-12, 1 - 1e-12)
    errors = np.sqrt((1 + seen**2 / 2) / (n - 3))
    return np.asarray(np.arctanh(seen) - special.ndtri(1 - ALPHA) * errors > math.atanh(floor))


def _share(found: NDArray[np.bool_]) -> tuple[float, float, float]:
    """Return a share with its interval of 95 %: Wilson (1927)."""
    n, share = len(found), float(found.mean())
    z = float(special.ndtri(0.975))
    center = (share + z * z / (2 * n)) / (1 + z * z / n)
    reach = z * math.sqrt(share * (1 - share) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    return share, center - reach, center + reach
