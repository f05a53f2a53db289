"""The settings of the platform `jyro`: the paper's simulation."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from realitygap.world import JYRO_SCRIBBLER, RangeSensors

from .._simulated import SimulatedPlatform

STEP_S = 0.1  # one step of Jyro, one command [s]


class JyroSettings(SimulatedPlatform):
    """The settings of `jyro`, and what follows from them alone."""

    name: ClassVar[str] = "jyro"
    summary: ClassVar[str] = (
        "the paper’s simulation: a box-shaped body; a blocked robot stops dead; uniform sensor noise"
    )
    default_noise: ClassVar[float] = 0.1
    is_paced: ClassVar[bool] = False
    runs_whole: ClassVar[bool] = True

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
        description="Distance of the outer two sensors from the middle one, to the sides [m]. Not in the "
        "paper; 0.05 as in an older simulator's IR pair.",
    )
    sensor_range: float = Field(
        0.2, gt=0, le=10, description="Longest distance that a sensor sees [m] (section 2.1: 0.2)."
    )
    noisy_reading: Literal["leave", "clip"] = Field(
        "leave",
        description="Treatment of a reading after noise is added: leave it, or clip it to 0..1. The paper limits it "
        "before adding noise and does not state what happens after.",
    )

    precision: Literal["single", "double"] = Field(
        "single",
        description="Precision of the arithmetic of trials: 32 or 64 bits. Single is about a third faster. "
        "Rounding changes the visited cells of one in several hundred trials.",
    )

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
    def command_s(self) -> float:
        """Duration of a command: one step of Jyro [s]."""
        return STEP_S

    @property
    def outline_words(self) -> str:
        """The origin of the outline in figures, for their captions."""
        return "Jyro’s; the paper does not state the start and where the sensors are mounted"
