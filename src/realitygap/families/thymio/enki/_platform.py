"""The platform `enki`: a Thymio II in Enki, a 2-D simulator that is a separate program."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, Self

from pydantic import Field

from realitygap.world import Arena

from .._platform import ThymioBody

if TYPE_CHECKING:
    from realitygap.robots import Robot


class EnkiPlatform(ThymioBody):
    """A Thymio II as Enki simulates it, in a program that `realitygap twin build-enki` compiles.

    The number of a trial alone chooses the noise of its wheels and sensors. Commands are wheel speeds.

    Source: Enki (S. Magnenat), robots/thymio2/Thymio2.cpp; GPL 2 or later.
    """

    name: ClassVar[str] = "enki"
    summary: ClassVar[str] = "a Thymio II in Enki: another simulator, in a separate program"
    channels: ClassVar[tuple[str, ...]] = ("line.0", "line.1", "encoder.0", "encoder.1")
    version: ClassVar[str] = "Enki, harness 1"

    step_s: float = Field(0.1, gt=0, le=10, description="Duration of a command [s].")
    speed: float = Field(
        0.099,
        gt=0,
        le=0.166,
        description="Speed of a wheel at full command [m/s]; Enki's robot reaches 0.166.",
    )

    @property
    def label(self) -> str:
        """The label of its figures."""
        return "EMULATED"

    @property
    def command_s(self) -> float:
        """Duration of a command [s]."""
        return self.step_s

    def at_pace(self, step_s: float) -> Self:
        """Return the platform with commands of this duration [s]."""
        return self.model_copy(update={"step_s": step_s})

    def check(self, arena: Arena, inputs: Sequence[str], noise: float) -> None:
        """Raise an error if networks with these inputs cannot be tried here.

        Raises:
            ValueError: An input is missing, there is noise, or Enki cannot have the arena.
        """
        from ._harness import check_arena

        super().check(arena, inputs, noise)
        check_arena(arena)

    def open_robot(self, arena: Arena, *, noise: float = 0.0) -> Robot:
        """Open one robot, in a separate program.

        Raises:
            RobotError: The harness is not built.
            ValueError: There is noise, or Enki cannot have the arena.
        """
        from ._robot import EnkiRobot

        self.check_noise(noise)
        return EnkiRobot(arena, self.step_s, self.speed)
