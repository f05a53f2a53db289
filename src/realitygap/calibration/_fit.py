"""The result of a fit, and the error of its predictions of what it did not see."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from realitygap.world import Fitted

from ._prior import Floats

Choice = Literal["fitted", "nominal"]

DECISIVE = ("after 5 s", "after 30 s")
"""Further errors that have to agree before fitted numbers are recommended."""


def is_better(errors: Sequence[tuple[float, float]]) -> bool:
    """Return whether fitted numbers predict better than nominal ones, by (nominal, fitted) errors of several kinds.

    The first error has to be smaller, and none of the others may be larger.
    """
    nominal, fitted = errors[0]
    return fitted < nominal and all(fitted <= nominal for nominal, fitted in errors[1:])


@dataclass(frozen=True)
class HeldOut:
    """Errors of two sets of numbers on the same unseen part.

    Attributes:
        measure: The error, in words.
        unit: Unit of the errors, such as m; empty for readings.
        nominal: Error of the numbers that the fit started from.
        fitted: Error of the fitted numbers.
        n: Observations in the unseen part.
        more: Further errors by name: nominal and fitted, in the same unit unless the name says otherwise.
        floor: Error of predicting each reading by its neighbors in the table; None for motion.
    """

    measure: str
    unit: str
    nominal: float
    fitted: float
    n: int
    more: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    floor: float | None = None

    @property
    def recommended(self) -> Choice:
        """The fitted numbers if they predict better; nominal if both are equal."""
        also = [self.more[name] for name in DECISIVE if name in self.more]
        return "fitted" if is_better([(self.nominal, self.fitted), *also]) else "nominal"


@dataclass(frozen=True)
class Fit:
    """The result of a fit: the fields that it adds to a calibration.

    Attributes:
        fitted: Parameters with 90 % intervals.
        numbers: Estimated numbers of the robot, by dotted name.
        draws: (d,) draws of each number from the joint posterior.
        method: Method of the fit, with its source.
        notes: Further results in words.
        misspecified: True if the simulator cannot reproduce the observations.
        misspecification_p: P value of that check.
        evidence: Data of figures.
        verdict: The numbers to use, fitted or nominal; empty if predictions were not compared.
        reasons: Reasons of the verdict.
    """

    fitted: tuple[Fitted, ...]
    numbers: Mapping[str, float]
    draws: Mapping[str, Sequence[float] | Floats]
    method: str
    notes: tuple[str, ...] = ()
    misspecified: bool = False
    misspecification_p: float = 1.0
    evidence: dict[str, Any] = field(default_factory=dict)
    verdict: str = ""
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True)
class HeldOutFit(Fit):
    """A fit to a recording, with its errors on the part that it did not see.

    Attributes:
        held_out: Errors on the part that the fit did not see; None if it saw everything.
    """

    held_out: HeldOut | None = None

    @property
    def recommended(self) -> Choice:
        """The numbers to use."""
        return self.held_out.recommended if self.held_out else "fitted"

    @property
    def recommended_numbers(self) -> dict[str, float]:
        """The fitted numbers, or none if those of the robot's file predict better."""
        return dict(self.numbers) if self.recommended == "fitted" else {}
