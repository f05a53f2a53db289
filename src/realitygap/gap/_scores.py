"""The gap in a table of scores: which rows are compared, and which tables are refused."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from realitygap._wording import (
    counted,
    gap_equivalence,
    methods_of_successes,
    rank_violation,
    ties_in_words,
    with_interval,
)
from realitygap.errors import TableError
from realitygap.logs import ScoreRow
from realitygap.stats import (
    MOST_CELLS,
    Estimate,
    Range,
    boschloo_p,
    holm,
    mcnemar_p,
    paired_success_difference,
    success_difference,
)

from ._level import difference_ends
from ._measure import LEAST_ORDERED, SEED, measure_gap
from ._ranks import Ties, WorstPair, worst_pair
from ._result import GapResult
from ._side import GapSide, Values

_MOST_NAMED = 12
"""Names in a message."""

BySide = Mapping[str, Sequence[ScoreRow]]
"""Rows of one platform by controller."""


@dataclass(frozen=True)
class ScoredController:
    """A controller of a table.

    Attributes:
        name: Its name.
        kind: Kind of controllers, for figures.
    """

    name: str
    kind: str = "table"


@dataclass(frozen=True)
class ScoreGap:
    """The gap between two platforms in a table of scores, for one task.

    Attributes:
        task: Name of the task; empty if the table has no tasks.
        result: All measures.
        source: Scores in simulation.
        target: Scores on the target.
        controllers: Row k of both sides is controller k.
        worst_pair: Pair of controllers with the largest rank violation; None if no pair is violated, or without order.
        left_out: Controllers of one platform only, which were left out.
        differences: Difference of each controller, target minus simulator, with its interval if trials are known.
        ties: Counting of pairs that tie on one platform only.
    """

    task: str
    result: GapResult
    source: GapSide
    target: GapSide
    controllers: tuple[ScoredController, ...]
    worst_pair: WorstPair | None
    left_out: tuple[str, ...]
    differences: tuple[Estimate, ...]
    ties: Ties = "both"

    @property
    def main_measures(self) -> list[tuple[str, str]]:
        """Name and value of the measures that matter most, in words."""
        result = self.result
        rms = (
            ("RMS, with noise", with_interval(result.raw_rms))
            if result.rms.value is None
            else ("RMS gap", with_interval(result.rms))
        )
        rows = [
            ("level", with_interval(result.level)),
            rms,
            *(
                (name, "" if estimate.value is None else with_interval(estimate))
                for name, estimate in (
                    ("rank correlation", result.srcc),
                    ("noise ceiling", result.noise_ceiling),
                    ("linear correlation", result.pearson),
                    ("rank violation (MMRV)", result.mmrv),
                    ("mean violation", result.mean_violation),
                )
            ),
            ("worst pair", self._worst_in_words),
            ("equivalence", gap_equivalence(result.equivalence)),
        ]
        return [(name, words) for name, words in rows if words]

    @property
    def _worst_in_words(self) -> str:
        if self.worst_pair is None:
            return ""
        better, worse, violation = self.worst_pair
        return rank_violation(
            self.controllers[better].name,
            self.controllers[worse].name,
            violation,
            self.source.in_words,
            self.target.in_words,
        )

    @property
    def remarks(self) -> list[str]:
        """Remarks on ties, and notes."""
        ties = ties_in_words(int(self.result.mmrv.more.get("ties") or 0), self.ties)
        found = [ties, *self.result.notes]
        sides = (self.source, self.target)
        has_trials = not any(side.are_means for side in sides)
        if has_trials and self.source.is_binary:
            found.append(methods_of_successes(paired=self.result.paired))
        elif has_trials and all(np.isin(_given(side), (0, 1)).all() for side in sides):
            found.append(
                "All scores are 0 or 1. For exact intervals and tests of each controller, add --binary."
            )
        return [text for text in found if text]

    @property
    def reasons(self) -> list[str]:
        """Why a main measure or its interval is missing, what is needed, and remarks; each once."""
        result = self.result
        of = [result.level, result.rms, result.srcc, result.pearson, result.mmrv, result.mean_violation]
        if result.equivalence.more.get("margin") is not None:
            of.append(result.equivalence)
        found = [*(each.refused for each in of), *self.remarks]
        return [text for text in dict.fromkeys(found) if text]

    @property
    def expected(self) -> tuple[Estimate | None, ...]:
        """The expected difference of each controller; None without a model of controllers and trials."""
        return self.result.each or (None,) * len(self.controllers)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values: the measures, the worst pair by name, and the mean scores of each controller."""
        worst = None
        if self.worst_pair is not None:
            better, worse, violation = self.worst_pair
            names = (self.controllers[better].name, self.controllers[worse].name)
            worst = {"better": names[0], "worse": names[1], "violation": violation}
        estimates = (self.source.estimates, self.target.estimates, self.differences)
        rows = zip(self.controllers, *estimates, self.expected, strict=True)
        return (
            {"task": self.task}
            | self.result.to_dict()
            | {
                "worst_pair": worst,
                "paired": self.result.paired,
                "left_out": list(self.left_out),
                "controllers": [
                    {
                        "name": each.name,
                        "sim": sim.to_dict(),
                        "real": real.to_dict(),
                        "difference": apart.to_dict(),
                        "expected": None if expected is None else expected.to_dict(),
                    }
                    for each, sim, real, apart, expected in rows
                ],
            }
        )


