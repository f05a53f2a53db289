"""The platform `scribbler`: the paper's robot, driven over its own protocol."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, ClassVar, Literal, Self

from pydantic import Field

from realitygap.platforms import PortPlatform

if TYPE_CHECKING:
    from ._robot import Scribbler

FULL_SCALE = 6400.0
"""The largest reading of a Fluke's obstacle sensors: readings of robots and simulators are shares of it."""
WATCHDOG_S = 1.0
"""Time without a command after which the driver stops the motors [s]."""


class ScribblerPlatform(PortPlatform):
    """The Scribbler with the paper's settings. The port comes from the command line.

    The robot moves on while a command's time runs, and until the next command. A reading is the raw value of an
    obstacle sensor, divided by `reading_max` and limited to 1; larger is nearer.

    Source: Rosenzweig & Remy, sections 2.2 and 2.3.
    """

    name: ClassVar[str] = "scribbler"
    summary: ClassVar[str] = "the paper’s robot: driven over its own protocol"
    channels: ClassVar[tuple[str, ...]] = (
        *("light.0", "light.1", "light.2", "line.0", "line.1"),
        *("encoder.0", "encoder.1"),  # of an S2 or S3
    )
    full_scale: ClassVar[float] = FULL_SCALE

    steps: int = Field(100, ge=1, le=100_000, description="Steps of a trial (section 2.2: 100).")
    wait_s: float = Field(0.5, gt=0, le=60, description="Duration of a command [s] (section 2.2: 0.5).")
    reading_max: float = Field(
        1700.0, gt=0, le=65_535, description="Divisor of raw readings (section 2.3: 1700)."
    )
    ir_power: int = Field(
        135,
        ge=0,
        le=255,
        description="Power of the Fluke's infrared emitters. Not in the paper; 135 as Myro sets it.",
    )
    forwardness: Literal["fluke", "scribbler"] = Field(
        "fluke",
        description="End that is ahead on a robot with a Fluke: the end with the Fluke, to which its obstacle sensors "
        "point, or the other one.",
    )

    @classmethod
    def from_rest(cls, rest: str) -> Self:
        """Return the robot at a port; readings are shares of the largest one that a Fluke gives."""
        return cls(port=rest, reading_max=FULL_SCALE)

    @property
    def command_s(self) -> float:
        """Duration of a command [s]."""
        return self.wait_s

    @property
    def outline_words(self) -> str:
        """The origin of the outline in figures, for their captions."""
        return "the box that holds the robot’s; the paper does not state the start and where the sensors are mounted"

    def connect(self) -> Scribbler:
        """Connect to the robot at the port, with these settings.

        Raises:
            RobotError: It cannot be reached.
        """
        from ._robot import Scribbler

        if not self.needs_person:
            import_module("realitygap.emulator")  # which tells pyserial of such ports
        robot = Scribbler(self.port, step_s=self.wait_s, reading_max=self.reading_max, watchdog_s=WATCHDOG_S)
        try:
            if robot.info.fluke != "none":
                robot.set_forwardness(self.forwardness)
                robot.set_ir_power(self.ir_power)
        except BaseException:
            robot.close()
            raise
        return robot
