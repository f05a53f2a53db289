"""The wording of results: counts, numbers with intervals, p values, and verdicts.

The terminal, the lab, and the reports use these functions, so that one result reads the same everywhere.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # the help of a command needs no NumPy
    from realitygap.stats import Ends, Estimate, Forecast, Null, SequentialVerdict


@dataclass(frozen=True)
class Basis:
    """The scores that a claim about selected networks rests on.

    A network is selected for the best of many noisy scores. That score is too high by the luck of its trial. A claim
    rests on trials after the selection, or it says that luck is a part of it.

    Attributes:
        why_recorded: Reason why it rests on the scores that selected the networks; empty if it rests on fresh trials.
    """

    why_recorded: str = ""

    @property
    def is_fresh(self) -> bool:
        """True if it rests on trials after the selection."""
        return not self.why_recorded

    def claim(self, text: str) -> str:
        """Return a claim with what it rests on, as a sentence.

        Args:
            text: The claim without a period, in lower case unless it begins with a name.
        """
        return f"{'In fresh trials' if self.is_fresh else 'As recorded'}, {text}."

    @property
    def caveat(self) -> str:
        """The limit of a claim on recorded scores, as a clause; empty if the claim rests on fresh trials."""
        if self.is_fresh:
            return ""
        return f"recorded scores are the best of many noisy trials, so luck is part of them ({self.why_recorded})"


def significant(value: float, digits: int, *, keep_zeros: bool = False) -> str:
    """Return a number with some significant digits; from 1,000 on without an exponent, and with commas.

    Args:
        value: The number.
        digits: Number of significant digits.
        keep_zeros: True to show zeros at the end, so that numbers of a column are equally exact.
    """
    rounded = float(f"{value:.{digits}g}")
    if abs(rounded) >= min(1000.0, 10.0**digits):
        return f"{rounded:,.0f}" if abs(rounded) < 1e15 else f"{value:.{digits}g}"
    text = f"{value:{'#' if keep_zeros else ''}.{digits}g}"
    return text.removesuffix(".")


def fixed(value: float, digits: int) -> str:
    """Return a number with some digits after the point; from a billion on with an exponent, so that it stays short."""
    return f"{value:.{digits}f}" if abs(value) < 1e9 else f"{value:.4g}"


MISSING = "–"
"""Stands for a number or an interval that does not exist."""


def number(value: float | None, digits: int = 3) -> str:
    """Return a measured number, such as `0.306` or `−0.089`: a leading zero, three decimals, and a true minus."""
    return MISSING if value is None else fixed(value, digits).replace("-", "−")


def joined(names: Sequence[str]) -> str:
    """Return names as a list in words; of more than two, the first two and the number of the others."""
    if len(names) > 2:
        return f"{names[0]}, {names[1]}, and {len(names) - 2} more"
    return " and ".join(names)


def highest(values: Mapping[str, float]) -> list[str]:
    """Return the names with the highest value; values that differ by rounding alone are equal."""
    most = max(values.values(), default=0.0)
    return [name for name, value in values.items() if round(value, 9) == round(most, 9)]


def counted(n: int, noun: str) -> str:
    """Return a number with its noun, such as `1 run` or `2,000 runs`."""
    return f"{n:,} {noun}{'' if n == 1 else 's'}"


def count_range(counts: Iterable[int]) -> str:
    """Return the smallest and the largest of several numbers, such as `3 to 10`; one number if all are the same."""
    known = list(counts)
    return " to ".join(f"{n:,}" for n in dict.fromkeys((min(known), max(known))))


def duration(seconds: float) -> str:
    """Return a time in words: seconds below 90 s, minutes below 90 min, hours above."""
    for limit, unit, name in ((90.0, 1.0, "s"), (5400.0, 60.0, "min")):
        if seconds < limit:
            return f"{seconds / unit:.0f} {name}"
    return f"{seconds / 3600.0:.1f} h"


def counted_range(counts: Iterable[int], noun: str) -> str:
    """Return the smallest and the largest of several numbers with their noun, such as `3 to 10 runs`."""
    known = list(counts)
    return f"{count_range(known)} {noun}{'' if max(known) == 1 else 's'}"


def values_between(values: Sequence[float], digits: int = 3) -> str:
    """Return the smallest and the largest value in words; one number if both read the same."""
    ends = dict.fromkeys(f"{value:.{digits}f}" for value in (min(values), max(values)))
    return " to ".join(ends)


def signed(value: float, digits: int = 3) -> str:
    """Return a number with its sign, and a true minus."""
    text = f"{value:+.{digits}f}".replace("-", "−")
    return text.replace("−", "±").replace("+", "±") if float(f"{value:.{digits}f}") == 0 else text


def with_interval(estimate: Estimate, *, signs: bool = False) -> str:
    """Return a number with its interval in brackets, if it has one; a dash without a number."""
    if estimate.value is None:
        return MISSING
    numbers = [estimate.value, *(estimate.ends or ())]
    texts = (signed(each) if signs else number(each) for each in numbers)
    value, *ends = texts
    return f"{value} [{ends[0]}, {ends[1]}]" if ends else value


def bracketed(estimate: Estimate, digits: int = 3, missing: str = "", *, signs: bool = False) -> str:
    """Return the ends of an interval in brackets, such as `[0.100, 0.200]`; another text without one."""
    if estimate.ends is None:
        return missing
    return f"[{', '.join(signed(end, digits) if signs else number(end, digits) for end in estimate.ends)}]"


def within(ends: Ends | None, digits: int = 3) -> str:
    """Return the ends of an interval in brackets after its number, such as ` [0.100, 0.200]`; empty without one."""
    return "" if ends is None else f" [{number(ends[0], digits)}, {number(ends[1], digits)}]"


def p_in_words(p: float) -> str:
    """Return a p value: three decimals, or a power of ten; below 10⁻⁹ exactness is of no use."""
    if p >= 0.001:
        return f"{p:.3f}" if p < 0.9995 else "1"
    if p < 1e-9:
        return "< 10⁻⁹"
    digits, exponent = f"{p:.0e}".split("e")
    return f"{digits}·10" + str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def p_equation(p: float, *, bound: bool = False) -> str:
    """Return p with its relation, such as `p = 0.012` or `p < 0.001`.

    Args:
        p: The value.
        bound: True if it is the largest of several.
    """
    if p < 0.001:
        return "p < 0.001"
    return f"p {'≤' if bound else '='} {p_in_words(p)}"


def difference_clause(difference: Estimate, p: float, *, bound: bool = False) -> str:
    """Return a difference with its interval and its corrected p, which is the largest of several if `bound`."""
    equation = p_equation(p, bound=bound).replace(" ", "\N{NO-BREAK SPACE}")
    return f"{with_interval(difference, signs=True)}, {equation}"


# verdicts


def highest_median(
    names: Sequence[str], medians: Sequence[str], of: str = "best coverage", *, n_conditions: int = 2
) -> str:
    """Return which conditions have the highest median, without a period.

    Args:
        names: All conditions that have it.
        medians: Their medians in words, of the first two.
        of: Score.
        n_conditions: Number of conditions with a median. A single one is not called the highest.
    """
    if n_conditions == 1:
        return f"the median {of} of {names[0]} is {medians[0]}"
    return f"{joined(names)} {'has' if len(names) == 1 else 'have'} the highest median {of}: {' and '.join(medians)}"


def highest_mean(names: Sequence[str], means: Sequence[str], *, n_conditions: int = 2) -> str:
    """Return which conditions have the best networks with the highest mean coverage, without a period.

    Args:
        names: All conditions that have it.
        means: Their means in words, of the first two.
        n_conditions: Number of conditions with a mean. A single one is not called the highest.
    """
    if n_conditions == 1:
        return f"the mean coverage of the best networks of {names[0]} is {means[0]}"
    return f"the best networks of {joined(names)} have the highest mean coverage: {' and '.join(means)}"


def undecided_highest(score: str, values: Sequence[float], about: str, needed: int) -> str:
    """Return the values of conditions with too few runs to name the highest, without a period.

    Args:
        score: Name of the values, such as `median best coverage`.
        values: The values of all conditions.
        about: Their labels and n, in words.
        needed: Smallest number of runs of each condition that can show a difference.
    """
    return (
        f"the {score} of {counted(len(values), 'condition')} is {values_between(values)} ({about}); at least "
        f"{counted(needed, 'run')} of each are needed to name the highest"
    )


def higher_than_others(leader: str, n_lower: int, n: int, nearest: str, difference: str) -> str:
    """Return how many of the conditions that were compared with one are lower, as sentences.

    Args:
        leader: The condition.
        n_lower: Number of conditions that it covers more than.
        n: Number of conditions that were compared with it.
        nearest: The highest of those that are lower.
        difference: Difference to that one, in words.
    """
    if not n_lower:
        return f"No comparison shows that {leader} covers more than another."
    n_others = n - n_lower
    others = (
        f"; no difference to the other {n_others if n_others > 1 else 'one'} is supported" if n_others else ""
    )
    return (
        f"{leader} covers more than {n_lower} of the {counted(n, 'condition')} compared with it{others}. "
        f"The nearest of them is {nearest}: {difference}."
    )


def higher_searches(one: str, other: str, n_above: int, n_below: int, n: int) -> str:
    """Return at how many of n noise levels one kind of search is above another, without a period."""
    if not n_above and not n_below:
        return f"no difference between {one} and {other} is supported"
    levels = at_levels(n_above or n_below, n)
    if n_above and n_below:
        return f"{one} covers more than {other}{levels} and less at {n_below}"
    return f"{one} covers {'more' if n_above else 'less'} than {other}{levels}"


def at_levels(k: int, n: int) -> str:
    """Return at how many of n noise levels something is shown, as the end of a clause; empty for a single level."""
    if n == 1:
        return ""
    return f" at all {n} noise levels" if k == n else f" at {k} of {n} noise levels"


def no_difference(runs: str) -> str:
    """Return that these runs support no difference between conditions, without a period."""
    return f"no difference in coverage between conditions is supported by {runs} each"


def changes_supported(n_shown: int, n: int) -> str:
    """Return how many changes against a baseline are supported, without a period."""
    if not n_shown:
        return f"none of the {counted(n, 'change')} against a baseline is supported"
    return (
        f"{n_shown} of {counted(n, 'change')} against a baseline {'is' if n_shown == 1 else 'are'} supported"
    )


def effect_of_noise(span: str, score: str, searches: str, raises: bool | None, *, is_shown: bool) -> str:
    """Return the effect of more noise on a score, without a period.

    Args:
        span: The levels of noise in words, such as ` from 10 % to 80 %`, or empty.
        score: Score.
        searches: The kinds of search in words, such as ` of novelty search`, or empty.
        raises: True if the score rises with noise, False if it falls, None if it rises in some conditions only.
        is_shown: True if an effect is supported.
    """
    if not is_shown:
        return f"no effect of noise{span} on the {score}{searches} is supported"
    if raises is None:
        return f"more noise{span} raises the {score} in some conditions and lowers it in others"
    return f"more noise{span} {'raises' if raises else 'lowers'} the {score}{searches}"


def runs_for_claims(needed: int) -> str:
    """Return how many runs claims need, as a sentence."""
    return f"A claim needs at least {counted(needed, 'run')} of each condition."


def few_runs_verdict(needed: int, detail: str = "") -> str:
    """Return that there are too few runs for a claim, and how many are needed."""
    return f"no claim possible{detail}; {needed} runs"


def higher_verdict(one: str, other: str, difference: float) -> str:
    """Return which of two conditions is higher, of a difference that is shown."""
    higher, lower = (one, other) if difference > 0 else (other, one)
    return f"{higher} above {lower}"


def inconclusive_verdict(
    n: int | None = None, detectable: float | None = None, needed: int | None = None, most: int = 100_000
) -> str:
    """Return that a difference is not shown, with what n can detect.

    Args:
        n: Number of runs.
        detectable: Smallest difference that n runs detect in 80 of 100 studies; None if it is unknown.
        needed: Number of runs that detect the observed difference as often; None if there are too many to compute.
        most: Largest number that is named.
    """
    if detectable is None:
        return "inconclusive"
    runs = f"about {needed:,}" if needed is not None and needed <= most else f"over {most:,}"
    return (
        f"inconclusive: {n} runs detect {detectable:.3f} with 80 % power; this difference would need {runs}"
    )


def equivalence_verdict(is_equivalent: bool, margin: float, difference: Estimate) -> str:
    """Return whether two conditions are shown to be equivalent, with the interval of their difference."""
    shown = "equivalent" if is_equivalent else "not shown equivalent"
    return f"{shown} within ±{margin:g} (90 % interval {bracketed(difference, signs=True)})"


RANKS_ALIKE = 0.8
"""Rank correlation from which a ranking is trusted: its whole interval must be at least that high."""


def platform_in_words(spec: str, label: str) -> str:
    """Return a platform in words, such as `the twin worn-1` for `twin:worn-1.toml`."""
    name, _, rest = spec.partition(":")
    if not rest:
        return name
    if "://" in rest or name not in ("sim", "twin", "recorded"):
        return f"the {'emulated ' if label == 'EMULATED' else 'robot ' if label == 'REAL' else ''}{name}"
    stem = rest.replace("\\", "/").rpartition("/")[2].rpartition(".")[0] or rest
    return {"sim": f"sim with {stem}", "twin": f"the twin {stem}"}.get(name, f"the recorded trials {stem}")


def trials_each(
    trials: tuple[int, int], most: tuple[int, int] = (0, 0), platforms: tuple[str, str] = ("", "")
) -> str:
    """Return the numbers of trials of each controller on the simulator and on the target.

    Args:
        trials: The fewest trials of a controller on both; 0 for means without trials.
        most: The most trials of a controller on both. Default: as many.
        platforms: Both platforms in words, for numbers that differ.
    """
    if trials == (0, 0):
        return "means without trials on both platforms"
    ends = [(few, max(few, many)) for few, many in zip(trials, most, strict=True)]
    if 0 in trials or any(few != many for few, many in ends):
        parts = [
            "means without trials" if few == 0 else f"{counted_range((few, many), 'trial')} of each"
            for few, many in ends
        ]
        return joined([f"{part} on {name}" for part, name in zip(parts, platforms, strict=True)])
    numbers = " and ".join(f"{n:,}" for n in dict.fromkeys(trials))
    return f"{numbers} {'trial' if trials == (1, 1) else 'trials'} of each on both platforms"


def gap_equivalence(equivalence: Estimate) -> str:
    """Return whether the level is shown to be equivalent, with its interval of 90 %; empty if that is not tested."""
    margin, is_equivalent = equivalence.more.get("margin"), equivalence.more.get("equivalent")
    if margin is None or is_equivalent is None:
        return ""
    return (
        f"{'' if is_equivalent else 'not '}shown within ±{margin:g}, 90 % interval {bracketed(equivalence)}"
    )


def level_verdict(
    sim: str, target: str, score: str, level: Estimate, rms: Estimate, equivalence: Estimate
) -> str:
    """Return whether a simulator can be trusted for the mean score of controllers, as sentences.

    Args:
        sim, target: The two platforms in words.
        score: Score of controllers.
        level: Mean difference, target minus simulator.
        rms: Root mean square of differences, which is stated if the level is not refuted.
        equivalence: Result of the test of equivalence.
    """
    of, margin = f"the level of {score}", equivalence.more.get("margin")
    if level.value is None or level.ends is None:
        return f"Too few controllers to judge {of}."
    low, high = level.ends
    single = f" Single controllers differ by {with_interval(rms)} RMS." if (rms.low or 0.0) > 0 else ""
    if equivalence.more.get("equivalent"):
        figures = f"it is equivalent within ±{margin:g}, and differs by {with_interval(level)}."
        return f"Trust {sim} for {of}: {figures}{single}"
    if low <= 0 <= high:
        difference = f"difference in {of} between {sim} and {target}"
        shown = (
            f"No {difference}"
            if margin is None
            else f"Neither a {difference} nor equivalence within ±{margin:g}"
        )
        return f"{shown} is shown: {with_interval(level)}.{single}"
    lower = level.value < 0
    size, *ends = (abs(number) for number in (level.value, *((high, low) if lower else (low, high))))
    return (
        f"Don’t trust {sim} for {of}: it is {size:.3f} [{ends[0]:.3f}, {ends[1]:.3f}] "
        f"{'lower' if lower else 'higher'} on {target}."
    )


def change_verdict(change: Estimate, before: Estimate, after: Estimate) -> str:
    """Return what a calibration did to the RMS gap, as a sentence.

    Args:
        change: Difference of the RMS gap, after minus before.
        before, after: The RMS gap.
    """
    if change.value is None or change.ends is None or before.value is None or after.value is None:
        return "Too few controllers or trials to judge the calibration."
    figures = f"from {before.value:.3f} to {after.value:.3f}."
    if change.ends[0] <= 0 <= change.ends[1]:
        return f"The calibration is not shown to change the RMS gap, {figures}"
    return f"The calibration {'lowers' if change.value < 0 else 'raises'} the RMS gap {figures}"


def claims(verdict: str) -> str:
    """Return a verdict without its figures, which follow a colon in a sentence."""
    return re.sub(r": .*?\.(?= |$)", ".", verdict)


def rank_verdict(raw: Estimate, ceiling: Estimate, without: Estimate) -> str:
    """Return whether a simulator can be trusted for the ranking of controllers, as a sentence.

    Args:
        raw: Rank correlation of both platforms.
        ceiling: The noise ceiling.
        without: The rank correlation without noise, whose interval decides if there is one.
    """
    if raw.value is None or raw.ends is None:
        return "Too few controllers to judge the ranking."
    noise = "" if ceiling.value is None else f", and the noise ceiling is {number(ceiling.value)}"
    figures = f"the rank correlation is {with_interval(raw)}{noise}."
    low, high = without.ends or raw.ends
    if low >= RANKS_ALIKE:
        return f"Trust the simulator’s ranking of controllers: {figures}"
    if low > 0:
        return f"Trust the simulator’s ranking of controllers only in part: {figures}"
    if high < RANKS_ALIKE:
        return f"Don’t trust the simulator’s ranking of controllers: {figures}"
    return f"The simulator’s ranking of controllers is undecided: {figures}"


def worth_verdict(worth: float, noun: str, *, helps: bool) -> str:
    """Return how many more units on the target a simulation was worth, as a sentence.

    Args:
        worth: Number of units; below 0 if the interval became wider.
        noun: A unit, such as `controller`.
        helps: True if the correlation is high enough to narrow intervals in most samples of this size.
    """
    if not helps:
        return (
            "The simulator is not shown to help. Both intervals are valid: report the one that you named before the "
            "trials."
        )
    if worth < 0.5:
        return f"The simulation was worth less than one more {noun} on the target."
    return f"The simulation was worth about {counted(round(worth), f'more {noun}')} on the target."


def rank_violation(better: str, worse: str, violation: float, sim: str, target: str) -> str:
    """Return the two controllers whose order a simulator gets most wrong, without a period."""
    return f"{better} is {violation:.3f} better than {worse} on {target}, and not on {sim}"


def methods_of_successes(*, paired: bool) -> str:
    """Return the methods behind the intervals and p of successes, as a sentence."""
    tests = (
        "differences Tango's, and p is of McNemar's exact test"
        if paired
        else "differences Newcombe's, and p is of Boschloo's exact test"
    )
    return (
        f"Intervals are of each controller alone. Shares have Clopper and Pearson's, {tests}, corrected for all "
        "controllers by Holm's method."
    )


def ties_in_words(n: int, ties: str) -> str:
    """Return how pairs of controllers that tie on one platform only count, as a sentence; empty if there are none."""
    if n == 0:
        return ""
    counts = "count as violated" if ties == "both" else "count as in the code of SIMPLER"
    if n == 1:
        counts = counts.replace("count", "counts")
    return f"{counted(n, 'pair')} of controllers {'ties' if n == 1 else 'tie'} on one platform only, and {counts}."


def reproduces(is_misspecified: bool) -> str:
    """Return whether a simulator can reproduce the observations of its calibration, as a sentence."""
    return f"The simulator {'cannot' if is_misspecified else 'can'} reproduce the observations of its calibration."


PLANNED_LOOKS = {
    "planned": "The comparison was stored before trial 1.",
    "changed": "The comparison was changed after trial 1. These figures are those of the present plan, and are valid "
    "only if the trials so far did not lead to the change.",
    "unplanned": "Nobody planned these looks in advance. The figures are valid at any look if these trials did not "
    "decide what is compared, and by which score and test.",
}
"""What a look rests on, as sentences: whether the comparison was stored before the first trial."""

MULTIPLE_LOOKS = "The error rate and E are corrected for {n} comparisons."
"""Note on several comparisons."""


def look_figures(
    first: str, second: str, n: int, unit: str, shift: Estimate, e: float, needed: float, fewest: int
) -> str:
    """Return the figures of a sequential test after n pairs, as a sentence.

    Args:
        first, second: The two that are compared.
        n: Number of pairs.
        unit: Noun for a pair.
        shift: Mean difference, first minus second, with its anytime-valid interval.
        e: E of the test.
        needed: Value of E that shows a difference.
        fewest: Smallest number of pairs with an interval.
    """
    pairs = counted(n, unit)
    if shift.value is None:
        return f"{first} and {second}: no complete {unit} yet."
    if shift.ends is None:
        return f"{pairs}: {first} − {second} is {number(shift.value)}. {shift.refused}"
    size = fixed(e, 1) if e < 1000 else significant(e, 2)
    difference = with_interval(shift, signs=True) if n >= fewest else signed(shift.value)
    return f"{pairs}: {first} − {second} is {difference}, E = {size} ({needed:.0f} shows a difference)."


def look_verdict(
    first: str,
    second: str,
    verdict: SequentialVerdict,
    margin: float | None,
    claimed_at: int | None = None,
    *,
    are_platforms: bool = False,
) -> str:
    """Return what a sequential test shows, as a sentence.

    Args:
        first, second: The two that are compared.
        verdict: The result.
        margin: Margin of equivalence.
        claimed_at: Number of pairs after which a difference was shown.
        are_platforms: True if two platforms are compared, of which neither is better.
    """
    if verdict == "equivalent":
        return f"Stop: {first} and {second} are equivalent within ±{margin:g}."
    if verdict == "open":
        return "Not shown yet. You may stop at any time."
    better, worse = (first, second) if verdict == "higher" else (second, first)
    since = "" if claimed_at is None else f", shown at number {claimed_at}"
    if are_platforms:
        return f"Stop: scores are higher on {better} than on {worse}{since}."
    return f"Stop: {better} is better than {worse}{since}."


def looks_summary(shown: Sequence[tuple[str, str, SequentialVerdict]], n: int) -> str:
    """Return which of n comparisons have a result, as a sentence.

    Args:
        shown: First, second, and verdict of each comparison with a result.
        n: Number of comparisons.
    """
    if not shown:
        return f"None of {counted(n, 'comparison')} has a result yet."
    words = {"higher": "better than", "lower": "worse than", "equivalent": "equivalent to"}
    results = [f"{first} is {words[verdict]} {second}" for first, second, verdict in shown]
    return f"{len(shown)} of {counted(n, 'comparison')}: {'; '.join(results)}."


def pairs_forecast(forecast: Forecast | None, n: int, unit: str, fewest: int, maximum: int | None) -> str:
    """Return how many more pairs a comparison may need, as a sentence that calls it a forecast.

    Args:
        forecast: The forecast, if there is one.
        n: Number of pairs so far.
        unit: Noun for a pair.
        fewest: Smallest number of pairs after which a claim is possible.
        maximum: Maximum number of pairs that is planned.
    """
    if maximum is not None and n >= maximum:
        return f"The planned maximum of {counted(maximum, unit)} is reached."
    if forecast is None:
        return f"A claim needs at least {counted(fewest, unit)}." if n < fewest else ""
    if forecast.more is None:
        return f"Forecast: probably no result by {counted(forecast.maximum, unit)}."
    limit = (
        f"80 %: at most {forecast.quantile:,}"
        if forecast.quantile is not None
        else f"{100 * (1 - forecast.ended):.0f} %: none by {forecast.maximum:,}"
    )
    return f"Forecast, if later {unit}s are like these: about {forecast.more:,} more ({limit})."


BLIND_NOTE = (
    "The design is blind: no results by arm are shown. `realitygap trials unblind` shows them, and logs it."
)
"""Note on a comparison whose design is blind."""


def blind_look(n: int, maximum: int | None, unit: str, *, has_ended: bool) -> str:
    """Return whether a blind comparison continues, as sentences without a result.

    Args:
        n: Number of complete pairs.
        maximum: Number of pairs in the locked design.
        unit: Noun for a pair.
        has_ended: True if the locked rule ends it.
    """
    of = "" if maximum is None else f" of at most {maximum:,}"
    state = "Stop: the planned end is reached." if has_ended else "Continue."
    return f"{counted(n, unit)}{of} complete. {state}"


def deviations_sentence(deviations: Sequence[str]) -> str:
    """Return the deviations from a locked plan, as sentences."""
    return f"Deviations from the locked plan: {' '.join(deviations) or 'none.'}"


def distribution_caveat(null: Null) -> str:
    """Return the limit of a sequential test, as sentences: which hypothesis it refutes."""
    if null == "mean":
        return "The hypothesis is that both have the same mean score."
    return (
        "The hypothesis is that both have the same distribution of scores. It is also false if the means are equal and "
        "the spreads or shapes differ. `realitygap trials advise --null mean` tests the means alone, with more pairs."
    )


FEW_RUNS = "[few runs]"
"""Stands for an interval in a table if there are too few runs for one."""
