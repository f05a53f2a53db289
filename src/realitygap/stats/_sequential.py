"""Tests and intervals that stay valid at any number of looks: of paired differences, and of one mean.

All of them bet against a hypothesis, one value at a time. If the hypothesis is true, no bet gains on average. The
product of the bets then exceeds 1/alpha with a probability of at most alpha, at any of all looks (Ville 1939).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from ._estimate import Estimate, Method, Values
from ._permutation import ALPHA

LAMBDAS = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
"""Stakes of the sign-symmetric bets, for scores in [0, 1]. Their mean needs no knowledge of the spread."""

BINARY_LAMBDAS = tuple(round(math.atanh(part / 20), 6) for part in range(1, 20))
"""Stakes for successes and failures, whose differences are -1, 0, and 1: bets of 5 %, 10 %, ..., 95 %."""

Null = Literal["distribution", "mean"]
"""The hypothesis: that both have the same distribution of scores, or the same mean."""

SequentialVerdict = Literal["higher", "lower", "equivalent", "open"]
"""Result of a look: the first of two is higher or lower, both are equivalent at the margin, or neither is shown."""

SHIFT_STEP = 0.001
"""Distance of the shifts that are tested for an interval. Its ends are the outermost shifts that are rejected."""

_SHIFTS = np.round(np.arange(-1000, 1001) * SHIFT_STEP, 3)

_LARGEST_BET = 0.9
_PRIOR_SQUARES = 0.25
"""Limits of the bets against a mean: 0.9 of what can be lost, and one earlier difference of 0.5."""

MEAN_GRID = 200
"""Number of means that are tested for the interval of one mean."""

_PRIOR_VARIANCE = 0.05
"""Variance of scores before the first one, which counts as one value."""


@dataclass(frozen=True)
class SequentialTest:
    """A test of paired differences in [-1, 1] after each pair, whose settings are fixed before the first one.

    Attributes:
        alpha: Probability of a wrong claim, at any of all looks.
        null: `distribution`: the sign-symmetric test. Its hypothesis is that both of a pair have the same distribution,
            so that a difference and its negative are equally likely. `mean`: bounded betting. Its hypothesis is that
            the differences have mean 0. It needs more pairs if scores vary little.
        margin: Margin of equivalence; None to test no equivalence.
        lambdas: Stakes of the sign-symmetric bets. Take `BINARY_LAMBDAS` if all scores are 0 or 1.

    Raises:
        ValueError: A setting is out of range.

    Source: de la Peña (1999), Annals of Probability 27(1), 537-564, for sums of symmetric variables; Ramdas, Ruf,
    Larsson & Koolen (2020), arXiv 2009.03167, section 5, for tests of symmetry by betting; Waudby-Smith & Ramdas
    (2024), Journal of the Royal Statistical Society B 86(1), for bounded means.
    Differs: The bet is 1 + tanh(λ d), averaged over a fixed grid of λ and over both signs.
    """

    alpha: float = ALPHA
    null: Null = "distribution"
    margin: float | None = None
    lambdas: tuple[float, ...] = LAMBDAS

    def __post_init__(self) -> None:
        if not 0 < self.alpha < 1:
            raise ValueError(f"alpha is {self.alpha}, expected a number above 0 and below 1.")
        if self.null not in get_args(Null):
            raise ValueError(f"null is {self.null!r}, expected distribution or mean.")
        if self.margin is not None and not 0 < self.margin < math.inf:
            raise ValueError(f"margin is {self.margin}, expected a number above 0, such as 0.05.")
        if not self.lambdas or not all(0 < each < math.inf for each in self.lambdas):
            raise ValueError(f"lambdas is {self.lambdas}, expected numbers above 0.")

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, from which `from_dict` makes the test."""
        return {"alpha": self.alpha, "null": self.null, "margin": self.margin, "lambdas": list(self.lambdas)}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> SequentialTest:
        """Return the test with these settings."""
        return cls(values["alpha"], values["null"], values["margin"], tuple(values["lambdas"]))

    @property
    def fewest(self) -> int:
        """Smallest number of pairs after which a claim is possible: each bet at most doubles what it risks."""
        return math.floor(math.log2(2 / self.alpha)) + 1

    def log_sides(self, differences: Values, shift: float = 0.0) -> tuple[Values, Values]:
        """Return the logarithms of both halves of E after each pair.

        They bet that differences are above a shift, and below it. E is their sum.

        Args:
            differences: (..., k) differences in [-1, 1], in the order of the pairs.
            shift: The center of the differences that is tested.

        Returns:
            Two arrays (..., k).
        """
        if self.null == "mean":
            above, below = _log_bets(differences, shift)
        else:
            above, below = _log_signs(differences - shift, self.lambdas)
        return above - math.log(2), below - math.log(2)

    def log_e(self, differences: Values, shift: float = 0.0) -> Values:
        """Return log E after each pair, (..., k), for differences (..., k)."""
        return np.asarray(np.logaddexp(*self.log_sides(differences, shift)))

    def stops(self, differences: Values) -> npt.NDArray[np.int64]:
        """Return the number of pairs after which each of many studies ends; 0 if it does not.

        A study ends when a difference is claimed, or equivalence if there is a margin.

        Args:
            differences: (..., k) differences of each study, in the order of the pairs.
        """
        bar = -math.log(self.alpha)
        ends = self.log_e(differences) >= bar
        if self.margin is not None:
            is_within = [
                np.logical_or.accumulate(self.log_sides(differences, shift)[side] >= bar, axis=-1)
                for shift, side in ((-self.margin, 0), (self.margin, 1))
            ]
            ends |= is_within[0] & is_within[1]
        return np.where(ends.any(axis=-1), ends.argmax(axis=-1) + 1, 0)

    def look(self, differences: Values) -> Look:
        """Return what is known after the last of some pairs, all looks before it included.

        Args:
            differences: (k,) differences in [-1, 1], first of two minus second, in the order of the pairs.

        Raises:
            ValueError: A difference is not finite, or outside [-1, 1].
        """
        values = _checked(differences, -1.0, 1.0, "differences")
        n, bar = len(values), -math.log(self.alpha)
        log_e = self.log_e(values) if n else np.zeros(0)
        shift = self._interval(values)
        verdict: SequentialVerdict = "open"
        first = int((log_e >= bar).argmax()) if (log_e >= bar).any() else None
        if first is not None:
            above, below = self.log_sides(values[: first + 1])
            verdict = "higher" if above[-1] > below[-1] else "lower"
        elif self.margin is not None and shift.ends is not None:
            is_within = (
                -self.margin <= shift.ends[0] and shift.ends[1] <= self.margin
            )  # both ends are rejected
            verdict = "equivalent" if is_within else "open"
        at_end = float(np.exp(min(log_e[-1], 700.0))) if n else 1.0
        return Look(self, n, at_end, shift, verdict, None if first is None else first + 1)

    def _interval(self, values: Values) -> Estimate:
        """Return the mean difference with the shifts that no look rejected."""
        n, bar = len(values), -math.log(self.alpha)
        if not n:
            return Estimate.refusal(0, "There is no complete pair.")
        is_open = np.ones(len(_SHIFTS), np.bool_)
        for log_e in self._log_e_of_shifts(values):
            is_open &= log_e < bar
        mean = float(values.mean())
        if not is_open.any():
            return Estimate(mean, None, None, n, "The differences are not symmetric about any center.")
        first, last = int(is_open.argmax()), len(_SHIFTS) - 1 - int(is_open[::-1].argmax())
        low, high = float(_SHIFTS[max(first - 1, 0)]), float(_SHIFTS[min(last + 1, len(_SHIFTS) - 1)])
        method: Method = "sign-symmetric" if self.null == "distribution" else "betting"
        return Estimate(mean, low, high, n, level=1 - self.alpha, method=method)

    def _log_e_of_shifts(self, values: Values) -> Any:
        """Yield log E of each shift after each pair."""
        if self.null == "mean":
            above, below = _log_bets(values[None, :], _SHIFTS[:, None])
            yield from np.logaddexp(above, below).T - math.log(2)
            return
        stakes = np.array(self.lambdas)[:, None]
        up, down = (np.zeros((len(self.lambdas), len(_SHIFTS))) for _ in range(2))
        for value in values:
            x = 2.0 * stakes * (value - _SHIFTS)
            gain = math.log(2) - np.logaddexp(0.0, -x)
            up += gain
            down += gain - x
            yield np.logaddexp(_log_mean(up, 0), _log_mean(down, 0)) - math.log(2)


