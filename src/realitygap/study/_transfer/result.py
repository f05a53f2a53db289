"""The result of a transfer: quality on the target by strategy and budget, with intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.drawing import card_of
from realitygap.gap import COVERAGE
from realitygap.stats import Estimate, SequentialTest, t_interval

from .._advise import Advice, advise_on, strategy_differences


@dataclass(frozen=True)
class Transferred:
    """One champion on the target.

    Attributes:
        strategy: Strategy that chose it.
        budget: Trials on the target that the strategy was given.
        spent: Number of these trials that it used.
        replicate: Replicate of the transfer.
        genome: Genome as JSON text.
        simulated: Mean score in the simulation that ranked it; None if none did.
        scores: (t,) the same on the target, in each fresh trial.
    """

    strategy: str
    budget: int
    spent: int
    replicate: int
    genome: str
    simulated: float | None
    scores: tuple[float, ...]

    @property
    def quality(self) -> float:
        """Its mean score on the target."""
        return float(np.mean(self.scores))


@dataclass(frozen=True)
class Strategist:
    """The result of a strategy with one budget.

    Attributes:
        strategy: Name of the strategy.
        budget: Trials on the target.
        quality: Score on the target in fresh trials, over replicates.
        regret: Difference to the quality of the best known champion on this target.
        simulated: Mean score in simulation; None where it evolved in none.
    """

    strategy: str
    budget: int
    quality: Estimate
    regret: Estimate
    simulated: float | None


@dataclass(frozen=True)
class TransferResult:
    """The result of a transfer.

    Attributes:
        study: Folder or catalogue name of what was evolved.
        condition: Evolved condition of the study.
        target: Name of the target.
        label: Label of the target, such as TWIN.
        replicates: Replicates of each strategy.
        fresh_trials: Fresh trials of each champion, which don't count toward the budget.
        strategies: Rows by strategy and budget, in the requested order.
        best_known: Mean score of the champion that is best in its fresh trials: as the best of many, luck
            lifts it somewhat, and regret with it.
        champions: Each with its fresh trials.
        score: Score of the trials, with its unit.
        score_range: Minimum and maximum of the score.
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
    score: str = COVERAGE
    score_range: tuple[float, float] = (0.0, 1.0)

    @property
    def advice(self) -> Advice | None:
        """Each strategy compared with the first, over replicates, at any look; None if the score has no range."""
        differences = strategy_differences(
            [(each.strategy, each.budget, each.replicate, each.scores) for each in self.champions]
        )
        if not differences or not np.isfinite(self.score_range).all():
            return None
        return advise_on(
            differences,
            test=SequentialTest(),
            score=self.score,
            label=self.label,
            score_range=self.score_range,
            unit="replicate",
        )

    @property
    def best_in_words(self) -> str:
        """The champion to which regret is measured, in words."""
        known = f"the best known champion ({self.best_known:.3f})"
        return f"{known}. It was selected by these trials, so luck is part of it"

    def __repr__(self) -> str:
        n = len({each.strategy for each in self.strategies})
        counts = f"{n} strateg{'y' if n == 1 else 'ies'}, {self.replicates} replicates"
        return (
            f"{type(self).__name__}({self.study}, {self.condition} → {self.target}: {counts}, {self.label})"
        )

    def _repr_html_(self) -> str:
        return card_of(self).to_html()

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON. `strategies` has `quality` and `regret` with `estimate`, `low`, `high`, `n`.

        Scores of champions are named `coverage` if they are that; otherwise `scores`, and `score` says of what.
        """
        fields = asdict(self)
        del fields["score_range"]
        if self.score == COVERAGE:
            del fields["score"]
            for champion in fields["champions"]:
                champion["coverage"] = champion.pop("scores")
        for row, strategist in zip(fields["strategies"], self.strategies, strict=True):
            row |= {"quality": strategist.quality.to_dict(), "regret": strategist.regret.to_dict()}
        return fields


def summarize_transfer(
    champions: Sequence[Transferred],
    known: Sequence[float] = (),
    score_range: tuple[float, float] = (0.0, 1.0),
) -> tuple[tuple[Strategist, ...], float]:
    """Return the quality and regret by strategy and budget, in the order of the strategies, and the best known quality.

    Intervals are of means over replicates; of a single replicate they are of its fresh trials, and nothing is said of
    another evolution. Regret is to the best, taken as it is.

    Args:
        champions: Champions with their fresh trials.
        known: Qualities of others on the same target.
        score_range: The least and the greatest score that there can be.
    """
    best = max([*known, *(champion.quality for champion in champions)])
    groups: dict[tuple[str, int], list[Transferred]] = {}
    for champion in champions:
        groups.setdefault((champion.strategy, champion.budget), []).append(champion)
    rows = []
    for (strategy, budget), group in groups.items():
        scores = np.array([champion.scores for champion in group])
        quality = estimate_mean(scores, score_range)
        low, high = (None if end is None else best - end for end in (quality.high, quality.low))
        regret = Estimate(best - float(scores.mean()), low, high, quality.n, method=quality.method)
        simulated = [champion.simulated for champion in group if champion.simulated is not None]
        mean = float(np.mean(simulated)) if simulated else None
        rows.append(Strategist(strategy, budget, quality, regret, mean))
    return tuple(rows), best


def estimate_mean(values: NDArray[np.float64], within: tuple[float, float] = (0.0, 1.0)) -> Estimate:
    """Return the mean of scores (r, t), t trials of each of r replicates, with Student's interval over replicates.

    A resampling of two or three would repeat each of them, and end at the extremes. Replicates that happen to be alike
    are as uncertain as their trials make them. Of one replicate the interval is over its trials; of one trial there is
    none.
    """
    r, t = values.shape
    mean, means = float(values.mean()), values.mean(axis=1)
    if r * t == 1:
        return Estimate(mean, None, None, r)
    of_trials = float(values.var(axis=1, ddof=1).mean()) / (r * t) if t > 1 else 0.0
    variance = max(float(means.var(ddof=1)) / r, of_trials) if r > 1 else of_trials
    low, high = t_interval(mean, math.sqrt(variance), (r if r > 1 else t) - 1, within)
    return Estimate(mean, float(low), float(high), r, method="t")
