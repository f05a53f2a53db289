"""The part of the page that compares conditions and answers what the paper asks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap._wording import bracketed, count_range, fixed, signed
from realitygap.report._champions import FRESH_TRIALS, MOST_RUNS, Champions
from realitygap.report._comparisons import (
    INTERVAL_NAME,
    Comparison,
    ComparisonsOnPage,
    comparisons_content,
    same_but_for,
)
from realitygap.report._questions import (
    MOST_BEHAVIORS,
    Variety,
    chances,
    measure_variety,
    plateau_length,
    plateaus,
    spreads,
)
from realitygap.report._table import Column, Part, Row, TableOnPage
from realitygap.report._tally import DescribedCondition, Tally, label_of, settings_of
from realitygap.stats import Estimate, bca_interval, bca_mean, difference_of_means


@dataclass(frozen=True)
class Deception:
    """Whether coverage under noise is a deceptive task.

    Attributes:
        table: Mean best coverage of a run, and runs that end on a plateau.
        k: Generations of a plateau.
        generations: Generations of a run.
        without_learning: Share of runs without learning that end on a plateau; None without such a condition.
        inputs_differ: True if networks have an additional input with novelty.
    """

    table: TableOnPage
    k: int
    generations: int
    without_learning: str | None
    inputs_differ: bool


@dataclass(frozen=True)
class Luck:
    """The part of the best coverage that is luck.

    Attributes:
        table: Best networks as reported and on fresh noise.
        problem: Why no network could be tried again; None if one could.
        missing: Conditions whose networks could not be tried again.
        fresh_trials: Number of trials of each network on fresh noise.
        trials_a_run: Number of trials of a run.
    """

    table: TableOnPage
    problem: str | None
    missing: list[str]
    fresh_trials: int
    trials_a_run: str


@dataclass(frozen=True)
class ChanceOnPage:
    """Which noise level comes out best by chance.

    Attributes:
        table: How often each level has the highest mean.
        sentence: How often it is that with 50 %; None without this level.
    """

    table: TableOnPage
    sentence: str | None


@dataclass(frozen=True)
class Statistics:
    """Answers to the paper’s questions, for the page.

    Attributes:
        comparisons: Comparisons of recorded scores; None without any.
        fresh: Comparisons on fresh noise; None without any.
        deception: Whether the task is deceptive; None without runs that end on a plateau or not.
        champions: How much of the best coverage is luck.
        spread: Spread between runs.
        variety: Variety of behaviors within a run; None if it cannot be measured.
        chance: Which noise level comes out best; None without several levels.
    """

    comparisons: ComparisonsOnPage | None
    fresh: ComparisonsOnPage | None
    deception: Deception | None
    champions: Luck
    spread: TableOnPage
    variety: TableOnPage | None
    chance: ChanceOnPage | None

    @property
    def compared(self) -> list[TableOnPage]:
        """Tables of comparisons in the order of the page."""
        return [each.table for each in (self.fresh, self.comparisons) if each is not None]

    @property
    def answers(self) -> list[TableOnPage | None]:
        """Tables of the paper's questions in the order of the page; None for one that is missing."""
        return [
            None if self.deception is None else self.deception.table,
            None if self.chance is None else self.chance.table,
            None if self.champions.problem else self.champions.table,
            self.spread,
            self.variety,
        ]


def statistics_content(
    tally: Tally,
    comparisons: Sequence[Comparison],
    champions: Sequence[Champions],
    fresh: Sequence[Comparison],
) -> Statistics:
    """Return the content of the section's template.

    Args:
        tally: The study.
        comparisons: Comparisons of its conditions, from `compare_conditions`.
        champions: Its best networks on fresh noise, from `retry_champions`.
        fresh: Comparisons of these networks, from `compare_champions`.
    """
    with_runs = tally.with_runs
    labels = ", ".join(sorted({label_of(each) for each in with_runs}))
    return Statistics(
        comparisons=comparisons_content(
            comparisons,
            "comparisons",
            "Differences between conditions, best coverage of a run as recorded",
            "As recorded",
        ),
        fresh=comparisons_content(
            fresh, "fresh", "Differences between conditions, best networks on fresh noise", "Conclusion"
        ),
        deception=_deception(tally, with_runs, labels),
        champions=_champions(tally, champions, with_runs),
        spread=_spread(tally, labels),
        variety=_variety(tally, with_runs, labels),
        chance=_chance(tally, labels),
    )


def _table(name: str, caption: str, columns: Sequence[Column], rows: Sequence[Row]) -> TableOnPage:
    """Return a table with one row for each condition."""
    return TableOnPage(name, caption, (Column("Condition"), *columns), (Part(rows),))


# deceptiveness


