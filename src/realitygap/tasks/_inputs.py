"""What networks see, as a task's table names it."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field


def _as_tuple(names: Any) -> Any:
    return tuple(names) if isinstance(names, list) else names


Inputs = Annotated[
    tuple[str, ...],
    BeforeValidator(_as_tuple),
    Field(
        min_length=1,
        max_length=256,
        description="What networks see, in order: obstacle, stall, time, bias, range.K, light.K, line.K, bump.K, "
        "encoder.K, goal_sector.K, goal_distance, last_move, last_turn. What there is of them says the robot.",
    ),
]
"""Names of inputs, in order."""
