"""The findings of a study in a few sentences, which its report shows first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from realitygap._wording import (
    Basis,
    at_levels,
    changes_supported,
    counted,
    counted_range,
    difference_clause,
    effect_of_noise,
    higher_searches,
    higher_than_others,
    highest,
    highest_mean,
    highest_median,
    no_difference,
    runs_for_claims,
    undecided_highest,
    values_between,
    with_interval,
)
from realitygap.report._champions import Champions
from realitygap.report._comparisons import Comparison, comparison_of, noise_extremes, noise_of
from realitygap.report._tally import DescribedCondition, Tally, label_of, score_text, selection_of, task_of
from realitygap.stats import median_interval, quartiles, runs_for_a_claim

MOST_FINDINGS = 3

_SEARCHES = {
    "coverage": "objective search",
    "novelty": "novelty search",
    "random": "random networks",
    "map-elites": "MAP-Elites",
}
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
        basis: Scores that it rests on.
        text: The result, without what it rests on, as `Basis.claim` takes it.
        evidence: The numbers behind it, in one or two sentences.
        tables: Keys of the tables that hold these numbers.
    """

    basis: Basis
    text: str
    evidence: str
    tables: tuple[str, ...]

    @property
    def claim(self) -> str:
        """The result in one sentence, with what it rests on."""
        return self.basis.claim(self.text)


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
    fresh: Sequence[Comparison],
    tasks: Sequence[Mapping[str, Any]] = (),
) -> Findings:
    """Return the findings of a study.

    Coverage selected the best network of each run. So the findings rest on fresh noise; if some networks could not be
    tried again, they say that they rest on recorded scores.

    Args:
        tally: The study.
        comparisons: Comparisons of its conditions, from `compare_conditions`.
        champions: Its best networks on fresh noise, from `retry_champions`.
        fresh: Comparisons of these networks, from `compare_champions`.
        tasks: Scores of other tasks than coverage, the rows of `summarize_tasks`.
    """
    basis = basis_of(champions)
    study = _Study(tally, basis, tuple(fresh if basis.is_fresh else comparisons), tuple(comparisons))
    possible: list[Finding | None] = [_best(study, champions)]
    if any(each.is_shown for each in study.compared):
        possible += [_of_search(study), _of_noise(study), _of_changes(study)]
    elif study.compared:
        possible.insert(0, _nothing(study))
    if tasks:
        is_mixed = any(task_of(each) == "coverage" for each in tally.with_runs)
        possible = [*_best_scores(tasks), *(possible if is_mixed else possible[:-1])]
    findings = tuple(each for each in possible if each is not None)[:MOST_FINDINGS]
    caveats = [each.basis.caveat for each in findings if each.basis.caveat]
    return Findings(findings, _limits(study, tally.with_runs, caveats))


@dataclass(frozen=True)
class _Study:
    """A study, and the comparisons that its findings rest on.

    Attributes:
        tally: The study.
        basis: Scores of the comparisons.
        compared: Comparisons of its conditions.
        recorded: Comparisons of recorded scores.
    """

    tally: Tally
    basis: Basis
    compared: tuple[Comparison, ...]
    recorded: tuple[Comparison, ...]

    @property
    def tables(self) -> tuple[str, ...]:
        """Keys of the tables of the comparisons."""
        return ("fresh", "champions") if self.basis.is_fresh else ("comparisons",)

    def find(self, claim: str, evidence: str, tables: tuple[str, ...] | None = None) -> Finding:
        """Return a finding on the comparisons."""
        return Finding(self.basis, claim, evidence, self.tables if tables is None else tables)


def basis_of(champions: Sequence[Champions]) -> Basis:
    """Return what findings rest on: fresh noise if all best networks were tried again."""
    problems = sorted({each.problem for each in champions if each.problem})
    return Basis("; ".join(problems) if problems or champions else "there are no networks to try again")


def leading_conditions(tally: Tally) -> list[str]:
    """Return the names of the conditions with the highest median, that with the highest mean first."""
    names = [str(each["name"]) for each in tally.conditions]
    values = {name: tally.run_bests(name, tally.measure) for name in names if len(tally.replicates(name))}
    leaders = highest({name: quartiles(each).median for name, each in values.items()})
    return sorted(leaders, key=lambda name: -float(values[name].mean()))


def _best(study: _Study, champions: Sequence[Champions]) -> Finding:
    tally = study.tally
    bests = {str(each["name"]): tally.run_bests(each["name"], tally.measure) for each in tally.conditions}
    bests = {name: values for name, values in bests.items() if len(values)}
    needed = _needed(study, [len(values) for values in bests.values()])
    if needed is not None:
        return _undecided(study, bests, champions, needed)
    leaders = leading_conditions(tally)
    medians = [with_interval(median_interval(bests[name])) for name in leaders[:2]]
    recorded = highest_median(leaders, medians, n_conditions=len(bests))
    if not study.basis.is_fresh:
        return study.find(recorded, _rank(study, leaders[0]), None if study.compared else ("results",))
    by_name = {each.condition: each for each in champions}
    best = highest({name: float(each.expected.mean()) for name, each in by_name.items()})
    means = [with_interval(by_name[name].expected_mean) for name in best[:2]]
    claim = highest_mean(best, means, n_conditions=len(by_name))
    evidence = f"{_rank(study, best[0])} As recorded, {recorded}.".strip()
    return study.find(claim, evidence, (*(study.tables if study.compared else ("champions",)), "results"))