@dataclass(frozen=True)
class Comparison:
    """Platforms and settings of a comparison.

    Attributes:
        sim: Platform that predicts.
        real: Platform that is predicted.
        labels: Labels of both: SIM, TWIN, EMULATED, or REAL.
        score_range: Range of scores.
        score: Name of the score.
        margin: Margin of equivalence; None without one.
        shared: True to leave out controllers, and blocks, of one platform only.
        ties: Counting of pairs that tie on one platform only.
        is_binary: True if scores are successes.
        uses_blocks: True to pair trials of the same block.
        seed: Seed of random draws.
    """

    sim: str
    real: str
    labels: tuple[str, str] = ("SIM", "REAL")
    score_range: Range = (0.0, 1.0)
    score: str = "score"
    margin: float | None = None
    shared: bool = False
    ties: Ties = "both"
    is_binary: bool = False
    uses_blocks: bool = True
    seed: int = SEED


def compare_scores(rows: Iterable[ScoreRow], how: Comparison) -> list[ScoreGap]:
    """Return the gap in a table of scores, for each task apart.

    Correlations over tasks are never averaged: a mean over tasks hides the task whose order is wrong.

    Args:
        rows: Rows of one or several tables; those of other platforms are left out.
        how: Platforms and settings.

    Raises:
        TableError: The table does not support a comparison; the message states the reason, and what to do.
    """
    chosen = [row for row in rows if row.platform in (how.sim, how.real)]
    _check(chosen, how)
    chosen = _with_common_task(chosen, how)
    tasks = list(dict.fromkeys(row.task for row in chosen))
    return [_of_task(task, [row for row in chosen if row.task == task], how) for task in tasks]


def _check(rows: Sequence[ScoreRow], how: Comparison) -> None:
    """Raise an error if a platform has no rows, a score is out of range, or a row occurs twice.

    Raises:
        TableError: That is so.
    """
    for name in (how.sim, how.real):
        if not any(row.platform == name for row in rows):
            raise TableError(f"The table has no scores of {name}.")
    low, high = how.score_range
    for row in rows:
        if not low <= row.score <= high:
            percent = (
                " If scores are in percent, give --range 0:100."
                if (low, high) == (0.0, 1.0) and 1 < row.score <= 100
                else " Give the range of the scores: --range LOW:HIGH"
            )
            raise TableError(
                f"{row.place}: the score of {row.controller} on {row.platform} is {row.score:g}, expected {low:g} to "
                f"{high:g}.{percent}"
            )
    if how.is_binary:
        _check_successes(rows)
    seen: dict[tuple[str, ...], ScoreRow] = {}
    for row in rows:
        key = (row.task, row.platform, row.controller, row.block, row.trial)
        if key in seen:
            what = f"trial {row.trial}" if row.trial else "a mean"
            raise TableError(
                f"{row.place}: {what} of {row.controller} on {row.platform} occurs twice, first in {seen[key].place}. "
                "Number trials in a column trial, name tasks in a column task, or remove one row."
            )
        seen[key] = row


def _with_common_task(rows: list[ScoreRow], how: Comparison) -> list[ScoreRow]:
    """Return the rows with the task of the other platform for a platform without tasks.

    Raises:
        TableError: The other platform has several tasks.
    """
    tasks = {name: {row.task for row in rows if row.platform == name} for name in (how.sim, how.real)}
    for name, other in ((how.sim, how.real), (how.real, how.sim)):
        if tasks[name] == {""} and tasks[other] != {""}:
            if len(tasks[other]) > 1:
                raise TableError(
                    f"The scores of {name} have no task, and those of {other} have {len(tasks[other])}. Choose one: "
                    "--task NAME"
                )
            (task,) = tasks[other]
            return [replace(row, task=task) for row in rows]
    return rows


