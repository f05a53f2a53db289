"""Audit of a distance of behaviors: the weight of each cell, and the influence of the number of cells."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import polars as pl
import scipy

from realitygap._wording import bracketed
from realitygap.errors import RecordError, real_number, whole_number
from realitygap.evolution import BehaviorDistance, CellOrder, behavior_distance, measure_of, pack_behaviors
from realitygap.kernels.neat import distances
from realitygap.records import ResultsFolder
from realitygap.report._questions import grid_of
from realitygap.report._tally import label_of
from realitygap.stats import CONFIDENCE, Estimate, rank_correlation

Values = npt.NDArray[np.float64]

SEED = 1
N_WALKS = 1000
"""Random walks to which each cell is added, or from which it is taken."""
N_PAIRS = 4000
MOST_STEPS = 87
"""Number of steps of a random walk: that of the paper's simulated trial."""
STRAIGHT = 0.6
"""Default probability that a random walk keeps its direction."""
CELL_M = 0.0762
"""The paper's cell of 3 in, as the unit of final positions of walks."""
_RESAMPLES = 1000
_TENTH = 1.1
"""Factor by which cells must have more weight than others for a bias."""
_LEAST_PAIRS = 10


@dataclass(frozen=True)
class Confound:
    """The dependence of a distance on lengths, over pairs of behaviors.

    Attributes:
        of: `random walks`, or the condition whose trials were compared.
        label: SIM, TWIN, EMULATED or REAL; empty for random walks.
        n_pairs: Number of pairs, which share no behavior.
        mean_cells: Mean number of cells of a behavior.
        contained: Share of the cells of the shorter behavior that the longer one visited too, on average [0..1].
        correlation: Spearman's, of the distance with the difference of the numbers of cells; refused if either is the
            same for all pairs. Interval: Bonett & Wright (2000).
        length_difference: (n_pairs,) [cells].
        distance: (n_pairs,) distances in the unit of the distance.
    """

    of: str
    label: str
    n_pairs: int
    mean_cells: float
    contained: float
    correlation: Estimate
    length_difference: Values
    distance: Values

    @property
    def shared(self) -> float:
        """Share of the variance of the ranks of distances that is explained by the lengths [0..1]."""
        value = self.correlation.value
        return math.nan if value is None else value**2


@dataclass(frozen=True)
class DistanceAudit:
    """The result of `audit_distance`.

    Attributes:
        distance: Distance of the audit.
        columns, rows: Size of the grid; `sort`: how the paper's distance sorts cells.
        seed: Seed of the random walks; `straight`: probability that they keep their direction.
        n_walks: Number of walks to which each cell was added, or from which it was removed.
        leverage: (rows, columns) mean distance from a walk to the walk with, or without, the cell, in the unit of the
            distance; `leverage_low`, `leverage_high`: its 95 % interval.
        front_over_back: Mean leverage of the first quarter of cells, as the paper sorts them, over the last quarter's.
        order_correlation: Spearman's, of leverage with the place of the cell in that order.
        highest_over_lowest: Highest leverage of a cell divided by the lowest; infinite if the lowest is 0.
        confounds: Relations with length: on random walks first, then on each condition of a study.
    """

    distance: BehaviorDistance
    columns: int
    rows: int
    sort: CellOrder
    seed: int
    straight: float
    n_walks: int
    leverage: Values
    leverage_low: Values
    leverage_high: Values
    front_over_back: Estimate
    order_correlation: Estimate
    highest_over_lowest: float
    confounds: list[Confound]

    @property
    def relative_leverage(self) -> Values:
        """Leverage divided by its mean over cells, (rows, columns); NaN if no cell has any."""
        mean = float(self.leverage.mean())
        return self.leverage / mean if mean > 0 else np.full_like(self.leverage, math.nan)

    def to_dict(self) -> dict[str, Any]:
        """Return all results but the single pairs as plain values."""
        fields = asdict(self)
        for name in ("leverage", "leverage_low", "leverage_high"):
            fields[name] = getattr(self, name).tolist()
        fields["most_steps"] = MOST_STEPS
        fields["weight_bias"] = weight_bias(self)
        for plain, confound in zip(fields["confounds"], self.confounds, strict=True):
            del plain["length_difference"], plain["distance"]
            plain["shared"] = confound.shared
        plain_values: dict[str, Any] = _without_nan(fields)
        return plain_values


