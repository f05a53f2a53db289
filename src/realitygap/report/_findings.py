"""The findings of a study in a few sentences, which its report shows first."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from realitygap._medians import Interval, median_interval, quartiles
from realitygap.report._champions import Champions
from realitygap.report._comparisons import Comparison, p_in_words, same_but_for, signed
from realitygap.report._effects import bca_interval, difference_of_means
from realitygap.report._tally import Tally, label_of, score_text, settings_of, task_of

MOST_FINDINGS = 3

_SEARCHES = {"coverage": "objective search", "novelty": "novelty search", "random": "random networks"}
_PAIRS = (("novelty", "coverage"), ("coverage", "random"), ("novelty", "random"))
_ORIGINS = {
    "SIM": "simulated",
    "TWIN": "driven by simulated twins of a robot",
    "EMULATED": "driven by an emulated robot",
    "REAL": "driven by a robot",
}


@dataclass(frozen=True)
class Finding:
    """A result in words.

    Attributes:
        claim: The result in one sentence.
        evidence: The numbers behind it, in one or two sentences.
        tables: Keys of the tables that hold these numbers.
    """

    claim: str
    evidence: str
    tables: tuple[str, ...]


@dataclass(frozen=True)
class Findings:
    """The first screen in words.

    Attributes:
        findings: Up to `MOST_FINDINGS`, the most important first.
        limits: Basis and limits of the findings, in one line.
    """

    findings: tuple[Finding, ...]
    limits: str


def find(
    tally: Tally,
    comparisons: Sequence[Comparison],
    champions: Sequence[Champions],
    tasks: Sequence[Mapping[str, Any]] = (),
) -> Findings:
    """Return the findings of a study.

    Args:
        tally: The study.
        comparisons: Comparisons of its conditions, from `compare_conditions`.
        champions: Its best networks on fresh noise, from `retry_champions`.
        tasks: Scores of other tasks than coverage, the rows of `summarize_tasks`.
    """
    with_runs = [each for each in tally.conditions if len(tally.replicates(each["name"]))]
    leaders = leading_conditions(tally)
    possible: list[Finding | None] = [_best(tally, leaders, comparisons)]
    if any(each.is_shown for each in comparisons):
        possible += [
            _of_search(tally, comparisons),
            _of_noise(tally, comparisons, champions),
            _of_changes(comparisons),
        ]
    elif comparisons:
        possible.insert(0, _nothing(comparisons))
    if tasks:
        is_mixed = any(task_of(each) == "coverage" for each in with_runs)
        possible = [*_best_scores(tasks), *(possible if is_mixed else possible[:-1])]
    found = tuple(each for each in possible if each is not None)[:MOST_FINDINGS]
    return Findings(found, _limits(tally, with_runs, comparisons))


def leading_conditions(tally: Tally) -> list[str]:
    """Return the names of the conditions with the highest median, that with the highest mean first."""
    names = [str(each["name"]) for each in tally.conditions]
    values = {name: tally.run_bests(name, tally.measure) for name in names if len(tally.replicates(name))}
    medians = {name: round(quartiles(each).median, 9) for name, each in values.items()}
    highest = max(medians.values())
    return sorted(
        (name for name in values if medians[name] == highest), key=lambda name: -float(values[name].mean())
    )


def _best(tally: Tally, leaders: Sequence[str], comparisons: Sequence[Comparison]) -> Finding:
    medians = []
    for name in leaders[:2]:
        values = tally.run_bests(name, tally.measure)
        medians.append(_value(quartiles(values).median, median_interval(values)))
    verb = "has" if len(leaders) == 1 else "have"
    claim = f"{_joined(leaders)} {verb} the highest median coverage: {' and '.join(medians)}."
    rivals = [_turned(each, leaders[0]) for each in comparisons if leaders[0] in (each.one, each.other)]
    if not rivals:
        return Finding(claim, "", ("results",))
    lower = [each for each in rivals if each.is_shown and each.difference > 0]
    if not lower:
        return Finding(
            claim, f"No comparison shows that {leaders[0]} covers more than another.", ("results",)
        )
    nearest = min(lower, key=lambda each: each.difference)
    return Finding(
        claim,
        f"{leaders[0]} covers more than {len(lower)} of the {_plural(len(rivals), 'condition')} compared with it. "
        f"The nearest of them is {nearest.other}: {_difference([nearest])}.",
        ("comparisons",),
    )


def _best_scores(tasks: Sequence[Mapping[str, Any]]) -> list[Finding]:
    """Return the condition with the highest median score for each task except coverage, without a comparison."""
    findings = []
    for task in dict.fromkeys(str(row["task"]) for row in tasks):
        rows = [row for row in tasks if row["task"] == task and row["median"] is not None]
        if rows:
            best = max(rows, key=lambda row: float(row["median"]))
            interval = (
                "" if best["low"] is None else f" [{score_text(best['low'])}, {score_text(best['high'])}]"
            )
            median = score_text(best["median"])
            claim = f"{best['condition']} has the highest median score of {task}: {median}{interval}."
            findings.append(Finding(claim, "", ("scores",)))
    return findings


def _nothing(comparisons: Sequence[Comparison]) -> Finding:
    runs = _runs(each.n for each in comparisons)
    claim = f"No difference in coverage between conditions is supported by {runs} each."
    if any(each.can_claim for each in comparisons):
        largest = max(comparisons, key=lambda each: abs(each.difference))
        evidence = f"The largest is between {largest.one} and {largest.other}: {_difference([largest])}."
    else:
        needed = max(each.runs_for_a_claim for each in comparisons)
        evidence = f"A claim needs at least {_plural(needed, 'run')} of each condition."
    return Finding(claim, evidence, ("comparisons",))


# search


def _of_search(tally: Tally, comparisons: Sequence[Comparison]) -> Finding | None:
    """Return the effect of selection at each noise level."""
    between = [each for each in comparisons if each.reason == "selection"]
    pairs = {}
    for first, second in _PAIRS:
        found = [
            turned
            for each in between
            for turned in (each, _swapped(each))
            if (_selection(tally, turned.one), _selection(tally, turned.other)) == (first, second)
        ]
        if found:
            pairs[first, second] = found
    sentences = [_search_sentences(*pair, found) for pair, found in pairs.items()]
    if not sentences:
        return None
    evolved = [pairs.get((each, "random"), []) for each in ("coverage", "novelty")]
    if all(evolved) and all(_is_above(each) for found in evolved for each in found):
        both = [each for found in evolved for each in found]
        levels = _at_levels(len(evolved[0]), len(evolved[0]))
        random = f"Objective and novelty search cover more than random networks{levels}.", _difference(both)
        sentences = [*sentences[: ("novelty", "coverage") in pairs], random]
    (claim, numbers), *others = sentences
    evidence = [_capital(numbers), *(f"{text.removesuffix('.')}: {numbers}" for text, numbers in others)]
    return Finding(claim, f"{'. '.join(evidence)}.", ("comparisons",))


def _selection(tally: Tally, name: str) -> Any:
    return settings_of(tally.condition(name)).get("selection")


def _search_sentences(first: str, second: str, found: Sequence[Comparison]) -> tuple[str, str]:
    """Return a claim on two kinds of search, and its numbers."""
    words, n = (_capital(_SEARCHES[first]), _SEARCHES[second]), len(found)
    above = [each for each in found if _is_above(each)]
    below = [each for each in found if each.is_shown and each.difference < 0]
    if above and below:
        levels = f"{_at_levels(len(above), n)} and less at {len(below)}"
        return f"{words[0]} covers more than {words[1]}{levels}.", _difference(above)
    if above or below:
        shown, word = (above, "more") if above else (below, "less")
        return f"{words[0]} covers {word} than {words[1]}{_at_levels(len(shown), n)}.", _difference(shown)
    return f"{words[0]} and {words[1]} are not shown to differ.", _difference(found)


def _at_levels(k: int, n: int) -> str:
    if n == 1:
        return ""
    return f" at all {n} noise levels" if k == n else f" at {k} of {n} noise levels"


# noise


def _of_noise(
    tally: Tally, comparisons: Sequence[Comparison], champions: Sequence[Champions]
) -> Finding | None:
    """Return the effect of the highest noise against the lowest, as recorded and on fresh noise."""
    by_names = {frozenset((each.one, each.other)): each for each in comparisons if each.reason == "noise"}
    extremes = []
    for group in same_but_for("noise", tally.conditions):
        usable = [each for each in group if isinstance(settings_of(each).get("noise"), int | float)]
        usable.sort(key=lambda each: float(settings_of(each)["noise"]))
        ends = [str(each["name"]) for each in (usable[0], usable[-1])] if len(usable) > 1 else []
        if ends and frozenset(ends) in by_names:
            extremes.append((_turned(by_names[frozenset(ends)], ends[1]), usable))
    # random networks are a control: they count only where nothing evolves
    evolved = [each for each in extremes if _selection(tally, each[0].one) in ("coverage", "novelty")]
    extremes = evolved or extremes
    if not extremes:
        return None
    levels = {tuple(float(settings_of(each)["noise"]) for each in (use[0], use[-1])) for _, use in extremes}
    span = ""
    if len(levels) == 1:
        ((low, high),) = levels
        span = f" from {100 * low:g} % to {100 * high:g} %"
    shown = [each for each, _ in extremes if each.is_shown]
    quoted = max(shown or [each for each, _ in extremes], key=lambda each: abs(each.difference))
    what = f"the best coverage{_with_searches(tally, shown or [each for each, _ in extremes])}"
    if not shown:
        claim = f"No effect of noise{span} on {what} is supported."
    elif all(each.difference > 0 for each in shown) or all(each.difference < 0 for each in shown):
        claim = f"More noise{span} {'raises' if quoted.difference > 0 else 'lowers'} {what}."
    else:
        claim = f"More noise{span} raises the best coverage in some conditions and lowers it in others."
    evidence = f"{quoted.one} less {quoted.other}: {_difference([quoted])}."
    fresh = _on_fresh_noise(quoted, champions)
    return Finding(claim, evidence + fresh, ("comparisons", "champions") if fresh else ("comparisons",))


def _with_searches(tally: Tally, comparisons: Sequence[Comparison]) -> str:
    words = dict.fromkeys(_SEARCHES.get(_selection(tally, each.one), "") for each in comparisons)
    return f" of {' and '.join(words)}" if all(words) else ""


def _on_fresh_noise(quoted: Comparison, champions: Sequence[Champions]) -> str:
    by_name = {each.condition: each for each in champions if not each.problem}
    if not {quoted.one, quoted.other} <= set(by_name):
        return ""
    high, low = by_name[quoted.one].expected, by_name[quoted.other].expected
    interval = bca_interval(difference_of_means, high, low, paired=False)
    difference = _value(float(high.mean() - low.mean()), interval, signs=True)
    return f" The best networks tried again on fresh noise: {difference}."


# changes


def _of_changes(comparisons: Sequence[Comparison]) -> Finding | None:
    """Return the number of changes against a baseline that are supported, and the largest."""
    changes = [each for each in comparisons if each.reason == "baseline"]
    shown = sorted((each for each in changes if each.is_shown), key=lambda each: -abs(each.difference))
    if not changes:
        return None
    if not shown:
        return Finding(
            f"None of the {_plural(len(changes), 'change')} against a baseline is supported.",
            "",
            ("comparisons",),
        )
    named = "; ".join(f"{each.one} {_difference([each])}" for each in shown[:2])
    return Finding(
        f"{len(shown)} of {_plural(len(changes), 'change')} against a baseline "
        f"{'is' if len(shown) == 1 else 'are'} supported.",
        f"Largest: {named}.",
        ("comparisons",),
    )


# limits


def _limits(tally: Tally, conditions: Sequence[Mapping[str, Any]], comparisons: Sequence[Comparison]) -> str:
    origins = sorted({_ORIGINS.get(label_of(each), label_of(each)) for each in conditions})
    runs = _runs(len(tally.replicates(each["name"])) for each in conditions)
    parts = [" and ".join(origins), f"{runs} per condition"]
    if comparisons:
        n_open = sum(not each.is_shown and not each.is_equivalent for each in comparisons)
        parts.append(f"{n_open} of {_plural(len(comparisons), 'comparison')} inconclusive")
    if len(comparisons) > 1:
        parts.append("p corrected for all of them")
    return f"{'; '.join(parts)}; brackets hold 95 % intervals."


# words


def _is_above(comparison: Comparison) -> bool:
    return comparison.is_shown and comparison.difference > 0


def _swapped(comparison: Comparison) -> Comparison:
    """Return the same comparison in the opposite direction."""
    interval = comparison.difference_interval
    return replace(
        comparison,
        one=comparison.other,
        other=comparison.one,
        difference=-comparison.difference,
        difference_interval=None
        if interval is None
        else Interval(-interval.high, -interval.low, interval.method),
    )


def _turned(comparison: Comparison, first: str) -> Comparison:
    return comparison if comparison.one == first else _swapped(comparison)


def _difference(comparisons: Sequence[Comparison]) -> str:
    """Return the difference with its interval and corrected p; of several, the smallest and the largest p."""
    if len(comparisons) == 1:
        (each,) = comparisons
        value = _value(each.difference, each.difference_interval, signs=True)
        return f"{value}, {_p(each.p_holm)}"
    if all(each.is_shown for each in comparisons):
        nearest = min(comparisons, key=lambda each: abs(each.difference))
        value = _value(nearest.difference, nearest.difference_interval, signs=True)
        return f"smallest difference {value}, {_p(max(each.p_holm for each in comparisons), bound=True)}"
    largest = max(comparisons, key=lambda each: abs(each.difference))
    value = _value(largest.difference, largest.difference_interval, signs=True)
    return f"largest difference {value}, {_p(largest.p_holm)}"


def _p(p: float, *, bound: bool = False) -> str:
    text = "< 0.001" if p < 0.001 else p_in_words(p)
    text = f"p {text}" if text.startswith("<") else f"p {'≤' if bound else '='} {text}"
    return text.replace(" ", "\N{NO-BREAK SPACE}")


def _value(value: float, interval: Interval | None, *, signs: bool = False) -> str:
    def form(number: float) -> str:
        return signed(number) if signs else f"{number:.3f}"

    return form(value) + ("" if interval is None else f" [{form(interval.low)}, {form(interval.high)}]")


def _runs(counts: Iterable[int]) -> str:
    known = sorted(set(counts))
    return _plural(known[0], "run") if len(known) == 1 else f"{known[0]:,} to {_plural(known[-1], 'run')}"


def _joined(names: Sequence[str]) -> str:
    if len(names) > 2:
        return f"{names[0]}, {names[1]}, and {len(names) - 2} more"
    return " and ".join(names)


def _plural(n: int, noun: str) -> str:
    return f"{n:,} {noun}" if n == 1 else f"{n:,} {noun}s"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