@dataclass(frozen=True)
class Look:
    """The state of a test after some pairs.

    Attributes:
        test: The test.
        n: Number of pairs.
        e: E after the last pair: what 1 became by bets against the hypothesis.
        shift: Mean difference, with the interval of shifts that no look rejected. It is the interval of the center of
            the differences if they are symmetric about it, or of their mean (`null="mean"`). The mean at a stop
            overstates the difference, and the interval does not.
        verdict: What is shown.
        claimed_at: Number of pairs at which E reached 1/alpha; None if it has not.
    """

    test: SequentialTest
    n: int
    e: float
    shift: Estimate
    verdict: SequentialVerdict
    claimed_at: int | None = None

    @property
    def is_stop(self) -> bool:
        """True if something is shown, so that no more pairs are needed."""
        return self.verdict != "open"

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        about = {"pairs": self.n, "e": self.e, "verdict": self.verdict, "claimed_at": self.claimed_at}
        return about | {"shift": self.shift.to_dict(), "test": self.test.to_dict()}


def _checked(values: npt.ArrayLike, low: float, high: float, name: str) -> Values:
    checked = np.asarray(values, dtype=np.float64)
    if checked.ndim != 1:
        raise ValueError(f"{name} have shape {checked.shape}, expected (k,).")
    slack = 1e-9
    outside = ~((checked >= low - slack) & (checked <= high + slack))
    if outside.any():
        raise ValueError(f"{name} contain {checked[outside][0]}, expected numbers from {low:g} to {high:g}.")
    return checked


