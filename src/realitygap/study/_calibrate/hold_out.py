"""Errors of a fit on what it did not see, next to those of simpler predictions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from realitygap.calibration import DECISIVE, Fit, is_better
from realitygap.errors import StudyError

HoldOut = float | Literal["blocks"]

FITTED, NOMINAL, NOISE, TABLE = "fitted", "nominal numbers", "nominal, uniform noise", "lookup table"
"""The predictions that are compared: the fit, and three that it has to beat."""

POSTERIOR = "draws of the posterior"
"""The mean prediction of robots with draws of the posterior, which is also compared if trials are held out."""

MOST_SHARE = 0.9


@dataclass(frozen=True)
class Compared:
    """Errors of several predictions on the unseen part.

    Attributes:
        measure: The error, in words.
        unit: Unit of the errors; empty for readings.
        n: Observations in the unseen part.
        errors: Error of each prediction.
        more: Further errors in the same unit, by their name and by prediction.
        by: Error of the fit and of the nominal numbers by condition: kind of condition, its value, prediction.
        choices: The predictions whose numbers can be recommended.
        intervals: 90 % intervals of further errors, by their name and by prediction.
    """

    measure: str
    unit: str
    n: int
    errors: Mapping[str, float]
    more: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    by: Mapping[str, Mapping[str, Mapping[str, float]]] = field(default_factory=dict)
    choices: tuple[str, ...] = (NOMINAL, FITTED, POSTERIOR)
    intervals: Mapping[str, Mapping[str, tuple[float, float]]] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, for the evidence of a calibration."""
        digits = 5
        plain = {name: round(value, digits) for name, value in self.errors.items()}
        more = {key: {name: round(v, digits) for name, v in rows.items()} for key, rows in self.more.items()}
        by = {
            kind: {at: {name: round(v, digits) for name, v in row.items()} for at, row in rows.items()}
            for kind, rows in self.by.items()
        }
        return {
            "measure": self.measure,
            "unit": self.unit,
            "n": self.n,
            "errors": plain,
            "more": more,
            "by": by,
            "intervals": {
                key: {name: [round(end, digits) for end in ends] for name, ends in rows.items()}
                for key, rows in self.intervals.items()
            },
            "recommended": self.recommended,
        }

    def relative(self, name: str) -> float:
        """Return the error of the fit as a multiple of that of another prediction."""
        fitted, other = self.errors[FITTED], self.errors[name]
        return fitted / other if other else math.inf if fitted else 1.0

    @property
    def in_words(self) -> str:
        """The error of the fit next to those of all other predictions, as a sentence."""
        ratios = "; ".join(f"{name}: {self.relative(name):.3g}" for name in self.errors if name != FITTED)
        return f"Error of the fit as a multiple of the others' errors: {ratios}."

    @property
    def intervals_in_words(self) -> tuple[str, ...]:
        """The errors of the fit and of the nominal numbers that have intervals, one line for each."""
        lines = []
        for key, rows in self.intervals.items():
            each = [
                f"{name} {self.more[key][name]:.3g} [{rows[name][0]:.3g}, {rows[name][1]:.3g}]"
                for name in (FITTED, NOMINAL)
                if name in rows
            ]
            lines.append(f"Error {key} with its 90 % interval: {', '.join(each)} {self.unit}.")
        return tuple(lines)

    @property
    def is_better(self) -> bool:
        """True if the fit predicts better than the nominal numbers, also after 5 and 30 s."""
        also = [self.more[name] for name in DECISIVE if name in self.more]
        return is_better([(errors[NOMINAL], errors[FITTED]) for errors in (self.errors, *also)])

    @property
    def recommended(self) -> str:
        """The one of the choices with the smallest error, and the first of those with equal errors."""
        choices = [name for name in self.choices if name in self.errors]
        if NOMINAL in choices and not self.is_better:
            choices.remove(FITTED)
        return min(choices, key=self.errors.__getitem__)


def chosen_parts(parts: Fit, compared: Compared | None, given: Mapping[str, float]) -> Fit:
    """Return the parts of a fit to a log or a table, without its numbers if the robot file's predict better.

    Args:
        parts: The parts, with the numbers of the fit.
        compared: The errors on the unseen part; None if the fit saw everything.
        given: Numbers of the recording itself, which stay.
    """
    evidence = {key: value for key, value in parts.evidence.items() if key != "held_out"}
    if compared is not None:
        evidence["held_out"] = compared.to_dict()
        reasons = (compared.in_words, *compared.intervals_in_words, *parts.reasons)
        parts = replace(parts, verdict=_verdict(compared), reasons=reasons)
    if compared is None or compared.is_better:
        return replace(parts, numbers={**given, **parts.numbers}, evidence=evidence)
    return replace(parts, numbers=dict(given), draws={}, evidence=evidence)


def _verdict(compared: Compared) -> str:
    """Return which numbers the calibration has, and whether they keep up with a lookup table."""
    better = compared.is_better
    if not better and compared.errors[FITTED] < compared.errors[NOMINAL]:
        worse = [key for key in DECISIVE if key in compared.more]
        worse = [key for key in worse if compared.more[key][FITTED] > compared.more[key][NOMINAL]]
        return (
            f"The fit predicts better over the whole unseen part, but worse {' and '.join(worse)}: the robot file's "
            "numbers stay."
        )
    if not compared.errors[FITTED if better else NOMINAL] > compared.errors.get(TABLE, math.inf):
        return (
            "The fit predicts better than the robot file's numbers: use it."
            if better
            else "The robot file's numbers predict better than the fit, and stay."
        )
    kept = (
        "better than the robot file's numbers, but"
        if better
        else "worse than the robot file's numbers, which stay, and"
    )
    return (
        f"The fit predicts {kept} worse than a lookup table of the same measurements: its error is "
        f"{compared.relative(TABLE):.3g} times as large. The measurements show something that the simulator does not "
        "reproduce. Check the mapping and the robot file."
    )


def hold_out_of(text: str) -> HoldOut:
    """Return what to hold out, as a user wrote it.

    Raises:
        StudyError: It is neither blocks nor a share.
    """
    if text == "blocks":
        return "blocks"
    try:
        share = float(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    except ValueError:
        share = -1.0
    if not 0 <= share <= MOST_SHARE:
        raise StudyError(
            f"--hold-out is {text!r}, expected a share from 0 to {MOST_SHARE:g}, such as 0.5 or 30%, or blocks."
        )
    return share