def _needed(study: _Study, n_runs: Sequence[int]) -> int | None:
    """Return how many runs of each condition would name the highest; None if there are enough, or one condition."""
    if study.compared:
        few = not any(each.can_claim for each in study.compared)
        return max(each.runs_for_a_claim for each in study.compared) if few else None
    return _needed_without_comparison(n_runs)


def _needed_without_comparison(n_runs: Sequence[int]) -> int | None:
    needed = runs_for_a_claim(len(n_runs) - 1, paired=True) if len(n_runs) > 1 else 0
    return needed if min(n_runs, default=0) < needed else None


def _undecided(
    study: _Study, bests: Mapping[str, npt.NDArray[np.float64]], champions: Sequence[Champions], needed: int
) -> Finding:
    """Return the range of coverage over conditions that have too few runs to name the highest."""
    about = f"{counted_range(map(len, bests.values()), 'run')} each"
    medians = [quartiles(values).median for values in bests.values()]
    if not study.basis.is_fresh:
        claim = undecided_highest("median best coverage", medians, about, needed)
        return study.find(claim, "", None if study.compared else ("results",))
    means = [float(each.expected.mean()) for each in champions]
    claim = undecided_highest("mean coverage of the best networks", means, about, needed)
    evidence = f"As recorded, their median best coverage is {values_between(medians)}."
    return study.find(claim, evidence, (*(study.tables if study.compared else ("champions",)), "results"))


def _rank(study: _Study, leader: str) -> str:
    """Return how a condition compares with the others, in words; empty if it is compared with none."""
    rivals = [each.seen_from(leader) for each in study.compared if leader in (each.one, each.other)]
    if not rivals:
        return ""
    lower = [each for each in rivals if each.is_shown and each.size > 0]
    nearest = min(lower or rivals, key=lambda each: each.size)
    return higher_than_others(leader, len(lower), len(rivals), nearest.other, _difference([nearest]))


def _best_scores(tasks: Sequence[Mapping[str, Any]]) -> list[Finding]:
    """Return the condition with the highest median score for each task except coverage, without a comparison."""
    findings = []
    for task in dict.fromkeys(str(row["task"]) for row in tasks):
        rows = {row["condition"]: row for row in tasks if row["task"] == task and row["median"] is not None}
        leaders = highest({name: float(row["median"]) for name, row in rows.items()})
        if not leaders:
            continue
        medians = []
        needed = _needed_without_comparison([int(row["n"]) for row in rows.values()])
        for row in (rows[name] for name in leaders[:2]):
            ends = "" if row["low"] is None else f" [{score_text(row['low'])}, {score_text(row['high'])}]"
            medians.append(f"{score_text(row['median'])}{ends}")
        if needed is None:
            claim = highest_median(leaders, medians, f"score of {task}", n_conditions=len(rows))
        else:
            values = [float(row["median"]) for row in rows.values()]
            about = f"{counted_range((int(row['n']) for row in rows.values()), 'run')} each"
            claim = undecided_highest(f"median score of {task}", values, about, needed)
        basis = Basis(f"the report tries no network again for its score of {task}")
        findings.append(Finding(basis, claim, "", ("scores",)))
    return findings


def _nothing(study: _Study) -> Finding:
    compared = study.compared
    claim = no_difference(counted_range((each.n for each in compared), "run"))
    if any(each.can_claim for each in compared):
        largest = max(compared, key=lambda each: abs(each.size))
        evidence = f"The largest is between {largest.one} and {largest.other}: {_difference([largest])}."
    else:
        evidence = runs_for_claims(max(each.runs_for_a_claim for each in compared))
    return study.find(claim, evidence)


# search


def _of_search(study: _Study) -> Finding | None:
    """Return the effect of selection at each noise level."""
    between, tally = [each for each in study.compared if each.reason == "selection"], study.tally
    pairs = {}
    for first, second in _PAIRS:
        matching = [
            turned
            for each in between
            for turned in (each, each.seen_from(each.other))
            if (_selection(tally, turned.one), _selection(tally, turned.other)) == (first, second)
        ]
        if matching:
            pairs[first, second] = matching
    sentences = [_search_sentences(*pair, matching) for pair, matching in pairs.items()]
    if not sentences:
        return None
    evolved = [pairs.get((each, "random"), []) for each in ("coverage", "novelty")]
    if all(evolved) and all(_is_above(each) for matching in evolved for each in matching):
        both = [each for matching in evolved for each in matching]
        levels = at_levels(len(evolved[0]), len(evolved[0]))
        random = f"objective and novelty search cover more than random networks{levels}", _difference(both)
        sentences = [*sentences[: ("novelty", "coverage") in pairs], random]
    (claim, numbers), *others = sentences
    evidence = [_capital(numbers), *(f"{_capital(text)}: {numbers}" for text, numbers in others)]
    return study.find(claim, f"{'. '.join(evidence)}.")


