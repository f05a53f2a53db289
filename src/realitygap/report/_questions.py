"""Questions that the paper could not answer: plateaus, spread, variety, and the role of chance with three runs."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import polars as pl

from realitygap.evolution import largest_cell_distance
from realitygap.report._champions import MOST_RUNS
from realitygap.report._comparisons import paired_values, same_but_for
from realitygap.report._tally import DescribedCondition, Results, Tally, read_tally, settings_of
from realitygap.stats import (
    SEED,
    Estimate,
    bca_intervals,
    exact_share_interval,
    lattice,
    ratio_of_robust_spreads,
    ratio_of_spreads,
    robust_spread,
)
from realitygap.world import ArenaSettings

Values = npt.NDArray[np.float64]

MOST_BEHAVIORS = 40
"""Maximum number of behaviors of a run that are compared in pairs: all of a run of the paper's size, otherwise a
sample."""


# plateaus


def plateau_length(n_generations: int) -> int:
    """Generations without a better trial that make a plateau: half of a run, rounded down."""
    return n_generations // 2


def plateaus(tally: Tally, condition: str) -> Estimate | None:
    """Runs whose best coverage so far does not rise in the last half of their generations.

    Returns:
        The share of runs with its exact interval; None with fewer than two generations.
    """
    bests = tally.generation_bests(condition, tally.measure)
    n, generations = bests.shape
    k = plateau_length(generations)
    if n == 0 or k == 0:
        return None
    so_far = np.fmax.accumulate(bests, axis=1)
    return exact_share_interval(int((so_far[:, -1] == so_far[:, -1 - k]).sum()), n)


# spread


@dataclass(frozen=True)
class Spread:
    """The spread of the runs of a condition, compared with another condition.

    Attributes:
        condition: Name of the condition.
        n: Number of runs.
        deviation: Standard deviation [share of the reachable cells]; NaN with one run.
        robust: Mean distance from the median, in standard deviations of a normal distribution with as much; a few
            extreme runs move it less.
        reference: Condition with which it is compared; its own name if there is none.
        ratio: `deviation` divided by that of the reference, with its BCa interval; refused if that is 0.
        robust_ratio: Ratio of `robust`, like `ratio`.
    """

    condition: str
    n: int
    deviation: float
    robust: float
    reference: str
    ratio: Estimate
    robust_ratio: Estimate


def spreads(tally: Tally) -> list[Spread]:
    """The spread of each condition with runs, against its baseline or the first of its selection."""
    return [_spread(tally, each["name"], _reference(each, tally.with_runs)) for each in tally.with_runs]


def _reference(condition: DescribedCondition, others: Sequence[DescribedCondition]) -> str:
    names = [each["name"] for each in others]
    if condition.get("baseline") in names:
        return str(condition["baseline"])
    for group in same_but_for("noise", others):
        if any(each["name"] == condition["name"] for each in group):
            return str(group[0]["name"])
    return str(condition["name"])


def _ratio(one: float, other: float, estimate: Estimate) -> Estimate:
    """Return the ratio of two spreads with the interval of an estimate of it."""
    if other <= 0:
        return Estimate.refusal(estimate.n, "The other condition has no spread.")
    return replace(estimate, value=one / other)


def _spread(tally: Tally, condition: str, reference: str) -> Spread:
    own = tally.run_bests(condition, tally.measure)
    samples = paired_values(tally, condition, reference)
    one, other = samples.one, samples.other
    ratio = robust = Estimate.refusal(min(len(one), len(other)), "There is no other condition with two runs.")
    if reference != condition and min(len(one), len(other)) > 1:
        ratio, robust = bca_intervals(
            [ratio_of_spreads, ratio_of_robust_spreads], one, other, paired=samples.paired
        )
        ratio = _ratio(float(one.std(ddof=1)), float(other.std(ddof=1)), ratio)
        robust = _ratio(robust_spread(one), robust_spread(other), robust)
    return Spread(
        condition,
        len(own),
        float(own.std(ddof=1)) if len(own) > 1 else math.nan,
        robust_spread(own),
        reference,
        ratio,
        robust,
    )


# variety


@dataclass(frozen=True)
class Variety:
    """The difference between the behaviors of a run, averaged over runs.

    Attributes:
        condition: Name of the condition.
        sorted_cells: (n,) mean distance of two behaviors of a run, the paper's [cells].
        jaccard: (n,) mean Jaccard distance of two behaviors: the share of cells visited by one of them
            alone, of those visited by either [0..1].
        n_behaviors: Behaviors of a run that were compared, at most.
    """

    condition: str
    sorted_cells: Values
    jaccard: Values
    n_behaviors: int

    @property
    def n(self) -> int:
        """Runs."""
        return len(self.jaccard)


def measure_variety(folder: Results) -> list[Variety]:
    """Mean distance between the behaviors of a run, for up to 100 runs a condition.

    A behavior is the set of cells along the line driven. From a run with more than 40 behaviors, 40 are drawn with a
    fixed seed.

    Args:
        folder: Results of a study, or the path to them.

    Returns:
        One for each condition with runs.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.

    Source: the distance of sorted cells, Rosenzweig & Remy, section 2.4 (by x, then y); Jaccard (1912).
    """
    tally = read_tally(folder)
    return [_variety(tally, each) for each in tally.with_runs]


def _variety(tally: Tally, condition: DescribedCondition) -> Variety:
    name = condition["name"]
    replicates = [int(run) for run in tally.replicates(name)[:MOST_RUNS]]
    rows = tally.folder.read(name, replicates, ["replicate", "cells"])
    columns, lines = grid_of(condition)
    points = np.stack(np.divmod(np.arange(columns * lines), lines), axis=1).astype(float)
    rng = np.random.default_rng(SEED)
    lengths = rows["replicate"].rle().struct.field("len").to_list()
    chosen = [
        first
        + (np.sort(rng.choice(n, MOST_BEHAVIORS, replace=False)) if n > MOST_BEHAVIORS else np.arange(n))
        for first, n in zip(itertools.accumulate(lengths, initial=0), lengths, strict=False)
    ]
    visited = _visited(rows["cells"].gather(np.concatenate(chosen)), columns, lines)
    behaviors = np.split(visited, np.cumsum([len(each) for each in chosen])[:-1])
    compared = [each for each in behaviors if len(each) > 1]
    padding = largest_cell_distance(columns, lines)
    return Variety(
        name,
        np.array([mean_sorted_distance(each, points, padding) for each in compared]),
        np.array([mean_jaccard_distance(each) for each in compared]),
        max(map(len, behaviors)),
    )


def _visited(cells: pl.Series, columns: int, lines: int) -> npt.NDArray[np.bool_]:
    """Return the cells that each of n behaviors visits, in the paper's order: by x, then y, (n, c)."""
    visited = np.zeros((len(cells), columns * lines), np.bool_)
    # cells are numbered row by row
    row, column = np.divmod(cells.explode().drop_nulls().to_numpy().astype(np.int64), columns)
    behavior = np.repeat(np.arange(len(cells)), cells.list.len().to_numpy())
    visited[behavior, column * lines + row] = True
    return visited