def _log_mean(logs: Values, axis: int) -> Values:
    """Return the logarithm of the mean of numbers whose logarithms are given."""
    return np.asarray(np.logaddexp.reduce(logs, axis=axis) - math.log(logs.shape[axis]))


def _log_signs(differences: Values, lambdas: tuple[float, ...]) -> tuple[Values, Values]:
    """Return log mean_λ Π (1 ± tanh(λ d)) after each pair."""
    above, below = [], []
    for stake in lambdas:
        x = 2.0 * stake * differences
        gain = math.log(2) - np.logaddexp(0.0, -x)  # log(1 + tanh(x / 2))
        above.append(np.cumsum(gain, axis=-1))
        below.append(np.cumsum(gain - x, axis=-1))
    return _log_mean(np.array(above), 0), _log_mean(np.array(below), 0)


def _log_bets(differences: Values, shift: float | Values) -> tuple[Values, Values]:
    """Return log Π (1 ± g (d − shift)) after each pair; each bet g follows from the pairs before.

    A bet is at most 0.9 of the one that could lose everything.
    """
    centered = differences - shift
    sums = np.cumsum(centered, axis=-1) - centered
    squares = np.cumsum(centered**2, axis=-1) - centered**2
    wanted = sums / (squares + _PRIOR_SQUARES)
    logs = []
    for sign in (1.0, -1.0):
        most = _LARGEST_BET / np.maximum(1.0 + sign * shift, SHIFT_STEP)
        bets = np.clip(sign * wanted, 0.0, most)
        logs.append(np.cumsum(np.log1p(sign * bets * centered), axis=-1))
    return logs[0], logs[1]


# several comparisons


def mean_e(e: npt.ArrayLike) -> float:
    """Return one e-value against the hypothesis that none of several comparisons has a difference: the mean.

    Source: Vovk & Wang (2021), Annals of Statistics 49(3), 1736-1754, section 3.
    """
    return float(np.mean(np.asarray(e, dtype=np.float64)))


def e_holm(e: npt.ArrayLike) -> Values:
    """Return e-values of a family, corrected so that one false claim in the whole family has its level.

    Args:
        e: (m,) e-values in any order.

    Returns:
        (m,) e-values in the same order: the largest over m, the next over m - 1 and so on, none above the one before
        it. A difference is claimed if its corrected value is at least 1/alpha.

    Source: Holm (1979), Scandinavian Journal of Statistics 6(2), with 1/e for p: Vovk & Wang (2021), section 4.
    Differs: Vovk & Wang's own procedure averages e-values, and is not limited to steps down.
    """
    values = np.asarray(e, dtype=np.float64)
    order = np.argsort(-values, kind="stable")
    corrected = np.empty(len(values))
    corrected[order] = np.minimum.accumulate(values[order] / np.arange(len(values), 0, -1))
    return corrected


# one mean


def betting_mean(values: npt.ArrayLike, *, alpha: float = ALPHA) -> Estimate:
    """Return the mean of one controller's scores, with an interval that is valid at any of all looks.

    It needs about 40 trials to be useful. For fewer, compare two controllers, or fix the number of trials.

    Args:
        values: (t,) scores in [0, 1], in the order of the trials.
        alpha: Probability that the interval ever misses the mean.

    Raises:
        ValueError: A score is not finite, or outside [0, 1]; or alpha is not between 0 and 1.

    Source: Waudby-Smith & Ramdas (2024), Journal of the Royal Statistical Society B 86(1), section 4: the hedged
    confidence sequence with predictable plug-in bets.
    Differs: 200 means are tested. The variance starts at 0.05, and a bet is at most half of what can be lost.
    """
    scores = _checked(values, 0.0, 1.0, "values")
    SequentialTest(alpha)  # checks alpha
    t = len(scores)
    if not t:
        return Estimate.refusal(0, "There is no trial.")
    step = 1 / MEAN_GRID
    means = (np.arange(MEAN_GRID) + 0.5) * step
    at = np.arange(1, t + 1)
    running = (0.5 + np.cumsum(scores)) / (at + 1)
    squares = (_PRIOR_VARIANCE + np.cumsum((scores - running) ** 2)) / (at + 1)
    before = np.concatenate([[_PRIOR_VARIANCE], squares[:-1]])
    wanted = np.sqrt(2 * math.log(2 / alpha) / (before * at * np.log1p(at)))
    centered = scores[:, None] - means
    logs = [
        np.cumsum(np.log1p(sign * np.minimum(wanted[:, None], 0.5 / reach) * centered), axis=0)
        for sign, reach in ((1.0, means), (-1.0, 1 - means))
    ]
    is_open = (np.maximum(*logs) - math.log(2) < -math.log(alpha)).all(axis=0)
    mean = float(scores.mean())
    if not is_open.any():  # the truth is between two of the means
        return Estimate(mean, mean, mean, t, level=1 - alpha, method="betting")
    low, high = means[is_open][0] - step / 2, means[is_open][-1] + step / 2
    return Estimate(mean, float(max(low, 0.0)), float(min(high, 1.0)), t, level=1 - alpha, method="betting")
