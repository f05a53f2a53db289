"""All measures of the gap between two platforms."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from realitygap._wording import counted
from realitygap.stats import (
    ALPHA,
    POWER,
    SMALLEST_N,
    Ends,
    Estimate,
    Method,
    RandomEffects,
    exact_share_interval,
    holm,
    mean_interval,
    pearson,
    percentile_interval,
    prove_equivalence,
    random_effects,
    range_of_differences,
    resampled_means,
    spearman,
)

from . import _resampling
from ._behavior import energy_distances, energy_test, smallest_energy_p
from ._level import mean_difference, rms_interval, rms_of, shares_above, skewed_interval, square_differences
from ._ranks import (
    Ties,
    fisher_interval,
    floor_interval,
    mean_maximum_rank_violation,
    mean_violation,
    mean_violation_interval,
    rank_violation_floor,
    rank_violation_interval,
    reliability,
    ties_on_one_side,
    trials_for_reliability,
)
from ._resampling import bootstrap, over_controllers
from ._result import GapResult
from ._side import GapSide, Values, trial_means

SEED = 7
"""Seed of every random draw in a measure, so that the same trials give the same numbers."""

RESAMPLES = 2_000

LEAST_RELIABILITY = 0.2
"""Less is noise above all: a correlation over a ceiling so low can be anything."""

WANTED_RELIABILITY = 0.5
"""Reliability for which the required number of trials is reported."""

LEAST_ORDERED = 3
"""Fewer controllers have no order that could be compared."""

_FEW_SPLITS = 6
"""Halves in each resample, whose number makes up for how few they are."""


def measure_gap(
    source: GapSide,
    target: GapSide,
    *,
    margin: float | None = None,
    misspecified: bool | None = None,
    ties: Ties = "both",
    paired: bool = False,
    resamples: int = RESAMPLES,
    seed: int = SEED,
) -> GapResult:
    """Measure the gap between a simulator and a target from trials of the same controllers on both.

    Args:
        source: The simulator's; row k is controller k.
        target: The target's, of the same controllers; the number of trials may differ.
        margin: Margin of equivalence in level, in units of quality. Without one, equivalence is not tested.
        misspecified: True if a check showed that the simulator cannot reproduce the observations.
        ties: Counting of pairs of controllers that tie on one platform only, in rank violations.
        paired: True if trial k of a controller had the same conditions on both sides, such as its start.
        resamples: Number of resamples of the bootstrap.
        seed: Seed of all random draws.

    Returns:
        All measures. What n cannot carry is refused there, with the n that would.

    Raises:
        ValueError: The sides differ in controllers, or a number is out of range.
    """
    if source.n != target.n:
        raise ValueError(
            f"{source.name} has {source.n} controllers and {target.name} {target.n}, expected the same ones."
        )
    if source.score_range != target.score_range:
        raise ValueError(
            f"{source.name} has scores from {source.score_range[0]:g} to {source.score_range[1]:g} and {target.name} "
            f"from {target.score_range[0]:g} to {target.score_range[1]:g}, expected the same score."
        )
    if margin is not None and not (math.isfinite(margin) and margin > 0):
        raise ValueError(f"margin is {margin}, expected a number above 0, such as 0.05.")
    if paired and not np.array_equal(source.counts, target.counts):
        raise ValueError(
            f"{source.name} and {target.name} have different numbers of trials, expected pairs of trials."
        )
    work = _Work(source, target, resamples, seed, ties, paired=paired)
    return GapResult(
        source.name,
        target.name,
        (source.label, target.label),
        (0 if source.are_means else source.trials, 0 if target.are_means else target.trials),
        rms=work.rms(),
        raw_rms=work.raw_rms(),
        level=work.level(),
        a12=work.a12(),
        srcc=work.srcc(),
        pearson=work.pearson(),
        srcc_disattenuated=work.disattenuated(),
        noise_ceiling=work.ceiling(),
        mmrv=work.mmrv(),
        mmrv_floor=work.mmrv_floor(),
        mean_violation=work.mean_violation(),
        energy=work.energy(
            source.cells.astype(float), target.cells.astype(float), "which cells were crossed"
        ),
        energy_ends=work.energy(source.ends, target.ends, "where trials end (observe track)"),
        equivalence=work.equivalence(margin),
        spread=work.spread(),
        each=work.each(),
        misspecified=misspecified,
        most_trials=(int(source.counts.max()), int(target.counts.max())),
        words=(source.in_words, target.in_words),
        paired=paired,
    )


class _Work:
    """Trials of both sides, the statistics of their resamples, and one method for each measure."""

    def __init__(
        self,
        source: GapSide,
        target: GapSide,
        n_resamples: int,
        seed: int,
        ties: Ties,
        *,
        paired: bool,
    ) -> None:
        self.source, self.target, self.n = source, target, source.n
        self.ties, self.paired = ties, paired
        self.n_resamples, self.seed = n_resamples, seed
        self.rng = rng = np.random.default_rng(seed)
        self.differences = range_of_differences(source.score_range)
        self.pair = source.values[None], target.values[None]
        self.fewest = min(source.trials, target.trials)
        self.alike = [side.name for side in (source, target) if np.ptp(side.means) == 0]
        self.drawn = bootstrap({"level": mean_difference}, source, target, n_resamples, rng, paired=paired)
        if self.n >= 2 and not self.alike:
            self._draw_orders()

    def _draw_orders(self) -> None:
        """Add statistics of ranks, and the reliability of both sides of the same resamples."""
        ranks: dict[str, _resampling.Statistic] = {"srcc": _srcc, "pearson": _pearson}
        if self._mmrv(*self.pair)[0] == 0:  # any other violation has an interval without resamples
            ranks["mmrv"] = self._mmrv
        if self.fewest >= 2 and self._floor() == 0:
            ranks["floor"] = lambda _, other: rank_violation_floor(other, self.rng, _FEW_SPLITS, self.ties)
        if self.fewest >= 2:
            ranks |= {
                "source": lambda one, _: reliability(one, self.rng, _FEW_SPLITS),
                "target": lambda _, other: reliability(other, self.rng, _FEW_SPLITS),
            }
        self.drawn |= bootstrap(
            ranks, self.source, self.target, self.n_resamples, self.rng, smooth=True, paired=self.paired
        )
        if self.fewest < 2:
            return
        self.reliabilities = tuple(float(reliability(values, self.rng)[0]) for values in self.pair)

    def _estimate(
        self, value: float, drawn: Values, change: Callable[[Values], Values] | None = None
    ) -> Estimate:
        ends = percentile_interval(drawn, self.n)
        if change is not None and ends is not None:
            low, high = change(np.array(ends))
            ends = float(low), float(high)
        return self._with_ends(value, ends)

    def _with_ends(self, value: float, ends: Ends | None, method: Method = "percentiles") -> Estimate:
        return over_controllers(value, ends, self.n, method)

    # level

    def level(self) -> Estimate:
        # lengthened residuals may leave the range that a difference can have
        drawn = np.clip(self.drawn["level"], *self.differences)
        return self._estimate(float(mean_difference(*self.pair)[0]), drawn)

    def _without_trials(self, what: str) -> str:
        """Return why one of the sides has too few trials, and what to do; empty if both have enough."""
        of_means = [side.name for side in (self.source, self.target) if side.are_means]
        if of_means:
            return (
                f"The scores of {' and '.join(of_means)} are means, without trials, so {what}. Give a row for each "
                "trial; for means of successes, --binary and the number of trials (n)."
            )
        if self.fewest < 2:
            some = "each controller" if self.most < 2 else "some controllers"
            return f"With one trial of {some}, {what}. Drive at least 2 of each on both sides."
        return ""

    @property
    def most(self) -> int:
        """Largest number of trials of a controller, on the side with fewer."""
        return int(min(self.source.counts.max(), self.target.counts.max()))

    def raw_rms(self) -> Estimate:
        differences = self.target.means - self.source.means
        squares = differences**2
        resampled = resampled_means(squares, self.n_resamples, self.rng.spawn(1)[0])
        return self._with_ends(
            float(rms_of(squares.mean())),
            rms_interval(differences, squares, resampled, most=self.differences[1]),
        )

    def rms(self) -> Estimate:
        if why := self._without_trials("noise and gap cannot be separated"):
            return Estimate.refusal(self.n, why)
        squares = square_differences(*self.pair, paired=self.paired)[0]
        value = float(rms_of(squares.mean()))
        resampled = resampled_means(squares, self.n_resamples, self.rng.spawn(1)[0])
        differences = self.target.means - self.source.means
        return self._with_ends(value, rms_interval(differences, squares, resampled, most=self.differences[1]))

    @cached_property
    def _model(self) -> RandomEffects | Estimate:
        """The hierarchical model of controllers and trials, or why there is none."""
        if why := self._without_trials("noise and spread cannot be separated"):
            return Estimate.refusal(self.n, why)
        differences = self.target.means - self.source.means
        return random_effects(differences, self._noise(), self.differences, noun="controllers")

    def _noise(self) -> Values:
        """Return the variance of each controller's difference of means by the trials of all, (c,).

        A few trials hardly tell the variance of one controller.
        """
        if self.paired:
            return _pooled_noise(self.target.values - self.source.values, self.source.counts)
        return sum(
            (_pooled_noise(side.values, side.counts) for side in (self.source, self.target)), np.zeros(self.n)
        )

    def spread(self) -> Estimate:
        return self._model if isinstance(self._model, Estimate) else self._model.spread

    def each(self) -> tuple[Estimate, ...]:
        """Return the expected difference of each controller, and p of no difference by its own trials."""
        if isinstance(self._model, Estimate):
            return ()
        z = (self.target.means - self.source.means) / np.sqrt(self._noise())
        freedom = int((self.target.counts - 1).sum()) + (
            0 if self.paired else int((self.source.counts - 1).sum())
        )
        corrected = holm(2 * scipy.special.stdtr(freedom, -np.abs(z)))
        return tuple(
            replace(one, more={"p": p}) for one, p in zip(self._model.each, corrected.tolist(), strict=True)
        )

    def a12(self) -> Estimate:
        if self.source.are_means or self.target.are_means:
            return Estimate.refusal(self.n, self._without_trials("single trials cannot be compared"))
        shares = shares_above(self.source.values, self.target.values)
        value = float(shares.mean())
        if self.n >= SMALLEST_N and value in (0.0, 1.0):
            # all samples are alike; so many controllers could have come out so of a share a little off
            return exact_share_interval(self.n if value else 0, self.n)
        return mean_interval(shares, (0.0, 1.0), noun="controllers")

    # order

    def _few(self) -> str:
        """Return the reason why these controllers support no claim about their order."""
        if self.n == 1:
            return f"One controller has no order. At least {SMALLEST_N} are needed."
        return (
            f"With {counted(self.n, 'controller')}, an order is too likely by chance (a perfect one in 1 of "
            f"{math.factorial(self.n)}). At least {SMALLEST_N} are needed."
        )

    def _no_order(self, least: int = LEAST_ORDERED) -> Estimate | None:
        if self.n < least:
            return Estimate.refusal(self.n, self._few())
        if self.alike:
            return Estimate.refusal(
                self.n,
                f"On {' and '.join(self.alike)} all controllers do equally well, so there is no order. Try "
                "controllers that differ.",
            )
        return None

    def _of_order(self, value: float, ends: Callable[[], Estimate]) -> Estimate:
        """Return a number about the order of controllers, without an interval if they are few."""
        if self.n < SMALLEST_N:
            return Estimate(value, None, None, self.n, self._few(), needed=SMALLEST_N)
        return ends()

    def srcc(self) -> Estimate:
        return self._no_order() or self._correlation(float(_srcc(*self.pair)[0]), "srcc")

    def pearson(self) -> Estimate:
        return self._no_order() or self._correlation(float(_pearson(*self.pair)[0]), "pearson")

    def _correlation(self, value: float, name: str) -> Estimate:
        return self._of_order(value, lambda: self._estimate(value, self.drawn[name]))

    def _mmrv(self, source: Values, target: Values) -> Values:
        return mean_maximum_rank_violation(trial_means(source), trial_means(target), self.ties)

    def mmrv(self) -> Estimate:
        refused = self._no_order()
        if refused:
            return refused
        value, means = float(self._mmrv(*self.pair)[0]), (self.source.means, self.target.means)

        def ends() -> Estimate:
            if value == 0:
                return self._estimate(value, self.drawn["mmrv"])
            return self._with_ends(value, rank_violation_interval(*means, ties=self.ties), "t")

        return replace(self._of_order(value, ends), more={"ties": ties_on_one_side(*means)})

    def mean_violation(self) -> Estimate:
        refused = self._no_order()
        if refused:
            return refused
        means = (self.source.means, self.target.means)
        value = mean_violation(*means, self.ties)

        def ends() -> Estimate:
            if value == 0:
                why = "No pair is violated, so the spread of violations is unknown."
                return Estimate(value, None, None, self.n, why)
            return self._with_ends(value, mean_violation_interval(*means, ties=self.ties), "t")

        return self._of_order(value, ends)

    def _no_halves(self) -> Estimate | None:
        if why := self._without_trials("there are no halves to compare"):
            return Estimate.refusal(self.n, why)
        return self._no_order(SMALLEST_N)

    def ceiling(self) -> Estimate:
        refused = self._no_halves()
        if refused:
            return refused
        value = float(np.sqrt(np.prod(self.reliabilities)))
        drawn = np.sqrt(self.drawn["source"] * self.drawn["target"])
        return self._with_ends(value, fisher_interval(value, drawn, self.n), "Fisher z")

    def disattenuated(self) -> Estimate:
        refused = self._no_halves() or self._unreliable()
        if refused:
            return refused
        drawn = self.drawn
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios = drawn["srcc"] / np.sqrt(drawn["source"] * drawn["target"])
        value = float(_srcc(*self.pair)[0] / np.sqrt(np.prod(self.reliabilities)))
        ratio = self._estimate(_within_one(value), ratios, lambda end: np.clip(end, -1.0, 1.0))
        return replace(ratio, more={"unclipped": value})

    def _unreliable(self) -> Estimate | None:
        for side, found in zip((self.source, self.target), self.reliabilities, strict=True):
            if found < LEAST_RELIABILITY:
                trials = trials_for_reliability(found, side.trials, WANTED_RELIABILITY)
                would = (
                    f"{trials} trials of each controller are needed"
                    if trials is not None
                    else "more trials must first show that controllers differ"
                )
                return Estimate.refusal(
                    self.n,
                    f"{side.name} does not repeat its own order (reliability {found:.2f} with {side.trials} "
                    f"trials of each controller), so the correlation cannot be corrected for noise; {would}.",
                )
        return None

    def mmrv_floor(self) -> Estimate:
        refused = self._no_halves()
        if refused:
            return refused
        value = self._floor()
        if value == 0:
            return self._estimate(value, self.drawn["floor"])
        return self._with_ends(
            value, floor_interval(self.target.values, self._halving(), ties=self.ties), "t"
        )

    def _floor(self) -> float:
        return float(rank_violation_floor(self.target.values[None], self._halving(), ties=self.ties)[0])

    def _halving(self) -> np.random.Generator:
        """Return the generator of the halves of the floor, always the same ones."""
        return np.random.default_rng(self.seed)

    # behavior

    def energy(self, one: Values, other: Values, what: str) -> Estimate:
        if not (len(one) and len(other)):
            return Estimate.refusal(self.n, f"No data on {what} on both sides.")
        if self.fewest < 2:
            return Estimate.refusal(
                self.n, "An energy distance needs 2 trials of each controller on both sides."
            )
        distances = energy_distances(one, other)
        mean = float(distances.mean())
        error = float(distances.std(ddof=1)) / math.sqrt(self.n) if self.n > 1 else 0.0
        resampled = resampled_means(distances, self.n_resamples, self.rng)
        estimate = self._with_ends(mean, skewed_interval(mean, error, resampled, self.n))
        smallest = smallest_energy_p(self.n, self.source.trials, self.target.trials)
        p = energy_test(one, other, self.rng) if smallest < ALPHA else None
        more = {"p": p}
        why = (
            ""
            if p is not None
            else f"The number of trials allows no p below {smallest:.2f}; twice as many do. "
        )
        return replace(estimate, refused=(why + estimate.refused).strip(), more=more)

    # equivalence

    def equivalence(self, margin: float | None) -> Estimate:
        if self.n < 2:
            return Estimate.refusal(
                self.n,
                "With one controller, the spread of differences is unknown. At least 5 are needed.",
                margin=margin,
            )
        equivalence = prove_equivalence(
            self.target.means - self.source.means, margin, self.source.score_range
        )
        more: dict[str, float | None] = {"margin": margin, "equivalent": equivalence.equivalent}
        why = ""
        if margin is None:
            why = "No margin was given (--margin), so equivalence is not tested."
        else:
            more["p"] = equivalence.p
            if not equivalence.equivalent and (equivalence.power or 0.0) < POWER:
                more["equivalent"] = None
                why = _too_few(self.n, margin, equivalence.power or 0.0, equivalence.needed)
        return replace(
            equivalence.difference, refused=why, more=more, needed=equivalence.needed if why else None
        )


def _too_few(n: int, margin: float, power: float, needed: int | None) -> str:
    would = f"{needed:,} do so in 80 of 100" if needed is not None else "no number of controllers is enough"
    return (
        f"{n} controllers show equivalence at ±{margin:g} in {100 * power:.0f} of 100 studies, even if there "
        f"is no difference; {would}."
    )


def _within_one(value: float) -> float:
    return max(-1.0, min(1.0, value))


def _pooled_noise(values: Values, counts: NDArray[np.int64]) -> Values:
    """Return the variance of the mean of each controller's trials by the scatter of the trials of all, (c,)."""
    squares = np.nansum((values - trial_means(values)[:, None]) ** 2)
    return np.asarray(squares / max(1, int((counts - 1).sum())) / counts)


def _srcc(source: Values, target: Values) -> Values:
    return spearman(trial_means(source), trial_means(target))


def _pearson(source: Values, target: Values) -> Values:
    return pearson(trial_means(source), trial_means(target))