def _without_nan(value: Any) -> Any:
    """JSON has no such numbers: None in their place."""
    if isinstance(value, dict):
        return {key: _without_nan(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_without_nan(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def audit_distance(
    name: str,
    folder: ResultsFolder | str | Path | None = None,
    *,
    seed: int = SEED,
    straight: float = STRAIGHT,
    n_walks: int = N_WALKS,
    n_pairs: int = N_PAIRS,
    sort: CellOrder = "x-then-y",
) -> DistanceAudit:
    """Measure the weight of each cell in a distance of behaviors, and the influence of the number of cells.

    A random walk starts in any of the paper's 12 x 6 cells and makes 1 to 87 steps to one of the four next cells. It
    keeps its direction in six of ten steps. A cell's leverage is the mean distance from a walk to the same walk without
    the cell. If the walk lacks the cell, it is compared with the walk that visits it right after the nearest cell. For
    a metric, this is the largest change of the distance to any behavior by the cell.

    Args:
        name: Name of the distance.
        folder: Results of a study, or the path to them, for the relation with length there; trials of different runs
            are compared.
        seed: Seed of walks and pairs.
        straight: Probability that a random walk keeps its direction, 0 to 1.
        n_walks: Number of walks for the leverage, at least 10.
        n_pairs: Number of pairs of behaviors for the relation with length, at least 10.
        sort: Order of cells in the paper's distance.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, or it holds no trials yet.
        TypeError, ValueError: there is no such distance; a number is no whole one or too small; the distance compares
            where trials ended, which rows do not hold.
    """
    distance = behavior_distance(name)
    seed = whole_number("seed", seed, 0)
    n_walks = whole_number("n_walks", n_walks, 10, 1_000_000)
    n_pairs = whole_number("n_pairs", n_pairs, _LEAST_PAIRS, 1_000_000)
    straight = real_number("straight", straight, 0.0, 1.0)
    study = None if folder is None else _open_for(distance, folder)
    columns, rows = 12, 6
    rng = np.random.default_rng(seed)
    walks = [random_walk(rng, columns, rows, straight) for _ in range(max(n_walks, 2 * n_pairs))]
    grid = _Grid(distance, columns, rows, sort)
    leverages, order = grid.leverages(walks[:n_walks]), grid.order
    means, front, trend = _resampled(leverages[:, order], rng)
    low, high = (np.empty(columns * rows) for _ in range(2))
    low[order], high[order] = np.quantile(means, _BEYOND, axis=0)
    mean = leverages.mean(axis=0)
    confounds = [grid.confound("random walks", "", walks[: 2 * n_pairs])]
    if study is not None:
        confounds += _confounds_of(study, distance, rng, n_pairs, sort)
    return DistanceAudit(
        distance=distance,
        columns=columns,
        rows=rows,
        sort=sort,
        seed=seed,
        straight=straight,
        n_walks=n_walks,
        leverage=mean.reshape(rows, columns),
        leverage_low=low.reshape(rows, columns),
        leverage_high=high.reshape(rows, columns),
        front_over_back=_estimate(_front_over_back(mean[order][None])[0], front, n_walks),
        order_correlation=_estimate(_trend(mean[order][None])[0], trend, n_walks),
        highest_over_lowest=float(mean.max() / mean.min()) if mean.min() > 0 else math.inf,
        confounds=confounds,
    )


_BEYOND = ((1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2)


def _estimate(value: float, resampled: Values, n_walks: int) -> Estimate:
    """Return a number of random walks with the interval of its (b,) resamples."""
    if math.isnan(value):
        return Estimate.refusal(n_walks, "all cells weigh the same")
    low, high = np.quantile(resampled, _BEYOND)
    return Estimate(float(value), float(low), float(high), n_walks, method="percentiles")


# random walks

_WAYS = ((1, 0), (0, 1), (-1, 0), (0, -1))


def random_walk(rng: np.random.Generator, columns: int, rows: int, straight: float) -> list[int]:
    """The cells of a random walk, step by step: the first one, and one after each step."""
    x, y = int(rng.integers(columns)), int(rng.integers(rows))
    cells = [columns * y + x]
    way = (0, 0)
    for goes_on in rng.random(int(rng.integers(1, MOST_STEPS + 1))) < straight:
        open_ways = [(a, b) for a, b in _WAYS if 0 <= x + a < columns and 0 <= y + b < rows]
        if not goes_on or way not in open_ways:
            way = open_ways[int(rng.integers(len(open_ways)))]
        x, y = x + way[0], y + way[1]
        cells.append(columns * y + x)
    return cells


# leverage


def changed_walk(walk: Sequence[int], cell: int, columns: int) -> list[int]:
    """Return a walk without a cell, or with it, after the first visit of the nearest cell, if it lacks the cell."""
    if cell in walk:
        return [each for each in walk if each != cell]
    y, x = divmod(cell, columns)
    apart = [(each % columns - x) ** 2 + (each // columns - y) ** 2 for each in walk]
    after = apart.index(min(apart)) + 1
    return [*walk[:after], cell, *walk[after:]]


@dataclass(frozen=True)
class _Grid:
    """A distance of behaviors on a grid of cells, and the order of cells in the paper's distance."""

    distance: BehaviorDistance
    columns: int
    rows: int
    sort: CellOrder

    @property
    def order(self) -> npt.NDArray[np.int64]:
        """Cells in the paper's order, (c,)."""
        numbers = np.arange(self.columns * self.rows).reshape(self.rows, self.columns)
        return (numbers.T if self.sort == "x-then-y" else numbers).ravel()

    def behavior(self, walk: Sequence[int]) -> Sequence[int] | tuple[float, float]:
        """Return the part of a walk that the distance compares: its cells, or the middle of the last one [m]."""
        if self.distance.compares == "cells":
            return walk
        row, column = divmod(walk[-1] if walk else 0, self.columns)
        return ((column + 0.5) * CELL_M, (row + 0.5) * CELL_M)

    def leverages(self, walks: Sequence[list[int]]) -> Values:
        """Return the distance from each walk to itself with each cell changed, (w, c)."""
        n_cells = self.columns * self.rows
        size = {"columns": self.columns, "rows": self.rows}
        leverages = np.empty((len(walks), n_cells))
        for k, walk in enumerate(walks):
            variants = [changed_walk(walk, cell, self.columns) for cell in range(n_cells)]
            behaviors = [self.behavior(each) for each in (walk, *variants)]
            leverages[k] = self.distance.distances(behaviors[:1], behaviors[1:], sort=self.sort, **size)
        return leverages

    def confound(self, of: str, label: str, behaviors: Sequence[Sequence[int]]) -> Confound:
        """Compare behaviors in pairs: the first with the second, the third with the fourth, and so on."""
        measure = measure_of(self.distance.name, self.columns, self.rows, self.sort)
        packed = pack_behaviors(measure, list(map(self.behavior, behaviors)), self.columns, self.rows)
        apart = np.empty(len(behaviors) // 2)
        distances.distances_in_pairs(measure, packed, apart)
        visited = [set(each) for each in behaviors]
        lengths = np.array([len(each) for each in visited], np.float64)
        difference = np.abs(lengths[0::2] - lengths[1::2])
        both = np.array([len(one & other) for one, other in zip(visited[0::2], visited[1::2], strict=True)])
        return Confound(
            of=of,
            label=label,
            n_pairs=len(apart),
            mean_cells=float(lengths.mean()),
            contained=float((both / np.maximum(1, np.minimum(lengths[0::2], lengths[1::2]))).mean()),
            correlation=rank_correlation(difference, apart),
            length_difference=difference,
            distance=apart,
        )


def _resampled(leverages: Values, rng: np.random.Generator) -> tuple[Values, Values, Values]:
    """Resample walks with replacement; return (b, c) means, (b,) front over back, (b,) correlations with order."""
    n = len(leverages)
    weights = rng.multinomial(n, np.full(n, 1 / n), _RESAMPLES) / n
    means = weights @ leverages
    return means, _front_over_back(means), _trend(means)


def _front_over_back(means: Values) -> Values:
    """Return the mean of the first quarter divided by that of the last, (b,), for means in order, (b, c)."""
    quarter = max(1, means.shape[1] // 4)
    back = means[:, -quarter:].mean(axis=1)
    front = means[:, :quarter].mean(axis=1)
    ratio: Values = np.divide(front, back, out=np.full(len(means), math.nan), where=back > 0)
    return ratio


def _trend(means: Values) -> Values:
    """Return Spearman's correlation of means (b, c) with their place, (b,); NaN if all are equal."""
    # equal but for the rounding of sums is equal
    ranks = scipy.stats.rankdata(means.round(9), axis=1)
    ranks -= ranks.mean(axis=1, keepdims=True)
    place = np.arange(means.shape[1]) - (means.shape[1] - 1) / 2
    spread = np.sqrt((ranks**2).sum(axis=1) * (place**2).sum())
    found: Values = np.divide(ranks @ place, spread, out=np.full(len(means), math.nan), where=spread > 0)
    return found


# the relation with length


def _open_for(distance: BehaviorDistance, folder: ResultsFolder | str | Path) -> ResultsFolder:
    """Results on whose trials a distance can be audited."""
    if distance.compares != "cells":
        raise ValueError(
            f"Distance {distance.name!r} compares where trials ended, which the rows of a study do not hold. Audit it "
            "without a folder, on random walks."
        )
    return folder if isinstance(folder, ResultsFolder) else ResultsFolder.open(folder)


def _confounds_of(
    folder: ResultsFolder, distance: BehaviorDistance, rng: np.random.Generator, n_pairs: int, sort: CellOrder
) -> list[Confound]:
    """Return the confounds for the trials of each condition of a study."""
    confounds = []
    for condition in folder.description["conditions"]:
        rows = folder.read(condition["name"], columns=["replicate", "cells"])
        behaviors = _pairs_of_runs(rows, rng, n_pairs)
        if len(behaviors) >= 2 * _LEAST_PAIRS:
            grid = _Grid(distance, *grid_of(condition), sort)
            confounds.append(grid.confound(condition["name"], label_of(condition), behaviors))
    if not confounds:
        raise RecordError(
            f"{folder.path} holds no condition with {2 * _LEAST_PAIRS} trials of two runs or more, so there is nothing "
            "to compare. Run the study first."
        )
    return confounds


def _pairs_of_runs(rows: pl.DataFrame, rng: np.random.Generator, n_pairs: int) -> list[list[int]]:
    """Behaviors of trials drawn without replacement, two by two of different runs."""
    drawn = rng.permutation(rows.height)[: 2 * n_pairs]
    drawn = drawn[: len(drawn) // 2 * 2]
    run = rows["replicate"].to_numpy()[drawn].reshape(-1, 2)
    apart = drawn.reshape(-1, 2)[run[:, 0] != run[:, 1]].ravel()
    behaviors: list[list[int]] = rows["cells"].gather(apart).to_list()
    return behaviors


# words


def distance_notes(audit: DistanceAudit) -> list[str]:
    """Return the findings of an audit, and their basis, as sentences."""
    distance = audit.distance
    unit = {"cells": "in cells", "m": "in meters", "1": "0 to 1"}[distance.unit]
    return [
        f"{distance.name}, {unit}: {distance.description}",
        f"It compares {_compared(distance)}, is {'a' if distance.is_metric else 'no'} metric of that, and takes "
        f"{distance.cost} steps for behaviors of n and m of c cells. Source: {distance.source}",
        _weight_note(audit),
        *(_length_note(each) for each in audit.confounds),
        _used_note(audit),
    ]


def _compared(distance: BehaviorDistance) -> str:
    if distance.compares == "position":
        return "where trials ended"
    return "cells in the order of first visits" if distance.needs_order else "which cells were visited"


def _weight_note(audit: DistanceAudit) -> str:
    front, trend = audit.front_over_back, audit.order_correlation
    if trend.value is None:
        return f"Weight: all cells weigh the same, {audit.leverage.mean():.3g}."
    lead = {1: "low-numbered cells weigh most", -1: "high-numbered cells weigh most", 0: "cells weigh alike"}
    return (
        f"Weight: {lead[weight_bias(audit)]}. The first quarter of cells, as the paper sorts them, counts "
        f"{front.value:.2f} times as much as the last {bracketed(front, 2)}; Spearman's correlation "
        f"of weight with the place in that order is {in_words(trend)}."
    )


def weight_bias(audit: DistanceAudit) -> int:
    """Return 1 if low-numbered cells have over a tenth more weight, -1 if high-numbered ones do, otherwise 0."""
    front = audit.front_over_back
    if front.low is not None and front.low > _TENTH:
        return 1
    return -1 if front.high is not None and front.high < 1 / _TENTH else 0


def _length_note(confound: Confound) -> str:
    correlation = confound.correlation
    where = f"{confound.label}, {confound.of}" if confound.label else confound.of
    if correlation.value is None:
        return f"Length, {where}: no correlation, all pairs being alike in one of the two."
    return (
        f"Length, {where}: Spearman's correlation of distance with the difference in cells is {in_words(correlation)}, "
        f"{100 * confound.shared:.0f} % of the variance of ranks. Of the cells of the shorter behavior, the longer "
        f"visited {100 * confound.contained:.0f} %."
    )


def _used_note(audit: DistanceAudit) -> str:
    pairs = audit.confounds[0].n_pairs
    return (
        f"Used: {audit.n_walks:,} random walks for the weight of cells, {pairs:,} pairs of them for length; seed "
        f"{audit.seed}. A walk starts in any of {audit.columns} x {audit.rows} cells and makes 1 to {MOST_STEPS} steps "
        f"to one of the four next cells, going on as it went in {100 * audit.straight:.0f} % of them. Intervals: 95 %."
    )


def in_words(found: Estimate) -> str:
    """A correlation with its interval."""
    signs = [f"{value:+.2f}".replace("-", "−") for value in (found.value, found.low, found.high)]
    return f"{signs[0]} ({signs[1]} to {signs[2]})"