def grid_of(condition: DescribedCondition) -> tuple[int, int]:
    """Return columns and rows of the arena's reachable cells; the paper's if the settings have none."""
    try:
        grid = ArenaSettings.model_validate(settings_of(condition).get("arena", {})).arena().grid
    except ValueError:
        return 12, 6
    return grid.columns, grid.rows


def mean_sorted_distance(visited: npt.NDArray[np.bool_], points: Values, padding: float) -> float:
    """Mean distance of sorted cells over all pairs of n behaviors [cells].

    Args:
        visited: (n, c) cells that each behavior visits, in the order in which cells are sorted.
        points: (c, 2) positions of the cells [cells].
        padding: Distance for each cell without a counterpart.
    """
    lengths = visited.sum(axis=1)
    width = max(int(lengths.max()), 1)
    # the cells of each behavior first, in order, then places that are not used
    order = np.argsort(~visited, axis=1, kind="stable")[:, :width]
    one, other = np.triu_indices(len(visited), 1)
    between = np.sqrt(((points[:, None] - points[None]) ** 2).sum(axis=2))
    shorter = np.minimum(lengths[one], lengths[other])
    distance = between[order[one], order[other]]
    distance[np.arange(width) >= shorter[:, None]] = 0.0
    unmatched = np.maximum(lengths[one], lengths[other]) - shorter
    return float((distance.sum(axis=1) + padding * unmatched).mean())


