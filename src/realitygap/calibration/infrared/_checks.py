"""Tests of the assumption that readings are independent, and of the fit itself."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from ._readings import Array, Placement

SHUFFLES = 999
"""Number of shuffles of a permutation test."""

REPLICATES = 300
"""Number of simulated data sets of a posterior predictive check."""

CERTAIN = 0.05
"""A p value from which on readings are taken to be independent."""


@dataclass(frozen=True)
class Independence:
    """The dependence of readings on each other.

    Attributes:
        placements: Number of placements of the robot.
        correlation: Correlation of consecutive readings, over placements.
        correlation_p: P value: the share of shuffled readings with at least this correlation.
        between: Part of the variance at one distance that lies between placements.
        between_p: P value: the share of readings shuffled over placements with at least this part.
        readings: Number of readings.
        effective: Number of independent readings with the same information.
    """

    placements: int
    correlation: float
    correlation_p: float
    between: float
    between_p: float
    readings: int
    effective: float

    @property
    def weight(self) -> float:
        """The weight of a reading, relative to an independent one."""
        return self.effective / self.readings if self.readings else 1.0


def independence(placements: list[Placement], rng: np.random.Generator) -> Independence:
    """Test whether consecutive readings, and those of one placement, are more alike than others.

    Both tests shuffle readings. If they detect a dependence, the number of readings is reduced: by the factor (1 - r) /
    (1 + r) for the correlation r of consecutive ones, and by the divisor 1 + (n - 1) i for n effective readings per
    placement with a share i of the variance between placements.
    """
    rows = [np.asarray(placement.readings, np.float64) for placement in placements]
    n = sum(map(len, rows))
    r, r_p = _consecutive(rows, rng)
    share, share_p = _between(placements, rng)
    kept = (1 - r) / (1 + r) if r_p < CERTAIN and 0 < r < 1 else 1.0
    n_effective = kept * n / max(len(rows), 1)
    spread = 1 + max(n_effective - 1, 0) * share if share_p < CERTAIN else 1.0
    return Independence(len(rows), r, r_p, share, share_p, n, n * kept / spread)


def _consecutive(rows: list[Array], rng: np.random.Generator) -> tuple[float, float]:
    """Return the correlation of consecutive readings, each less the mean of its placement, and its p value."""
    centered = [row - row.mean() for row in rows if len(row) > 2 and np.ptp(row) > 0]
    power = sum(float(row @ row) for row in centered)
    if not centered or power == 0:
        return 0.0, 1.0

    def correlation(rows: list[Array]) -> float:
        return sum(float(row[1:] @ row[:-1]) for row in rows) / power

    observed = correlation(centered)
    shuffled = [correlation([rng.permutation(row) for row in centered]) for _ in range(SHUFFLES)]
    p = (1 + sum(value >= observed for value in shuffled)) / (1 + SHUFFLES)
    n = sum(map(len, centered))
    return min(observed + len(centered) / n, 1.0), p  # a mean taken from the same readings lowers it by 1 / n


def _between(placements: list[Placement], rng: np.random.Generator) -> tuple[float, float]:
    """Return the share of the variance at one distance that lies between placements, and its p value."""
    groups: dict[tuple[float, ...], list[Array]] = defaultdict(list)
    for placement in placements:
        groups[placement.group].append(np.asarray(placement.readings, np.float64))
    several = [rows for rows in groups.values() if len(rows) > 1 and np.ptp(np.concatenate(rows)) > 0]
    if not several:
        return 0.0, 1.0

    def ratio(groups: list[list[Array]]) -> float:
        return float(np.mean([_intraclass(rows) for rows in groups]))

    def shuffled(rows: list[Array]) -> list[Array]:
        mixed = rng.permutation(np.concatenate(rows))
        return np.split(mixed, np.cumsum([len(row) for row in rows])[:-1])

    observed = ratio(several)
    others = [ratio([shuffled(rows) for rows in several]) for _ in range(SHUFFLES)]
    p = (1 + sum(value >= observed for value in others)) / (1 + SHUFFLES)
    return max(observed, 0.0), p


def _intraclass(rows: list[Array]) -> float:
    """Return the intraclass correlation of readings in placements at one distance, by the analysis of variance."""
    sizes = np.array([len(row) for row in rows])
    means = np.array([row.mean() for row in rows])
    within = sum(float(((row - row.mean()) ** 2).sum()) for row in rows) / max(sizes.sum() - len(rows), 1)
    grand = float((sizes * means).sum() / sizes.sum())
    between = float((sizes * (means - grand) ** 2).sum()) / (len(rows) - 1)
    n = float(sizes.mean())
    whole = between + (n - 1) * within
    return (between - within) / whole if whole > 0 else 0.0


def predictive_check(probabilities: Array, counts: Array, rng: np.random.Generator) -> tuple[float, float]:
    """Test whether readings drawn from the fit differ from it as much as the recorded ones.

    Args:
        probabilities: (m, p, b) probability of each bin at each placement, for m draws from the posterior.
        counts: (p, b) readings in each bin.
        rng: Random numbers.

    Returns:
        The posterior predictive p value of the discrepancy of Freeman and Tukey, sum of (sqrt(seen) - sqrt(expected))^2
        over bins and placements; near 0: the sensor's model does not make such readings. And the share of readings that
        are in another bin than the fit has them (the total variation), less that of readings drawn from it.

    Source: Gelman, Meng & Stern (1996).
    """
    sizes = counts.sum(axis=1)
    larger, elsewhere = 0, 0.0
    for k in rng.integers(len(probabilities), size=REPLICATES):
        chance = probabilities[k] / probabilities[k].sum(axis=1, keepdims=True)
        expected = sizes[:, None] * chance
        drawn = rng.multinomial(sizes, chance)
        root = np.sqrt(expected)
        larger += ((np.sqrt(drawn) - root) ** 2).sum() >= ((np.sqrt(counts) - root) ** 2).sum()
        elsewhere += (np.abs(counts - expected).sum() - np.abs(drawn - expected).sum()) / 2
    p = (1 + larger) / (1 + REPLICATES)
    return p, max(elsewhere / REPLICATES / max(sizes.sum(), 1), 0.0)
