"""A measured number with its interval and its n, or why there is none."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

CONFIDENCE = 0.95
"""Level of all intervals except those of equivalence, which have 90 % because its test has two sides of 5 %."""


@dataclass(frozen=True)
class Estimate:
    """A measured number.

    Attributes:
        estimate: The number; None if n is too small for it.
        low: Lower end of its interval; None if there is no interval.
        high: Upper end.
        n: Controllers behind it.
        refused: Reason for a missing number or interval, with the required number of trials or controllers; empty if
            both exist.
        more: Related values, such as `p` or `margin`.
    """

    estimate: float | None
    low: float | None
    high: float | None
    n: int
    refused: str = ""
    more: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def refusal(cls, n: int, why: str, **more: Any) -> Estimate:
        """Return an estimate without a number, with the reason."""
        return cls(None, None, None, n, why, dict(more))

    def to_dict(self) -> dict[str, Any]:
        """Return a dictionary as in the output of `--json`: estimate, low, high, n, and related values."""
        values: dict[str, Any] = {"estimate": self.estimate, "low": self.low, "high": self.high, "n": self.n}
        if self.refused:
            values["refused"] = self.refused
        return values | self.more

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> Estimate:
        """Return the estimate from the output of `to_dict`."""
        own = {name: values[name] for name in ("estimate", "low", "high", "n")}
        more = {name: value for name, value in values.items() if name not in (*own, "refused")}
        return cls(**own, refused=values.get("refused", ""), more=more)

    def __str__(self) -> str:
        if self.estimate is None:
            return "–"
        if self.low is None or self.high is None:
            return f"{self.estimate:.3f}"
        return f"{self.estimate:.3f} [{self.low:.3f}, {self.high:.3f}]"