def _check_successes(rows: Sequence[ScoreRow]) -> None:
    """Raise an error if a trial is neither a success nor a failure.

    Raises:
        TableError: That is so.
    """
    for row in rows:
        if not row.is_mean and row.score not in (0, 1):
            raise TableError(
                f"{row.place}: the score of {row.controller} on {row.platform} is {row.score:g}, expected 0 or 1 with "
                "--binary. Leave --binary out for partial scores."
            )


def _of_task(task: str, rows: Sequence[ScoreRow], how: Comparison) -> ScoreGap:
    of_task = f" in task {task}" if task else ""
    sides = [_by_controller(rows, platform) for platform in (how.sim, how.real)]
    shared = [name for name in sides[0] if name in sides[1]]
    left_out = [name for side in sides for name in side if name not in shared]
    if left_out and not how.shared:
        raise TableError(
            f"{counted(len(left_out), 'controller')}{of_task} {'is' if len(left_out) == 1 else 'are'} on one platform "
            f"only: {_listed(left_out)}. Add scores on the other platform, or leave them out: --shared"
        )
    of_shared = [{name: side[name] for name in shared} for side in sides]
    has_trials = all(_has_trials(of, how) for side in of_shared for of in side.values())
    if not shared or (len(shared) < LEAST_ORDERED and not has_trials):
        raise TableError(
            f"{how.sim} and {how.real} share {counted(len(shared), 'controller')}{of_task}, expected at least "
            f"{LEAST_ORDERED}: the gap is measured over controllers. Add controllers, or give a row for each trial."
        )
    pairs = _pairs(of_shared[0], of_shared[1], how) if has_trials and how.uses_blocks else None
    scores = pairs or [{name: _scores(of, how) for name, of in side.items()} for side in of_shared]
    source, target = (
        _side(platform, label, side, of, how)
        for platform, label, side, of in zip((how.sim, how.real), how.labels, scores, of_shared, strict=True)
    )
    notes = [f"Left out, because they are on one platform only: {_listed(left_out)}."] if left_out else []
    if pairs is not None:
        notes.append("Trials are paired: each pair has the same block on both platforms.")
    result = measure_gap(
        source, target, margin=how.margin, ties=how.ties, paired=pairs is not None, seed=how.seed
    )
    worst = None if result.mmrv.value is None else worst_pair(source.means, target.means, how.ties)
    controllers = tuple(map(ScoredController, shared))
    result = replace(result, score=how.score, notes=tuple(notes))
    differences = _differences(source, target, paired=pairs is not None)
    return ScoreGap(task, result, source, target, controllers, worst, tuple(left_out), differences, how.ties)


def _differences(source: GapSide, target: GapSide, *, paired: bool) -> tuple[Estimate, ...]:
    """Return the difference of each controller, with an interval if it has several trials on both sides."""
    counts = np.minimum(source.counts, target.counts).tolist()
    values = (target.means - source.means).tolist()
    if source.are_means or target.are_means:
        return tuple(Estimate(value, None, None, 0, "means without trials") for value in values)
    if source.is_binary:
        return _differences_of_successes(source, target, paired=paired)
    ends = np.column_stack(difference_ends(source, target, paired=paired)).tolist()
    return tuple(
        Estimate(value, each[0], each[1], n, method="t") if n > 1 else Estimate.of_few(value, n, 2, "trials")
        for value, each, n in zip(values, ends, counts, strict=True)
    )


def _given(side: GapSide) -> Values:
    """Return the scores of all trials, (n,)."""
    return side.values[~np.isnan(side.values)]


def _differences_of_successes(source: GapSide, target: GapSide, *, paired: bool) -> tuple[Estimate, ...]:
    """Return the difference in successes of each controller, with p of the exact test, corrected over controllers."""
    found: list[tuple[Estimate, float | None]] = []
    for sim, real in zip(source.values, target.values, strict=True):
        if paired:
            gained, lost = int(np.nansum(real > sim)), int(np.nansum(sim > real))
            n = int((~np.isnan(sim)).sum())
            found.append((paired_success_difference(gained, lost, n), mcnemar_p(gained, lost)))
            continue
        counts = [
            number for side in (sim, real) for number in (int(np.nansum(side)), int((~np.isnan(side)).sum()))
        ]
        is_feasible = (counts[1] + 1) * (counts[3] + 1) <= MOST_CELLS
        found.append((success_difference(*counts), boschloo_p(*counts) if is_feasible else None))
    known = [p for _, p in found if p is not None]
    corrected = iter(holm(np.array(known)).tolist())
    return tuple(
        replace(difference, more={"p": None if p is None else next(corrected)}) for difference, p in found
    )


