"""A calibration: what was fitted to a robot, from what, and how sure it is."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from realitygap.settings import Settings


class Fitted(Settings):
    """One parameter that was fitted.

    It may stand for several numbers of the robot: `body.length` for the x of all corners, `range.decay` for that of all
    sensors. `Calibration.numbers` and `Calibration.draws` have the robot's own names.
    """

    name: str = Field(description="Of the parameter.")
    estimate: float = Field(description="Median of the posterior, or the point of greatest likelihood.")
    low: float = Field(description="Lower end of the 90 % interval.")
    high: float = Field(description="Upper end.")
    prior_low: float = Field(description="Lower end of what was thought possible.")
    prior_high: float = Field(description="Upper end.")
    identified: bool = Field(description="Whether the observations tell it from its prior.")
    unit: str = Field("", description="Such as m/s.")
    advice: str = Field("", description="Where it is not identified: what to record to identify it.")


class Calibration(Settings):
    """What was fitted to a robot: parameters, the robot's numbers, and draws from the posterior."""

    format: Literal["realitygap calibration 1"] = "realitygap calibration 1"
    kind: Literal["path", "sensors", "motion", "contact", "all"] = Field(description="What was calibrated.")
    robot: str = Field(description="The robot on whose numbers it builds, by name or file.")
    target: str = Field(description="What was observed, such as twin:FILE.")
    label: Literal["SIM", "TWIN", "EMULATED", "REAL"] = Field(description="Of the target.")
    observe: Literal["cells", "encoders", "track"] = Field(description="How much was seen.")
    trials: int = Field(ge=0, description="How many trials it took.")
    date: str = Field(description="When it was measured, ISO 8601.")
    method: str = Field(description="How it was fitted, with the source of the method.")
    fitted: tuple[Fitted, ...] = Field((), description="The parameters.")
    numbers: dict[str, float] = Field({}, description="Numbers of the robot by dotted name: the estimate.")
    draws: dict[str, tuple[float, ...]] = Field(
        {}, description="The same numbers in each draw from the posterior; all of one length."
    )
    misspecified: bool = Field(False, description="Whether the simulator cannot make what was observed.")
    misspecification_p: float = Field(1.0, description="Of the posterior predictive check.")
    notes: tuple[str, ...] = Field((), description="What else there is to say.")
    evidence: dict[str, Any] = Field({}, description="What figures are drawn from.")
