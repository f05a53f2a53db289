"""The platform `jyro`: the paper's simulation."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from realitygap.world import JYRO_SCRIBBLER, RangeSensors

from ._figures import ScribblerFigures

STEP_S = 0.1  # one step of Jyro, one command [s]


class JyroPlatform(ScribblerFigures):
    """The Scribbler as the paper simulated it.

    Box body, a blocked robot freezes, three thin rays, uniform noise. A step lasts 0.1 s; full output
    moves 0.1 m.

    Source: Jyro 0.3.2, checked against its trajectories; Rosenzweig & Remy, sections 2.2 and 2.3. Differs:
    Jyro's rounding to seven decimals is left out, which moves a reading by less than 1e-6 m. Under given
    commands the poses are Jyro's within 1e-9; a network that closes the loop lets a difference grow. The
    rounding is in `realitygap simulate`.
    """

    steps: int = Field(
        87,
        ge=1,
        le=100_000,
        description="Steps of a trial. 87 as printed (section 2.2); 70 from the paper's own lengths "
        "(13.75 in / 19.7 in of 100 steps).",
    )
    turn_per_step: float = Field(
        0.1,
        gt=0,
        le=3.0,
        description="Turn at full output [rad]. Jyro: 0.1; the robot turns up to about 0.9 rad in one command.",
    )
    sensor_offset: float = Field(
        0.05,
        ge=0,
        le=0.5,
        description="How far the outer two sensors are mounted to the sides of the middle one [m]. Not in the "
        "paper; 0.05 as in an older simulator's IR pair.",
    )
    sensor_range: float = Field(
        0.2, gt=0, le=10, description="Longest distance that a sensor sees [m] (section 2.1: 0.2)."
    )
    noisy_reading: Literal["leave", "clip"] = Field(
        "leave",
        description="After adding noise: leave the reading as it is, or limit it to 0..1. The paper limits it "
        "before adding noise and does not say what happens after.",
    )

    precision: Literal["single", "double"] = Field(
        "single",
        description="Of the arithmetic of trials: 32 or 64 bits. Single is about a third faster; rounding changes "
        "what one in several hundred trials visits.",
    )

    @property
    def label(self) -> str:
        """What every figure of this platform says."""
        return "SIM"

    @property
    def sensors(self) -> RangeSensors:
        """Three rays from the front edge, straight ahead."""
        front = max(forward for forward, _ in JYRO_SCRIBBLER.corners)
        lefts = (self.sensor_offset, 0.0, -self.sensor_offset)
        return RangeSensors(tuple((front, left, 0.0) for left in lefts), self.sensor_range)

    @property
    def speed(self) -> float:
        """Speed at full output [m/s]: Jyro takes outputs as meters a second."""
        return 1.0

    @property
    def turn_rate(self) -> float:
        """Turn rate at full output [rad/s]."""
        return self.turn_per_step / STEP_S

    @property
    def title(self) -> str:
        """Of its picture."""
        return f"jyro ({self.label})"