def _deception(tally: Tally, conditions: Sequence[DescribedCondition], labels: str) -> Deception | None:
    rows: list[Row] = []
    generations = 0
    for condition in conditions:
        name = condition["name"]
        share = plateaus(tally, name)
        if share is None:
            continue
        generations = max(generations, tally.generation_bests(name, tally.measure).shape[1])
        values = tally.run_bests(name, tally.measure)
        rows.append(
            (
                name,
                f"{share.n:,}",
                f"{values.mean():.3f}",
                bracketed(bca_mean(values), missing="–"),
                _percent(share),
                _percent_span(share),
            )
        )
    if not rows:
        return None
    table = _table(
        "plateaus",
        f"Mean best coverage of a run, and runs that end on a plateau ({labels}, n runs). Intervals: {INTERVAL_NAME}; "
        "of shares, exact (Clopper & Pearson).",
        (
            Column("n"),
            Column("mean", kind="median"),
            Column("interval"),
            Column("plateaus", kind="median"),
            Column("interval"),
        ),
        rows,
    )
    k = plateau_length(generations)
    has_random = any(settings_of(each).get("selection") == "random" for each in conditions)
    return Deception(
        table=table,
        k=k,
        generations=generations,
        without_learning=f"{100 * (generations - k) / generations:.0f} %" if has_random else None,
        inputs_differ=_inputs_differ(conditions),
    )


def _inputs_differ(conditions: Sequence[DescribedCondition]) -> bool:
    """Return whether networks have an additional input with novelty, so that two settings change together."""
    return any(
        settings_of(each).get("task", {}).get("bias_input") == "with-novelty"
        and settings_of(each).get("selection") == "novelty"
        for group in same_but_for("selection", conditions)
        for each in group
    )


def _within(difference: Estimate, digits: int = 3) -> str:
    return "" if difference.ends is None else f" {bracketed(difference, digits, signs=True)}"


def _percent(share: Estimate) -> str:
    return f"{100 * (share.value or 0.0):.0f} %"


def _percent_span(share: Estimate) -> str:
    return "–" if share.ends is None else f"[{100 * share.ends[0]:.0f}, {100 * share.ends[1]:.0f}] %"


# champions


def _champions(tally: Tally, found: Sequence[Champions], conditions: Sequence[DescribedCondition]) -> Luck:
    problems = {each.problem for each in found if each.problem}
    return Luck(
        table=_champions_table(found, conditions),
        problem=None if any(not each.problem for each in found) else "; ".join(sorted(problems)),
        missing=[each.condition for each in found if each.problem],
        fresh_trials=FRESH_TRIALS,
        trials_a_run=_trials_a_run(tally),
    )


def _champions_table(found: Sequence[Champions], conditions: Sequence[DescribedCondition]) -> TableOnPage:
    columns = [
        Column("n"),
        Column("reported"),
        Column("on fresh noise", kind="median"),
        Column("interval"),
        Column("luck"),
        Column("interval"),
    ]
    rows: list[Row] = [_champion_row(each) for each in found if not each.problem]
    labels = ", ".join(sorted({label_of(each) for each in conditions}))
    return _table(
        "champions",
        f"Coverage of best networks as reported and on fresh noise ({labels}; n runs, up to {MOST_RUNS}; "
        f"{FRESH_TRIALS} fresh trials each). Intervals: {INTERVAL_NAME}, over runs.",
        columns,
        rows,
    )


def _trials_a_run(tally: Tally) -> str:
    return count_range(tally.best.group_by("condition", "replicate").agg(pl.col("trials").sum())["trials"])


def _champion_row(champions: Champions) -> tuple[str, ...]:
    luck = champions.luck
    return (
        champions.condition,
        f"{champions.n:,}",
        f"{champions.reported.mean():.3f}",
        f"{champions.expected.mean():.3f}",
        bracketed(champions.expected_mean, missing="–"),
        signed(luck.value or 0.0),
        bracketed(luck, missing="–", signs=True),
    )


# spread


def _spread(tally: Tally, labels: str) -> TableOnPage:
    measured = spreads(tally)
    has_ratio = any(each.reference != each.condition for each in measured)
    columns = [Column("n"), Column("standard deviation", kind="median"), Column("robust")]
    if has_ratio:
        columns += [
            Column("against", kind="text", head_kind="text"),
            Column("ratio", kind="median"),
            Column("interval"),
            Column("robust ratio"),
            Column("interval"),
        ]
    rows: list[Row] = []
    for each in measured:
        ratios = (
            each.reference,
            _number(each.ratio.value, 2),
            bracketed(each.ratio, 2, "–"),
            _number(each.robust_ratio.value, 2),
            bracketed(each.robust_ratio, 2, "–"),
        )
        if each.reference == each.condition:
            ratios = ("",) * 5
        own = (each.condition, f"{each.n:,}", _number(each.deviation), _number(each.robust))
        rows.append((*own, *ratios) if has_ratio else own)
    about = f" Ratios to the condition named. Intervals: {INTERVAL_NAME}." if has_ratio else ""
    return _table("spread", f"Spread between runs ({labels}, n runs).{about}", columns, rows)


