"""A mean score on a target, assisted by a simulator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap._wording import number, with_interval, worth_verdict
from realitygap.orders import EstimateOrder
from realitygap.stats import FEW_UNITS, Assisted, least_correlation

Values = NDArray[np.float64]


@dataclass(frozen=True)
class EstimatedScore:
    """A mean score on a target, assisted by a simulator.

    Attributes:
        assisted: The estimate, and the one from the target alone.
        title: What was estimated, in words.
        noun: Noun for an independent unit, such as `controller`.
        real: (n,) mean score of each driven unit on the target.
        simulated: (N,) mean score of each unit in simulation; the first ones are those of `real`.
        basis: Labels, units, and trials of both platforms, in words.
        score: Score of trials, with its unit.
        order: The order, from which it can be estimated again.
    """

    assisted: Assisted
    title: str
    noun: str
    real: Values
    simulated: Values
    basis: str
    score: str
    order: EstimateOrder

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.assisted.estimate}, target alone {self.assisted.real_only})"

    @property
    def rows(self) -> list[tuple[str, str]]:
        """Name and value of each result, in words."""
        assisted, n = self.assisted, len(self.real)
        estimate = with_interval(assisted.estimate)
        rows = [("estimate", f"{estimate}  {assisted.estimate.refused}".rstrip())]
        rows.append(("target alone", with_interval(assisted.real_only)))
        if assisted.width_ratio is not None:
            rows.append(("width of interval", f"{assisted.width_ratio:.2f} of that of the target alone"))
        if n < 3:
            return rows
        return [
            *rows,
            ("correlation", f"{number(assisted.correlation)} (helps above {least_correlation(n):.2f})"),
        ]

    @property
    def verdict(self) -> str:
        """The worth of the simulation, as a sentence."""
        if self.assisted.worth is None:
            return "Use the estimate from the target alone."
        return worth_verdict(self.assisted.worth, self.noun, helps=self.assisted.helps)

    @property
    def notes(self) -> tuple[str, ...]:
        """Limits of the intervals, each a sentence."""
        if self.assisted.estimate.ends is None or len(self.real) >= FEW_UNITS:
            return ()
        return (
            f"With fewer than {FEW_UNITS} {self.noun}s on the target, intervals of skewed scores miss more often than "
            "5 of 100 times.",
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the estimates, what they rest on, and the verdict, as in the output of `--json`."""
        assisted = self.assisted
        return {
            "title": self.title,
            "estimate": assisted.estimate.to_dict(),
            "target_alone": assisted.real_only.to_dict(),
            "width_ratio": assisted.width_ratio,
            "worth": assisted.worth,
            "correlation": assisted.correlation,
            "helps": assisted.helps,
            "verdict": self.verdict,
            "notes": list(self.notes),
            "score": self.score,
            "unit": self.noun,
            "units": {"simulated": len(self.simulated), "real": len(self.real)},
            "basis": self.basis,
        }
