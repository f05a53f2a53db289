"""Advice after each pair of trials: what is shown, and how many more pairs a comparison may need."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from realitygap._wording import (
    BLIND_NOTE,
    MULTIPLE_LOOKS,
    PLANNED_LOOKS,
    blind_look,
    distribution_caveat,
    look_figures,
    look_verdict,
    looks_summary,
    pairs_forecast,
)
from realitygap.errors import StudyError
from realitygap.stats import Estimate, Forecast, Look, SequentialTest, e_holm, forecast_pairs

Values = NDArray[np.float64]

Planned = Literal["planned", "changed", "unplanned"]
"""Whether the comparison was stored before the first trial, changed later, or not stored."""


@dataclass(frozen=True)
class Advised:
    """The state of one comparison.

    Attributes:
        first: The first of the two that are compared.
        second: The second.
        look: State of the test, in units of the score's range.
        e: E of the test, corrected for all comparisons by Holm's method.
        shift: Mean difference of the score, first minus second, with its anytime-valid interval.
        margin: Margin of equivalence, in the unit of the score; None if there is none.
        forecast: Forecast of more pairs; None if there is a result, or below 5 pairs.
    """

    first: str
    second: str
    look: Look
    e: float
    shift: Estimate
    margin: float | None
    forecast: Forecast | None

    @property
    def is_stop(self) -> bool:
        """True if the comparison has a result."""
        return self.look.is_stop


@dataclass(frozen=True)
class Advice:
    """Advice on a comparison of two or more.

    Attributes:
        score: Name of the score.
        label: Label of the trials: SIM, TWIN, EMULATED, or REAL.
        unit: Noun for a pair: pair, run, or round.
        test: The test of each comparison. Its alpha is divided by their number.
        planned: Whether the comparison was stored before the first trial.
        maximum: Maximum number of pairs that is planned; None if there is none.
        comparisons: The comparisons.
    """

    score: str
    label: str
    unit: str
    test: SequentialTest
    planned: Planned
    maximum: int | None
    comparisons: tuple[Advised, ...]

    @property
    def is_stop(self) -> bool:
        """True if every comparison has a result."""
        return all(each.is_stop for each in self.comparisons)

    @property
    def line(self) -> str:
        """The main result in one line."""
        return self._lines()[0]

    @property
    def summary(self) -> str:
        """All results in one line."""
        if len(self.comparisons) == 1:
            return self.line
        shown = [each for each in self.comparisons if each.is_stop]
        return looks_summary(
            [(each.first, each.second, each.look.verdict) for each in shown], len(self.comparisons)
        )

    @property
    def sentences(self) -> list[str]:
        """The results, a line for each comparison, and what limits them."""
        notes = [PLANNED_LOOKS[self.planned]]
        if len(self.comparisons) > 1:
            notes.append(MULTIPLE_LOOKS.format(n=len(self.comparisons)))
        return [*self._lines(), *notes, distribution_caveat(self.test.null)]

    def _lines(self) -> list[str]:
        lines = []
        for each in self.comparisons:
            figures = look_figures(
                each.first,
                each.second,
                each.look.n,
                self.unit,
                each.shift,
                each.e,
                1 / self._alpha,
                self.test.fewest,
            )
            verdict = look_verdict(
                each.first,
                each.second,
                each.look.verdict,
                each.margin,
                each.look.claimed_at,
                are_platforms=self.unit == "round",
            )
            more = ""
            if each.look.verdict == "open":
                more = pairs_forecast(each.forecast, each.look.n, self.unit, self.test.fewest, self.maximum)
            lines.append(" ".join(part for part in (figures, verdict, more) if part))
        return lines

    @property
    def _alpha(self) -> float:
        """Error rate of all comparisons together."""
        return self.test.alpha * len(self.comparisons)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "score": self.score,
            "label": self.label,
            "unit": self.unit,
            "planned": self.planned,
            "maximum": self.maximum,
            "is_stop": self.is_stop,
            "comparisons": [
                {
                    "first": each.first,
                    "second": each.second,
                    "pairs": each.look.n,
                    "e": each.e,
                    "verdict": each.look.verdict,
                    "difference": each.shift.to_dict(),
                    "margin": each.margin,
                    "forecast": None if each.forecast is None else vars(each.forecast),
                }
                for each in self.comparisons
            ],
            "test": self.test.to_dict() | {"alpha": self._alpha},
            "sentences": self.sentences,
        }


@dataclass(frozen=True)
class BlindAdvice(Advice):
    """Advice on a comparison whose design is blind: how many pairs are complete, and whether to stop.

    It has no comparison and no E. The sign of an effect would name an arm. E has no sign, but its change after a trial
    is void or counted again would tell the operator which results bring the end closer.

    Attributes:
        n: Number of complete pairs.
        has_ended: True if the locked rule ends the comparison.
    """

    n: int
    has_ended: bool

    @property
    def is_stop(self) -> bool:
        """True if the locked rule ends the comparison."""
        return self.has_ended

    @property
    def line(self) -> str:
        """Whether to continue, in one line."""
        return blind_look(self.n, self.maximum, self.unit, has_ended=self.has_ended)

    @property
    def summary(self) -> str:
        """Whether to continue, in one line."""
        return self.line

    @property
    def sentences(self) -> list[str]:
        """Whether to continue, and how to see results."""
        return [self.line, BLIND_NOTE]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "is_blind": True,
            "score": self.score,
            "label": self.label,
            "unit": self.unit,
            "pairs": self.n,
            "maximum": self.maximum,
            "is_stop": self.has_ended,
            "sentences": self.sentences,
        }


def blinded(advice: Advice, maximum: int) -> BlindAdvice:
    """Return advice without results by arm.

    Args:
        advice: The advice.
        maximum: Number of blocks in the locked design.
    """
    n = max(each.look.n for each in advice.comparisons)
    has_ended = advice.is_stop or n >= maximum
    return BlindAdvice(
        advice.score, advice.label, advice.unit, advice.test, advice.planned, maximum, (), n, has_ended
    )


def advise_on(
    differences: Sequence[tuple[str, str, Values]],
    *,
    test: SequentialTest,
    score: str,
    label: str,
    score_range: tuple[float, float] = (0.0, 1.0),
    unit: str = "pair",
    planned: Planned = "unplanned",
    maximum: int | None = None,
) -> Advice:
    """Return advice on paired differences.

    Args:
        differences: Names of the two that are compared, and (k,) differences, first minus second, in the unit of the
            score; for each comparison.
        test: The test of one comparison. Its margin has the unit of the score, and its alpha is that of all
            comparisons together.
        score: Name of the score.
        label: Label of the trials.
        score_range: Minimum and maximum of the score.
        unit: Noun for a pair.
        planned: Whether the comparison was stored before the first trial.
        maximum: Maximum number of pairs that is planned.

    Raises:
        StudyError: The score has no minimum or no maximum.
    """
    width = score_range[1] - score_range[0]
    if not math.isfinite(width):
        raise StudyError(
            f"The {score} has no {'minimum' if math.isinf(score_range[0]) else 'maximum'}, and a sequential test needs "
            "both. Compare by a score with a range, such as coverage."
        )
    margin = None if test.margin is None else test.margin / width
    scaled = replace(test, margin=margin, alpha=test.alpha / len(differences))
    looks = [scaled.look(values / width) for _, _, values in differences]
    corrected = e_holm([look.e for look in looks])
    looks = [_claimed(look, e, test.alpha) for look, e in zip(looks, corrected, strict=True)]
    return Advice(
        score,
        label,
        unit,
        scaled,
        planned,
        maximum,
        tuple(
            Advised(
                first,
                second,
                look,
                float(e),
                _scaled(look.shift, width),
                test.margin,
                None if look.is_stop else forecast_pairs(values / width, scaled, maximum=maximum),
            )
            for (first, second, values), look, e in zip(differences, looks, corrected, strict=True)
        ),
    )


def _claimed(look: Look, e: float, alpha: float) -> Look:
    """Return a look whose difference is claimed if its corrected E shows it, although E without steps down does not."""
    if look.verdict in ("higher", "lower") or e < 1 / alpha:
        return look
    return replace(look, verdict="higher" if (look.shift.value or 0.0) > 0 else "lower", claimed_at=look.n)


def _scaled(shift: Estimate, width: float) -> Estimate:
    """Return an estimate in the unit of the score."""
    value, low, high = (
        None if each is None else each * width for each in (shift.value, shift.low, shift.high)
    )
    return replace(shift, value=value, low=low, high=high)


def strategy_differences(
    champions: Sequence[tuple[str, int, int, Sequence[float]]],
) -> list[tuple[str, str, Values]]:
    """Return the differences between each strategy with a budget and the first, over replicates that both have.

    Args:
        champions: Strategy, budget, replicate, and fresh scores of each champion.
    """
    means: dict[tuple[str, int], dict[int, float]] = {}
    for strategy, budget, replicate, scores in champions:
        means.setdefault((strategy, budget), {})[replicate] = float(np.mean(scores))
    (baseline, of_baseline), *others = means.items()
    has_budgets = len({budget for _, budget in means}) > 1
    names = {key: f"{key[0]} {key[1]}" if has_budgets else key[0] for key in means}
    return [
        (
            names[key],
            names[baseline],
            np.array([values[k] - of_baseline[k] for k in sorted(values.keys() & of_baseline.keys())]),
        )
        for key, values in others
    ]
