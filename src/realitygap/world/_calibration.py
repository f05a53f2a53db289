"""A calibration: the parameters fitted to a robot, their origin, and their uncertainty."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field, PrivateAttr, model_validator

import realitygap
from realitygap._toml import as_in_file, toml_table
from realitygap.drawing import Bar, Card, ShownAsCard, Table, card_of
from realitygap.settings import Settings

MOST_DRAWS = 10_000
NEAR_END = 0.05  # of the prior's width: what is nearer to an end of it lies at that end

AT_WALL = 0.03
"""Distance from an interval to an end of the prior, in widths of the interval, below which the prior binds. An interval
of draws that are even between the ends of the prior is 0.056 away; one of a tail at an end, 0.017."""

_HEAD = """\
# What was measured of a robot, with intervals of 90 %. `sim:FILE` simulates it with [numbers];
# `realitygap run --randomize posterior` draws a column of [draws] for each trial. In meters, radians and seconds.
"""


class _AsInFile(Settings):
    """Settings whose numbers are those of their file, so that a run with them is the run with the file."""

    @model_validator(mode="before")
    @classmethod
    def _has_the_numbers_of_its_file(cls, values: Any) -> Any:
        return as_in_file(values)


class Fitted(_AsInFile):
    """One fitted parameter.

    It may stand for several numbers of the robot: `body.length` for the x of all corners, `range.decay` for that of all
    sensors. `Calibration.numbers` and `Calibration.draws` have the robot's own names.
    """

    name: str = Field(description="Name of the parameter.")
    estimate: float = Field(description="Median of the posterior, or the point of greatest likelihood.")
    low: float = Field(description="Lower end of the 90 % interval.")
    high: float = Field(description="Upper end of the 90 % interval.")
    prior_low: float = Field(description="Lower end of the prior.")
    prior_high: float = Field(description="Upper end of the prior.")
    identified: bool = Field(description="True if the observations narrow the parameter down from its prior.")
    unit: str = Field("", description="Unit, such as m/s.")
    advice: str = Field(
        "", description="Observations that would identify the parameter, if it is not identified."
    )

    @model_validator(mode="before")
    @classmethod
    def _is_not_identified_by_its_prior(cls, values: Any) -> Any:
        """An interval that begins at an end of the prior is that of the prior, however narrow it is.

        If it is wide, the advice begins with that end if the estimate is there.
        """
        if not isinstance(values, Mapping) or not _is_bound(values):
            return values
        if not values.get("identified") and not _is_bound(values, "estimate", "estimate"):
            return values
        low, high, unit = values["prior_low"], values["prior_high"], values.get("unit", "")
        at_end = (
            f"The estimate is at an end of its prior, {low:.3g} to {high:.3g}{f' {unit}' if unit else ''}."
        )
        if not values.get("identified") and values.get("advice", "").startswith(at_end):  # read from a file
            return values
        advice = "" if values.get("identified") else values.get("advice", "")
        advice = advice or "Start from another robot model (--base ROBOT)."
        return {**values, "identified": False, "advice": f"{at_end} {advice}"}

    @model_validator(mode="after")
    def _has_its_ends_in_order(self) -> Self:
        for low, high in (("low", "high"), ("prior_low", "prior_high")):
            if getattr(self, low) > getattr(self, high):
                raise ValueError(
                    f"{low} is {getattr(self, low):g}, expected at most {high}, {getattr(self, high):g}"
                )
        return self

    @property
    def shown(self) -> tuple[str, str]:
        """The estimate and the interval as text, without digits beyond a hundredth of the interval's width."""
        width = self.high - self.low
        decimals = 2 - math.floor(math.log10(width)) if width > 0 else None

        def text(value: float, digits: int) -> str:
            return f"{(value if decimals is None else round(value, decimals)) + 0.0:.{digits}g}"

        return text(self.estimate, 4), f"{text(self.low, 3)} to {text(self.high, 3)}"

    @property
    def is_bound(self) -> bool:
        """True if an end of the interval is at an end of the prior that may cut off values."""
        return _is_bound(self.model_dump())

    @property
    def is_at_end(self) -> bool:
        """True if the parameter is identified, and its estimate is at or beyond an end of the prior other than 0."""
        ways = [self.estimate - self.prior_low if self.prior_low else math.inf]
        ways += [self.prior_high - self.estimate if self.prior_high else math.inf]
        return self.identified and min(ways) < NEAR_END * (self.prior_high - self.prior_low)


