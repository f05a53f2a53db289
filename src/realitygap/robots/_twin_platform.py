"""The platform `twin`: a robot of real physics in MuJoCo, whose file is read in a process of its own."""

from __future__ import annotations

import subprocess
import sys
from typing import Literal

from pydantic import Field

from ._figures import ScribblerFigures

_HASH = """
import hashlib, sys
try:
    with open(sys.argv[1], "rb") as file:
        print(hashlib.file_digest(file, "sha256").hexdigest())
except OSError as error:
    sys.exit(error.strerror or str(error))
"""


class TwinPlatform(ScribblerFigures):
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
    def title(self) -> str:
        """Of its picture."""
        return f"twin ({self.label})"


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
