"""The platform `twin`: a robot of real physics in MuJoCo, whose file is read in a process of its own."""

from __future__ import annotations

import math
import subprocess
import sys
from typing import Literal

from pydantic import Field

from realitygap.drawing import Picture
from realitygap.settings import Settings
from realitygap.world import JYRO_SCRIBBLER, Body, RangeSensors, robot_picture

_HASH = """
import hashlib, sys
try:
    with open(sys.argv[1], "rb") as file:
        print(hashlib.file_digest(file, "sha256").hexdigest())
except OSError as error:
    sys.exit(error.strerror or str(error))
"""


class TwinPlatform(Settings):
    """A twin, as pseudo-reality to evolve on.

    It is tried in processes of their own, which alone read its file; here it is known by its hash. Figures draw the
    Scribbler's outline, whatever the twin's own is.
    """

    file: str = Field("", description="The twin's file, as `realitygap twin sample` writes one.")
    sha256: str = Field(
        "",
        pattern="^([0-9a-f]{64})?$",
        description="Of the file: one that has changed is another twin.",
        json_schema_extra={"hidden": True},
    )
    steps: int = Field(100, ge=1, le=100_000, description="Steps of a trial.")

    @property
    def precision(self) -> Literal["single", "double"]:
        """Of what is kept of its trials."""
        return "double"

    @property
    def label(self) -> str:
        """What every figure of this platform says."""
        return "TWIN"

    @property
    def body(self) -> Body:
        """What figures draw: the box of 0.18 x 0.16 m that holds a Scribbler."""
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
        return robot_picture(f"twin ({self.label})", self.body, self.sensors)

    def _repr_svg_(self) -> str:
        return self.picture().to_svg(300.0)


def hash_elsewhere(file: str) -> str:
    """The SHA-256 of a file, which another process reads.

    Raises:
        ValueError: There is no such file, or it cannot be read.
    """
    asked = [sys.executable, "-I", "-S", "-c", _HASH, file]
    done = subprocess.run(asked, capture_output=True, text=True, check=False)
    if done.returncode:
        raise ValueError(
            f"the twin's file {file!r} cannot be read ({done.stderr.strip()}). Draw one: realitygap twin sample "
            "--family close -o FILE"
        )
    return done.stdout.strip()
