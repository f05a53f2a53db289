"""The platform `scribbler`: the paper's robot, driven over its own protocol."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field

from realitygap.drawing import Picture
from realitygap.settings import Settings
from realitygap.world import JYRO_SCRIBBLER, Body, RangeSensors, robot_picture


class ScribblerPlatform(Settings):
    """The Scribbler as the paper drove it; the port comes from the command line.

    The robot moves on while a command's time runs, and until the next command. A reading is the raw value of an
    obstacle sensor, divided by `reading_max` and limited to 1; larger is nearer.

    Source: Rosenzweig & Remy, sections 2.2 and 2.3.
    """

    steps: int = Field(100, ge=1, le=100_000, description="Steps of a trial (section 2.2: 100).")
    wait_s: float = Field(
        0.5, gt=0, le=60, description="How long a command lasts before the next one [s] (section 2.2: 0.5)."
    )
    reading_max: float = Field(
        1700.0, gt=0, le=65_535, description="What raw readings are divided by (section 2.3: 1700)."
    )
    ir_power: int = Field(
        135,
        ge=0,
        le=255,
        description="Of the Fluke's infrared emitters. Not in the paper; 135 as Myro sets it.",
    )
    forwardness: Literal["fluke", "scribbler"] = Field(
        "fluke",
        description="Which end goes ahead, where there is a Fluke: the one with it, to which its obstacle sensors "
        "look, or the other.",
    )

    @property
    def label(self) -> str:
        """What a figure says as long as nothing was driven; then REAL or EMULATED, as the driver found."""
        return "not driven"

    @property
    def body(self) -> Body:
        """What figures draw: the box of 0.18 x 0.16 m that holds the body, whose corners are round."""
        return JYRO_SCRIBBLER

    @property
    def sensors(self) -> RangeSensors:
        """What figures draw: three rays from the front, as far as readings were reasonable to the paper (9 in)."""
        return RangeSensors(((0.09, 0.05, 0.0), (0.09, 0.0, 0.0), (0.09, -0.05, 0.0)), 0.2286)

    @property
    def body_radius(self) -> float:
        """Distance of the farthest corner from the center [m]."""
        return max(math.hypot(forward, left) for forward, left in self.body.corners)

    def picture(self) -> Picture:
        """The robot from above, to scale, with its dimensions."""
        return robot_picture("scribbler", self.body, self.sensors)

    def _repr_svg_(self) -> str:
        return self.picture().to_svg(300.0)
