"""What came of a transfer: quality on the target by strategy and budget, with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

CONFIDENCE = 0.95
RESAMPLES = 4000
SEED = 7
"""Of the resampling: the same figures each time."""


@dataclass(frozen=True)
class Transferred:
    """One champion on the target.

    Attributes:
        strategy: That chose it.
        budget: Trials on the target that the strategy was given.
        spent: Of these, how many it used.
        replicate: Of the transfer.
        genome: As JSON text.
        simulated: Share of cells that it visits in the simulation in which it was ranked; None where in none.
        coverage: (t,) the same on the target, in each fresh trial.
    """

    strategy: str
    budget: int
    spent: int
    replicate: int
    genome: str
    simulated: float | None
    coverage: tuple[float, ...]

    @property
    def quality(self) -> float:
        """Mean share of cells that it visits on the target."""
        return float(np.mean(self.coverage))


class Estimate(NamedTuple):
    """A number with its 95 % interval; n champions stand behind it."""

    estimate: float
    low: float
    high: float
    n: int


@dataclass(frozen=True)
class Strategist:
    """What came of a strategy with one budget.

    Attributes:
        strategy: Its name.
        budget: Trials on the target.
        quality: Share of cells visited on the target in fresh trials, over replicates.
        regret: How much less that is than the best known champion's on this target.
        simulated: Mean share of cells in simulation; None where it evolved in none.
    """

    strategy: str
    budget: int
    quality: Estimate
    regret: Estimate
    simulated: float | None


@dataclass(frozen=True)
class TransferResult:
    """A transfer, carried out.

    Attributes:
        study: Folder or catalogue name of what was evolved.
        condition: Of the study, that was evolved.
        target: Where it was tried.
        label: What the target says it is.
        replicates: Of each strategy.
        fresh_trials: Of each champion; they are not of the budget.
        strategies: By strategy and budget, in the order asked.
        best_known: Mean share of cells of the champion that is best in its fresh trials: as the best of many, luck
            lifts it somewhat, and regret with it.
        champions: Each with its fresh trials.
    """

    study: str
    condition: str
    target: str
    label: str
    replicates: int
    fresh_trials: int
    strategies: tuple[Strategist, ...]
    best_known: float
    champions: tuple[Transferred, ...]

    def to_dict(self) -> dict[str, Any]:
        """As plain values, for JSON; `strategies` has `quality` and `regret` with `estimate`, `low`, `high`, `n`."""
        found = asdict(self)
        for row, strategist in zip(found["strategies"], self.strategies, strict=True):
            row |= {"quality": strategist.quality._asdict(), "regret": strategist.regret._asdict()}
        return found


def summarize_transfer(champions: Sequence[Transferred]) -> tuple[tuple[Strategist, ...], float]:
    """Quality and regret by strategy and budget, in the order in which they come, and the best known quality.

    Intervals are of a bootstrap that resamples replicates, and within each its fresh trials; of a single replicate only
    the trials, so that nothing is said of another evolution.
    """
    best = max(champion.quality for champion in champions)
    groups: dict[tuple[str, int], list[Transferred]] = {}
    for champion in champions:
        groups.setdefault((champion.strategy, champion.budget), []).append(champion)
    rows = []
    for (strategy, budget), group in groups.items():
        quality = estimate_mean(np.array([champion.coverage for champion in group]))
        regret = Estimate(best - quality.estimate, best - quality.high, best - quality.low, quality.n)
        simulated = [champion.simulated for champion in group if champion.simulated is not None]
        mean = float(np.mean(simulated)) if simulated else None
        rows.append(Strategist(strategy, budget, quality, regret, mean))
    return tuple(rows), best


def estimate_mean(values: NDArray[np.float64]) -> Estimate:
    """The mean of values (r, t), t trials of each of r replicates, by a bootstrap over replicates and trials."""
    rng = np.random.default_rng(SEED)
    r, t = values.shape
    who = rng.integers(r, size=(RESAMPLES, r, 1))
    means = values[who, rng.integers(t, size=(RESAMPLES, r, t))].mean(axis=(1, 2))
    low, high = np.quantile(means, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Estimate(float(values.mean()), float(low), float(high), r)
