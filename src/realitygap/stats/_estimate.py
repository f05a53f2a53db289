"""A number with its interval and its n, or the reason why there is none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from realitygap._wording import with_interval

Values = npt.NDArray[np.float64]

CONFIDENCE = 0.95
"""Level of all intervals except those of equivalence, which have 90 % because its test has two sides of 5 %."""

Method = Literal[
    "", "BCa", "Clopper-Pearson", "Fisher z", "Newcombe", "Tango", "Wilson", "betting", "empirical Bayes",
    "percentiles", "profile", "ranks", "regression", "sign-symmetric", "t",
]  # fmt: skip
"""How an interval is made: `BCa` and `percentiles`, bootstraps; `ranks`, two observed values; `betting` and
`sign-symmetric`, valid at any of all looks; the others, formulas."""

Ends = tuple[float, float]
"""Lower and upper end of an interval, both included."""


@dataclass(frozen=True)
class Estimate:
    """A number with its interval, in the unit of the number.

    Attributes:
        value: The number; None if n is too small for it.
        low: Lower end of its interval, included; None if there is no interval.
        high: Upper end.
        n: Independent values behind it: controllers, runs, pairs of runs, or trials.
        refused: Reason for a missing number or interval, with the required n; empty if both exist, and if the caller
            gives the reason.
        more: Related values, such as `p` or `margin`.
        level: Probability with which such an interval covers the truth.
        method: How the interval is made; empty if there is none.
        needed: Smallest n with an interval; None if n is not the reason.
    """

    value: float | None
    low: float | None
    high: float | None
    n: int
    refused: str = ""
    more: Mapping[str, float | None] = field(default_factory=dict)
    level: float = CONFIDENCE
    method: Method = ""
    needed: int | None = None

    @classmethod
    def refusal(cls, n: int, why: str, **more: float | None) -> Estimate:
        """Return an estimate without a number, with the reason."""
        return cls(None, None, None, n, why, more)

    @classmethod
    def of_few(cls, value: float, n: int, needed: int, noun: str = "values") -> Estimate:
        """Return a number without an interval, because n is below the smallest that gives one."""
        some = f"{n} {noun} are" if n != 1 else f"1 {noun.removesuffix('s')} is"
        refused = f"{some} too few for an interval; at least {needed} are needed."
        return cls(value, None, None, n, refused, needed=needed)

    @property
    def ends(self) -> Ends | None:
        """Both ends of the interval; None if there is none."""
        return None if self.low is None or self.high is None else (self.low, self.high)

    def mirrored(self, about: float) -> Estimate:
        """Return the estimate of a number minus this one, such as 0 for differences seen from the other side."""
        value = None if self.value is None else about - self.value
        low, high = (None, None) if self.ends is None else (about - self.ends[1], about - self.ends[0])
        return Estimate(
            value, low, high, self.n, self.refused, self.more, self.level, self.method, self.needed
        )

    def to_dict(self) -> dict[str, Any]:
        """Return a dictionary as in the output of `--json`: estimate, low, high, n, and related values."""
        values: dict[str, Any] = {"estimate": self.value, "low": self.low, "high": self.high, "n": self.n}
        if self.refused:
            values["refused"] = self.refused
        return values | dict(self.more)

    def __float__(self) -> float:
        if self.value is None:
            raise ValueError(f"There is no number: {self.refused or 'n is too small for it.'}")
        return self.value

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self}, n={self.n})"

    def __str__(self) -> str:
        return with_interval(self)