def _is_bound(values: Mapping[str, Any], lower: str = "low", upper: str = "high") -> bool:
    """Return whether an end of an interval is at an end of its prior. Ends at 0, and at 1 of a share, cut off nothing.

    Args:
        values: Values of `Fitted`.
        lower, upper: The values that are compared with the ends of the prior.
    """
    names = ("low", "high", "prior_low", "prior_high", lower, upper)
    try:
        low, high, least, most, first, last = (float(values[name]) for name in names)
    except (KeyError, TypeError, ValueError):
        return False
    if low < least or high > most:
        return False
    near = AT_WALL * (high - low)
    return (least != 0.0 and first - least <= near) or ((least, most) != (0.0, 1.0) and most - last <= near)


class Calibration(_AsInFile, ShownAsCard):
    """A calibration of a robot: the fitted parameters, the robot's numbers, and draws from the posterior."""

    format: Literal["realitygap calibration 1"] = "realitygap calibration 1"
    kind: Literal["path", "sensors", "motion", "contact", "all"] = Field(
        description="Parameters that were calibrated."
    )
    robot: str = Field(description="Robot whose file has all other numbers, by name or file.")
    target: str = Field(description="Robot or simulator that was observed, such as twin:FILE.")
    label: Literal["SIM", "TWIN", "EMULATED", "REAL"] = Field(description="Label of the target.")
    observe: Literal["cells", "encoders", "track"] = Field(description="Kind of the observations.")
    trials: int = Field(ge=0, description="Number of trials.")
    step_s: float = Field(
        0.0, ge=0, le=60, description="Duration of a command [s]; 0: the one of the robot file."
    )
    date: str = Field(description="Date of the fit, ISO 8601.")
    measured: str = Field("", description="Date of the last change of the file with the trials, ISO 8601.")
    arena: str = Field("", description="Arena of the trials, by name.")
    seed: int = Field(0, description="Seed of trials and draws.")
    software: str = Field("", description="Software that fitted the numbers, with its version.")
    method: str = Field(description="Method of the fit, with its source.")
    fitted: tuple[Fitted, ...] = Field((), description="Fitted parameters.")
    numbers: dict[str, float] = Field({}, description="Numbers of the robot by dotted name: the estimate.")
    draws: dict[str, tuple[float, ...]] = Field(
        {}, description="The same numbers in each draw from the posterior; all of one length."
    )
    misspecified: bool = Field(False, description="True if the simulator cannot reproduce the observations.")
    misspecification_p: float = Field(
        1.0, description="P value of the posterior predictive check; 1 without one (path, motion, contact)."
    )
    verdict: str = Field(
        "",
        description="The numbers to use, by the errors on what the fit did not see; empty without such errors.",
    )
    reasons: tuple[str, ...] = Field((), description="Reasons for the verdict, each a sentence.")
    notes: tuple[str, ...] = Field((), description="Notes on the fit, each a sentence.")
    evidence: dict[str, Any] = Field({}, description="Data of the figures.")
    order: dict[str, Any] = Field({}, description="Settings of the command that made the calibration.")
    _file: str | None = PrivateAttr(None)

    @model_validator(mode="after")
    def _draws_go_together(self) -> Self:
        lengths = {len(values) for values in self.draws.values()}
        if len(lengths) > 1:
            raise ValueError(
                f"draws: expected as many of each number, got {min(lengths)} to {max(lengths)}: a draw is one "
                "of each"
            )
        if lengths and not 1 <= max(lengths) <= MOST_DRAWS:
            raise ValueError(f"draws: expected 1 to {MOST_DRAWS:,} of each number, got {max(lengths):,}")
        return self

    def __repr__(self) -> str:
        n_identified = sum(fitted.identified for fitted in self.fitted)
        state = "rejected" if self.misspecified else "ok"
        counts = f"{self.trials} trials, {n_identified}/{len(self.fitted)} identified"
        return f"{type(self).__name__}({self.kind!r}, {counts}, {state})"

    def simulator(self, path: str | Path | None = None) -> str:
        """Return the platform that simulates the calibrated robot, such as `sim:fit.toml`.

        Args:
            path: File to write the calibration to first. Default: the file that it has already.

        Raises:
            ValueError: It has no file yet, and no path is given.
        """
        if path is not None:
            realitygap.study.save_calibration(path, self)
        elif (path := self._file) is None:
            raise ValueError("This calibration has no file yet. Name one: simulator('fit.toml')")
        return f"sim:{path}"

    def in_file(self, path: str | Path) -> Self:
        """Return the calibration that is in a file, which `simulator` names."""
        copy = self.model_copy()
        copy._file = str(path)
        return copy

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Calibration) and dict(self) == dict(other)

    @property
    def held_out(self) -> dict[str, Any]:
        """The errors of the fit and of simpler predictions on what the fit did not see; empty if it saw everything."""
        return dict(self.evidence.get("held_out", {}))

    @property
    def remarks(self) -> tuple[str, ...]:
        """The verdict if there is one, its reasons, and the notes."""
        return (*filter(None, [self.verdict]), *self.reasons, *self.notes)

    @property
    def recommended(self) -> str:
        """The numbers that predict held-out data best: fitted, draws of the posterior, or nominal numbers.

        Empty if nothing was held out.
        """
        return str(self.held_out.get("recommended", ""))

    @property
    def step(self) -> dict[str, float]:
        """Measured duration of a command as a setting of the robot [s]; empty if it was not measured."""
        return {"step_s": self.step_s} if self.step_s else {}

    @property
    def n_draws(self) -> int:
        """Number of draws from the posterior; 0 if there is only the estimate."""
        return max((len(values) for values in self.draws.values()), default=0)

    def to_toml(self) -> str:
        """Return the file that keeps it; `load_calibration` reads it."""
        values = self.model_dump()
        tables = [(name, values.pop(name)) for name in ("order", "numbers", "draws", "evidence")]
        parts = [_HEAD + toml_table(values)]
        parts += [f"[{name}]\n{toml_table(table)}" for name, table in tables if table]
        return "\n\n".join(parts) + "\n"