def _number(value: float | None, digits: int = 3) -> str:
    return "–" if value is None or not math.isfinite(value) else fixed(value, digits)


# variety


def _variety(tally: Tally, conditions: Sequence[DescribedCondition], labels: str) -> TableOnPage | None:
    measured = [each for each in measure_variety(tally) if each.n]
    if not measured:
        return None
    by_name = {each.condition: each for each in measured}
    objective: dict[str, str] = {}
    for group in same_but_for("selection", conditions):
        names = {settings_of(each)["selection"]: str(each["name"]) for each in group}
        if "coverage" in names:
            objective |= {name: names["coverage"] for name in names.values() if name != names["coverage"]}
    less = [Column("− objective search")] if objective else []
    columns = [
        Column("n"),
        *(Column("sorted cells [cells]", kind="median"), Column("interval"), *less),
        *(Column("Jaccard", kind="median"), Column("interval"), *less),
    ]
    rows = []
    for each in measured:
        row = _variety_row(each, by_name.get(objective.get(each.condition, "")))
        rows.append(row if objective else (*row[:4], *row[5:7]))
    n_behaviors = max(each.n_behaviors for each in measured)
    return _table(
        "variety",
        f"Variety of behaviors within a run ({labels}; n runs, up to {MOST_RUNS}; "
        f"{'up to ' if n_behaviors == MOST_BEHAVIORS else ''}{n_behaviors} behaviors of each). Intervals: "
        f"{INTERVAL_NAME}, over runs.",
        columns,
        rows,
    )


def _variety_row(variety: Variety, objective: Variety | None) -> tuple[str, ...]:
    row = [variety.condition, f"{variety.n:,}"]
    for digits, own, other in (
        (1, variety.sorted_cells, None if objective is None else objective.sorted_cells),
        (3, variety.jaccard, None if objective is None else objective.jaccard),
    ):
        row += [f"{own.mean():.{digits}f}", bracketed(bca_mean(own), digits, "–")]
        row.append("" if other is None else _difference(own, other, digits))
    return tuple(row)


def _difference(one: npt.NDArray[np.float64], other: npt.NDArray[np.float64], digits: int = 3) -> str:
    within = _within(bca_interval(difference_of_means, one, other, paired=False), digits)
    return f"{signed(float(one.mean() - other.mean()), digits)}{within}"


# chance


def _chance(tally: Tally, labels: str) -> ChanceOnPage | None:
    few, more = chances(tally, 3), chances(tally, 100)
    if not few:
        return None
    rows = []
    for three, hundred in zip(few, more, strict=True):
        for k, condition in enumerate(three.conditions):
            rows.append(
                (
                    condition,
                    f"{len(tally.replicates(condition)):,}",
                    f"{tally.run_bests(condition, tally.measure).mean():.3f}",
                    f"{100 * three.best[k]:.0f} %",
                    f"{100 * three.best_if_equal:.0f} %",
                    f"{100 * hundred.best[k]:.0f} %",
                )
            )
    table = _table(
        "chance",
        f"How often a noise level has the highest mean of those with the same selection ({labels}), if runs are drawn "
        "from the n observed ones, and if all levels have one distribution. Ties are shared.",
        (
            Column("n"),
            Column("mean"),
            Column("best of 3 runs a level", kind="median"),
            Column("if noise made no difference"),
            Column("best of 100 runs a level"),
        ),
        rows,
    )
    return ChanceOnPage(table, _chance_sentence(tally))


def _chance_sentence(tally: Tally) -> str | None:
    """Describe how often 50 % is the best of three levels, for objective and novelty search together."""
    by_selection = {}
    for each in chances(tally, 3):
        settings = [settings_of(tally.condition(name)) for name in each.conditions]
        middle = [k for k, part in enumerate(settings) if part.get("noise") == 0.5]
        if middle:
            by_selection[settings[0].get("selection")] = (each.best[middle[0]], each.best_if_equal)
    if not {"coverage", "novelty"} <= set(by_selection):
        return None
    (objective, equal), (novelty, _) = by_selection["coverage"], by_selection["novelty"]
    return (
        f"With three runs per level, 50 % noise is the best in {100 * objective:.0f} % of studies of objective "
        f"search, in {100 * novelty:.0f} % of those of novelty search, and in both in "
        f"{100 * objective * novelty:.0f} %. If noise had no effect, it would be {100 * equal:.0f} % each, and both "
        f"would agree on some level in {100 * equal:.0f} % of studies."
    )
