"""What networks see, as a task's table names it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

Inputs = Annotated[
    tuple[str, ...],
    Field(
        min_length=1,
        max_length=256,
        description="What networks see, in order: obstacle, stall, time, bias, range.K, light.K, line.K, bump.K, "
        "encoder.K, goal_sector.K, goal_distance, last_move, last_turn. What there is of them says the robot.",
    ),
]
"""Names of inputs, in order."""