def _by_controller(rows: Iterable[ScoreRow], platform: str) -> dict[str, list[ScoreRow]]:
    """Return the rows of a platform by controller."""
    found: dict[str, list[ScoreRow]] = {}
    for row in rows:
        if row.platform == platform:
            found.setdefault(row.controller, []).append(row)
    return found


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _MOST_NAMED
    *shown, last = [*names[:_MOST_NAMED], *([f"{more} more"] if more > 0 else [])]
    return f"{', '.join(shown)} and {last}" if shown else last


# scores of one controller


def _has_trials(rows: Sequence[ScoreRow], how: Comparison) -> bool:
    """Return whether the scores of single trials are known; those of successes are, if their number is."""
    return not rows[0].is_mean or (how.is_binary and rows[0].n is not None)


def _scores(rows: Sequence[ScoreRow], how: Comparison) -> list[float]:
    """Return the scores of the trials of a controller, or its mean.

    Raises:
        TableError: There are trials and a mean, or a share that so many trials cannot have.
    """
    first = rows[0]
    mean = next((row for row in rows if row.is_mean), None)
    if mean is None:
        return [row.score for row in rows]
    if len(rows) > 1:
        raise TableError(
            f"{mean.place}: a mean of {first.controller} on {first.platform}, which also has trials. Remove one of "
            "both, or number the trials in a column trial."
        )
    if mean.n is None or not how.is_binary:
        return [mean.score]
    successes = round(mean.score * mean.n)
    if abs(successes / mean.n - mean.score) > 0.5 * 10.0**-mean.decimals + 1e-9:
        raise TableError(
            f"{mean.place}: {mean.score:g} of {counted(mean.n, 'trial')} is no whole number of successes. The nearest "
            f"share is {successes / mean.n:.4f}. Correct the score or n."
        )
    return [1.0] * successes + [0.0] * (mean.n - successes)


def _side(
    platform: str, label: str, scores: Mapping[str, Sequence[float]], rows: BySide, how: Comparison
) -> GapSide:
    """Return one side of the gap.

    Raises:
        TableError: Some controllers have trials, and others a mean alone.
    """
    means = [name for name, of in rows.items() if not _has_trials(of, how)]
    if means and len(means) < len(rows):
        raise TableError(
            f"On {platform}, {_listed(means)} {'has' if len(means) == 1 else 'have'} a mean alone, and other "
            "controllers have trials. Give trials of all, or the mean of all."
        )
    side = GapSide.of_trials(platform, label, list(scores.values()), how.score_range, title=platform)
    return replace(side, are_means=bool(means), is_binary=how.is_binary)


# blocks


def _pairs(sim: BySide, real: BySide, how: Comparison) -> list[dict[str, list[float]]] | None:
    """Return the scores of both platforms in the same order of blocks; None if there are no blocks.

    Several trials in a block are averaged.

    Raises:
        TableError: Blocks are on one platform only, or there are several successes in one.
    """
    if not all(row.block for side in (sim, real) for rows in side.values() for row in rows):
        return None
    pairs: list[dict[str, list[float]]] = [{}, {}]
    for name in sim:
        blocks = [_by_block(rows, how) for rows in (sim[name], real[name])]
        both = [block for block in blocks[0] if block in blocks[1]]
        only = [block for side in blocks for block in side if block not in both]
        if only and not how.shared:
            raise TableError(
                f"{counted(len(only), 'block')} of {name} {'is' if len(only) == 1 else 'are'} on one platform only: "
                f"{_listed(only)}. Leave them out (--shared), or compare without pairs (--unpaired)."
            )
        if not both:
            raise TableError(f"{name} has no block on both platforms. Compare without pairs: --unpaired")
        for scores, side in zip(pairs, blocks, strict=True):
            scores[name] = [side[block] for block in both]
    return pairs


def _by_block(rows: Sequence[ScoreRow], how: Comparison) -> dict[str, float]:
    found: dict[str, list[float]] = {}
    for row in rows:
        found.setdefault(row.block, []).append(row.score)
    twice = next((block for block, scores in found.items() if len(scores) > 1), None)
    if twice is not None and how.is_binary:
        first = rows[0]
        raise TableError(
            f"{first.controller} was tried {len(found[twice])} times in block {twice} on {first.platform}, expected "
            "one success or failure for each pair. Compare without pairs: --unpaired"
        )
    return {block: float(np.mean(scores)) for block, scores in found.items()}