def is_calibration(values: Mapping[str, Any]) -> bool:
    """Return whether the values of a file are those of a calibration, of this version or another."""
    return str(values.get("format", "")).startswith("realitygap calibration")


@card_of.register(Calibration)
def calibration_card(calibration: Calibration) -> Card:
    """Return the parameters, with their intervals in the range of the prior, and the origin of the numbers."""
    n_identified = sum(fitted.identified for fitted in calibration.fitted)
    warning = ""
    if calibration.misspecified:
        warning = (
            f"Rejected: the simulator cannot reproduce this robot (p = {calibration.misspecification_p:.2g}). Don't "
            "use this calibration for conclusions."
        )
    elif calibration.recommended == "nominal numbers":
        warning = "The numbers that this calibration started from predict held-out trials better."
    rows: list[list[str | Bar]] = [
        [
            f"{fitted.name} [{fitted.unit}]" if fitted.unit else fitted.name,
            *fitted.shown,
            _bar(fitted),
            "yes" if fitted.identified else f"no. {fitted.advice}",
        ]
        for fitted in calibration.fitted
    ]
    origin = {
        "built on": calibration.robot,
        "observed": calibration.observe,
        "arena": calibration.arena,
        "date": calibration.date,
        "seed": str(calibration.seed),
        "draws": f"{calibration.n_draws:,}",
        "software": calibration.software,
        "method": calibration.method,
    }
    about = [[key, value] for key, value in origin.items() if value]
    return Card(
        f"Calibration ({calibration.kind}) of {calibration.target}",
        [calibration.label],
        f"{n_identified} of {len(rows)} parameters identified from {calibration.trials:,} trials",
        warning,
        parts=[
            Table(
                ["parameter", "estimate", "90 % interval", "in the range thought possible", "identified"],
                rows,
            ),
            Table(["", ""], about, "Origin", closed=True),
            *calibration.remarks,
        ],
    )


def _bar(fitted: Fitted) -> Bar:
    start, end = min(fitted.prior_low, fitted.low), max(fitted.prior_high, fitted.high)
    return Bar(fitted.estimate, fitted.low, fitted.high, start, end)
