"""The platform `thymio`: a Thymio II, driven over its own protocol; and what all platforms with a Thymio share."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Self

from pydantic import Field, PrivateAttr

from realitygap.platforms import Opening, PortPlatform, RobotFilePlatform
from realitygap.world import Arena

if TYPE_CHECKING:
    from realitygap.robots import Port
    from realitygap.trials import Target

    from ._robot import Thymio


class ThymioBody(RobotFilePlatform):
    """A platform whose robot is a Thymio II."""

    base_robot: ClassVar[str] = "thymio"


class ThymioPlatform(ThymioBody, PortPlatform):
    """A Thymio II on a cable, on a dongle, or in Aseba's playground. The port comes from the command line.

    The robot moves on while a command's time runs, and until the next command, or for 0.2 s. A reading is the raw value
    of an infrared sensor, divided by `reading_max` and limited to 1; larger is nearer. Nobody has tried it on a robot.

    A playground in this program, `thymio:emulator://playground?speed=8`, begins with the arena of the trials, if its
    port names none (`arena=`).
    """

    name: ClassVar[str] = "thymio"
    summary: ClassVar[str] = "a Thymio II: driven over its own protocol"
    channels: ClassVar[tuple[str, ...]] = (
        *("line.0", "line.1"),
        *("encoder.0", "encoder.1"),  # of a robot, not in a playground
    )
    full_scale: ClassVar[float] = 4505.0

    step_s: float = Field(
        0.1,
        gt=0,
        le=60,
        description="Duration of a command [s]; the robot's sensors are read ten times a second.",
    )
    full_speed: int = Field(
        300,
        ge=1,
        le=1000,
        description="Target of a wheel at full command; some robots go no faster than 300 to 400.",
    )
    reading_max: float = Field(
        4505.0, gt=0, le=32_767, description="Infrared reading that counts as 1, as near as measurable."
    )
    ground_white: float = Field(
        938.0, ge=0, le=1023, description="Reading of a ground sensor on a white floor."
    )
    ground_black: float = Field(
        76.0, ge=0, le=1023, description="Reading of a ground sensor on a black floor."
    )
    _arena: Arena | None = PrivateAttr(None)

    @property
    def command_s(self) -> float:
        """Duration of a command [s]."""
        return self.step_s

    def in_arena(self, arena: Arena) -> Self:
        """Return the platform with the arena with which a playground in this program begins."""
        platform = self.model_copy()
        platform._arena = arena
        return platform

    def open(self, arena: Arena, how: Opening) -> Target:
        """Open the robot for trials one by one, with its observer or its witness."""
        return super(ThymioPlatform, self.in_arena(arena)).open(arena, how)

    def connect(self) -> Thymio:
        """Connect to the robot at the port, with these settings.

        Raises:
            RobotError: It cannot be reached.
        """
        from ._robot import Thymio
        from .playground._port import open_playground

        port: str | Port = self.port
        if not self.needs_person:
            port = open_playground(self.port, self._arena)
        robot = Thymio(
            port,
            step_s=self.step_s,
            full_speed=self.full_speed,
            reading_max=self.reading_max,
            ground_white=self.ground_white,
            ground_black=self.ground_black,
        )
        robot.platform = self
        return robot
