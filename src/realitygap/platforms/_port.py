"""Platforms whose robot is driven over a port."""

from __future__ import annotations

from typing import ClassVar, Self

from pydantic import Field

from realitygap.robots import Robot, is_in_this_program
from realitygap.world import Arena

from ._platform import Platform


class PortPlatform(Platform):
    """A robot with its own protocol. The port comes from the command line."""

    rest: ClassVar[str] = "PORT"
    rest_setting: ClassVar[str] = "port"
    needs_rest: ClassVar[bool] = True
    is_physical: ClassVar[bool] = True

    port: str = Field(
        "",
        exclude=True,
        description="Port of the robot, which the command line names.",
        json_schema_extra={"hidden": True},
        repr=False,
    )

    @property
    def label(self) -> str:
        """The label of its figures while nothing was driven; then REAL or EMULATED, as the driver finds."""
        return "not driven"

    @property
    def title(self) -> str:
        """Title of its picture."""
        return self.name

    @property
    def needs_person(self) -> bool:
        """True if a person has to place the robot, which is not the case for one that is emulated in this program."""
        return not is_in_this_program(self.port)

    def at_port(self, port: str) -> Self:
        """Return the platform with the port of its robot."""
        return self.model_copy(update={"port": port})

    def open_robot(self, arena: Arena, *, noise: float = 0.0) -> Robot:
        """Connect to the robot; an emulated one in this program is placed at the start."""
        robot = self.in_arena(arena).connect()
        witness = getattr(getattr(robot, "port", None), "witness", None)
        if witness is not None:
            witness.place(arena.start, 0)
        return robot
