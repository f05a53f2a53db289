"""The inputs and outputs of networks, as a study file declares them."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from realitygap.settings import Settings, as_tuple
from realitygap.world import SENSORS

Inputs = Annotated[
    tuple[str, ...],
    BeforeValidator(as_tuple),
    Field(
        min_length=1,
        max_length=256,
        description="Older name of controller.inputs: the inputs of networks, in order.",
    ),
]
"""Names of inputs, in order."""


class ControllerSettings(Settings):
    """The inputs and outputs of the networks of a study."""

    inputs: Annotated[tuple[str, ...], BeforeValidator(as_tuple)] = Field(
        (),
        max_length=256,
        description="Names of the inputs of networks, in order: obstacle (the largest range reading), stall, time, "
        + "".join(f"{kind}.K, " for kind in SENSORS)
        + "encoder.K, goal_sector.K, goal_distance, last_move, last_turn. The "
        "constant input is bias, the last one. The robot and the arena must have them. Empty: those of the task.",
    )
    outputs: Annotated[tuple[str, ...], BeforeValidator(as_tuple)] = Field(
        ("move", "turn"),
        description="Outputs of networks, each -1..1: move and turn, or the wheel speeds left and right. With wheel "
        "speeds, move = (left + right) / 2 and turn = (right - left) / 2.",
    )

    @model_validator(mode="after")
    def _can_be_declared(self) -> Self:
        if self.outputs not in (("move", "turn"), ("left", "right")):
            raise ValueError(
                f'outputs: expected ["move", "turn"] or ["left", "right"], got {list(self.outputs)}'
            )
        if not all(self.inputs) or "bias" in self.inputs[:-1]:
            raise ValueError(
                f"inputs: expected a name for each, and bias as the last, got {list(self.inputs)}"
            )
        return self

    @model_serializer(mode="wrap")
    def _without_defaults(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Conditions that declare nothing keep their hashes."""
        values: dict[str, Any] = handler(self)
        defaults = ControllerSettings.model_fields
        return {key: value for key, value in values.items() if getattr(self, key) != defaults[key].default}
