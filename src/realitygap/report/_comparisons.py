"""Comparisons between conditions: size and certainty of each difference, and the limits set by the number of runs."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap._wording import (
    bracketed,
    equivalence_verdict,
    few_runs_verdict,
    higher_verdict,
    inconclusive_verdict,
    p_in_words,
    signed,
)
from realitygap.report._champions import FRESH_TRIALS, Champions
from realitygap.report._table import Cell, Column, Part, Row, TableOnPage
from realitygap.report._tally import DescribedCondition, Results, Tally, label_of, read_tally, settings_of
from realitygap.stats import (
    ALPHA,
    BCA_SMALLEST_N,
    CONFIDENCE,
    RESAMPLES,
    Estimate,
    a12,
    bca_intervals,
    detectable_effect,
    difference_interval,
    difference_of_means,
    holm,
    mean_interval,
    newcombe_interval,
    permutation_p,
    runs_for_a_claim,
    runs_needed,
    share_above,
    sign_flip_p,
    smallest_p,
)

MARGIN = 0.02
"""Difference of mean coverage up to which conditions count as equivalent: 1.4 of the paper's 72 cells, and about half
of the smallest effect of the constant input."""

Reason = Literal["noise", "selection", "baseline"]
"""Reason for a comparison: two conditions differ in nothing else, or one names the other as its baseline."""


@dataclass(frozen=True)
class Comparison:
    """Two conditions on the best coverage of a run, as recorded or on fresh noise.

    Attributes:
        one: First condition.
        other: Condition with which it is compared.
        reason: Reason for the comparison.
        label: SIM, TWIN, EMULATED or REAL; both if they differ.
        n: Number of runs of `one`, or of pairs if `paired`.
        n_other: Number of runs of `other`.
        paired: True if the two draw the same random numbers run by run, so that runs are compared in pairs.
        difference: Mean of `one` minus mean of `other` [share of the reachable cells], with its BCa interval.
        a12: Probability that a run of `one` is above a run of `other` [0..1], with its BCa interval, or Newcombe's if n
            is too small for it. It has none if n cannot give p < 0.05.
        p: Two-sided p of a permutation test of the difference.
        p_holm: P value corrected for all comparisons of the study.
        best_p: Smallest possible `p_holm` with this number of runs.
        runs_for_a_claim: Smallest number of runs with which `p_holm` can be below 0.05.
        detectable: Smallest difference that n runs detect in 80 of 100 studies, at 5 % divided by the number of
            comparisons; None without spread.
        runs_for_difference: Number of runs that detect the observed difference in 80 of 100 studies; None above a
            million.
        equivalence_interval: The difference with its 90 % interval by t, which lies within `MARGIN` if the conditions
            are equivalent (two one-sided tests at 5 %); without one with fewer than 10 runs.
    """

    one: str
    other: str
    reason: Reason
    label: str
    n: int
    n_other: int
    paired: bool
    difference: Estimate
    a12: Estimate
    p: float
    p_holm: float
    best_p: float
    runs_for_a_claim: int
    detectable: float | None
    runs_for_difference: int | None
    equivalence_interval: Estimate

    @property
    def can_claim(self) -> bool:
        """True if this number of runs could show any difference."""
        return self.best_p < ALPHA

    @property
    def is_shown(self) -> bool:
        """True if the difference is claimed."""
        return self.p_holm < ALPHA

    @property
    def size(self) -> float:
        """The difference as a number; 0 without runs."""
        return self.difference.value or 0.0

    def seen_from(self, condition: str) -> Comparison:
        """Return the comparison with this one of its two conditions first.

        The runs and A12 of both sides change places.
        """
        if condition == self.one:
            return self
        return replace(
            self,
            one=self.other,
            other=self.one,
            n=self.n_other,
            n_other=self.n,
            difference=self.difference.mirrored(0.0),
            a12=self.a12.mirrored(1.0),
            equivalence_interval=self.equivalence_interval.mirrored(0.0),
        )

    @property
    def verdict(self) -> str:
        """The conclusion on the difference and, if none is shown, on equivalence, in words."""
        if self.equivalence and not self.is_shown and self.can_claim:
            return f"{self.difference_verdict}; {self.equivalence}"
        return self.difference_verdict

    @property
    def is_equivalent(self) -> bool | None:
        """True if equivalence within `MARGIN` is shown; None if there are too few runs."""
        return is_within(self.equivalence_interval)

    @property
    def equivalence(self) -> str:
        """Result of the test of equivalence in words, with the margin; empty if there are too few runs."""
        if self.is_equivalent is None:
            return ""
        return equivalence_verdict(self.is_equivalent, MARGIN, self.equivalence_interval)

    @property
    def difference_verdict(self) -> str:
        """The conclusion on the difference, in words."""
        if not self.can_claim:
            n = min(self.n, self.n_other)
            detail = f": with n = {n} corrected p cannot be below {p_in_words(self.best_p)}"
            return f"{few_runs_verdict(self.runs_for_a_claim, detail)} at least"
        if self.is_shown:
            return higher_verdict(self.one, self.other, self.size)
        n = min(self.n, self.n_other)
        return inconclusive_verdict(n, self.detectable, self.runs_for_difference)

    @property
    def conclusion(self) -> str:
        """The conclusion in two words, for a table that has the numbers."""
        if not self.can_claim:
            return "too few runs"
        if self.is_shown:
            return "first higher" if self.size > 0 else "first lower"
        return "equivalent" if self.is_equivalent else "inconclusive"


def is_within(difference: Estimate) -> bool | None:
    """Return whether the interval of a difference lies within `MARGIN`; None without one."""
    return None if difference.ends is None else difference.ends[0] > -MARGIN and difference.ends[1] < MARGIN


def compare_conditions(folder: Results) -> list[Comparison]:
    """Conditions of a study in pairs, on the best coverage of each run.

    Compared are conditions that differ in the noise level alone, in the selection alone, and every condition
    with its baseline. The test is a permutation test of the difference of means: signs are flipped where the
    conditions draw the same random numbers run by run, else runs are relabeled. It is exact for any
    distribution and any n, and tests the very difference that is shown with it.

    Args:
        folder: Results of a study, or the path to them.

    Returns:
        The comparisons: across noise, across selections, against baselines. Empty if there is nothing to compare.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
    """
    tally = read_tally(folder)
    return _compare((*pair, paired_values(tally, pair[0]["name"], pair[1]["name"])) for pair in _pairs(tally))


def compare_champions(folder: Results, champions: Sequence[Champions]) -> list[Comparison]:
    """Compare conditions as `compare_conditions` does, on the coverage of each run's best network on fresh noise.

    The best coverage of a run selected its network, so luck is part of it. These values contain no luck of selection.

    Args:
        folder: Results of a study, or the path to them.
        champions: Its best networks on fresh noise, from `retry_champions`.

    Returns:
        The comparisons, corrected over all of them; pairs without fresh trials of both are left out.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
    """
    tally = read_tally(folder)
    by_name = {each.condition: each for each in champions if not each.problem}
    return _compare(
        (one, other, reason, _paired_champions(tally, by_name[one["name"]], by_name[other["name"]]))
        for one, other, reason in _pairs(tally)
        if {one["name"], other["name"]} <= set(by_name)
    )


def _compare(
    pairs: Iterable[tuple[DescribedCondition, DescribedCondition, Reason, Samples]],
) -> list[Comparison]:
    parts = [pair for pair in pairs if min(len(pair[-1].one), len(pair[-1].other))]
    raw = np.array([values.p() for *_, values in parts])
    floors = np.array([values.smallest_p() for *_, values in parts])
    corrected, best = holm(raw), holm(floors)
    return [
        _comparison(*part, len(parts), float(raw[k]), float(corrected[k]), float(best[k]))
        for k, part in enumerate(parts)
    ]


@dataclass(frozen=True)
class Samples:
    """Best coverages of two conditions.

    Attributes:
        one: (n,) values of the first condition.
        other: (m,) values of the second condition; in pairs, value by value, if `paired`.
        paired: True if runs draw the same random numbers.
        trials: Number of trials of which each value is the mean, so that `trials` times a value is a share of cells.
    """

    one: npt.NDArray[np.float64]
    other: npt.NDArray[np.float64]
    paired: bool
    trials: int = 1

    def p(self) -> float:
        """Two-sided p of the difference of means, by permutation."""
        if not self.paired:
            return permutation_p(self.one, self.other)
        return sign_flip_p(
            (self.one - self.other) * self.trials
        )  # p has no unit, and shares are counted exactly

    def smallest_p(self) -> float:
        """The smallest `p` possible with this number of runs."""
        return smallest_p(len(self.one), None if self.paired else len(self.other), as_drawn=True)

    def spread(self) -> float:
        """Standard deviation of a difference, or of a run (pooled); NaN with fewer than two."""
        if len(self.one) < 2 or len(self.other) < 2:
            return math.nan
        if self.paired:
            return float((self.one - self.other).std(ddof=1))
        n, m = len(self.one), len(self.other)
        pooled = ((n - 1) * self.one.var(ddof=1) + (m - 1) * self.other.var(ddof=1)) / (n + m - 2)
        return math.sqrt(float(pooled))

    def equivalence_interval(self) -> Estimate:
        """The difference with its 90 % interval by t, for two one-sided tests at 5 %; without one below 10 runs.

        Source: Schuirmann (1987), Journal of Pharmacokinetics and Biopharmaceutics 15(6); unpaired, Welch (1947).
        """
        level = 1 - 2 * ALPHA
        if self.paired:
            differences = self.one - self.other
            return mean_interval(differences, (-1.0, 1.0), level=level, smallest=BCA_SMALLEST_N, noun="pairs")
        return difference_interval(
            self.one, self.other, (0.0, 1.0), level=level, smallest=BCA_SMALLEST_N, noun="runs"
        )


def paired_values(tally: Tally, one: str, other: str) -> Samples:
    """Return the runs of two conditions; if they draw the same random numbers, the pairs that both have."""
    return _in_pairs(
        tally,
        *((name, tally.replicates(name), tally.run_bests(name, tally.measure)) for name in (one, other)),
    )


def _paired_champions(tally: Tally, one: Champions, other: Champions) -> Samples:
    """Return the means on fresh noise of two conditions, in pairs as `paired_values`."""
    samples = _in_pairs(tally, *((each.condition, each.replicates, each.expected) for each in (one, other)))
    return replace(samples, trials=FRESH_TRIALS)


_Runs = tuple[str, npt.NDArray[np.uint32], npt.NDArray[np.float64]]
"""Name of a condition, its replicates (n,), and a value of each (n,)."""


def _in_pairs(tally: Tally, one: _Runs, other: _Runs) -> Samples:
    if not _is_paired(tally, one[0], other[0]):
        return Samples(one[2], other[2], paired=False)
    _, in_one, in_other = np.intersect1d(one[1], other[1], assume_unique=True, return_indices=True)
    return Samples(one[2][in_one], other[2][in_other], paired=True)


def _is_paired(tally: Tally, one: str, other: str) -> bool:
    settings = [settings_of(tally.condition(name)) for name in (one, other)]
    if any("pair" not in each for each in settings):
        return tally.description.get("pair") is True
    return all(each["pair"] is True for each in settings) and settings[0].get("seed") == settings[1].get(
        "seed"
    )


def same_but_for(key: str, conditions: Sequence[DescribedCondition]) -> list[list[DescribedCondition]]:
    """Conditions in groups that differ in one setting alone; groups of one are left out."""
    groups: list[tuple[dict[str, Any], list[DescribedCondition]]] = []
    for condition in conditions:
        settings = settings_of(condition)
        if key not in settings:
            continue
        rest = {name: value for name, value in settings.items() if name != key}
        for known, members in groups:
            if known == rest:
                if all(settings_of(each)[key] != settings[key] for each in members):
                    members.append(condition)
                break
        else:
            groups.append((rest, [condition]))
    return [members for _, members in groups if len(members) > 1]


def noise_extremes(
    conditions: Sequence[DescribedCondition],
) -> list[tuple[DescribedCondition, DescribedCondition]]:
    """Return those with the least and the most noise of each group of conditions that differ in noise alone."""
    extremes = []
    for group in same_but_for("noise", conditions):
        usable = [each for each in group if isinstance(noise_of(each), int | float)]
        if len(usable) > 1:
            extremes.append((min(usable, key=noise_of), max(usable, key=noise_of)))
    return extremes


def noise_of(condition: DescribedCondition) -> Any:
    """Return the noise level of a condition, a number in all studies of this version."""
    return settings_of(condition).get("noise")


def comparison_of(comparisons: Sequence[Comparison], one: str, other: str) -> Comparison | None:
    """Return the comparison of two conditions, seen from the first; None if they were not compared."""
    return next((each.seen_from(one) for each in comparisons if {each.one, each.other} == {one, other}), None)


def _pairs(tally: Tally) -> Iterator[tuple[DescribedCondition, DescribedCondition, Reason]]:
    """Yield the pairs of conditions to compare, each pair once."""
    seen: set[frozenset[str]] = set()
    for one, other, reason in _all_pairs(tally.conditions):
        both = frozenset((one["name"], other["name"]))
        if len(both) == 2 and both not in seen:
            seen.add(both)
            yield one, other, reason


def _all_pairs(
    conditions: Sequence[DescribedCondition],
) -> Iterator[tuple[DescribedCondition, DescribedCondition, Reason]]:
    reasons: tuple[Reason, ...] = ("noise", "selection")
    for reason in reasons:
        for group in same_but_for(reason, conditions):
            for later in range(1, len(group)):
                for earlier in range(later):
                    yield group[later], group[earlier], reason
    names = {condition["name"]: condition for condition in conditions}
    for condition in conditions:
        baseline = names.get(condition.get("baseline") or "")
        if baseline is not None:
            yield condition, baseline, "baseline"


def _comparison(
    one: DescribedCondition,
    other: DescribedCondition,
    reason: Reason,
    samples: Samples,
    n_comparisons: int,
    p: float,
    p_holm: float,
    best_p: float,
) -> Comparison:
    n, m, paired = len(samples.one), len(samples.other), samples.paired
    size, share = difference_and_share(samples.one, samples.other, samples.smallest_p(), paired=paired)
    spread = samples.spread()
    # Bonferroni's level is the strictest that Holm can ask for
    alpha = ALPHA / n_comparisons
    effect = detectable_effect(min(n, m), paired=paired, alpha=alpha)
    has_spread = math.isfinite(spread) and spread > 0
    return Comparison(
        one=one["name"],
        other=other["name"],
        reason=reason,
        label="/".join(dict.fromkeys((label_of(one), label_of(other)))),
        n=n,
        n_other=m,
        paired=paired,
        difference=size,
        a12=share,
        p=p,
        p_holm=p_holm,
        best_p=best_p,
        runs_for_a_claim=runs_for_a_claim(n_comparisons, paired=paired),
        detectable=effect * spread if effect is not None and has_spread else None,
        runs_for_difference=runs_needed((size.value or 0.0) / spread, paired=paired, alpha=alpha)
        if has_spread
        else None,
        equivalence_interval=samples.equivalence_interval(),
    )


def difference_and_share(
    one: npt.NDArray[np.float64], other: npt.NDArray[np.float64], floor: float, *, paired: bool
) -> tuple[Estimate, Estimate]:
    """Return the difference of means and A12 of two conditions, with their intervals.

    Args:
        one: (n,) and
        other: (m,) values, in pairs if `paired`.
        floor: Smallest p that this number of runs can give. A12 of few runs has Newcombe's interval if that is below
            0.05.
        paired: True if value k of one belongs to value k of the other.
    """
    size, share = bca_intervals([difference_of_means, share_above], one, other, paired=paired)
    value = a12(one, other)
    if share.ends is None and floor < ALPHA:
        share = newcombe_interval(value, len(one), len(other))
    return replace(size, value=float(one.mean() - other.mean())), replace(share, value=value)


def comparisons_frame(comparisons: Sequence[Comparison]) -> pl.DataFrame:
    """Return one row per comparison: its numbers, the bounds of its intervals, its conclusion, and its verdict."""
    rows = []
    for each in comparisons:
        row: dict[str, Any] = {}
        for field in dataclasses.fields(each):
            value = getattr(each, field.name)
            if isinstance(value, Estimate):
                name = field.name.removesuffix("_interval")
                row |= {field.name: value.value} if name == field.name else {}
                row |= {f"{name}_interval_low": value.low, f"{name}_interval_high": value.high}
            else:
                row[field.name] = value
        rows.append(row | {"conclusion": each.conclusion, "verdict": each.verdict})
    return pl.DataFrame(rows, infer_schema_length=None)


# on the page

INTERVAL_NAME = f"{100 * CONFIDENCE:.0f} % BCa interval from {RESAMPLES:,} resamples"

_REASONS: dict[Reason, str] = {
    "noise": "Noise levels, with one selection",
    "selection": "Selections, at one noise level",
    "baseline": "Against the baseline",
}


@dataclass(frozen=True)
class ComparisonsOnPage:
    """Comparisons as a page shows them.

    Attributes:
        table: Their table.
        n_comparisons: Number of them.
        n_shown: Number of those with a supported difference.
        n_refused: Number of those with too few runs.
        test: How they are tested.
        notes: Sentences on what the table shows.
    """

    table: TableOnPage
    n_comparisons: int
    n_shown: int
    n_refused: int
    test: str
    notes: list[str]


def comparisons_content(
    comparisons: Sequence[Comparison], name: str, caption: str, verdict: str
) -> ComparisonsOnPage | None:
    """Return the comparisons for the page; None without comparisons.

    Args:
        comparisons: The comparisons.
        name: Name of the table.
        caption: What is compared.
        verdict: Heading of the conclusions.
    """
    if not comparisons:
        return None
    labels = ", ".join(dict.fromkeys(each.label for each in comparisons))
    columns = (
        Column("First − second"),
        Column(verdict, kind="text", head_kind="text"),
        Column("difference", kind="median"),
        Column("interval"),
        Column("p (Holm)"),
        Column("p"),
        Column("A12"),
        Column("interval"),
        Column("n"),
        Column("detectable"),
        Column("n needed"),
    )
    table = TableOnPage(
        name,
        f"{caption} ({labels}; n runs of each). A12: probability that a run of the first condition is above one of the "
        f"second. Detectable: difference that n runs detect with 80 % power; n needed: runs that detect the observed "
        f"difference as often. Intervals: {INTERVAL_NAME}.",
        columns,
        tuple(
            Part(rows, title)
            for reason, title in _REASONS.items()
            if (rows := [_row(each) for each in comparisons if each.reason == reason])
        ),
        kind="numbers statistics comparisons",
    )
    return ComparisonsOnPage(
        table,
        len(comparisons),
        sum(each.is_shown for each in comparisons),
        sum(not each.can_claim for each in comparisons),
        _test_in_words(comparisons),
        _notes(comparisons),
    )


def _row(comparison: Comparison) -> Row:
    n, m = comparison.n, comparison.n_other
    detectable, needed = comparison.detectable, comparison.runs_for_difference
    return (
        f"{comparison.one} − {comparison.other}",
        Cell(comparison.conclusion, "text strong" if comparison.is_shown else None),
        signed(comparison.size),
        bracketed(comparison.difference, missing="–", signs=True),
        p_in_words(comparison.p_holm),
        p_in_words(comparison.p),
        f"{comparison.a12.value:.2f}",
        bracketed(comparison.a12, 2, "–") + (" *" if comparison.a12.method == "Newcombe" else ""),
        f"{n:,}" if n == m else f"{n:,}; {m:,}",
        "–" if detectable is None else f"{detectable:.3f}",
        "–" if comparison.is_shown or needed is None else f"{needed:,}",
    )


def _test_in_words(comparisons: Sequence[Comparison]) -> str:
    paired = [each.paired for each in comparisons]
    flips = (
        "signs of the differences are flipped run by run, since both conditions draw the same random numbers "
        "in runs of the same number, and all 2ⁿ patterns are counted"
    )
    labels = (
        "runs are relabeled, every way up to ten runs against ten, else 9,999 ways drawn with a fixed seed"
    )
    if all(paired):
        return flips
    return f"where conditions are paired, {flips}; where not, {labels}" if any(paired) else labels


def _notes(comparisons: Sequence[Comparison]) -> list[str]:
    notes = []
    sizes = {(each.n, each.n_other, each.paired) for each in comparisons if not each.can_claim}
    for n, m, paired in sorted(sizes)[:3]:
        floor = smallest_p(n) if paired else smallest_p(n, m)
        runs = f"{n:,} pairs" if paired else f"{n:,} runs against {m:,}"
        notes.append(
            f"The smallest p that {runs} can give is {p_in_words(floor)}, and corrected for {len(comparisons)} "
            f"comparisons {p_in_words(min(1.0, floor * len(comparisons)))}, so no difference can be supported at the "
            f"level of {ALPHA}."
        )
    if any(each.difference.ends is None for each in comparisons):
        notes.append(f"A dash: no interval, because n is below {BCA_SMALLEST_N} or all resamples are alike.")
    if any(each.can_claim and not each.is_shown and each.equivalence for each in comparisons):
        notes.append(
            f"Equivalent: the 90 % interval of the difference by t lies within ±{MARGIN:g}. This is two one-sided "
            "tests at 5 %, not corrected."
        )
    if any(each.a12.method == "Newcombe" for each in comparisons):
        notes.append("Marked *: Newcombe’s interval, which needs no resampling.")
    return notes
