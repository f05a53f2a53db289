"""Which arena, and where trials begin, as a study names them."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, field_validator

from realitygap.settings import Settings

from ._arena import NAMED_STARTS, Arena, Pose, is_inside, paper_arena

StartName = Literal["corner", "center", "left"]


class ArenaSettings(Settings):
    """The arena of a study."""

    preset: Literal["paper"] = Field(
        "paper",
        description="The arena by name. paper: 42 x 24 in, cells of 3 in, the inner 12 x 6 reachable (section 2.1).",
    )
    start: StartName | Annotated[list[float], Field(min_length=3, max_length=3)] = Field(
        "corner",
        description="Where trials begin: a name, or [x, y, heading] in meters and radians from +x, "
        "counter-clockwise. corner: (0.1905, 0.1905) facing +x, a cell's center; center: the arena's center, on a "
        "junction of cells, which belongs to the upper right one; left: middle of the left side, on a border of "
        "cells, which belongs to the upper one. The paper says only that it is always the same.",
    )

    @field_validator("start")
    @classmethod
    def _start_is_inside(cls, start: StartName | list[float]) -> StartName | list[float]:
        if isinstance(start, str):
            return start
        arena = paper_arena()
        if not is_inside(arena, start[0], start[1]):
            raise ValueError("start lies outside the arena: expected 0 < x < 1.0668 and 0 < y < 0.6096 [m]")
        if abs(start[2]) > 2 * math.pi:
            raise ValueError("heading is in radians, expected -2 pi to 2 pi")
        return start

    def pose(self) -> Pose:
        """Where trials begin."""
        return (
            NAMED_STARTS[self.start]
            if isinstance(self.start, str)
            else Pose(self.start[0], self.start[1], self.start[2])
        )

    def arena(self) -> Arena:
        """The arena."""
        return paper_arena(self.pose())
