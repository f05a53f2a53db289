"""The numbers of controllers and trials needed for an effect, for equivalence, or for a correlation."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from realitygap.errors import check_finite

from ._correlation import attenuated, correlation_error, spearman
from ._estimate import Values
from ._means import SMALLEST_N
from ._permutation import ALPHA
from ._shares import root, share_interval

POWER = 0.8
"""Statistical power for which the required n is reported."""

MOST_CONTROLLERS = 100_000
MOST_RUNS = 1_000_000
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
    is_detected = np.abs(means) > float(scipy.special.stdtrit(n - 1, 1 - ALPHA / 2)) * errors
    return _needed(trials, n, is_detected)


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
    effect = detectable_effect(n, paired=True, power=power)
    return (effect or 0.0) * spread_of_differences(spread, noise, trials)


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
    reach = float(scipy.special.stdtrit(n - 1, 1 - ALPHA)) * errors
    return _needed(trials, n, np.abs(means) + reach < margin)


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
    while n is not None and n <= MOST_CONTROLLERS:
        correlations = _simulated_correlations(correlation, reliability, floor, n, seed)
        needed, share = _needed(trials, n, correlations), float(correlations.mean())
        # fewer studies give a wider interval, which is no reason for more controllers
        if (needed.low or 0.0) >= power - SHORT_OF * math.sqrt(SIMULATED / len(correlations)):
            return needed
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


def _z_power(seen: float, floor: float, n: int) -> float:
    apart = (math.atanh(seen) - math.atanh(floor)) / correlation_error(seen, n)
    return float(scipy.special.ndtr(apart - scipy.special.ndtri(1 - ALPHA)))


def _reach(power: float) -> float:
    """Return the distance of a correlation from the floor for a power, in standard errors; it grows with sqrt(n)."""
    return float(scipy.special.ndtri(max(power, 2 * ALPHA)) + scipy.special.ndtri(1 - ALPHA))


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
    return np.asarray(np.arctanh(seen) - scipy.special.ndtri(1 - ALPHA) * errors > math.atanh(floor))


def _needed(trials: int, n: int, found: NDArray[np.bool_]) -> Needed:
    """Return n controllers with the share of simulated studies that detect the effect."""
    share = share_interval(int(found.sum()), len(found))
    return Needed(trials, n, share.value, share.low, share.high)


# power


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
    critical = float(scipy.special.stdtrit(n - 1, 1 - ALPHA))
    scale = math.sqrt(n) / spread
    passes = sum(_above(n - 1, side * scale, critical) for side in (margin - difference, margin + difference))
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


def fewest_pairs(effect: float, spread: float, power: float = POWER, alpha: float = ALPHA) -> int | None:
    """Return the fewest pairs with which a paired t test finds a mean difference; None above 100,000.

    Args:
        effect: Mean difference.
        spread: Standard deviation of a difference, above 0.
        power: Probability of detecting it.
        alpha: Two-sided level.
    """
    return fewest(lambda n: _t_power(effect / spread, n, alpha=alpha), power)


def runs_needed(effect: float, *, paired: bool, alpha: float = ALPHA) -> int | None:
    """Runs a condition with which a t test finds a difference of `effect` standard deviations so often.

    Args:
        effect: Difference of means over the standard deviation of a run (`paired`: of a difference).
        paired: True if runs come in pairs.
        alpha: Two-sided level.

    Returns:
        The number, at least 2; None above a million.

    Source: Cohen (1988), chapter 2, by the noncentral t distribution. It assumes normal values; the
    permutation tests here need about as many.
    """
    return fewest(lambda n: _t_power(effect, n, paired, alpha), POWER, most=MOST_RUNS)


@functools.lru_cache
def detectable_effect(n: int, *, paired: bool, alpha: float = ALPHA, power: float = POWER) -> float | None:
    """Return the smallest difference [standard deviations] that n runs of each condition detect; None below 2 runs.

    Args:
        n: Number of runs, or of pairs.
        paired, alpha: Arguments of `runs_needed`.
        power: Probability of detecting it.

    Source: as `runs_needed`.
    """
    if n < 2:
        return None
    high = 1.0
    while _t_power(high, n, paired, alpha) < power:
        high *= 2
    return root(lambda effect: _t_power(effect, n, paired, alpha) - power, 0.0, high)


def _t_power(effect: float, n: int, paired: bool = True, alpha: float = ALPHA) -> float:
    """Return the power of a two-sided t test for an effect in standard deviations."""
    freedom = n - 1 if paired else 2 * n - 2
    center = abs(effect) * math.sqrt(n if paired else n / 2)
    critical = float(scipy.special.stdtrit(freedom, 1 - alpha / 2))
    # a difference found with the wrong sign; beyond 3 it is less than one in 10 million
    wrong = float(scipy.special.nctdtr(freedom, center, -critical)) if center < 3 else 0.0
    return _above(freedom, center, critical) + (wrong if math.isfinite(wrong) else 0.0)


def _above(freedom: int, center: float, critical: float) -> float:
    """Return the probability that noncentral t is above a critical value."""
    share = 1.0 - float(scipy.special.nctdtr(freedom, center, critical))
    # so far out the noncentral distribution cannot be computed, and a normal one will do
    return share if math.isfinite(share) else float(scipy.special.ndtr(center - critical))
