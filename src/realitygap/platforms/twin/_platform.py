"""The platform `twin`: a robot with physics by MuJoCo, whose file is read in a separate process."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Self

from pydantic import Field

from realitygap._limits import MOST_TOML_BYTES
from realitygap.errors import DescriptionError, require_extra
from realitygap.evolution import ControllerInterface, inputs_of_robot
from realitygap.robots import Robot
from realitygap.robots.twin import load_twin
from realitygap.trials import PlatformTrials, Target
from realitygap.world import Arena

from .._fleet import Fleet
from .._platform import Opening, Platform
from .._stepwise import StepwiseFleet
from ._open import open_twin
from ._pooled import TwinRobots, TwinTarget, TwinTrials, shared_pool

if TYPE_CHECKING:
    from realitygap.kernels.neat.genome import NeatRules

_HASH = """
import hashlib, os, stat, sys
name, most = sys.argv[1], int(sys.argv[2])
try:
    descriptor = os.open(name, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        sys.exit("it is not a plain file")
    with os.fdopen(descriptor, "rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        sys.exit(f"it has more than {most:,} bytes")
    print(hashlib.sha256(data).hexdigest())
except OSError as error:
    sys.exit(error.strerror or str(error))
"""


class TwinPlatform(Platform):
    """A twin, as pseudo-reality to evolve on.

    It runs in separate processes, and only they read its file. This process identifies it by its hash. Figures draw the
    outline of the paper's robot for any twin.
    """

    name: ClassVar[str] = "twin"
    summary: ClassVar[str] = (
        "pseudo-reality: a robot of real wheels, motors and sensors in MuJoCo, as its file has them"
    )
    rest: ClassVar[str] = "FILE"
    rest_setting: ClassVar[str] = "file"
    needs_rest: ClassVar[bool] = True
    file_settings: ClassVar[tuple[str, ...]] = ("file",)
    channels: ClassVar[tuple[str, ...]] = (
        *("light.0", "light.1", "light.2", "line.0", "line.1"),  # if the twin's file has them
        *("encoder.0", "encoder.1"),
    )

    file: str = Field("", description="File of the twin, such as one that `realitygap twin sample` writes.")
    sha256: str = Field(
        "",
        pattern="^([0-9a-f]{64})?$",
        description="SHA-256 of the file. A changed file is another twin.",
        json_schema_extra={"hidden": True},
    )
    steps: int = Field(100, ge=1, le=100_000, description="Steps of a trial.")

    @classmethod
    def kind_of_file(cls, path: Path) -> str:
        """Return "twin" for the file of a twin; empty for other files."""
        try:
            load_twin(path)
        except DescriptionError:
            return ""
        return "twin"

    @property
    def label(self) -> str:
        """The label of its figures."""
        return "TWIN"

    @property
    def outline_words(self) -> str:
        """The origin of the outline in figures, for their captions."""
        return "the box around the paper’s robot, and the sensors are that robot’s: the twin’s own are in its file"

    def identified(self) -> Self:
        """Return the platform with the hash of its file.

        Raises:
            ValueError: No file is named, or it cannot be read.
        """
        if not self.file:
            raise ValueError("platform is 'twin', expected twin:FILE, with the file of the twin")
        return self if self.sha256 else self.model_copy(update={"sha256": hash_elsewhere(self.file)})

    def open_robot(self, arena: Arena, *, noise: float = 0.0) -> Robot:
        """Open the twin in this process."""
        return open_twin(load_twin(self.file), arena)

    def open(self, arena: Arena, how: Opening) -> Target:
        """Open the twin for trials one by one, in separate processes."""
        require_extra("mujoco", "twin")
        return TwinTarget(self.file, arena, how.processes, name=how.name)

    def prepare(
        self, arena: Arena, rules: NeatRules, *, inputs: Sequence[str], noise: float, bias_value: float
    ) -> PlatformTrials:
        """Set the twin up for many trials, shared among processes."""
        self.check_noise(noise)
        require_extra("mujoco", "twin")
        pool = shared_pool(self.file, self.sha256, arena)
        known = inputs_of_robot(pool.n_sensors, pool.channels)
        ControllerInterface(tuple(inputs)).check(known, "A network", f"twin {self.file}")
        return TwinTrials(self, arena, rules, pool, inputs=inputs, bias_value=bias_value)

    def fleet(self, arena: Arena, inputs: Sequence[str], noise: float, n: int) -> Fleet:
        """Open n robots that are driven step by step, in a separate process."""
        self.check_noise(noise)
        self.check_starts(arena)
        return StepwiseFleet(self, arena, inputs, TwinRobots(self.file, arena, n), n)


def hash_elsewhere(file: str) -> str:
    """Return the SHA-256 of a file, which another process reads.

    Raises:
        ValueError: There is no such file, or it cannot be read.
    """
    asked = [sys.executable, "-I", "-S", "-c", _HASH, file, str(MOST_TOML_BYTES)]
    done = subprocess.run(asked, capture_output=True, text=True, check=False)
    if done.returncode:
        raise ValueError(
            f"the twin's file {file!r} cannot be read ({done.stderr.strip()}). Draw one: realitygap twin sample "
            "--family close -o FILE"
        )
    return done.stdout.strip()
