"""The platform `scribbler`: the paper's robot, driven over its own protocol."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from ._figures import ScribblerFigures


class ScribblerPlatform(ScribblerFigures):
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