def mean_jaccard_distance(visited: npt.NDArray[np.bool_]) -> float:
    """Mean Jaccard distance over all pairs of n behaviors [0..1]; two that visit nothing are equal."""
    counts = visited.astype(np.float64)
    lengths = counts.sum(axis=1)
    both = counts @ counts.T
    either = lengths[:, None] + lengths[None] - both
    distance = 1.0 - np.divide(both, either, out=np.ones_like(both), where=either > 0)
    return float(distance[np.triu_indices(len(visited), 1)].mean())


# chance


@dataclass(frozen=True)
class Chance:
    """The chance of each of several conditions to have the highest mean of a few runs.

    Attributes:
        conditions: Names of the conditions, one for each level.
        n_runs: Number of runs of each that are drawn.
        best: (k,) share of draws from the observed runs in which each level is the best [0..1].
        best_if_equal: The same share if all levels have one distribution, that of all their runs together.
    """

    conditions: tuple[str, ...]
    n_runs: int
    best: Values
    best_if_equal: float


def chance_of_best(samples: Sequence[Values], n_runs: int) -> Values:
    """Return the chance of each of k samples to have the highest mean of `n_runs` values drawn with replacement.

    Args:
        samples: k arrays of values that are multiples of one unit, as coverages are.
        n_runs: Values drawn from each, >= 1.

    Returns:
        (k,) adding up to 1; those with equal means share. Exact: distributions of sums are computed, and
        nothing is drawn.

    Raises:
        ValueError: the values have no common unit.
    """
    whole = lattice(np.concatenate(samples))
    if whole is None:
        raise ValueError("The values are no multiples of 1/N for an N up to 256, as coverages are.")
    parts = np.split(whole - whole.min(), np.cumsum([len(sample) for sample in samples])[:-1])
    most = int(max(part.max() for part in parts))
    sums = np.stack([_sum_distribution(part, most, n_runs) for part in parts])
    below = np.cumsum(sums, axis=1) - sums
    return np.array([_wins(sums, below, k) for k in range(len(sums))])


def _sum_distribution(values: npt.NDArray[np.int64], most: int, n_runs: int) -> Values:
    one = np.bincount(values, minlength=most + 1) / len(values)
    total = np.ones(1)
    for _ in range(n_runs):
        total = np.convolve(total, one)
    return total


def _wins(sums: Values, below: Values, k: int) -> float:
    """Return the probability that sample k is highest. If it ties with j others, it counts 1 / (j + 1) of that."""
    # ties[j]: that j of the others so far equal k's sum, and the rest are below it
    ties = [np.ones(sums.shape[1])]
    for other in range(len(sums)):
        if other != k:
            grown = [each * below[other] for each in ties] + [np.zeros(sums.shape[1])]
            for j, each in enumerate(ties):
                grown[j + 1] = grown[j + 1] + each * sums[other]
            ties = grown
    return float(sum((sums[k] * each).sum() / (j + 1) for j, each in enumerate(ties)))


def chances(tally: Tally, n_runs: int = 3) -> list[Chance]:
    """Return the chance of each noise level to have the highest mean of `n_runs` runs.

    Each group of three or more conditions that differ in noise alone gives one result.
    """
    chances_of = []
    for group in same_but_for("noise", tally.with_runs):
        if len(group) < 3:
            continue
        names = tuple(str(each["name"]) for each in group)
        samples = [tally.run_bests(name, tally.measure) for name in names]
        together = np.concatenate(samples)
        if lattice(together) is not None:
            equal = chance_of_best([together] * len(samples), n_runs)
            chances_of.append(Chance(names, n_runs, chance_of_best(samples, n_runs), float(equal[0])))
    return chances_of