def _selection(tally: Tally, name: str) -> str:
    return selection_of(tally.condition(name))


def _search_sentences(first: str, second: str, comparisons: Sequence[Comparison]) -> tuple[str, str]:
    """Return a claim on two kinds of search, and its numbers."""
    above = [each for each in comparisons if _is_above(each)]
    below = [each for each in comparisons if each.is_shown and each.size < 0]
    claim = higher_searches(_SEARCHES[first], _SEARCHES[second], len(above), len(below), len(comparisons))
    return claim, _difference(above or below or comparisons)


# noise


def _of_noise(study: _Study) -> Finding | None:
    """Return the effect of the highest noise against the lowest, and the recorded one."""
    tally = study.tally
    by_noise = [each for each in study.compared if each.reason == "noise"]
    pairs = [
        (comparison, low, high)
        for low, high in noise_extremes(tally.conditions)
        if (comparison := comparison_of(by_noise, high["name"], low["name"]))
    ]
    # random networks are a control: they count only where nothing evolves
    evolved = [pair for pair in pairs if _selection(tally, pair[0].one) in ("coverage", "novelty")]
    pairs = evolved or pairs
    if not pairs:
        return None
    levels = {(float(noise_of(low)), float(noise_of(high))) for _, low, high in pairs}
    span = ""
    if len(levels) == 1:
        ((low, high),) = levels
        span = f" from {100 * low:g} % to {100 * high:g} %"
    compared = [each for each, _, _ in pairs]
    shown = [each for each in compared if each.is_shown]
    quoted = max(shown or compared, key=lambda each: abs(each.size))
    score = "coverage" if study.basis.is_fresh else "best coverage"
    searches = _with_searches(tally, shown or compared)
    directions = {each.size > 0 for each in shown}
    raises = directions.pop() if len(directions) == 1 else None
    claim = effect_of_noise(span, score, searches, raises, is_shown=bool(shown))
    evidence = f"{quoted.one} − {quoted.other}: {_difference([quoted])}."
    if not study.basis.is_fresh:
        return study.find(claim, evidence)
    recorded = comparison_of(study.recorded, quoted.one, quoted.other)
    value = "–" if recorded is None else with_interval(recorded.difference, signs=True)
    return study.find(
        claim, f"{evidence} As recorded, luck included: {value}.", (*study.tables, "comparisons")
    )


def _with_searches(tally: Tally, comparisons: Sequence[Comparison]) -> str:
    words = dict.fromkeys(_SEARCHES.get(_selection(tally, each.one), "") for each in comparisons)
    return f" of {' and '.join(words)}" if all(words) else ""


# changes


def _of_changes(study: _Study) -> Finding | None:
    """Return the number of changes against a baseline that are supported, and the largest."""
    changes = [each for each in study.compared if each.reason == "baseline"]
    shown = sorted((each for each in changes if each.is_shown), key=lambda each: -abs(each.size))
    if not changes:
        return None
    if not shown:
        return study.find(changes_supported(0, len(changes)), "")
    named = "; ".join(f"{each.one} {_difference([each])}" for each in shown[:2])
    return study.find(changes_supported(len(shown), len(changes)), f"Largest: {named}.")


# limits


def _limits(study: _Study, conditions: Sequence[DescribedCondition], caveats: Sequence[str]) -> str:
    origins = sorted({_ORIGINS.get(label_of(each), label_of(each)) for each in conditions})
    runs = counted_range((len(study.tally.replicates(each["name"])) for each in conditions), "run")
    parts = [" and ".join(origins), f"{runs} per condition"]
    if study.compared:
        n_open = sum(not each.is_shown and not each.is_equivalent for each in study.compared)
        parts.append(f"{n_open} of {counted(len(study.compared), 'comparison')} inconclusive")
    if len(study.compared) > 1:
        parts.append("p corrected for all of them")
    parts += dict.fromkeys(caveats)
    return f"{'; '.join(parts)}; brackets hold 95 % intervals."


# words


def _is_above(comparison: Comparison) -> bool:
    return comparison.is_shown and comparison.size > 0


def _difference(comparisons: Sequence[Comparison]) -> str:
    """Return the difference with its interval and corrected p; of several, the smallest and the largest p."""
    if len(comparisons) == 1:
        return difference_clause(comparisons[0].difference, comparisons[0].p_holm)
    if all(each.is_shown for each in comparisons):
        nearest = min(comparisons, key=lambda each: abs(each.size))
        most = max(each.p_holm for each in comparisons)
        return f"smallest difference {difference_clause(nearest.difference, most, bound=True)}"
    largest = max(comparisons, key=lambda each: abs(each.size))
    return f"largest difference {difference_clause(largest.difference, largest.p_holm)}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
